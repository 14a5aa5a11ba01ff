"""A recorded input changes how fast an error follows: a pump, a fan, a door.

    d/dt error = ... - r_in u/u_max error    [1/time]

r_in in 1/h at the largest value that was recorded, of either sign. Source: Newton's law of cooling in a model
whose states are the errors. Limits: in proportion to the input; towards zero error.
"""

from discovery.effects.form import DRIVING, Amplitude, Effect, Example

EFFECT = Effect(
    word="input_exchange",
    title="A recorded input changes the time constant of an error",
    group="inputs",
    place="error state",
    formula="-r_in*level*body",
    amplitude=Amplitude("r_in", "1/h", 0.3, 0),
    signature="an error follows faster, or slower, while a recorded input is on",
    confused_with=("input_path",),
    source="Newton's law of cooling in the form of eq. (7) of Mayr et al. 2015",
    roles=DRIVING,
    examples=(Example({"r_in": 0.5, "level": 1.0, "body": 20.0}, -10.0),),
)
