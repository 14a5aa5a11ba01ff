"""What can be concealed in a virtual machine, in forms of its own: no catalogue has exactly these laws."""

from discovery.virtual.effects.drive import DRIVE
from discovery.virtual.effects.effect import Effect, Place, Shapes
from discovery.virtual.effects.fluid import FLUID
from discovery.virtual.effects.inputs import INPUTS
from discovery.virtual.effects.outside import OUTSIDE
from discovery.virtual.effects.structure import STRUCTURE

EFFECTS: dict[str, Effect] = {e.word: e for e in (*FLUID, *DRIVE, *STRUCTURE, *INPUTS)}

__all__ = ["EFFECTS", "OUTSIDE", "Effect", "Place", "Shapes"]
