"""A joint sticks before it slides: part of the error follows with play."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Shape

EFFECT = Effect(
    word="joint_hysteresis",
    title="Hysteresis of a joint",
    group="air and structure",
    place="output",
    formula="slip*(play(y, width) - y)",
    amplitude=Amplitude("slip", "1", 0.5),
    shapes=(Shape("width", "um", (1.0, 2.5), 0.2, 10.0),),
    signature="a plateau at every reversal, the same at any rate",
    confused_with=("sensor_lag",),
    source="Prandtl-Ishlinskii play operator of joints, widths of 0.5 to 2 um",
)
