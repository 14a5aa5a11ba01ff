"""The verbs of the command line: a function each, no logic, heavy imports inside."""
