"""The chiller switches with a dead band, so that the heat it takes does not follow its signal at once."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Shape

EFFECT = Effect(
    word="cooling_hysteresis",
    title="Chiller hysteresis",
    group="drive and cooling",
    place="cooling terms",
    formula="play(cooling, width)",
    amplitude=Amplitude("on", "1", 1.0, 1, 1.0),
    shapes=(Shape("width", "W", (10.0, 40.0), 1.0, 400.0),),
    signature="the cooling acts with a dead band: it does not follow small changes of its signal",
    confused_with=("fluid_delay",),
    source="on/off chiller with a dead band of 0.5 to 2 K around its set point",
    prior=0.5,
)
