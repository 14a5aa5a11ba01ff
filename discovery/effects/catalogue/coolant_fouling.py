"""A cooler that fouls between recordings, or is cleaned.

    q = -lost q_coolant    [W] at each body, from a recording on; or -k lost q_coolant in the k-th one after
                           the first

q_coolant: what the model exchanges with the coolant there; lost: share that is gone, 0.05 to 0.5, negative
after cleaning. Source: fouling resistances of cooling water, 1e-4 to 4e-4 m2 K/W (TEMA Standards, RGP-T-2.4):
at 1000 W/(m2 K) a tenth to a third of the exchange. Limits: never inside a recording; what all recordings
share is the model's own parameter.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="coolant_fouling",
    title="A cooler that fouls",
    group="drive and cooling",
    place="coolant terms",
    formula="-lost*term",
    amplitude=Amplitude("lost", "1", 0.2, 0),
    signature="bodies follow the coolant less from a recording on, or in each recording",
    confused_with=("wear", "air_fouling"),
    source="fouling resistances of cooling water, 1e-4 to 4e-4 m2 K/W (TEMA Standards, RGP-T-2.4)",
    acts="as parts age",
    examples=(Example({"lost": 0.2, "term": -500.0}, 100.0),),
)
