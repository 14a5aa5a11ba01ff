"""A joint that changes between recordings: screws settle, paste dries out, a clamp is tightened.

    q = -lost q_link    [W] into one body and out of the other, from a recording on; or -k lost q_link in the
                        k-th one after the first

q_link: what the model lets flow through the joint; lost: share that is gone, 0.1 to 0.6, negative where it
was tightened. Source: joint conductance goes with contact pressure to the power of 0.95 (Yovanovich, IEEE
Trans. Components and Packaging Technologies 28, 2005); preload of screws falls by 10 to 50 % as they settle
(VDI 2230). Limits: never inside a recording; what all recordings share is the model's own parameter.
"""

from discovery.effects.form import Amplitude, Effect, Example

EFFECT = Effect(
    word="joint_loosening",
    title="A joint that ages",
    group="air and structure",
    place="link",
    formula="-lost*term",
    amplitude=Amplitude("lost", "1", 0.3, 0),
    signature="two bodies follow each other less from a recording on, or in each recording",
    confused_with=("wear", "air_fouling"),
    source="conductance goes with contact pressure to the power of 0.95 (Yovanovich 2005); preload settles",
    acts="as parts age",
    examples=(Example({"lost": 0.3, "term": 50.0}, -15.0),),
)
