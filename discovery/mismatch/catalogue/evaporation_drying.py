"""Evaporation from a wet surface, going on after the pump stops until the film is dry."""

from discovery.mismatch.catalogue.effect import Amplitude, Effect, Example, Shape

EFFECT = Effect(
    word="evaporation_drying",
    title="Evaporation of the film",
    group="cutting fluid",
    place="body",
    formula="-q_ev*max(flow, lag(flow, t_dry))",
    amplitude=Amplitude("q_ev", "W", 60.0),
    shapes=(Shape("t_dry", "s", (1200.0, 2400.0, 4800.0), 300.0, 14400.0),),
    signature="after a pump stop the body cools below the air for the drying time; while wet it stays below the fluid",
    confused_with=(
        "sensor_offset",
        "fluid_convection",
    ),
    source="Lewis relation: 500 to 1400 W/m2 on a spinning wet table; film of 0.05 to 0.2 kg/m2 dries within 5 to 60 min",
    examples=(Example({"q_ev": 60.0, "flow": 1.0, "t_dry": 2400.0}, -60.0),),
)
