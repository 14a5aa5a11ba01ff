"""The fluid that wets the bodies is a mixed volume behind the sensor: it follows with a first-order lag."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Shape

EFFECT = Effect(
    word="fluid_sump",
    title="Fluid remembers",
    group="cutting fluid",
    place="fluid terms",
    formula="lag(fluid, t_sump)",
    amplitude=Amplitude("on", "1", 1.0, 1, 1.0),
    shapes=(Shape("t_sump", "s", (900.0, 2700.0, 8000.0), 300.0, 30000.0),),
    signature="every wet body follows a smoothed fluid temperature",
    confused_with=("fluid_delay",),
    source="heat balance of the fluid on the machine: C/UA of channels and bed from 0.3 to 6 h",
    prior=0.5,
)
