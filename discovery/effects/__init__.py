"""Effects that a model can lack: a catalogue with a file for each one, and the places where it can act."""
