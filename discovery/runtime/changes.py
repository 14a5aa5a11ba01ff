"""What new readings say of a possible change of a machine, as normal equations.

Around the model at work, the whitened residual of new recordings is

    r = J_p (dp + a) + J_e e + J_s ds + J_c c + J_h h + white noise

The fit left unknown: errors dp of the parameters and form errors e of the laws, as far as its readings say
(`discovery.export.knowledge`), and start values ds. What may have changed: parameters by a, the sensors of
inputs by offsets c, and unknown heat h at the bodies. All are Gaussian with mean zero. So what the fit left
unknown is integrated out once, and the odds of each change are a Gaussian integral in closed form (marginal
likelihood; Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, section 2.3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory, sensitivities
from discovery.dynamics.trajectory import flows
from discovery.evidence.events import heat_steps
from discovery.evidence.form_error import edge_columns, law_columns
from discovery.export.knowledge import Knowledge, compressed, spreads
from discovery.fitting.kalman import make_filter
from discovery.fitting.noise import Noise
from discovery.fitting.problem import Problem
from discovery.terms import Term

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

BLOCKS = 192  # in which unknown heat is one number, over all recordings


@dataclass(frozen=True)
class Change:
    """Something that may have changed: columns of the slopes, and a square root (len(columns), K) of the
    covariance of their coefficients.
    """

    columns: Ints
    root: Array

    def and_also(self, other: Change) -> Change:
        """This and another change, independent of each other."""
        root = np.zeros((len(self.root) + len(other.root), self.root.shape[1] + other.root.shape[1]))
        root[: len(self.root), : self.root.shape[1]] = self.root
        root[len(self.root) :, self.root.shape[1] :] = other.root
        return Change(np.concatenate([self.columns, other.columns]), root)


@dataclass(frozen=True)
class Wear:
    """Parameters that may age, with a square root (A, K) of the covariance of their changes: columns (A,) of
    the slopes for changes before the recordings, and bit by bit during them; `share`: of the changes during
    them, over those before.
    """

    before: Ints
    during: Ints
    root: Array
    share: float = 1.0

    @property
    def change(self) -> Change:
        """As something that may have changed: so much before the recordings, and so much during them."""
        first = Change(self.before, self.root)
        return first.and_also(Change(self.during, self.share * self.root))


@dataclass(frozen=True)
class Followed:
    """How far parameters have worn at the end of the recordings (A,), its standard deviation (A,), and what
    is known of all parameters and form errors then, as rows of `Knowledge`. `during` (A,): how much of it
    came during the recordings, with its standard deviation.
    """

    by: Array
    sd: Array
    rows: Array
    during: Array
    during_sd: Array


@dataclass(frozen=True)
class Seen:
    """Readings with what the fit left unknown integrated out: normal equations (1 + K, 1 + K) of the
    residual, then of the slopes of what may have changed.
    """

    gram: Array

    def log_odds(self, change: Change) -> float:
        """Log of the probability of the readings with a change over that without."""
        normal, pull = self._normal(change)
        factor = np.linalg.cholesky(normal)
        solved = np.linalg.solve(factor, pull)
        return float(0.5 * solved @ solved - np.log(np.diag(factor)).sum())

    def log_odds_of(self, columns: Ints, by: Array) -> float:
        """The same for changes of coefficients by known amounts."""
        at = 1 + columns
        return float(self.gram[at, 0] @ by - 0.5 * by @ self.gram[np.ix_(at, at)] @ by)

    def size(self, change: Change) -> tuple[Array, Array]:
        """Most likely coefficients (len(columns),) of a change, and their covariance."""
        normal, pull = self._normal(change)
        inverse = np.linalg.inv(normal)
        return change.root @ (inverse @ pull), change.root @ inverse @ change.root.T

    def _normal(self, change: Change) -> tuple[Array, Array]:
        at = 1 + change.columns
        normal = change.root.T @ self.gram[np.ix_(at, at)] @ change.root
        return normal + np.eye(len(normal)), change.root.T @ self.gram[at, 0]


@dataclass(frozen=True)
class Heat:
    """Unknown heat at a state in blocks of time: its columns of the slopes, rms flow (b,) through the state
    in each block, and a square root (b, b) of the correlation of the blocks.
    """

    columns: Ints
    flow: Array
    root: Array

    def change(self, floor: float, share: float) -> Change:
        """Heat of a usual size: the root of `floor`^2 (W, or a rate) and (`share` times the flow)^2."""
        return Change(self.columns, np.hypot(floor, share * self.flow)[:, None] * self.root)

    def flow_to(self, other: Heat, floor: float, share: float) -> Change:
        """Heat of a usual size that leaves this state and enters another; the smaller flow of both counts."""
        size = np.hypot(floor, share * np.minimum(self.flow, other.flow))[:, None] * self.root
        return Change(np.concatenate([self.columns, other.columns]), np.concatenate([-size, size]))


@dataclass(frozen=True)
class Table:
    """Whitened readings (N,) of the fit and of new recordings, with their slopes.

    `base` (N, B): what the fit left unknown, in standard deviations `spread` (B,): parameters, form errors,
    then starts; `slopes` (N, K): of what may have changed; `at`: their columns by name, of parameters
    "at once" and "bit by bit", of offsets of channels, and of what else is asked; `heat`: of heat at each
    state. The rows of the fit, `fitted` in number, come first; the first `kept` columns of the base are in
    them.
    """

    residual: Array
    base: Array
    slopes: Array
    at: Mapping[str, Ints]
    heat: Mapping[str, Heat]
    spread: Array
    fitted: int
    kept: int

    def seen(self, usual: Change | None = None) -> Seen:
        """With what the fit left unknown integrated out, and with what changes all the time."""
        base = self.base
        if usual is not None:
            base = np.hstack([base, self.slopes[:, usual.columns] @ usual.root])
        columns = np.column_stack([self.residual, self.slopes])
        factor = np.linalg.cholesky(base.T @ base + np.eye(base.shape[1]))
        inside = np.linalg.solve(factor, base.T @ columns)
        return Seen(columns.T @ columns - inside.T @ inside)

    def followed(self, wear: Wear) -> Followed:
        """The next revision under wear: parameters p + a at the end of the recordings, where the readings of
        the fit see p, and the new ones p plus what has worn until then.

        Only `a` may move, along the root of the wear. It moves to where the errors of the new recordings are
        as near as it can bring them to the most likely ones.
        """
        size, kept, new = self.spread[: self.kept], self.kept, slice(self.fitted, None)
        before, during = (self.slopes[:, at] @ wear.root for at in (wear.before, wear.during))
        count = wear.root.shape[1]
        # per unit of wear before and during: what the readings show less than the parameters at the end do
        rows_of_fit = self.base[: self.fitted, wear.before] @ _over(wear.root, size[wear.before])
        lag = np.hstack([np.zeros_like(before), during - before])
        lag[: self.fitted] = -np.tile(rows_of_fit, 2)
        lag[:, count:] *= wear.share
        every = np.column_stack([self.residual, self.base, lag])
        gram = every.T @ every
        inverse = np.linalg.inv(gram[1:, 1:] + np.eye(len(gram) - 1))
        grown = wear.share * wear.root
        last = slice(len(inverse) - count, None)  # none, where nothing of the model can wear
        during_by = grown @ (inverse @ gram[1:, 0])[last]
        during_sd = np.sqrt(np.einsum("ij,jk,ik->i", grown, inverse[last, last], grown))
        gram = _without(gram, 1 + kept)
        covariance = np.linalg.inv(gram[1:, 1:] + np.eye(kept))
        mine = before[new]
        narrow = np.linalg.solve(mine.T @ mine + np.eye(mine.shape[1]), mine.T @ self.base[new, :kept])
        to = wear.root @ narrow
        by = to @ covariance @ gram[1:, 0]
        moved = np.zeros(kept)
        moved[wear.before] = _over(by, size[wear.before])
        gram[:, 0] -= gram[:, 1:] @ moved
        gram[0] -= moved @ gram[1:]
        sd = np.sqrt(np.einsum("ij,jk,ik->i", to, covariance, to))
        rows = compressed(gram, np.concatenate([[1.0], size]))
        return Followed(by, sd, rows, during_by, during_sd)


def _over(values: Array, size: Array) -> Array:
    """Values (A, ...) over sizes (A,), zero where a size is."""
    size = size.reshape(-1, *[1] * (values.ndim - 1))
    return np.divide(values, size, out=np.zeros_like(values), where=size > 0)


def _without(gram: Array, count: int) -> Array:
    """Normal equations (count, count) with the rest integrated out, which has standard deviations of one."""
    inner = gram[count:, count:] + np.eye(len(gram) - count)
    return np.asarray(
        gram[:count, :count] - gram[:count, count:] @ np.linalg.solve(inner, gram[count:, :count])
    )


@dataclass(frozen=True)
class Rows:
    """Whitened readings (N,) of the fit and of new recordings: `base` (N, B), what the fit left unknown, in
    standard deviations `spread` (B,); `more`: what else is asked, of the readings of each recording alone.
    The rows of the fit, `fitted` in number, come first; the first `kept` columns of the base are in them.
    `log`: of the standard deviations of all innovations, summed.
    """

    residual: Array
    base: Array
    more: tuple[Array, ...]
    spread: Array
    fitted: int
    kept: int
    log: float


def whitened(
    known: Knowledge,
    problem: Problem,
    runs: Sequence[Trajectory],
    more: Sequence[Array],
    flows: Sequence[Term] | None = None,
) -> Rows:
    """What the readings of a problem and of the fit say of what the fit left unknown.

    Args:
        problem: a model on new recordings; start values count as unknown.
        runs: of the model on each recording.
        more: further columns (R, Y, M) of each recording.
        flows: terms that the fit knew; default all of the model.

    Raises:
        UserError: what is known is of another model.
    """
    starts = [u for u in problem.unknowns if u.is_start]
    noise = noise_of(known, problem.outputs)
    residuals, bases, others, log = [], [], [], 0.0
    for k, run in enumerate(runs):
        mine = [i for i, u in enumerate(starts) if u.recording == run.system.grid.recording]
        laws = law_columns(run, known.scales, flows=flows)
        bounds = edge_columns(run, flows)
        blocks = [
            problem.residual(run)[:, :, None],
            np.concatenate([sensitivities(run, known.parameters), laws, bounds], axis=2),
            sensitivities(run, (), [starts[i].name for i in mine]),
            more[k],
        ]
        white, logs = make_filter(run).whitened(noise, np.concatenate(blocks, axis=2))
        ends = np.cumsum([block.shape[2] for block in blocks])[:-1]
        residual, base, begun, other = np.split(white, ends, axis=1)
        began = np.zeros((len(white), len(starts)))
        began[:, mine] = begun
        residuals.append(residual[:, 0])
        bases.append(np.hstack([base, began]))
        others.append(other)
        log += float(np.sum(logs))
    spread = np.concatenate(
        [
            spreads(known, problem.model, laws.shape[2], bounds.shape[2]),
            [u.prior[1] if u.prior else 1.0 for u in starts],
        ]
    )
    fitted = np.hstack([known.rows[:, 1:], np.zeros((len(known.rows), len(starts)))])
    return Rows(
        np.concatenate([known.rows[:, 0], *residuals]),
        np.concatenate([fitted, *bases]) * spread,
        tuple(others),
        spread,
        len(known.rows),
        known.rows.shape[1] - 1,
        log,
    )


def make_table(
    known: Knowledge,
    problem: Problem,
    channels: Sequence[str],
    more: Mapping[str, Sequence[Array]] | None = None,
) -> Table:
    """What the readings of a problem and of the fit say of changes, whitened with the noise of the fit.

    Args:
        problem: the model at work on new recordings; start values count as unknown.
        channels: inputs whose sensors may have an offset.
        more: by name, further slopes (R, Y, M) of each recording.

    Raises:
        UserError: what is known is of another model.
    """
    more = more or {}
    runs = [problem.run(system, problem.start) for system in problem.systems]
    noise, own = noise_of(known, problem.outputs), len(known.parameters)
    edges = _block_edges(runs, noise)
    states = [name for name, floor in known.floor.items() if floor > 0]
    lasts = [float(run.system.grid.time[-1]) for run in runs]
    asked = []
    for k, run in enumerate(runs):
        grown = (sum(lasts[:k]) + run.system.grid.time) / sum(lasts)
        changing = [
            sensitivities(run, known.parameters),
            sensitivities(run, known.parameters, grown=grown),
            sensitivities(run, channels),
            *(group[k] for group in more.values()),
        ]
        heat = [-np.diff(heat_steps(run, n, edges[k]), axis=2) for n in states]
        asked.append(np.concatenate([*changing, *heat], axis=2))
    rows = whitened(known, problem, runs, asked)
    counts = {"at once": own, "bit by bit": own} | dict.fromkeys(channels, 1)
    counts |= {name: group[0].shape[2] for name, group in more.items()}
    edge = np.cumsum([0, *counts.values()])
    before = int(edge[-1])
    first = np.cumsum([0, *((len(e) - 1) * len(states) for e in edges)])
    slopes = [np.zeros((rows.fitted, before + first[-1]))]
    for k, part in enumerate(rows.more):
        mine = np.zeros((len(part), before + first[-1]))
        mine[:, :before] = part[:, :before]
        mine[:, before + first[k] : before + first[k + 1]] = part[:, before:]
        slopes.append(mine)
    return Table(
        rows.residual,
        rows.base,
        np.concatenate(slopes),
        {n: np.arange(a, b) for n, a, b in zip(counts, edge[:-1], edge[1:], strict=True)},
        {n: _heat(runs, edges, i, noise.heat_time, before + first, n) for i, n in enumerate(states)},
        rows.spread,
        rows.fitted,
        rows.kept,
    )


def noise_of(known: Knowledge, outputs: Sequence[str]) -> Noise:
    """The noise of the fit, of the outputs that were read now."""
    assert known.noise is not None
    at = [known.noise.outputs.index(name) for name in outputs]
    white = tuple(known.noise.white[k] for k in at)
    slow = tuple(known.noise.slow[k] for k in at) if known.noise.slow else ()
    return replace(known.noise, outputs=tuple(outputs), white=white, slow=slow)


def _block_edges(runs: Sequence[Trajectory], noise: Noise) -> list[Array]:
    """Edges (b + 1,) of the blocks of each recording: a quarter of the memory of heat apart, or more."""
    lasts = [float(run.system.grid.time[-1]) for run in runs]
    width = max(sum(lasts) / BLOCKS, noise.heat_time / 4)
    return [np.linspace(0.0, last, 1 + max(1, round(last / width))) for last in lasts]


def _heat(
    runs: Sequence[Trajectory],
    edges: Sequence[Array],
    i: int,
    memory: float,
    first: Ints,
    state: str,
) -> Heat:
    """Unknown heat at a state, number `i` of those with columns; those of a recording begin at `first`."""
    columns, flow, count = [], [], sum(len(e) - 1 for e in edges)
    root, done = np.zeros((count, count)), 0
    for k, run in enumerate(runs):
        size = len(edges[k]) - 1
        columns.append(first[k] + i * size + np.arange(size))
        time = run.system.grid.time
        block = np.clip(
            np.searchsorted(edges[k], 0.5 * (time[1:] + time[:-1]), side="right") - 1, 0, size - 1
        )
        weight = np.bincount(block, run.system.grid.step, size)
        square = np.bincount(
            block, run.system.grid.step * flows(run)[:, run.system.states.index(state)] ** 2, size
        )
        flow.append(np.sqrt(square / np.maximum(weight, 1e-300)))
        lag = np.abs(np.subtract.outer(edges[k][:-1], edges[k][:-1]))
        own = slice(done, done + size)
        root[own, own] = np.linalg.cholesky(np.exp(-lag / memory) + 1e-9 * np.eye(size))
        done += size
    return Heat(np.concatenate(columns), np.concatenate(flow), root)
