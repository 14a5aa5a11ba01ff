"""A joint that conducts better (or worse) as the machine warms up.

    q = G_p (T - T_env)/10 (T_other - T)     [W] into one body and out of the other

G_p in W/K per 10 K, of either sign: 10 to 30 % of the link between cold and warm. Source: joint
conductance against contact pressure. Limits: straight in the temperature rise; the link itself stays in
the model. Seldom visible.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="contact_conductance",
    title="Contact conductance",
    group="air and structure",
    place="link",
    formula="G_p*(body - ambient)/10*(other - body)",
    amplitude=Amplitude("G_p", "W/K", 8.0, 0),
    signature="a link between bodies gets better or worse as they warm up",
    confused_with=("natural_convection",),
    source="joint conductance changes with contact pressure: 10 to 30 % between cold and warm",
    examples=(Example({"G_p": 5.0, "body": 32.0, "ambient": 22.0, "other": 34.0}, 10.0),),
)
