"""Families of machines: each draws a machine of its kind, every number from physics."""

from collections.abc import Callable, Mapping

from discovery.virtual.families.bearing_rig import bearing_rig
from discovery.virtual.families.headstock import headstock
from discovery.virtual.families.linear_axis import linear_axis
from discovery.virtual.families.measuring_machine import measuring_machine
from discovery.virtual.families.portal import portal
from discovery.virtual.families.printer import printer
from discovery.virtual.families.rotary_table import rotary_table
from discovery.virtual.machine import Machine
from discovery.virtual.signals import Draw

FAMILIES: Mapping[str, Callable[[Draw], Machine]] = {
    "rotary_table": rotary_table,
    "headstock": headstock,
    "linear_axis": linear_axis,
    "bearing_rig": bearing_rig,
    "portal": portal,
    "printer": printer,
    "measuring_machine": measuring_machine,
}
# Settings of the diagnosis were chosen on cases of these, and of five-axis tables of other generators; every
# other family only confirms.
CHOSEN_ON = frozenset({"headstock"})
