"""Concealed physics for the finer plant: each effect draws its own place, exponents, edges.

Exponents are drawn about the textbook's and edges are smooth, so that no catalogue has exactly these forms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from discovery.virtual import chains
from discovery.virtual.chains import Law
from discovery.virtual.fine import BODIES, LINKS, LOSSES, STEP_S, WET, Array, FineMachine, Inputs, first_order

Draw = np.random.Generator


@dataclass(frozen=True)
class Concealed:
    """One effect, still without size: `laws(size, inputs)` is the heat that it brings."""

    effect: str
    states: tuple[str, ...]
    laws: Callable[[float, Inputs], list[Law]]
    unit: str
    trial: float  # size to begin with
    limit: float  # largest size that is physical
    regime: str = ""
    shape: dict[str, float] = field(default_factory=dict)  # exponents, time constants
    accepts: tuple[str, ...] = ()
    also: tuple[str, ...] = ()


Maker = Callable[[Draw, FineMachine], Concealed]


def body_law(
    form: int,
    into: int,
    gate: Callable[[Inputs], Array],
    ref: Callable[[Inputs], Array] | None = None,
    *,
    out: int = -1,
    shape: tuple[float, float, float] = (0.0, 0.0, 1.0),
) -> Callable[[float, Inputs], list[Law]]:
    """Heat of one form into one body, `size * gate` times its function of temperature."""

    def laws(size: float, u: Inputs) -> list[Law]:
        return [Law(form, into, out, size * gate(u), ref(u) if ref else u.air, *shape)]

    return laws


def always(u: Inputs) -> Array:
    """1 at every step, (n,)."""
    return np.ones_like(u.air)


def while_pumping(u: Inputs) -> Array:
    """The pump, 0 or 1, (n,)."""
    return u.pump


def fluid(u: Inputs) -> Array:
    """Temperature of the fluid, (n,) degC."""
    return u.fluid


def speed_power(p: float) -> Callable[[Inputs], Array]:
    """(n/600)^p of the speed n in rpm."""
    return lambda u: np.asarray((u.speed / 600.0) ** p)


def wet_speed_power(p: float) -> Callable[[Inputs], Array]:
    """pump (n/600)^p of the speed n in rpm."""
    return lambda u: np.asarray(u.pump * (u.speed / 600.0) ** p)


def one_of(rng: Draw, places: tuple[int, ...]) -> int:
    """One of some bodies, drawn."""
    return int(rng.choice(places))


def fluid_convection(rng: Draw, _: FineMachine) -> Concealed:
    """q = size pump (T_fluid - T) at a body that the baseline takes for dry."""
    b = one_of(rng, (2, 3, 4))
    law = body_law(chains.TO_REF, b, while_pumping, fluid)
    return Concealed("fluid_convection", (BODIES[b],), law, "W/K", 20.0, 60.0, "pump > 0.5")


def fluid_convection_speed(rng: Draw, _: FineMachine) -> Concealed:
    """q = size pump (n/600)^m (T_fluid - T), m 0.5 to 0.9."""
    b, m = one_of(rng, WET), rng.uniform(0.5, 0.9)
    law = body_law(chains.TO_REF, b, wet_speed_power(m), fluid)
    shape, also = {"m": m}, ("rim_detachment",) if b == 1 else ()
    return Concealed(
        "fluid_convection_speed", (BODIES[b],), law, "W/K", 20.0, 120.0, "pump > 0.5", shape, (), also
    )


def rim_detachment(rng: Draw, m: FineMachine) -> Concealed:
    """C-Body 1 is wetted less the faster the table throws the film off, with an edge of its own steepness."""
    edge, p = rng.uniform(120, 300), rng.uniform(1.5, 3.0)

    def thrown(u: Inputs) -> Array:
        return np.asarray(-m.wet[1] * u.pump * (1.0 - 1.0 / (1.0 + (u.speed / edge) ** p)))

    law, also = body_law(chains.TO_REF, 1, thrown, fluid), ("fluid_convection_speed",)
    shape = {"n_c": edge, "m": p}
    return Concealed("rim_detachment", (BODIES[1],), law, "1", 0.5, 1.0, "pump > 0.5", shape, (), also)


def evaporation_drying(rng: Draw, _: FineMachine) -> Concealed:
    """After the pump the film m dries by m' = -m^p/tau, p 0 to 0.7: neither straight nor exponential."""
    b, tau, p = one_of(rng, WET), rng.uniform(1500, 4000), rng.uniform(0.0, 0.7)

    def wetness(u: Inputs) -> Array:
        m, film = float(u.pump[0]), np.empty_like(u.pump)
        for k, pump in enumerate(u.pump.tolist()):
            m = min(1.0, m + STEP_S / 120.0) if pump > 0 else max(0.0, m - STEP_S / tau * max(m, 1e-3) ** p)
            film[k] = m
        return film

    law = body_law(chains.EVAPORATION, b, wetness)
    return Concealed(
        "evaporation_drying", (BODIES[b],), law, "W", 50.0, 250.0, "after the pump", {"drying_s": tau}
    )


def film_drag(rng: Draw, _: FineMachine) -> Concealed:
    """q = size pump (n/600)^m at the table, m 1.8 to 2.2."""
    p = rng.uniform(1.8, 2.2)
    law = body_law(chains.HEAT, 0, wet_speed_power(p))
    return Concealed("film_drag", (BODIES[0],), law, "W", 30.0, 150.0, "pump > 0.5 and speed > 600", {"m": p})


def flooded_gap(rng: Draw, _: FineMachine) -> Concealed:
    """q = size pump (T_1 - T_2) between C-Body 1 and the B corpus."""
    del rng
    law = body_law(chains.LINK, 1, while_pumping, out=3)
    return Concealed("flooded_gap", (BODIES[1], BODIES[3]), law, "W/K", 30.0, 90.0, "pump > 0.5")


