"""Objections to a single effect: reasons for which it may not be named although it adds evidence."""

from __future__ import annotations

import numpy as np

from discovery.mismatch.assess import Assessment
from discovery.mismatch.catalogue import Shape
from discovery.mismatch.context import Context
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.signatures import block_signatures

BLOCKS = 12  # per recording, in which an effect is asked for its size
STEADY = 6.0  # log evidence for a size that changes with time beyond which the form is wrong
FORM = 0.03  # share of the gain that a law slightly off in form may leave unsteady
ALIKE = 0.8  # squared correlation of a window with an input from which the two cannot be told apart
AROUND = 8  # readings on each side in which a jump has to show
JUMPS = ("sensor_offset", "rezero")
PRESSED = 0.03  # relative distance from the end of a physical range
ASKED = 2.0  # log-likelihood beyond the end of an exponent's range from which another law is at work


def objections(best: Assessment, h: Hypothesis, gain: float) -> list[str]:
    """Sentences that speak against naming an effect of the best model; empty where none does.

    Args:
        gain: log evidence of the best model over the baseline; the larger it is, the more of a wrong form
        may show.
    """
    limit = STEADY + FORM * max(gain, 0.0)
    found = (
        bent(best, h),
        _untold(best, h),
        _no_jump(best, h),
        _is_an_input(best, h),
        _no_window(h),
        _unsteady(best, h, 1, limit, "from recording to recording"),
        _unsteady(best, h, BLOCKS, limit, "with time"),
    )
    return [text for text in found if text]


def bent(attempt: Assessment, h: Hypothesis) -> str | None:
    """A sentence when a size or a shape parameter presses against the end of its physical range: another law
    is at work.
    """
    most = h.effect.amplitude.most
    for name in h.amplitudes if most < np.inf else ():
        if abs(attempt.fit.model.parameters[name].value) > most * (1 - PRESSED):
            return f"{h.effect.word} would need {name} = {most:g}, the most that is physical"
    for name, shape in zip(h.shapes, h.effect.shapes, strict=True):
        p = attempt.fit.model.parameters[name]
        value = p.values.get(h.recording or "", p.value)
        # an end at zero is a natural one: there the law turns into a simpler one
        inside = shape.low * (1 + PRESSED) < value if shape.low > 0 else True
        if shape.low < 0:
            inside = value > shape.low * (1 - PRESSED)
        free = not (shape.fixed or p.fixed)
        if free and not (inside and value < shape.high * (1 - PRESSED)) and _asked(attempt, name, shape):
            size = f"{shape.name} = {value:.3g} {shape.unit}".removesuffix(" 1")
            return f"{h.effect.word} would need {size}, at the end of what is physical"
    return None


def _asked(attempt: Assessment, name: str, shape: Shape) -> bool:
    """Whether the data ask for more than the end of a range. The ends of times and widths are those of other
    laws; those of an exponent are a custom, and a value a little inside may do as well.
    """
    if shape.unit != "1":
        return True
    lens = attempt.lens
    view = attempt.best_view if attempt.views else lens.view(attempt.fit.noise)
    places = [k for k, u in enumerate(attempt.fit.problem.unknowns) if u.name == name]
    return any(lens.beyond(view, k) > ASKED for k in places)


def _untold(best: Assessment, h: Hypothesis) -> str | None:
    """A sentence when an effect whose only size is a time or a width could as well be nearly none."""
    if h.effect.amplitude.fixed is None or len(h.shapes) != 1 or h.recording is not None:
        return None
    (name,) = h.shapes
    p = best.model.parameters[name]
    if p.low is None or p.high is None or p.high - p.low < 2 * abs(p.value):
        return None
    return f"{h.effect.word}: these data do not tell {name}, {p.low:.3g} to {p.high:.3g} {p.unit}"


def _no_jump(best: Assessment, h: Hypothesis) -> str | None:
    """A sentence when a sensor said to have jumped shows no jump, only a slope, in the readings around.

    Around the instant each output gets a line of its own and a step; the steps have to be half of what is
    claimed, within twice their error.
    """
    if h.effect.word not in JUMPS or h.recording is None:
        return None
    trajectory, residual = next(
        (t, r)
        for t, r in zip(best.fit.trajectories, best.lens.residuals, strict=True)
        if t.system.grid.recording == h.recording
    )
    grid, parameters = trajectory.system.grid, best.model.parameters
    time, (instant,) = grid.time[grid.read], (parameters[n].values[h.recording] for n in h.shapes)
    seen = claimed = 0.0
    for name, amplitude in zip(h.shown, h.amplitudes, strict=True):
        y, size = grid.outputs.index(name), parameters[amplitude].values[h.recording]
        known = np.flatnonzero(np.isfinite(residual[:, y]))
        k = int(np.searchsorted(time[known], instant))
        near = known[max(0, k - AROUND) : k + AROUND]
        if len(near) < 6:
            continue
        step = (time[near] >= instant).astype(float)
        line = np.column_stack([np.ones(len(near)), time[near] - instant])
        left, values = (
            v - line @ np.linalg.lstsq(line, v, rcond=None)[0]
            for v in (step, residual[near, y] + size * step)
        )
        slope = float(left @ values) / max(float(left @ left), 1e-12)
        # what the fit takes for noise may be its own misfit: here the scatter around counts
        scatter = float(np.sum((values - slope * left) ** 2)) / (len(near) - 3)
        white = best.best_view.noise.white[best.best_view.noise.outputs.index(name)]
        weight = size / max(min(white**2, scatter), 1e-4 * white**2)
        seen += weight * float(left @ values)
        claimed += weight * size * float(left @ left)
    # `claimed` is also the variance of `seen`: each step is weighed by its size over its noise
    if claimed <= 0 or seen + 2 * np.sqrt(claimed) > 0.5 * claimed:
        return None
    share = f"{100 * max(seen / claimed, 0.0):.0f} %"
    return f"{h.effect.word}: the readings around show {share} of the jump, the rest is a slope"


