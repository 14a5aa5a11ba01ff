"""One error drifts in a straight line through every recording.

    error shown = y + drift time/86400    [um]

As `sensor_drift`, at the same rate in each recording and from zero at its start: electronics that warm up as
they are switched on. Source: data sheets. Limits: straight; a slow body looks the same over one recording.
"""

from dataclasses import replace

from discovery.effects.catalogue import sensor_drift

EFFECT = replace(
    sensor_drift.EFFECT,
    title="Drift of a sensor in every recording",
    place="output",
    acts="always",
    signature="one error runs away in a straight line in every recording alike, unrelated to any input",
)
