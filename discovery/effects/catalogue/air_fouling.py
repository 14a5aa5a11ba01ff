"""A loss to the air that changes between recordings: dust on a fin, a filter that clogs or is cleaned.

    q = -lost q_air    [W] at each body, from a recording on; or -k lost q_air in the k-th one after the first

q_air: what the model exchanges with the air there; lost: share that is gone, 0.1 to 0.5, negative after
cleaning. Source: Bott, Fouling of Heat Exchangers (Elsevier 1995): deposits on the air side, and the
lower air flow behind them. Limits: never inside a recording; what all recordings share is the model's own
parameter.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="air_fouling",
    title="A loss to the air that ages",
    group="air and structure",
    place="air terms",
    formula="-lost*term",
    amplitude=Amplitude("lost", "1", 0.3, 0),
    signature="bodies cool down slower from a recording on, or in each recording",
    confused_with=("wear", "joint_loosening"),
    source="deposits on fins and filters (Bott, Fouling of Heat Exchangers, Elsevier 1995)",
    acts="as parts age",
    examples=(Example({"lost": 0.3, "term": -120.0}, 36.0),),
)
