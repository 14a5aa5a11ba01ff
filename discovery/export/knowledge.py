"""What the recordings of a fit say about the fitted model, kept with it: an update weighs new readings
against it.

Around the fitted model, the residual of any recording is

    r = J_p dp + J_e e + noise,      e ~ N(0, form^2)

with errors dp of the parameters and form errors e of the laws (`discovery.evidence.form_error`). Form errors
stay with the operating point, so the fit has seen most of those that new recordings hold. The whitened
readings of the fit, compressed to as many rows [r, J_p, J_e] as they determine directions, say what it knows
of both (square-root information filter; Bierman, Factorization Methods for Discrete Sequential Estimation,
1977).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import process_prior, thinned
from discovery.dynamics import Trajectory
from discovery.errors import UserError
from discovery.evidence.form_error import edge_columns, law_columns, scales_of
from discovery.evidence.process_noise import floors, reading_noise
from discovery.evidence.whitening import Whitened
from discovery.export.guessed import at_readings
from discovery.fitting import Fit, Noise
from discovery.fitting.begin import first_noise
from discovery.fitting.noise import resolution, white_noise
from discovery.fitting.problem import Problem, make_problem
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.threads import one_thread

Array = NDArray[np.float64]

UNKNOWN = 2.0  # relative standard deviation of a parameter before any reading
HEATS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)  # unrecorded heat, in floors of the diagnosis
SHARES = (
    0.002,
    0.005,
    0.01,
    0.02,
    0.04,
    0.08,
    0.25,
    0.8,
)  # of what flows through a body, off from hour to hour
SLOW = (0.0, 0.15, 0.3, 0.6, 1.0, 2.0, 4.0, 8.0)  # slow noise of outputs, in reading noises
FORMS = (0.0, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25)  # by which laws are off at an operating point ...
EDGES = (0.0, 0.02, 0.05, 0.1, 0.25)  # ... and of flows that enter the neighbours of a body
_ROUNDS, _STAYS = 20, 0.02  # at most, and relative change, of a reading noise that is not stated
SEEN = 1e-3  # of the information before any reading, below which a direction is not kept


@dataclass(frozen=True)
class Knowledge:
    """What a fit knows. `residual`: rms of readings minus model by output (None: not read). `noise`: the most
    likely one on the ladders of the diagnosis; None: nothing was read. `floor`: usual unknown heat of each
    state, W or a rate. `scales`: mean and spread of each series, from which operating points are counted.
    `rows` (K, 1 + P + E): whitened residual and slopes of `parameters`, then of form errors. `worn`:
    parameters that revisions have moved; the machine goes on to wear there.
    """

    residual: Mapping[str, float | None]
    parameters: tuple[str, ...]
    noise: Noise | None
    floor: Mapping[str, float]
    scales: Mapping[str, tuple[float, float]]
    rows: Array
    worn: tuple[str, ...] = ()

    def document(self) -> dict[str, Any]:
        """As it stands in an exported model."""
        return {
            "residual": dict(self.residual),
            "parameters": list(self.parameters),
            "noise": None if self.noise is None else _plain(self.noise),
            "floor": dict(self.floor),
            "scales": {name: list(pair) for name, pair in self.scales.items()},
            "rows": [[float(f"{v:.6g}") for v in row] for row in self.rows.tolist()],
            "worn": list(self.worn),
        }


def _plain(noise: Noise) -> dict[str, Any]:
    return {key: list(v) if isinstance(v, tuple) else v for key, v in asdict(noise).items()}


def read_knowledge(model: str, written: Mapping[str, Any]) -> Knowledge:
    """The knowledge of an exported model.

    Raises:
        UserError: an export that does not say how well its parameters are known.
    """
    if not (written.get("parameters") and written.get("noise") and written.get("rows")):
        raise UserError(
            f"model '{model}' does not say how well its parameters are known; export it again from its run"
        )
    noise: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in written["noise"].items()}
    return Knowledge(
        written["residual"],
        tuple(written["parameters"]),
        Noise(**noise),
        written["floor"],
        {name: (pair[0], pair[1]) for name, pair in written["scales"].items()},
        np.array(written["rows"]).reshape(len(written["rows"]), -1),
        tuple(written.get("worn", ())),
    )


@one_thread
def knowledge(model: Model, campaign: Campaign, recordings: Sequence[str]) -> Knowledge:
    """What the recordings say of a model fitted to them; parameters of one recording alone are left out."""
    outputs = [
        name for name in model.outputs if name in campaign.channels and _read(campaign, recordings, name)
    ]
    names = tuple(name for name in model.free if not model.parameters[name].per_recording)
    if not outputs:
        return Knowledge(dict.fromkeys(model.outputs), (), None, {}, {}, np.zeros((0, 1)))
    problem = problem_of(at_readings(model, campaign, recordings), campaign, recordings, outputs)
    stated = {name: campaign.channels[name].noise for name in outputs}
    theta, runs, white = _settled(problem, stated)
    residuals = [problem.residual(run) for run in runs]
    level = {
        name: max(float(np.sqrt(np.nanmean(np.concatenate([r[:, j] for r in residuals]) ** 2))), 1e-6)
        for j, name in enumerate(outputs)
    }
    fit = Fit(problem, theta, np.zeros((len(theta),) * 2), white, runs, 0.0, (), 0.0)
    ambient = [n for n, channel in campaign.channels.items() if channel.role == "ambient temperature"]
    floor = floors(fit, thresholds.FLOOR, ambient, thresholds.AIR, own=False)
    scales = scales_of(runs)
    laws = [law_columns(run, scales) for run in runs]
    edges = [edge_columns(run) for run in runs]
    form = tuple(np.concatenate(pair, axis=2) for pair in zip(laws, edges, strict=True))
    seen = Whitened(fit, 1, form, np.ones(form[0].shape[2]), (laws[0].shape[2], edges[0].shape[2]))
    noise = _likely(seen, reading_noise(fit, stated, floor, process_prior()), floor)
    return Knowledge(
        {name: level.get(name) for name in model.outputs},
        names,
        noise,
        floor,
        scales,
        _compressed(seen, noise, names),
    )


def problem_of(
    model: Model, campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str]
) -> Problem:
    """A model on recordings, with no more readings than an answer in reasonable time allows."""
    problem = make_problem(model, campaign, recordings, outputs)
    grids = {system.grid.recording: system.grid for system in problem.systems}
    return make_problem(model, campaign, recordings, outputs, grids=thinned(grids))


def spreads(known: Knowledge, model: Model, laws: int, edges: int) -> Array:
    """(P + E,) standard deviations of parameters and form errors before any reading. A parameter that presses
    against a bound stays there.

    Raises:
        UserError: what is known is of another model.
    """
    assert known.noise is not None
    if known.rows.shape[1] != 1 + len(known.parameters) + laws + edges:
        raise UserError(
            f"model '{model.name}': its knowledge of its fit belongs to another model; "
            "export it again from its run"
        )
    own = [_free(model, name) * UNKNOWN * abs(model.parameters[name].value) for name in known.parameters]
    return np.concatenate([own, np.full(laws, known.noise.form), np.full(edges, known.noise.edge)])


def _free(model: Model, name: str) -> bool:
    p = model.parameters[name]
    near = 1e-6 * max(1.0, abs(p.value))
    return p.min + near < p.value < p.max - near


def _settled(
    problem: Problem, stated: Mapping[str, float | None]
) -> tuple[Array, tuple[Trajectory, ...], Noise]:
    """Unknowns (U,) and free runs with settled start values, and the reading noise that weighs the readings.

    As in the fit, a noise that is not stated is that of the residual: it falls from what the declared starts
    leave, until it stays.
    """
    least = resolution([system.grid.single for system in problem.systems])
    noise = first_noise(problem, [problem.run(s, problem.start) for s in problem.systems], stated, least)
    for _ in range(_ROUNDS):
        theta, runs = settle_starts(problem, noise.white)
        single = [problem.residual(run) * run.system.grid.per_reading for run in runs]
        before, noise = noise, white_noise(problem.outputs, stated, single, least)
        if max(abs(np.log(a / b)) for a, b in zip(noise.white, before.white, strict=True)) < _STAYS:
            break
    return theta, runs, noise


def settle_starts(problem: Problem, white: Sequence[float]) -> tuple[Array, tuple[Trajectory, ...]]:
    """Two Gauss-Newton steps on the start values alone: unknowns (U,) and the free runs there.

    Args:
        white: (Y,) noise of a reading. A start is known by its spread, and by readings as far as they are
            precise: a model starts without a reading, so a body may have begun far from its declared start.
    """
    theta = problem.start
    starts = [i for i, u in enumerate(problem.unknowns) if u.is_nuisance]
    for _ in range(2 if starts else 0):
        information = np.diag(_spreads_of_starts(problem)[starts] ** -2.0)
        pull = -np.diag(information) * (theta - problem.start)[starts]
        for system in problem.systems:
            trajectory = problem.run(system, theta)
            weighed = problem.residual(trajectory) / system.grid.sd(white)
            seen = np.isfinite(weighed)
            slopes = problem.jacobian(trajectory)[:, :, starts] / system.grid.sd(white)[:, :, None]
            rows = slopes[seen]
            information = information + rows.T @ rows
            pull += rows.T @ weighed[seen]
        theta = theta.copy()
        theta[starts] += np.linalg.solve(information, pull)
    return theta, tuple(problem.run(system, theta) for system in problem.systems)


def _spreads_of_starts(problem: Problem) -> Array:
    """(U,) standard deviations of what is known before any reading, one where nothing is."""
    return np.array([u.prior[1] if u.prior else 1.0 for u in problem.unknowns])


def _likely(seen: Whitened, white: Noise, floor: Mapping[str, float]) -> Noise:
    """The most likely noise on the ladders, all steps as likely before; what the readings do not determine is
    integrated out.
    """
    ladders = (HEATS, SHARES, SLOW, FORMS, EDGES)

    def noise(at: tuple[int, ...]) -> Noise:
        heat, share, slow, form, edge = (ladder[k] for ladder, k in zip(ladders, at, strict=True))
        return replace(
            white,
            slow=tuple(slow * w for w in white.white),
            heat={name: heat * value for name, value in floor.items()},
            share=share,
            form=form,
            edge=edge,
        )

    known: dict[tuple[int, ...], float] = {}

    def level(at: tuple[int, ...]) -> float:
        if at not in known:
            known[at] = seen.grams(noise(at)).level()
        return known[at]

    best = tuple(len(ladder) // 2 for ladder in ladders)
    while True:
        near = [
            (*best[:k], best[k] + step, *best[k + 1 :])
            for k, ladder in enumerate(ladders)
            for step in (-1, 1)
            if 0 <= best[k] + step < len(ladder)
        ]
        higher = max(near, key=level)
        if level(higher) <= level(best):
            return noise(best)
        best = higher


def _compressed(seen: Whitened, noise: Noise, names: Sequence[str]) -> Array:
    """Rows (K, 1 + P + E) that say of parameters and form errors what all readings say, start values and
    other unknowns of the recordings integrated out.
    """
    unit, _ = seen.rows(replace(noise, form=1.0, edge=1.0))
    unknowns = [seen.fit.problem.unknowns[i] for i in seen.moving]
    count = len(unknowns)
    place = {u.name: 1 + k for k, u in enumerate(unknowns) if u.recording is None and u.name in names}
    own = [1 + k for k, u in enumerate(unknowns) if 1 + k not in place.values()]
    gram = unit.T @ unit
    if own:
        inner = gram[np.ix_(own, own)] + seen.prior[0][np.ix_(own, own)]
        gram = gram - gram[:, own] @ np.linalg.pinv(inner, hermitian=True) @ gram[own]
    kept = [0, *(place[n] for n in names if n in place), *range(1 + count, len(gram))]
    where = [0, *(1 + names.index(n) for n in names if n in place)]
    where += list(range(1 + len(names), 1 + len(names) + len(gram) - 1 - count))
    model = seen.fit.problem.model
    sd = np.array([UNKNOWN * abs(model.parameters[n].value) for n in names if n in place])
    scale = np.concatenate([[1.0], sd, np.full(seen.form[0], noise.form), np.full(seen.form[1], noise.edge)])
    found = compressed(gram[np.ix_(kept, kept)] * np.outer(scale, scale), scale)
    rows = np.zeros((len(found), 1 + len(names) + len(gram) - 1 - count))
    rows[:, where] = found
    return rows


def compressed(gram: Array, scale: Array) -> Array:
    """Rows (K, M) whose normal equations are those of a residual and of its slopes in units of `scale` (M,):
    one for each direction of which the readings say anything.
    """
    size, axes = np.linalg.eigh(gram)
    clear = size > SEEN
    inverse = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale > 0)
    return np.asarray(np.sqrt(size[clear])[:, None] * axes[:, clear].T * inverse)


def _read(campaign: Campaign, recordings: Collection[str], name: str) -> bool:
    return any(
        name in campaign.recordings[r].values and np.isfinite(campaign.recordings[r].values[name]).any()
        for r in recordings
    )
