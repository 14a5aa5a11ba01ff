"""The fluid reaches the bodies later than its temperature sensor says.

    T_fluid(t) in every wet term of the model becomes T_fluid(t - t_delay)

t_delay in s: 5 to 50 s for the hose alone, minutes where the fluid reaches the bodies through channels,
5 min to 1 h where a tank lies between. Source: plug flow. Limits: at all bodies or at one; mixing on the way
is `fluid_sump`.
"""

from discovery.effects.form import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="fluid_delay",
    title="Delay between tank and nozzle",
    group="cutting fluid",
    place="fluid terms",
    formula="delay(fluid, t_delay)",
    amplitude=Amplitude("delayed", "1", 1.0, 1, 1.0),
    shapes=(Shape("t_delay", "s", 300.0, factor=3.0, apart=1.5, is_shift=True),),
    signature="every wet body answers to the fluid temperature later than it is measured",
    confused_with=(
        "fluid_sump",
        "clock_shift",
    ),
    source=(
        "plug flow through the hose; effective dead times of a distribution system are far longer than "
        "the hose alone"
    ),
    examples=(
        Example({"fluid": 26.0, "t_delay": 1200.0}, 22.0, {"fluid": 22.0}, 1000.0),
        Example({"fluid": 26.0, "t_delay": 1200.0}, 26.0, {"fluid": 22.0}, 1300.0),
    ),
)
