"""The paper's machine: a plant finer than any model of the tool, its test cycles, its campaign."""