def _is_an_input(best: Assessment, h: Hypothesis) -> str | None:
    """A sentence when the window of an unrecorded heat is that of an input: the input acts by another law."""
    if h.effect.word != "unmeasured_heat" or h.recording is None:
        return None
    t = next(t for t in best.fit.trajectories if t.system.grid.recording == h.recording)
    on, off = (best.fit.model.parameters[n].values[h.recording] for n in h.shapes)
    time = np.linspace(t.system.grid.time[0], t.system.grid.time[-1], 2000)
    window = ((time >= on) & (time < off)).astype(float)
    for name, samples in t.system.grid.samples.items():
        series = samples.at(time)
        if np.ptp(series) > 0 and np.ptp(window) > 0 and np.corrcoef(series, window)[0, 1] ** 2 > ALIKE:
            return f"{h.effect.word} acts just while {name} does: no event"
    return None


def _no_window(h: Hypothesis) -> str | None:
    """A sentence when the readings leave open whether a window had begun before it could have ended."""
    if len(h.spans) != 2:
        return None
    begins, ends = (h.spans[name] for name in h.shapes)
    if begins[1] < ends[0]:
        return None
    return f"{h.effect.word} at {h.where}: these data do not tell when it began and ended"


def matters(context: Context, attempt: Assessment, h: Hypothesis) -> bool:
    """Whether an effect has a size that physics would give it.

    A model with few bodies is a little wrong everywhere; with enough readings that shows, as effects of a
    few per cent of the usual size. They are not what is missing. No body jumps, but a slow one drifts.
    """
    if unseen_lag(context, h, attempt):
        return False
    if h.effect.amplitude.fixed is not None or h.effect.word in JUMPS:
        return True
    return any(size >= least for size, least in zip(_sizes(attempt, h), context.minor(h), strict=True))


def of_a_link(context: Context, attempt: Assessment, h: Hypothesis) -> bool:
    """Whether an exchange carries less than half of what the model's own link does, as an attempt fits it."""
    return all(size < half for size, half in zip(_sizes(attempt, h), context.half_a_link(h), strict=True))


def _sizes(attempt: Assessment, h: Hypothesis) -> list[float]:
    """Magnitudes of the amplitudes."""
    parameters = (attempt.fit.model.parameters[name] for name in h.amplitudes)
    return [abs(p.values.get(h.recording or "", p.value)) for p in parameters]


def unseen_lag(context: Context, h: Hypothesis, attempt: Assessment | None = None) -> bool:
    """Whether an effect is a lag of a sensor, as an attempt has fitted it, and shorter than the time between
    its readings: these do not tell it from the way of heat through a body that the model takes for one.
    """
    if (
        h.effect.word != "sensor_lag" or h.output is None or len(h.shapes) != 1
    ):  # an engineer's own may differ
        return False
    (name,) = h.shapes
    lag = attempt.fit.model.parameters[name].value if attempt else h.shapes[name]
    grids = context.grids.values()
    read = [g.time[g.read][g.measured[:, g.outputs.index(h.output)]] for g in grids]
    every = np.concatenate([np.diff(times) for times in read])
    return len(every) > 0 and lag < float(np.median(every))


def _unsteady(best: Assessment, h: Hypothesis, blocks: int, limit: float, text: str) -> str | None:
    """A sentence when the size of an effect would have to change from one block of time to the next.

    Each block gets an amplitude of its own; their scatter is tested against a constant (log Bayes factor),
    and counts only when it is a large share of the amplitude itself: a law that is slightly off in form may
    stand.
    """
    if h.effect.amplitude.fixed is not None or h.shown or h.recording is not None or len(h.amplitudes) > 1:
        return None
    total = blocks * len(best.fit.trajectories)
    if total < 2:
        return None
    size = best.model.parameters[h.amplitudes[0]].value
    there = h.at({name: best.model.parameters[name].value for name in h.shapes})
    columns = [
        block_signatures(t, there, blocks, k * blocks, total) for k, t in enumerate(best.fit.trajectories)
    ]
    view = best.best_view
    z = view.project(best.lens.whiten(view.noise, columns)[0])
    gram, dot = z.T @ z, z.T @ view.residual
    best_gain, share = 0.0, 0.0
    for spread in (0.2, 0.5, 1.0, 2.0):
        sd = spread * abs(size)
        inner = np.eye(total) + sd * sd * gram
        solved = sd * np.linalg.solve(inner, sd * dot)
        gain = 0.5 * float(dot @ solved) - 0.5 * float(np.linalg.slogdet(inner)[1])
        if gain > best_gain:
            best_gain, share = gain, spread
    if best_gain > limit and share >= 0.5:
        return f"the size of {h.effect.word} would have to change {text} (log evidence {best_gain:.0f})"
    return None
