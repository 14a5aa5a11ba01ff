"""The chiller switches with a dead band, so that the heat it takes does not follow its signal at once.

    P_cool in the model's terms becomes play(P_cool, width)

width in W, 10 to 400: the dead band of the chiller (0.5 to 2 K) seen in cooling power. Source: on/off
control about a set point. Limits: play describes the loop of many cycles, not for the sawtooth of a
single one, which readings every 5 to 15 minutes alias; +-0.5 K is below detection on most machines.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="cooling_hysteresis",
    title="Chiller hysteresis",
    group="drive and cooling",
    place="cooling terms",
    formula="play(cooling, width)",
    amplitude=Amplitude("switched", "1", 1.0, 1, 1.0),
    shapes=(Shape("width", "W", 50.0, factor=2.5),),
    signature="the cooling acts with a dead band: it does not follow small changes of its signal",
    confused_with=("fluid_delay",),
    source="on/off chiller with a dead band of 0.5 to 2 K around its set point",
    examples=(Example({"cooling": 250.0, "width": 40.0}, 210.0, {"cooling": 100.0}),),
)
