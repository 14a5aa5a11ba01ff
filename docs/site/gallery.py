"""The gallery of effects: what the catalogue says of each, and a picture of its signature."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HOURS = np.linspace(0.0, 24.0, 961)
STEP = float(HOURS[1] - HOURS[0]) * 3600.0  # s
INSTANTS = (6.0, 14.0)  # h: where a jump or a window of the picture begins and ends
MEMORY = 3600.0  # s: time constants that the catalogue leaves to the recordings
TEMPLATE = """# Gallery of effects

The catalogue holds {count} laws of {words} effects. A diagnosis searches all of them at every place where
they can act. `discovery explain WORD` prints the same text. Each picture shows one day of a simulated table
with the usual size of the effect: the inputs of the formula above, its result below. Sizes are log-normal:
about 68 % of machines lie within the typical range.

"""


def pages() -> dict[str, str | bytes]:
    """gallery/index.md and a picture for each law."""
    from discovery.diagnosis.thresholds import FACTOR
    from discovery.effects.catalogue import catalogue

    laws = catalogue()
    words = {effect.word for effect in laws.values()}
    lines, made = [TEMPLATE.format(count=len(laws), words=len(words))], {}
    for group in dict.fromkeys(effect.group for effect in laws.values()):
        lines += [f"## {group.capitalize()}", ""]
        for name, effect in laws.items():
            if effect.group == group:
                made[f"gallery/{name}.svg"] = _picture(effect)
                lines += _entry(name, effect, FACTOR)
    return {"gallery/index.md": "\n".join(lines), **made}


def _entry(name: str, effect: Any, factor: float) -> Iterator[str]:
    from discovery.effects.reading import gives, meanings, shown_example
    from discovery.report.mathml import expression, math
    from discovery.terms import parse

    size = effect.amplitude
    sign = {1: "positive", -1: "negative"}.get(size.sign, "either sign")
    yield from (f"### {effect.title} {{ #{name} }}", "", f"`{effect.word}`: {_text(effect.signature)}.", "")
    formula = math(expression(parse(effect.formula)), block=True)
    yield from (f'<div style="overflow-x: auto">{formula}</div>', "")
    yield from (f"| formula | `{effect.formula}` |", "|---|---|", f"| gives | {gives(effect)} |")
    if known := "; ".join(_text(said) for said in meanings(effect)):
        yield f"| in which | {known} |"
    yield f"| acts on | {effect.place} |"
    if size.fixed is None:
        low, high = size.plausible / factor, size.plausible * factor
        unit = "" if size.unit == "1" else f" {size.unit}"
        span = f"{low:.2g} to {high:.2g}{unit} (usual {size.plausible:g}), {sign}"
        yield f"| typical range | `{size.name}`: {span} |"
    for shape in effect.shapes:
        yield f"| shape | `{shape.name}`: {_range(shape)} |"
    for example in effect.examples:
        yield f"| example | {_text(shown_example(effect, example))} |"
    if effect.confused_with:
        yield f"| looks like | {', '.join(f'`{word}`' for word in effect.confused_with)} |"
    yield from (
        f"| source | {_text(effect.source)} |",
        "",
        f"![{effect.title}: inputs and effect]({name}.svg)",
        "",
    )


def _range(shape: Any) -> str:
    unit = "" if shape.unit == "1" else f" {shape.unit}"
    if shape.instant:
        return "an instant, searched for in the recording"
    if shape.middle is None:
        return "any time constant that the recordings can show"
    if shape.factor:
        low, high = shape.middle / shape.factor, shape.middle * shape.factor
    else:
        low, high = shape.middle - shape.spread, shape.middle + shape.spread
    return f"{low:.3g} to {high:.3g}{unit}"


def _text(words: str) -> str:
    return " ".join(words.split()).replace("|", "\\|").replace("<", "&lt;").replace("*", "\\*")


class _Series:
    """Memory of formulas along the evenly spaced instants of the pictures."""

    def __init__(self, channels: dict[str, Array]) -> None:
        self.channels = channels

    def delayed(self, channel: str, seconds: float) -> tuple[Array, Array]:
        """The channel `seconds` ago."""
        return np.interp(HOURS - seconds / 3600.0, HOURS, self.channels[channel]), np.zeros(len(HOURS))

    def lagged(self, value: Array, time_constant: float) -> Array:
        """First-order lag, settled at the start."""
        return _lag(np.broadcast_to(value, HOURS.shape), time_constant)

    def play(self, value: Array, width: float) -> tuple[Array, NDArray[np.intp], Array]:
        """Play operator."""
        series = np.broadcast_to(value, HOURS.shape)
        out = np.array(series, dtype=float)
        for k in range(1, len(out)):
            out[k] = np.clip(out[k - 1], series[k] - width, series[k] + width)
        return out, np.arange(len(out)), np.zeros(len(out))


def _lag(series: Array, time_constant: float) -> Array:
    out = np.array(series, dtype=float)
    share = 1.0 - np.exp(-STEP / time_constant)
    for k in range(1, len(out)):
        out[k] = out[k - 1] + share * (series[k] - out[k - 1])
    return out


def _day() -> dict[str, Array]:
    """One day of a table under cutting fluid: inputs, two bodies and an error."""

    def during(*spans: tuple[float, float]) -> Array:
        return np.any([(start <= HOURS) & (end > HOURS) for start, end in spans], axis=0).astype(float)

    speed = 800.0 * during((3, 8), (16, 21)) + 400.0 * during((9, 11))
    flow = during((2, 7), (10, 14), (17, 22))
    ambient = 22.0 + 1.5 * np.sin(2 * np.pi * (HOURS - 8.0) / 24.0)
    load = 0.3 * speed
    fluid = 22.0 + _lag(3.0 * flow, 5400.0)
    body = _lag(ambient, 7200.0) + _lag(load / 40.0, 5400.0)
    other = _lag(ambient, 14400.0) + 0.4 * _lag(load / 40.0, 14400.0)
    other_input = during((5, 7), (12, 13), (19, 20))
    return {
        "time": HOURS * 3600.0,
        "speed": speed,
        "flow": flow,
        "ambient": ambient,
        "load": load,
        "cooling": _lag(load, 1800.0),
        "coolant": 20.0 + _lag(load / 120.0, 1800.0),
        "fluid": fluid,
        "body": body,
        "other": other,
        "other_input": other_input,
        "level": other_input,
        "rate": 0.3 + 0.7 * flow,
        "height": np.full(len(HOURS), 50.0),
        "input": fluid,
        "term": 0.5 * load,
        "y": 5.0 * (body - 22.0),
    }


def _values(effect: Any) -> dict[str, Any]:
    """The day, with usual sizes and middles of shapes."""
    size = effect.amplitude
    usual = size.fixed if size.fixed is not None else (size.plausible if size.sign >= 0 else -size.plausible)
    values: dict[str, Any] = {**_day(), size.name: usual}
    instants = iter(INSTANTS)
    for shape in effect.shapes:
        values[shape.name] = next(instants) * 3600.0 if shape.instant else shape.middle or MEMORY
    return values


def _label(effect: Any) -> str:
    """What the formula is, with its unit."""
    if "output" in effect.place or effect.place == "recording":
        return "added to the reading [µm]"
    if effect.place == "seat":
        return "added to the temperature [K]"
    if effect.place == "lever":
        return "added to the error [µm]"
    if effect.place == "error state":
        return "added to the rate"
    if "term" in effect.formula.replace("_", " ").split("*")[-1] or effect.place in (
        "current terms",
        "loss terms",
        "air terms",
    ):
        return "added to the term [W]"
    if effect.place in (
        "fluid terms",
        "cooling terms",
        "input temperature",
        "driving input",
        "inputs of a recording",
    ):
        return "the input as the term sees it"
    return "heat into the body [W]"


def _picture(effect: Any) -> bytes:
    """SVG: inputs that the formula names, and the formula."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from discovery.terms import evaluate, names, parse

    tree, values = parse(effect.formula), _values(effect)
    series = {name: values[name] for name in _day()}
    result = np.broadcast_to(evaluate(tree, values, memory=_Series(series)).value, HOURS.shape)
    shown = sorted((names(tree) & set(series)) - {"time"})
    with rc_context({"svg.hashsalt": effect.word, "font.size": 8, "svg.fonttype": "none"}):
        figure = Figure(figsize=(7.4, 3.0))
        top, bottom = figure.subplots(
            2, 1, sharex=True, gridspec_kw={"left": 0.09, "right": 0.72, "top": 0.97, "bottom": 0.14}
        )
        for name in shown:
            one = np.asarray(series[name], dtype=float)
            span = float(np.ptp(one)) or 1.0
            top.plot(
                HOURS, (one - one.min()) / span, lw=1.1, label=f"{name} ({one.min():.3g} to {one.max():.3g})"
            )
        if shown:
            top.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
        top.set_yticks([])
        top.set_ylabel("inputs")
        bottom.axhline(0.0, color="0.7", lw=0.6)
        bottom.plot(HOURS, result, color="C3", lw=1.4)
        bottom.set_ylabel(_label(effect), fontsize=7)
        bottom.set_xlabel("time [h]")
        text = io.BytesIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()
