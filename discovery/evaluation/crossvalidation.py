"""Cross-validation over the recordings to fit: whole recordings left out, and blocks of hours left out.

Held-out recordings take no part. What is left out here is refitted without, then predicted; it says how far
the figures of the fit can be trusted before anything unseen is looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.evaluation.criteria import criteria
from discovery.fitting import Fit, Noise, fit_model, predict_recording
from discovery.models import Model
from discovery.recordings import Campaign, Recording

Array = NDArray[np.float64]
Window = tuple[float, float]  # s, from and up to
Refit = Callable[[Campaign, Sequence[str]], Fit]

ROUNDS = 6  # of Levenberg-Marquardt: the start is the fit to everything
LEAD = 0.2  # of the first block, which stays: only there readings show where hidden states begin
MOST_FOLDS = 4  # recordings are left out in groups when there are more


@dataclass(frozen=True, slots=True)
class Fold:
    """What is left out of one fit: whole recordings, or a window of each recording."""

    name: str
    recordings: tuple[str, ...] = ()
    windows: Mapping[str, Window] | None = None


def folds(campaign: Campaign, recordings: Sequence[str], blocks: int = 3) -> list[Fold]:
    """Leave one recording (or group of them) out, where there are two or more; then blocks of time."""
    out = []
    if len(recordings) > 1:
        groups = [tuple(recordings[i::MOST_FOLDS]) for i in range(min(MOST_FOLDS, len(recordings)))]
        out += [Fold(", ".join(group), recordings=group) for group in groups]
    for k in range(blocks):
        windows = {}
        for name in recordings:
            span = float(campaign.recordings[name].time[-1])
            begin, end = max(float(k), LEAD) * span / blocks, (k + 1) * span / blocks
            windows[name] = (begin, end if k + 1 < blocks else np.inf)
        out.append(Fold(f"block {k + 1} of {blocks}", windows=windows))
    return out


def cross_validate(
    model: Model,
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    noise: Noise | None = None,
    refit: Refit | None = None,
) -> dict[str, dict[str, float]]:
    """rms of each output on what was left out, pooled over the folds: {"recordings": {...}, "blocks": {...}}.

    The structure of the model stays; its parameters are fitted anew from where they are, a few steps far.

    Args:
        noise: of the fit to everything, so that no fold has to find it again.
        refit: how the model is fitted to what stays; default by output error.
    """

    def by_output_error(seen: Campaign, kept: Sequence[str]) -> Fit:
        return fit_model(model, seen, kept, outputs, noise=noise, max_rounds=ROUNDS)

    refit = refit or by_output_error
    left: dict[str, list[Array]] = {}
    for fold in folds(campaign, recordings):
        for rows in _left_over(refit, campaign, recordings, outputs, fold):
            left.setdefault("blocks" if fold.windows else "recordings", []).append(rows)
    return {
        kind: {name: criteria(np.concatenate([r[:, y] for r in rows])).rms for y, name in enumerate(outputs)}
        for kind, rows in left.items()
    }


def _left_over(
    refit: Refit,
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    fold: Fold,
) -> Iterator[Array]:
    """Readings minus model (R, Y) where the fit did not see them, NaN elsewhere."""
    if fold.windows is None:
        kept = [name for name in recordings if name not in fold.recordings]
        seen = replace(campaign, recordings={name: campaign.recordings[name] for name in kept})
        fit = refit(seen, kept)
        for name in fold.recordings:
            trajectory = predict_recording(
                fit.model, campaign, name, outputs, fit.noise.white, zeros=fit.zeros
            )
            yield fit.problem.residual(trajectory)
        return
    hidden = {name: masked(campaign.recordings[name], outputs, fold.windows[name]) for name in recordings}
    fit = refit(replace(campaign, recordings=hidden), recordings)
    for trajectory in fit.trajectories:
        name = trajectory.system.grid.recording
        whole = predict_recording(
            fit.model, campaign, name, outputs, fit.noise.white, known=fit.offset_in(name)
        )
        rows = fit.problem.residual(whole)
        time = whole.system.grid.time[whole.system.grid.read]
        low, high = fold.windows[name]
        yield np.where(((time >= low) & (time < high))[:, None], rows, np.nan)


def masked(recording: Recording, outputs: Sequence[str], window: Window) -> Recording:
    """The recording with the readings of a window taken away, save the first one, on which models are zeroed.

    Inputs stay: the machine went on.
    """
    hidden = (recording.time >= window[0]) & (recording.time < window[1])
    values = dict(recording.values)
    for name in outputs:
        series = np.array(values[name])
        series[hidden & (np.cumsum(np.isfinite(series)) > 1)] = np.nan
        values[name] = series
    return replace(recording, values=values)
