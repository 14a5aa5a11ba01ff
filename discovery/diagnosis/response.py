"""How an output follows what is recorded, where no effect of the catalogue explains what a model misses:
gains and time constants that are found without the model. A description, not a cause.

    y(t) = z_run + sum_k (g_k lag(u_k, tau_k) + s_run,k exp(-t/tau_k))

Two time constants are two masses or two paths; gains of opposite sign are a path that acts early and another
one that works against it later. What was before a recording is not known: a heater may be on at its first
instant, at a machine that is cold or still warm. So each lag begins in each recording with a value of its
own, s, also in a recording that is left out. What these starts explain counts neither for the sum nor
against the model. A sum is said only if it predicts each recording that it was not fitted to better than the
model does, fitted without it, too, if it leaves at most half of the squares that the model leaves there, and
if each of these fits finds the same inputs.

Terms are found one after the other (orthogonal least squares: S. Chen, S. Billings and W. Luo, Int. J.
Control 50, 1989, 1873); time constants are refined together after each step (variable projection: G. Golub
and V. Pereyra, SIAM J. Numerical Analysis 10, 1973, 413).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import Context
from discovery.diagnosis.crossvalidation import model_left_out
from discovery.diagnosis.proof import block_sums, surely_better
from discovery.dynamics import Grid
from discovery.dynamics.grid import interleaved
from discovery.dynamics.series import lag_ends
from discovery.evaluation.crossvalidation import folds
from discovery.models.units import differences, per
from discovery.printed import lasting, printed
from discovery.recordings import Campaign

Array = NDArray[np.float64]
Lagged = tuple[str, float]  # an input, and the time constant [s] with which an output follows it
Sum = tuple[tuple[Lagged, ...], Array]  # and their gains

MOST_TERMS = 3
TRIED = 14  # time constants of each input, from half the usual distance of readings to the longest recording
MOST_STEPS = 60  # of a refinement


@dataclass(frozen=True)
class Part:
    """An output follows an input: `gain` in its unit per unit of the input, and a time constant.

    `low` and `high` [s] are the shortest and the longest over the fits without a recording.
    """

    input: str
    gain: float
    unit: str
    seconds: float
    low: float
    high: float


@dataclass(frozen=True)
class Response:
    """How an output follows inputs, and the rms [its unit] of what is left of recordings that are left out.

    `shortest` [s]: shorter time constants cannot be told from none, and those of `longest` from a ramp.
    """

    output: str
    unit: str
    parts: tuple[Part, ...]
    left: float
    left_by_model: float
    shortest: float
    longest: float

    def sentence(self) -> str:
        """What was found, in words."""
        inputs = list(dict.fromkeys(p.input for p in self.parts))
        said = "; ".join(self._of(name) for name in inputs)
        left = f"{printed(self.left)} {self.unit}".removesuffix(" 1")
        judged = f"rms {left} on recordings left out of the fit, {printed(self.left_by_model)} with the model"
        return f"{self.output} follows {said} ({judged}; a description, not a cause)"

    def _of(self, name: str) -> str:
        """An input in words: `bed with two time constants of opposite sign: +3 um/K after 1 min, ...`."""
        own = [p for p in self.parts if p.input == name]
        several = ("", "", "with two time constants", "with three time constants")[len(own)]
        opposite = " of opposite sign" if len({p.gain > 0 for p in own}) > 1 else ""
        head = f"{name} {several}{opposite}: " if several else f"{name}: "
        return head + ", ".join(self._term(p) for p in own)

    def _term(self, p: Part) -> str:
        gain = f"{'+' if p.gain > 0 else '-'}{printed(abs(p.gain))} {p.unit}"
        if p.seconds <= self.shortest:
            return f"{gain} at once"
        if p.seconds >= self.longest:
            rate = f"{'+' if p.gain > 0 else '-'}{printed(60.0 * abs(p.gain) / p.seconds)} {p.unit}"
            return f"{rate} each minute, for longer than a recording ({lasting(p.seconds)})"
        ends = f" ({lasting(p.low)} to {lasting(p.high)})" if lasting(p.low) != lasting(p.high) else ""
        return f"{gain} after {lasting(p.seconds)}{ends}"


def responses(context: Context) -> list[Response]:
    """How outputs follow inputs, of those that a short sum predicts better than the model; none where no
    recording can be left out.
    """
    left, campaign = model_left_out(context), context.campaign
    found = []
    for y, output in enumerate(context.outputs):
        read = [r for r in context.recordings if r in left and np.isfinite(left[r][:, y]).sum() > MOST_TERMS]
        warm = campaign.channels[output].role == "temperature"
        data = _Readings({r: context.grids[r] for r in read}, y, campaign, warm)
        by_model = {r: left[r][:, y] for r in read}
        one = data.response(output, by_model) if len(read) > 1 and data.inputs else None
        found += [one] if one else []
    return found


@dataclass(frozen=True)
class _Readings:
    """Readings of one output in several recordings; the zero of each is its own. `warm`: a thermometer."""

    grids: Mapping[str, Grid]
    output: int
    campaign: Campaign
    warm: bool

    @property
    def inputs(self) -> list[str]:
        """Recorded channels that move. A thermometer does not follow another one: both answer."""
        grids, channels = list(self.grids.values()), self.campaign.channels
        names = [n for n in (grids[0].samples if grids else ()) if n in channels]
        names = [n for n in names if channels[n].is_input or not self.warm]
        return [n for n in names if any(np.ptp(g.nodes[n]) > 1e-9 for g in grids)]

    def response(self, output: str, by_model: Mapping[str, Array]) -> Response | None:
        """The sum whose terms surely predict; None if the model predicts about as well."""
        read = list(self.grids)
        parts = [
            (fold.recordings, self.sums([r for r in read if r not in fold.recordings]))
            for fold in folds(self.campaign, read, blocks=0)
        ]
        whole, chosen, used = self.sums(read), 0, dict[str, Sum]()
        best = {r: self.readings(r) for r in read}
        for k, (terms, _) in enumerate(whole):
            if any(len(sums) <= k or _inputs(sums[k]) != _inputs(whole[k]) for _, sums in parts):
                continue
            found = {r: sums[k] for group, sums in parts for r in group}
            left = {r: self.left(r, found[r]) for r in read}
            if _surely({r: self.begun(r, best[r], found[r][0]) for r in read}, left):
                best, chosen, used = left, len(terms), found
        if not chosen:
            return None
        model = {r: self.begun(r, by_model[r], used[r][0]) for r in read}
        worse = any(_rms([best[r]]) >= _rms([model[r]]) for r in read)
        rms = _rms(list(best.values())), _rms(list(model.values()))
        if worse or thresholds.MISSED * rms[0] ** 2 > rms[1] ** 2:
            return None
        unit = differences(self.campaign.channels[output].unit)
        terms, gains = whole[chosen - 1]
        folded = [sorted(sums[chosen - 1][0]) for _, sums in parts]
        said = []
        for place, k in enumerate(sorted(range(chosen), key=lambda k: terms[k])):
            name, seconds = terms[k]
            ends = [seconds, *(one[place][1] for one in folded)]
            by = f"{unit}{per(differences(self.campaign.channels[name].unit))}"
            said.append(Part(name, float(gains[k]), by, seconds, min(ends), max(ends)))
        shortest, longest = self.limits
        return Response(output, unit, tuple(said), *rms, 1.01 * shortest, 0.99 * longest)

    def sums(self, recordings: Sequence[str]) -> list[Sum]:
        """The best sums of one term, two terms, ..., each with one term more than the one before."""
        times = [float(t) for t in np.geomspace(*self.limits, TRIED)]
        found, terms = list[Sum](), tuple[Lagged, ...]()
        while len(terms) < MOST_TERMS:
            tried = [one for t in times for one in self._with_one_more(recordings, terms, t)]
            best, chosen = min(tried, default=(np.inf, ("", 0.0)))
            if not np.isfinite(best):
                break
            terms = self.refined(recordings, (*terms, chosen))
            if _twice(terms, times[1] / times[0]):
                break
            found.append((terms, _gains(*self.rows(recordings, terms))))
        return found

    def _with_one_more(
        self, recordings: Sequence[str], terms: Sequence[Lagged], seconds: float
    ) -> list[tuple[float, Lagged]]:
        """What is left, as a sum of squares, with each input in addition, if it follows it so late."""
        new = [(name, seconds) for name in self.inputs]
        x, y = self.rows(recordings, [*terms, *new])
        own = np.linalg.qr(x[:, : len(terms)])[0]
        y, free = y - own @ (own.T @ y), x[:, len(terms) :] - own @ (own.T @ x[:, len(terms) :])
        size, whole = np.sum(free**2, axis=0), np.sum(x[:, len(terms) :] ** 2, axis=0)
        left = y @ y - (free.T @ y) ** 2 / np.maximum(size, 1e-300)
        return [(float(v), one) for v, one, s, w in zip(left, new, size, whole, strict=True) if s > 1e-8 * w]

    @property
    def limits(self) -> tuple[float, float]:
        """The shortest and the longest time constant [s]."""
        steps = np.concatenate([np.diff(g.time[g.read]) for g in self.grids.values()])
        return float(np.median(steps)) / 2, max(float(np.ptp(g.time)) for g in self.grids.values())

    def refined(self, recordings: Sequence[str], terms: Sequence[Lagged]) -> tuple[Lagged, ...]:
        """The terms with the time constants that fit best together."""
        from scipy.optimize import least_squares  # a third of a second that most diagnoses do not need

        names = [name for name, _ in terms]
        low, high = np.log(self.limits)

        def left(logs: Array) -> Array:
            x, y = self.rows(recordings, list(zip(names, np.exp(logs).tolist(), strict=True)))
            return np.asarray(y - x @ _gains(x, y))

        inside = 1e-6 * (high - low)
        begin = np.clip(np.log([t for _, t in terms]), low + inside, high - inside)
        logs = least_squares(left, begin, bounds=(low, high), max_nfev=MOST_STEPS).x
        return tuple(zip(names, np.exp(logs).tolist(), strict=True))

    def rows(self, recordings: Sequence[str], terms: Sequence[Lagged]) -> tuple[Array, Array]:
        """Lagged inputs (R, P) and readings (R,) of recordings, without what their starts explain."""
        columns, readings = [], []
        for r in recordings:
            seen = np.isfinite(self.readings(r))
            x, start = self.lagged(r, terms)[seen], self.starts(r, seen, terms)
            rest = x - start @ (start.T @ x)
            rest[:, np.sum(rest**2, axis=0) < 1e-12 * np.sum(x**2, axis=0)] = 0.0  # it did not move
            y = self.readings(r)[seen]
            columns.append(rest)
            readings.append(y - start @ (start.T @ y))
        return np.concatenate(columns), np.concatenate(readings)

    def starts(self, recording: str, seen: NDArray[np.bool_], terms: Sequence[Lagged]) -> Array:
        """What the zero of a recording and the starts of its lags may explain of its readings: orthonormal
        columns (R, S).
        """
        grid = self.grids[recording]
        time = (grid.time[grid.read] - grid.time[0])[seen]
        falling = [np.exp(-time / seconds) for seconds in sorted({t for _, t in terms})]
        u, size, _ = np.linalg.svd(np.column_stack([np.ones_like(time), *falling]), full_matrices=False)
        return np.asarray(u[:, size > 1e-6 * size[0]])

    def begun(self, recording: str, left: Array, terms: Sequence[Lagged]) -> Array:
        """What is left of a recording (R,) without what the starts of these lags explain of it."""
        seen, rest = np.isfinite(left), left.copy()
        start = self.starts(recording, seen, terms)
        rest[seen] -= start @ (start.T @ left[seen])
        return rest

    def readings(self, recording: str) -> Array:
        """The readings (R,), NaN where the output was not read."""
        return np.asarray(self.grids[recording].readings[:, self.output])

    def lagged(self, recording: str, terms: Sequence[Lagged]) -> Array:
        """Lagged inputs (R, P) at the readings; each begins settled."""
        grid = self.grids[recording]
        columns = np.empty((len(grid.read), len(terms)))
        for k, (name, seconds) in enumerate(terms):
            nodes = np.asarray(grid.nodes[name], dtype=float)
            after = lag_ends(interleaved(nodes[:-1], nodes[1:]), grid.step, seconds)
            columns[:, k] = np.concatenate((after[:1], after[1::2]))[grid.read]
        return columns

    def left(self, recording: str, found: Sum) -> Array:
        """What a sum leaves of the readings of a recording (R,)."""
        terms, gains = found
        return self.begun(recording, self.readings(recording) - self.lagged(recording, terms) @ gains, terms)


def _inputs(found: Sum) -> list[str]:
    return sorted(name for name, _ in found[0])


def _twice(terms: Sequence[Lagged], ratio: float) -> bool:
    """Whether an input stands twice with time constants that cannot be told apart: gains that cancel.

    Args:
        ratio: of neighbouring time constants that are tried.

    >>> _twice((("P", 60.0), ("P", 70.0)), 1.5), _twice((("P", 60.0), ("F", 70.0), ("P", 90.0)), 1.5)
    (True, False)
    """
    logs = [(name, float(np.log(seconds))) for name, seconds in sorted(terms)]
    return any(a[0] == b[0] and b[1] - a[1] < 0.999 * np.log(ratio) for a, b in pairwise(logs))


def _gains(x: Array, y: Array) -> Array:
    return np.asarray(np.linalg.lstsq(x, y, rcond=1e-10)[0])


def _surely(before: Mapping[str, Array], after: Mapping[str, Array]) -> bool:
    """Whether blocks of time get better by more than chance makes them."""
    pairs = [block_sums(before[r][:, None], after[r][:, None]) for r in before]
    return surely_better(np.concatenate([old - new for old, new, _ in pairs]))


def _rms(parts: Sequence[Array]) -> float:
    return float(np.sqrt(np.nanmean(np.concatenate(parts) ** 2)))
