"""The online compensator: inputs in, offsets out, whatever comes in; and how its model keeps up with an
ageing machine.
"""
