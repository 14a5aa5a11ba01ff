"""A virtual machine: a plant, what its log shows, and the baseline that somebody believes in."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from discovery.models import Model
from discovery.virtual.materials import Bar
from discovery.virtual.network import Array, Inputs, Law, Network, Switch
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


def felt(name: str, role: str, of: str = "", sd: float = 0.03, decimals: int = 2) -> Channel:
    """A temperature [degC] that the log shows: that of a node or input, `name` where no other is given."""
    source = of or name
    return Channel(name, role, "degC", decimals, lambda run: run[source], sd)


def logged(name: str, role: str, unit: str, decimals: int = 0) -> Channel:
    """An input that the log shows unchanged."""
    return Channel(name, role, unit, decimals, lambda run: run[name])


@dataclass(frozen=True)
class Pace:
    """How long and how often a machine of a family is recorded and read."""

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
class Lack:
    """A law that nature has at a machine in silence, and that its baseline lacks or has in another form."""

    effect: str
    states: tuple[str, ...]
    laws: tuple[str, ...]  # names of the laws of the plant
    believed: Callable[[Law], Law | None]  # each of them in the form of the baseline; None: not at all


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
    cooling: str = ""  # channel of a cooling power that the baseline uses unchanged


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
    lacks: tuple[Lack, ...] = ()  # what the baseline lacks even in silence

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

    def scaled(self, laws: str, factor: float) -> Machine:
        """This machine with every law whose name begins with `laws` so many times as strong."""
        changed = self.network.changed(
            lambda law: replace(law, size=factor * law.size) if law.name.startswith(laws) else law
        )
        return replace(self, network=changed)

    def as_believed(self, lack: Lack) -> Machine:
        """This machine with one law in the form that the baseline has."""
        changed = self.network.changed(lambda law: lack.believed(law) if law.name in lack.laws else law)
        return replace(self, network=changed)

    def mean(self, run: Run, body: str) -> Array:
        """Mean temperature of a body at the step beginnings, (n,)."""
        nodes = self.bodies[body].nodes
        return np.asarray(sum(run[node] for node in nodes) / len(nodes))
