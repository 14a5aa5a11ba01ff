"""A virtual machine, and the model that an engineer would write of it.

`Assembly` builds both side by side. What an engineer knows (a joint, the air, a recorded power) enters the plant
cell by cell and the baseline as one term of a body. What he leaves out, `nature`, enters the plant alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from discovery.models import Model, Parameter, State
from discovery.terms import Term, parse
from discovery.virtual.materials import Bar, Share, facing
from discovery.virtual.network import Array, Form, Gate, Inputs, Law, Network, Switch, heat, link
from discovery.virtual.signals import Draw
from discovery.virtual.simulate import Run

T_REF = 22.0


@dataclass(frozen=True)
class Channel:
    """A column of the log. `series` gives it over the steps of a run; outputs have none, they are levers."""

    name: str
    role: str
    unit: str
    decimals: int = 2
    series: Callable[[Run], Array] | None = None
    sd: float = 0.0  # noise of an input; of an output in its unit, as a multiple of the machine's noise


@dataclass(frozen=True)
class Pace:
    """How long and how often: hours of a recording, steps of the plant, rows of the log, range of the gaps of readings [s]."""

    hours: float = 72.0
    step_s: float = 20.0
    log_s: float = 60.0
    read_s: tuple[float, float] = (300.0, 900.0)
    before_h: float = 30.0  # history before a recording begins
    noise: tuple[float, float] = (0.25, 0.9)  # least and largest noise of a reading, um
    heat_w: float = 2.0  # rms of the heat that no channel shows, at each body


@dataclass(frozen=True)
class Spare:
    """A recorded input that the baseline does not use: where it acts if it does."""

    channel: str
    kind: str  # input_exchange, input_heat or input_path
    body: str = ""
    source: str = ""  # of an exchange
    output: str = ""  # of a path
    size: float = 1.0  # W/K, W or um at full input, typical
    full: float = 1.0  # value of the input that counts as full


@dataclass(frozen=True)
class Words:
    """Names that inputs and nodes have on this machine; empty: it has none."""

    air: str = "T_env"
    fluid: str = ""  # node or input that wets
    fluid_channel: str = ""
    water: bool = True  # the fluid evaporates
    pump: str = ""
    flow: str = ""  # channel of a flow in steps
    speed: str = ""
    top_speed: float = 1.0  # rpm
    power: str = ""
    cooling: str = ""  # channel of a cooling power that the baseline takes as it is


@dataclass(frozen=True)
class Machine:
    """A plant, its log, and the baseline that somebody believes in."""

    title: str
    network: Network
    bodies: Mapping[str, Bar]
    levers: Mapping[str, Mapping[str, float]]  # output -> node -> unit/K
    offsets: Mapping[str, float]  # output -> value at which all nodes are at T_REF
    channels: tuple[Channel, ...]
    baseline: Model
    nominal: Mapping[str, float]  # of its parameters: what a drawing gives; a refit begins there
    cycle: Callable[[Draw, float], Inputs]  # hours -> inputs
    words: Words = Words()
    pace: Pace = Pace()
    heat: float = 200.0  # W that such a machine makes
    warm: float = T_REF  # degC of a body that rests
    joints: Mapping[tuple[str, str], float] = field(default_factory=dict)  # W/K, of links of the baseline
    air: Mapping[str, float] = field(default_factory=dict)  # W/K, of bodies with a term of air
    wet: Mapping[str, float] = field(default_factory=dict)  # W/K, of bodies with a term of fluid
    driven: Mapping[str, str] = field(default_factory=dict)  # body -> channel that its loss follows
    cooled: tuple[str, ...] = ()  # bodies that a recorded cooling power cools
    rotating: tuple[str, ...] = ()
    splashed: tuple[str, ...] = ()  # dry in the baseline, and within reach of the fluid
    chips: tuple[str, ...] = ()  # bodies that hot swarf falls on
    gaps: tuple[tuple[str, str], ...] = ()  # pairs of bodies that fluid may bridge
    unlinked: tuple[tuple[str, str], ...] = ()  # pairs that might touch
    on_bed: tuple[str, ...] = ()
    spare: tuple[Spare, ...] = ()
    work: tuple[str, ...] = ()  # inputs that are zero while the machine rests
    shown: tuple[
        Callable[[Array, float], Array], ...
    ] = ()  # what joints and sensors do to the outputs (n, Y)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of what is read."""
        return tuple(self.levers)

    def read(self, run: Run) -> Array:
        """Outputs at every instant of the plant, (n + 1, Y)."""
        index = {name: k for k, name in enumerate(run.network.nodes)}
        columns = []
        for output, levers in self.levers.items():
            rise = run.nodes[:, [index[node] for node in levers]] - T_REF
            columns.append(rise @ np.array(list(levers.values())) + self.offsets.get(output, 0.0))
        y = np.column_stack(columns)
        for show in self.shown:
            y = show(y, run.step_s)
        return np.asarray(y)

    def plus(
        self,
        laws: Sequence[Law] = (),
        nodes: Mapping[str, float] | None = None,
        switches: Mapping[str, Switch] | None = None,
    ) -> Machine:
        """This machine with more in its plant; the baseline does not know."""
        return replace(self, network=self.network.plus(laws, nodes, switches))

    def mean(self, run: Run, body: str) -> Array:
        """Mean temperature of a body at the step beginnings, (n,)."""
        nodes = self.bodies[body].nodes
        return np.asarray(sum(run[node] for node in nodes) / len(nodes))