def fluid_delay(rng: Draw, m: FineMachine) -> Concealed:
    """The fluid arrives as the sensor saw it `size` seconds ago."""
    del rng

    def laws(size: float, u: Inputs) -> list[Law]:
        t = np.arange(len(u.fluid)) * STEP_S
        behind = np.interp(t - size, t, u.fluid) - u.fluid
        return [Law(chains.HEAT, b, -1, G * u.pump * behind, u.air) for b, G in zip(WET, m.wet, strict=True)]

    states = tuple(BODIES[b] for b in WET)
    return Concealed("fluid_delay", states, laws, "s", 1200.0, 3600.0, "pump > 0.5")


def friction_speed(rng: Draw, _: FineMachine) -> Concealed:
    """q = size (n/600)^m that the recorded power does not show, m 1.3 to 1.9."""
    b, p = one_of(rng, LOSSES), rng.uniform(1.3, 1.9)
    law = body_law(chains.HEAT, b, speed_power(p))
    return Concealed("friction_speed", (BODIES[b],), law, "W", 50.0, 250.0, "speed > 0", {"m": p})


def viscosity_temperature(rng: Draw, _: FineMachine) -> Concealed:
    """q = size (n/600)^m exp(-k (T - 22)), k 0.025 to 0.04 1/K."""
    b, p, k = one_of(rng, (1, 2)), rng.uniform(1.3, 1.9), rng.uniform(0.025, 0.04)
    law = body_law(chains.EXPONENT, b, speed_power(p), shape=(-k, 0.0, 1.0))
    shape, also = {"k": k, "m": p}, ("friction_speed",)
    return Concealed(
        "viscosity_temperature", (BODIES[b],), law, "W", 80.0, 300.0, "speed > 0", shape, (), also
    )


def thermal_preload(rng: Draw, _: FineMachine) -> Concealed:
    """q = size (n/600)^m (T - T_b_corpus) at C-Body 1."""
    p = rng.uniform(0.9, 1.2)
    law = body_law(chains.DRIVEN, 1, speed_power(p), out=3)
    return Concealed("thermal_preload", (BODIES[1],), law, "W/K", 5.0, 15.0, "speed > 0", {"m": p})


def rotating_air_convection(rng: Draw, _: FineMachine) -> Concealed:
    """q = size (n/600)^m (T_env - T), m 0.6 to 0.9."""
    b, p = one_of(rng, (0, 1)), rng.uniform(0.6, 0.9)
    law = body_law(chains.TO_REF, b, speed_power(p))
    return Concealed("rotating_air_convection", (BODIES[b],), law, "W/K", 8.0, 30.0, "speed > 0", {"m": p})


def natural_convection(rng: Draw, _: FineMachine) -> Concealed:
    """q = size (|dT|/5)^m dT with dT = T_env - T, m 0.2 to 0.3."""
    b, p = one_of(rng, (0, 1, 2, 3, 4)), rng.uniform(0.2, 0.3)
    law = body_law(chains.POWER, b, always, shape=(p, 0.0, 1.0))
    return Concealed(
        "natural_convection", (BODIES[b],), law, "W/K", 10.0, 40.0, "", {"m": p}, (), ("radiation",)
    )


def conduction_path(rng: Draw, _: FineMachine) -> Concealed:
    """q = size (T_1 - T_2) between two bodies that the baseline does not link."""
    missing = [(i, j) for i in range(5) for j in range(i + 1, 5) if (i, j) not in LINKS]
    i, j = missing[int(rng.integers(len(missing)))]
    law = body_law(chains.LINK, i, always, out=j)
    return Concealed("conduction_path", (BODIES[i], BODIES[j]), law, "W/K", 10.0, 60.0)


def second_thermal_mass(rng: Draw, _: FineMachine) -> Concealed:
    """A hidden mass of 0.5 to 2 h hangs on a body by `size`."""
    b, tau = one_of(rng, (0, 1, 2, 3)), rng.uniform(1800, 7200)
    law = body_law(chains.HIDDEN_MASS, b, always, shape=(tau, 0.0, 1.0))
    return Concealed(
        "second_thermal_mass", (BODIES[b],), law, "W/K", 20.0, 90.0, "", {"time_constant_s": tau}
    )


def bed_memory(rng: Draw, _: FineMachine) -> Concealed:
    """q = size (T_bed - T), the bed follows the room in 20 to 50 h."""
    b, tau = one_of(rng, (3, 4)), rng.uniform(20, 50) * 3600
    law = body_law(chains.TO_REF, b, always, lambda u: first_order(u.air, tau))
    return Concealed("bed_memory", (BODIES[b],), law, "W/K", 10.0, 40.0, "", {"time_constant_s": tau})


def contact_conductance(rng: Draw, m: FineMachine) -> Concealed:
    """A link conducts 1 + size ((T_1 + T_2)/2 - 22) times as well."""
    k = int(rng.integers(len(LINKS)))
    i, j = LINKS[k]
    law = body_law(chains.CONTACT, i, lambda u: np.full_like(u.air, m.links[k]), out=j)
    return Concealed("contact_conductance", (BODIES[i], BODIES[j]), law, "1/K", 0.05, 0.15)


ONE: tuple[Maker, ...] = (
    fluid_convection,
    fluid_convection_speed,
    rim_detachment,
    evaporation_drying,
    film_drag,
    flooded_gap,
    fluid_delay,
    friction_speed,
    viscosity_temperature,
    thermal_preload,
    rotating_air_convection,
    natural_convection,
    conduction_path,
    second_thermal_mass,
    bed_memory,
    contact_conductance,
)
