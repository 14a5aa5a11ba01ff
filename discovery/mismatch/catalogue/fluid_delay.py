"""The fluid reaches the bodies later than its temperature sensor says."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Shape

EFFECT = Effect(
    word="fluid_delay",
    title="Delay between tank and nozzle",
    group="cutting fluid",
    place="fluid terms",
    formula="delay(fluid, t_delay)",
    amplitude=Amplitude("on", "1", 1.0, 1, 1.0),
    shapes=(Shape("t_delay", "s", (300.0, 600.0, 1200.0, 1800.0, 2700.0, 3600.0), 30.0, 7200.0),),
    signature="every wet body answers to the fluid temperature later than it is measured",
    confused_with=(
        "fluid_sump",
        "clock_shift",
    ),
    source="plug flow through the hose; effective dead times of a distribution system are far longer than the hose alone",
)
