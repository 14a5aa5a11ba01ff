"""Which effect of the catalogue began to act, as in a diagnosis: every effect at every place.

The model at work is as uncertain as its fit left it (`changes.py`), so what an effect shows counts only as
far as this does not explain it. A scan scores all candidates to first order. The most likely ones are then
fitted, their sizes and shapes by Gauss-Newton steps: a large effect changes the temperatures that drive it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from discovery.diagnosis.context import make_scene, recorded_inputs, shown_by, thinned
from discovery.diagnosis.refit import shape_priors
from discovery.diagnosis.selection import hopeful
from discovery.diagnosis.sizes import Sizes
from discovery.dynamics import make_grid, sensitivities
from discovery.effects.candidates import candidates, with_shapes
from discovery.effects.catalogue import catalogue
from discovery.effects.form import Effect
from discovery.effects.hypothesis import Hypothesis
from discovery.errors import RunsAwayError
from discovery.evidence.bayes import Score, Slab, products, projected, ranked
from discovery.evidence.signatures import signatures
from discovery.evidence.whitening import Absorbed
from discovery.export.document import Exported
from discovery.export.knowledge import Knowledge
from discovery.fitting.covariance import Z95
from discovery.fitting.problem import Prior, Problem, make_problem
from discovery.models import Model
from discovery.printed import printed
from discovery.recordings import Campaign
from discovery.runtime.changes import Rows, noise_of, whitened
from discovery.threads import side_by_side

Array = NDArray[np.float64]

REFITS = 8  # candidates that are fitted
STEPS = 5  # of a fit, at most
SMALL = 0.1  # standard deviations: the step that ends a fit
LITTLE = 1e-12  # of the information about a size, that it has one
FAR = 2.0  # standard deviations of its prior by which a shape moves in a step, at most


def new_physics(
    exported: Exported,
    known: Knowledge,
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
) -> dict[str, Score]:
    """Effects that may have begun to act in all recordings, by "effect at place", best odds first: those that
    were fitted.

    What the other hypotheses of an update stand for is left out: wear, and offsets of the sensors of inputs.
    """
    task = Task.of(exported.model, known, campaign, recordings, outputs)
    fits = side_by_side(task.fitted, hopeful(task.scan(), REFITS))
    found = sorted((one for one in fits if one is not None), key=lambda one: -one.odds)
    return {name_of(one): one for one in found}


def name_of(claim: Score) -> str:
    """Effect and place in words, with the input that it follows."""
    h = claim.hypothesis
    return f"{h.effect.word} at {h.where}"


def sizes_of(claim: Score) -> str:
    """Sizes with their units; of a single one with its 95 % interval."""
    h = claim.hypothesis
    units = [h.units.get(name, "1") for name in h.amplitudes]
    if h.effect.amplitude.fixed is not None:
        return ", ".join(f"{n} {printed(v)} {h.units.get(n, '1')}" for n, v in h.shapes.items())
    if len(claim.size) == 1 and claim.t:
        (size,), half = claim.size, Z95 * abs(claim.size[0] / claim.t)
        return f"{printed(size)} {units[0]}, 95 % {printed(size - half)} to {printed(size + half)}"
    return ", ".join(f"{printed(v)} {u}" for v, u in zip(claim.size, units, strict=True))


@dataclass(frozen=True)
class Task:
    """The model at work on new recordings, and the effects that may have begun."""

    model: Model
    known: Knowledge
    campaign: Campaign
    recordings: tuple[str, ...]
    problem: Problem
    hypotheses: tuple[Hypothesis, ...]
    sizes: Sizes

    @classmethod
    def of(
        cls,
        model: Model,
        known: Knowledge,
        campaign: Campaign,
        recordings: Sequence[str],
        outputs: Sequence[str],
    ) -> Task:
        inputs = recorded_inputs(campaign, recordings, outputs)
        grids = thinned({r: make_grid(campaign, r, inputs, outputs) for r in recordings})
        problem = make_problem(model, campaign, recordings, outputs, grids=grids)
        runs = [problem.run(system, problem.start) for system in problem.systems]
        scene = make_scene(campaign, model, recordings, outputs, {})
        effects = shown_by(grids, [e for e in catalogue().values() if _may_begin(e)], scene)
        return cls(
            model,
            known,
            campaign,
            tuple(recordings),
            problem,
            tuple(candidates(model, effects, scene)),
            Sizes(model, runs, noise_of(known, outputs)),
        )

    def scan(self) -> list[Score]:
        """Every candidate to first order, best odds first."""
        runs = self.sizes.trajectories
        every = [one for h in self.hypotheses for one in with_shapes(h)]
        rows = whitened(self.known, self.problem, runs, [signatures(run, every) for run in runs])
        z = np.concatenate([np.zeros((rows.fitted, rows.more[0].shape[1])), *rows.more])
        part = products(projected(z, _absorbed(rows)), every)
        return ranked(every, self.sizes.slab(every), np.zeros(1), [part])

    def fitted(self, claim: Score) -> Score | None:
        """A claim with its sizes and shapes fitted, and what it gains over the model at work; None if the
        model does not stay finite with it.
        """
        h, best = replace(claim.hypothesis, log_weight=0.0), None
        usual = self.sizes.slab([h])
        point = Point(h, np.where(usual.sign * claim.size < 0, 0.1 * usual.median, claim.size))
        try:
            for _ in range(STEPS):
                seen = self.seen(point)
                one = seen.score(usual, self.level)
                best = one if best is None or one.odds > best.odds else best
                point, far = seen.next()
                if not far:
                    break
        except RunsAwayError:
            pass
        return best

    @cached_property
    def level(self) -> float:
        """Log likelihood of the model at work."""
        runs = self.sizes.trajectories
        empty = [np.zeros((len(r.system.grid.read), len(self.problem.outputs), 0)) for r in runs]
        rows = whitened(self.known, self.problem, runs, empty)
        return _absorbed(rows).level - rows.log

    def seen(self, point: Point) -> _Seen:
        """What the readings say of an effect of these sizes and shapes."""
        grids = {s.grid.recording: s.grid for s in self.problem.systems}
        problem = make_problem(
            point.model(self.model), self.campaign, self.recordings, self.problem.outputs, grids
        )
        runs = [problem.run(system, problem.start) for system in problem.systems]
        flows = [t for t in self.problem.model.terms if not self.problem.model.states[t.into].memory]
        h = point.hypothesis
        names = (*h.shapes, *point.free)
        rows = whitened(self.known, problem, runs, [sensitivities(run, names) for run in runs], flows)
        return _Seen(point, rows, tuple(shape_priors([h]).values()))


@dataclass(frozen=True)
class Point:
    """An effect with sizes (A,)."""

    hypothesis: Hypothesis
    sizes: Array

    @property
    def free(self) -> tuple[str, ...]:
        """Amplitudes that are fitted."""
        return self.hypothesis.amplitudes if self.hypothesis.effect.amplitude.fixed is None else ()

    def model(self, model: Model) -> Model:
        """A model with the effect."""
        return self.hypothesis.added_to(model, dict(zip(self.free, self.sizes.tolist(), strict=False)))


@dataclass(frozen=True)
class _Seen:
    """The rows of an effect at a point, with the slopes of its shapes, then of its sizes; `priors` of its
    shapes.
    """

    point: Point
    rows: Rows
    priors: tuple[Prior, ...]

    @cached_property
    def slopes(self) -> Array:
        """(N, S + A)."""
        count = self.rows.more[0].shape[1]
        return np.concatenate([np.zeros((self.rows.fitted, count)), *self.rows.more])

    @cached_property
    def shapes(self) -> tuple[Array, Array]:
        """Of each shape, by how many standard deviations it is off the mean of its prior, and how far it
        moves for one.
        """
        values = np.array(list(self.point.hypothesis.shapes.values()))
        off = [(np.log(v) if p.is_log else v) - p.mean for v, p in zip(values, self.priors, strict=True)]
        sd = np.array([p.sd for p in self.priors])
        return np.array(off) / sd, np.where([p.is_log for p in self.priors], values, 1.0) * sd

    def absorbed(self, residual: Array) -> Absorbed:
        """What the fit and the prior of the shapes leave unknown, of a residual (N,)."""
        off, size = self.shapes
        return _absorbed(self.rows, residual, self.slopes[:, : len(off)] * size, off)

    @property
    def level(self) -> float:
        """Log likelihood of exactly these sizes, shapes integrated out."""
        return self.absorbed(self.rows.residual).level - self.rows.log

    def score(self, usual: Slab, level: float) -> Score:
        """The claim here: what it gains over `level`, sizes and shapes integrated out."""
        h, sized = self.point.hypothesis, self.slopes[:, len(self.priors) :]
        if not self.point.free:
            return Score(h, self.level - level, 0.0, (1.0,), 1.0, 0)
        gone = self.absorbed(self.rows.residual + sized @ self.point.sizes)
        (one,) = ranked([h], usual, np.zeros(1), [products(projected(sized, gone), [h])])
        return replace(one, gain=one.gain + gone.level - self.rows.log - level)

    def next(self) -> tuple[Point, bool]:
        """Where a Gauss-Newton step leads, and whether it is far."""
        h, (off, size), count = self.point.hypothesis, self.shapes, len(self.priors)
        slopes = np.hstack([self.slopes[:, :count] * size, self.slopes[:, count:]])
        base = np.hstack([self.rows.base, slopes])
        known = np.ones(base.shape[1])
        known[self.rows.base.shape[1] + count :] = LITTLE
        normal = base.T @ base + np.diag(known)
        pull = base.T @ self.rows.residual
        pull[self.rows.base.shape[1] : self.rows.base.shape[1] + count] -= off
        mine = slice(self.rows.base.shape[1], None)
        inverse = np.linalg.inv(normal)
        step = (inverse @ pull)[mine]
        far = bool(np.any(np.abs(step) > SMALL * np.sqrt(np.diag(inverse)[mine])))
        moves = np.clip(step[:count], -FAR, FAR)
        shapes = {
            name: float(value * np.exp(p.sd * move)) if p.is_log else float(value + p.sd * move)
            for (name, value), p, move in zip(h.shapes.items(), self.priors, moves, strict=True)
        }
        low, high = h.effect.amplitude.ends
        sizes = np.clip(self.point.sizes + step[count:], low, high) if self.point.free else self.point.sizes
        return Point(h.at(shapes), sizes), far


def _absorbed(
    rows: Rows, residual: Array | None = None, shapes: Array | None = None, off: Array | None = None
) -> Absorbed:
    """What the fit left unknown absorbs; `shapes` (N, S) are columns of shapes that are `off` (S,) standard
    deviations.
    """
    residual = rows.residual if residual is None else residual
    base = rows.base if shapes is None else np.hstack([rows.base, shapes])
    pull, before = base.T @ residual, 0.0
    if off is not None and len(off):
        pull[-len(off) :] -= off
        before = float(off @ off)
    factor = np.linalg.cholesky(base.T @ base + np.eye(base.shape[1]))
    basis = solve_triangular(factor, base.T, lower=True).T
    slope = solve_triangular(factor, pull, lower=True)
    quadratic = float(residual @ residual) + before - float(slope @ slope)
    return Absorbed(residual, basis, slope, -0.5 * quadratic - float(np.log(np.diag(factor)).sum()))


def _may_begin(effect: Effect) -> bool:
    """Whether an effect is one of the hypotheses here: events are heat of unknown cause, and the wear of
    parts and the offset of an input have hypotheses of their own.
    """
    own = effect.place == "input temperature" and effect.word == "sensor_offset"
    return effect.search == "shapes" and effect.acts == "always" and not own
