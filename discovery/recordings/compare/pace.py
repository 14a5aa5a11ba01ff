"""A clock that runs too fast or too slow: all responses of a recording are too slow, or too fast, alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discovery.recordings.compare.crossprediction import LEAST, CrossPrediction, Reading
from discovery.recordings.compare.repairs import Disagreement, paced

_FACTORS = np.exp(np.linspace(-np.log(2.0), np.log(2.0), 29))
_FIRST = (0.8, 1.25)  # are tried first: most clocks are right
_NEAR = 0.08  # of the logarithm: so little of a factor is no finding
_LOOK, _GAIN = 0.15, 0.4  # log likelihood a reading, over the root of the outputs
_OTHERS = 2.0  # times the logarithm of the factor with which any other recording agrees best
_POOR = 0.2  # of the movement: a worse prediction has causes that nobody recorded
_BACK = 1.15  # times the usual misfit: as well as the others
_JUDGES = 8


def odd_pace(known: CrossPrediction) -> Disagreement | None:
    """The recording that gains most by another pace of its clock, if no other one agrees best with a factor
    that is nearly as large, and it then agrees as well as the others do.

    A wrong model of a machine is wrong in all recordings; a wrong clock is so in one. Where recordings say
    little about the pace, the others agree best with any factor; what nothing predicts well says nothing.
    """
    if len(known.recordings) < 3:
        return None
    found = []
    for name in known.recordings:
        if max(_gained(known, name, factor)[0] for factor in _FIRST) > _LOOK:
            gain, factor = _best(known, name)
            if gain > _GAIN and abs(np.log(factor)) > _NEAR:
                found.append((gain, name, factor))
    if not found:
        return None
    gain, name, factor = max(found)
    others = [other for other in known.recordings if other != name]
    others = others[:: max(1, len(others) // _JUDGES)][:_JUDGES]
    judges = [other for other in others if _gained(known, other, 1.0, [name])[3] > 0.0]
    if len(judges) < 2:
        return None
    usual = max(abs(np.log(_best(known, other, [name])[1])) for other in judges)
    _, before, after, limit = _gained(known, name, factor)
    if abs(np.log(factor)) < _OTHERS * usual or after > _BACK * limit:
        return None
    return Disagreement(name, paced(known.recordings[name], factor), before, after, limit, gain)


def _best(known: CrossPrediction, name: str, without: Sequence[str] = ()) -> tuple[float, float]:
    """The largest gain of a recording by another pace of its clock, and the factor."""
    return max((_gained(known, name, factor, without)[0], factor) for factor in _FACTORS)


def _gained(
    known: CrossPrediction, name: str, factor: float, without: Sequence[str] = ()
) -> tuple[float, float, float, float]:
    """What a recording gains if its time is multiplied; its misfit before and after, and the usual one.

    Args:
        without: recordings that do not predict it.
    """
    one, predicted = known.recordings[name], known.predicted(name, without=without)
    read = {y: r for y in predicted.theta if (r := known.readings[name, y]) is not None}
    usual = {y: known.usual_misfit(name, y) for y in read}
    read = {y: r for y, r in read.items() if usual[y] <= _POOR}
    if not read:
        return 0.0, 0.0, 0.0, 0.0
    made = paced(one, factor).made
    again = known.repaired(predicted, made, (), list(read))
    before = np.array([known.misfit(predicted, y, r) for y, r in read.items()])
    after = np.array([known.misfit(again, y, Reading(factor * r.at, r.read)) for y, r in read.items()])
    gain = float(np.sum(np.log(np.maximum(before, LEAST) / np.maximum(after, LEAST)))) / len(read) ** 0.5
    limit = np.array([usual[y] for y in read])
    rms = [float(np.sqrt(np.mean(values**2))) for values in (before, after, limit)]
    return gain, rms[0], rms[1], rms[2]
