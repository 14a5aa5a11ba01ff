"""A machine built part by part, together with the model that an engineer would write of it.

What an engineer knows (a joint, the air, a recorded power) enters the plant cell by cell and the baseline as
one term of a body. What he leaves out, `nature`, enters the plant alone. A law of the plant that the baseline
lacks, or has in another form, is noted where it is built: `lacks`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from discovery.models import Model, Parameter, State
from discovery.terms import Term, parse
from discovery.virtual.machine import T_REF, Channel, Lack, Machine, Pace, Words
from discovery.virtual.materials import Bar, Share, facing
from discovery.virtual.network import Array, Form, Gate, Inputs, Law, Network, Switch, heat, linear, link
from discovery.virtual.signals import Draw

ONE = 1000.0  # times the conductance inside a body: it has one temperature


class Assembly:
    """Builds plant and baseline of a machine part by part.

    Args:
        rough: standard deviation of the logarithm of the baseline's start values.
        refine: times as many cells in every body.
        spread: times the usual spread of a dimension; 0: every dimension as written.
    """

    def __init__(
        self, rng: Draw, air: str = "T_env", rough: float = 0.35, refine: int = 1, spread: float = 1.0
    ) -> None:
        self.rng, self.default_air, self.rough, self.refine, self.spread = rng, air, rough, refine, spread
        self.nodes: dict[str, float] = {}
        self.laws: list[Law] = []
        self.switches: dict[str, Switch] = {}
        self.bodies: dict[str, Bar] = {}
        self.states: dict[str, State] = {}
        self.parameters: dict[str, Parameter] = {}
        self.nominal: dict[str, float] = {}
        self.terms: list[Term] = []
        self.levers: dict[str, dict[str, float]] = {}
        self.believed: dict[str, str] = {}
        self.offsets: dict[str, float] = {}
        self.outputs: list[Channel] = []
        self.joints: dict[tuple[str, str], float] = {}
        self.airs: dict[str, float] = {}
        self.wet: dict[str, float] = {}
        self.driven: dict[str, str] = {}
        self.unknown: list[Lack] = []

    def about(self, value: float, spread: float = 0.15) -> float:
        """A dimension drawn around its usual value; `spread` is the standard deviation of its logarithm."""
        return float(value * np.exp(self.spread * self.rng.normal(0.0, spread)))

    # what both know

    def body(self, bar: Bar, start: str | None = None) -> None:
        """A body: cells in the plant, one state in the baseline."""
        bar = replace(bar, cells=bar.cells * self.refine if bar.cells > 1 else 1)
        self.bodies[bar.name] = bar
        self.nodes |= dict.fromkeys(bar.nodes, bar.capacity / bar.cells)
        self.laws += [
            link(f"inside {bar.name}", a, b, bar.conductance * bar.cells)
            for a, b in zip(bar.nodes, bar.nodes[1:], strict=False)
        ]
        if bar.cells > 1:  # heat diffuses through it: its inside is a mass behind its surface
            self.lacks(
                "second_thermal_mass",
                (bar.name,),
                f"inside {bar.name}",
                believed=lambda law: replace(law, size=ONE * law.size),
            )
        begin = parse(start or self.default_air)
        capacity = float(f"{bar.capacity:.4g}")
        self.states[bar.name] = State(bar.name, capacity=capacity, start=begin, scale=1.0 / capacity)

    def joint(
        self,
        one: str,
        other: str,
        conductance: float,
        at: tuple[float, float] = (0.0, 1.0),
        other_at: tuple[float, float] = (0.0, 1.0),
    ) -> None:
        """Conduction [W/K] between stretches of two bodies."""
        name = f"{one}-{other}"
        pairs = facing(self.span(one, *at), self.span(other, *other_at))
        self.laws += [link(name, a, b, conductance * share) for a, b, share in pairs]
        self.joints[one, other] = conductance
        inner = 1 / conductance + sum(0.3 / self.bodies[b].conductance for b in (one, other))
        self.believe(f"conduction {other} to {one}", one, f"G_{one}_{other}*({other} - {one})",
                     {f"G_{one}_{other}": (1 / inner, "W/K")}, other)  # fmt: skip

    def air(
        self,
        body: str,
        coefficient: float,
        exponent: float = 0.0,
        at: tuple[float, float] = (0.0, 1.0),
        air: str = "",
        believed: str = "",
    ) -> None:
        """Exchange with the air: `coefficient` |dT/5 K|^exponent dT [W/K at 5 K].

        Args:
            air: series that the plant takes; default the room.
            believed: expression of channels that the baseline takes instead.
        """
        around = air or self.default_air
        for node, share in self.span(body, *at):
            size = coefficient * share / 5.0**exponent
            form, shape = (Form.POWER, (exponent,)) if exponent else (Form.LINK, ())
            self.laws.append(Law(f"air {body}", form, node, around, size, shape=shape, leaves=around))
        if exponent:
            self.lacks("natural_convection", (body,), f"air {body}", believed=linear)
        self.airs[body] = coefficient
        self.believe(
            f"air around {body}",
            body,
            f"hA_{body}*({believed or around} - {body})",
            {f"hA_{body}": (coefficient, "W/K")},
        )

    def loss(
        self,
        body: str,
        channel: str,
        share: float,
        at: tuple[float, float] = (0.0, 1.0),
        gate: Gate | None = None,
    ) -> None:
        """A share of a recorded power warms a body; `gate` is what the plant does instead."""
        name = f"loss {body}"
        self.laws += [heat(name, node, share * part, gate or channel) for node, part in self.span(body, *at)]
        self.driven[body] = channel
        short = f"loss_{body}" + ("" if f"loss_{body}" not in self.parameters else f"_{channel}")
        self.believe(f"{channel} into {body}", body, f"{short}*{channel}", {short: (share, "1")})

    def friction(
        self, body: str, speed: str, power: Callable[[Inputs], Array], at: tuple[float, float] = (0.0, 1.0)
    ) -> None:
        """Friction of a bearing: `power` in the plant, by the 5/3 power of the speed in the baseline."""
        name = f"loss {body}"
        self.laws += [heat(name, node, part, power) for node, part in self.span(body, *at)]
        self.driven[body] = speed
        typical = float(power({speed: np.array([1000.0])})[0])

        def palmgren(u: Inputs) -> Array:
            return np.asarray(typical * (u[speed] / 1000.0) ** (5.0 / 3.0))

        self.lacks("friction_speed", (body,), name, believed=lambda law: replace(law, gate=palmgren))
        self.believe(f"friction of {body}", body, f"P_{body}*({speed}/1000)**1.667",
                     {f"P_{body}": (typical, "W")})  # fmt: skip

    def fluid(
        self, body: str, conductance: float, words: Words, at: tuple[float, float], film: str = ""
    ) -> None:
        """Fluid floods a stretch of a body while the pump runs; with `film`, as much as its film covers."""
        covered = (film, 0.02) if film else None
        for node, share in self.span(body, *at):
            self.laws.append(
                Law(f"fluid {body}", Form.LINK, node, words.fluid, conductance * share, words.pump,
                    leaves=words.fluid, film=covered)
            )  # fmt: skip
        if film:  # the surface is wetted by the film, not in proportion to the flow
            self.lacks(
                "fluid_convection_flow",
                (body,),
                f"fluid {body}",
                believed=lambda law: replace(law, film=None),
            )
        self.wet[body] = conductance
        self.believe(f"fluid on {body}", body,
                     f"hF_{body}*{words.pump}*({words.fluid_channel} - {body})",
                     {f"hF_{body}": (conductance, "W/K")})  # fmt: skip

    def believe(
        self,
        name: str,
        into: str,
        expression: str,
        parameters: Mapping[str, tuple[float, str]],
        source: str | None = None,
    ) -> None:
        """A term of the baseline, its parameters with rough start values."""
        for parameter, (value, unit) in parameters.items():
            start = float(f"{value * np.exp(self.rng.normal(0.0, self.rough)):.2g}")
            self.parameters[parameter] = Parameter(start, unit, min=0.0)
            self.nominal[parameter] = value
        self.terms.append(Term(name, into, parse(expression), source))

    def error(
        self, name: str, unit: str, levers: Mapping[str, float], noise: float = 1.0, uneven: float = 0.0
    ) -> None:
        """An error by the levers [unit/K] of the bodies; cells count unevenly by up to `uneven`."""
        nodes: dict[str, float] = {}
        for body, lever in levers.items():
            cells = self.bodies[body].nodes
            slope = self.rng.uniform(-uneven, uneven) if uneven else 0.0
            place = (np.arange(len(cells)) + 0.5) / len(cells)  # of the middle of a cell along the body
            weight = 1.0 + slope * (2.0 * place - 1.0)
            nodes |= {node: lever * w / len(cells) for node, w in zip(cells, weight.tolist(), strict=True)}
        self.levers[name] = nodes
        self.outputs.append(Channel(name, "error", unit, sd=noise))
        self.believed[name] = " ".join(
            f"{lever:+.4g}*({body} - {T_REF:g})" for body, lever in levers.items() if lever
        ).removeprefix("+")

    def sensor(self, name: str, body: str, noise: float, at: tuple[float, float] = (0.0, 1.0)) -> None:
        """A sensor of temperature on a stretch of a body; the baseline believes that it shows the body."""
        self.levers[name] = dict(self.span(body, *at))
        self.offsets[name] = T_REF
        self.outputs.append(Channel(name, "temperature", "degC", sd=noise))
        self.believed[name] = body

    def span(self, body: str, low: float = 0.0, high: float = 1.0) -> list[Share]:
        """Cells of a stretch of a body."""
        return self.bodies[body].span(low, high)

    # what the plant has beyond it

    def nature(
        self,
        *laws: Law,
        nodes: Mapping[str, float] | None = None,
        switches: Mapping[str, Switch] | None = None,
    ) -> None:
        """Laws, nodes and switches of the plant alone."""
        self.laws += laws
        self.nodes |= nodes or {}
        self.switches |= switches or {}

    def lacks(
        self, effect: str, states: tuple[str, ...], *laws: str, believed: Callable[[Law], Law | None]
    ) -> None:
        """The baseline lacks these laws of the plant, or has them as `believed`."""
        self.unknown.append(Lack(effect, states, laws, believed))

    def machine(
        self,
        title: str,
        channels: Sequence[Channel],
        cycle: Callable[[Draw, float], Inputs],
        words: Words,
        pace: Pace,
        **facts: Any,
    ) -> Machine:
        """The machine; `facts` are further fields of Machine: where else something could act, how much."""
        outputs = {name: parse(text) for name, text in self.believed.items()}
        baseline = Model(
            f"{title}, {len(self.states)} bodies", self.parameters, self.states, tuple(self.terms), outputs
        )
        return Machine(
            title, Network(self.nodes, tuple(self.laws), self.switches), self.bodies, self.levers,
            self.offsets, (*channels, *self.outputs), baseline, self.nominal, cycle, words, pace,
            joints=self.joints, air=self.airs, wet=self.wet, driven=self.driven,
            lacks=tuple(self.unknown), **facts,
        )  # fmt: skip
