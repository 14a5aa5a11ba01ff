"""Effects that a model can lack: a catalogue with a file for each effect, and the places where each can act."""
