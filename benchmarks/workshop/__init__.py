"""Realistic machines of a workshop: concealed cases for the diagnosis, with their keys.

Bodies are chains of parts. Thermometers lag and are a little off. Inputs flicker and are stamped late. The
air near a machine is not that of the room. The hand-built models are simpler, as an engineer writes them.
The key names what a model lacks beyond these usual imperfections. Nothing here uses the package.
"""