class Assembly:
    """Builds plant and baseline of a machine part by part.

    Args:
        rough: standard deviation of the logarithm of the baseline's start values.
        refine: times as many cells in every body.
        spread: times the usual spread of a dimension; 0: every dimension as it is written.
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
        gate: Gate | None = None,
        known: bool = True,
    ) -> None:
        """Exchange with the air: `coefficient` |dT/5 K|^exponent dT [W/K at 5 K]."""
        around = air or self.default_air
        for node, share in self.span(body, *at):
            size = coefficient * share / 5.0**exponent
            form, shape = (Form.POWER, (exponent,)) if exponent else (Form.LINK, ())
            self.laws.append(Law(f"air {body}", form, node, around, size, gate, shape, leaves=around))
        if known and body not in self.airs:
            self.airs[body] = coefficient
            self.believe(f"air around {body}", body, f"hA_{body}*({around} - {body})",
                         {f"hA_{body}": (coefficient, "W/K")})  # fmt: skip

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

    def error(self, channel: Channel, levers: Mapping[str, float], uneven: float = 0.0) -> None:
        """An error by the levers [unit/K] of the bodies' means; the cells count unevenly by up to `uneven`."""
        nodes: dict[str, float] = {}
        for body, lever in levers.items():
            cells = self.bodies[body].nodes
            slope = self.rng.uniform(-uneven, uneven) if uneven else 0.0
            weight = 1.0 + slope * np.linspace(-1, 1, len(cells)) if len(cells) > 1 else np.ones(1)
            nodes |= {node: lever * w / len(cells) for node, w in zip(cells, weight.tolist(), strict=True)}
        self.levers[channel.name] = nodes
        self.outputs.append(channel)
        self.believed[channel.name] = " ".join(
            f"{lever:+.4g}*({body} - {T_REF:g})" for body, lever in levers.items() if lever
        ).removeprefix("+")

    def sensor(self, channel: Channel, body: str, at: tuple[float, float] = (0.0, 1.0)) -> None:
        """A sensor of temperature on a stretch of a body; the baseline believes that it shows the body."""
        self.levers[channel.name] = dict(self.span(body, *at))
        self.offsets[channel.name] = T_REF
        self.outputs.append(channel)
        self.believed[channel.name] = body

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
            title, Network(self.nodes, tuple(self.laws), self.switches), self.bodies, self.levers, self.offsets,
            (*channels, *self.outputs), baseline, self.nominal, cycle, words, pace,
            joints=self.joints, air=self.airs, wet=self.wet, driven=self.driven, **facts,
        )  # fmt: skip
