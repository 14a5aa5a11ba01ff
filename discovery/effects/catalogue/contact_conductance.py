"""A joint that conducts better (or worse) as the machine warms up.

    q = p (T_joint - T_env)/10 q_link    [W] into one body and out of the other

q_link is what the model lets flow through the joint; T_joint: mean of both bodies; p: share for each 10 K, of
either sign. Source: joint conductance against contact pressure: 10 to 30 % between cold and warm. Limits:
straight in the temperature rise. Seldom visible.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="contact_conductance",
    title="Contact conductance",
    group="air and structure",
    place="link",
    formula="p_joint*((body + other)/2 - ambient)/10*term",
    amplitude=Amplitude("p_joint", "1", 0.2, 0, most=2.0),
    signature="a link between bodies gets better or worse as they warm up",
    confused_with=("natural_convection",),
    source="joint conductance changes with contact pressure: 10 to 30 % between cold and warm",
    examples=(Example({"p_joint": 0.2, "body": 30.0, "other": 34.0, "ambient": 22.0, "term": 40.0}, 8.0),),
)
