"""The body exchanges heat with a bed that follows the room over days."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Shape

EFFECT = Effect(
    word="bed_memory",
    title="Memory of the bed",
    group="air and structure",
    place="body",
    formula="G_bed*(lag(ambient, t_bed) - body)",
    amplitude=Amplitude("G_bed", "W/K", 8.0),
    shapes=(Shape("t_bed", "s", (36000.0, 108000.0), 20000.0, 300000.0),),
    signature="a drift over the first day, related to the room of yesterday",
    confused_with=(
        "sensor_drift",
        "air_convection",
    ),
    source="machine bed as a first-order follower of the room, 20 to 60 h (Bryan's thermal memory)",
    prior=0.5,
)
