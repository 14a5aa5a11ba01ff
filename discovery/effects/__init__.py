"""What can be left out of a model: a catalogue with a file for each effect, and where each could act."""
