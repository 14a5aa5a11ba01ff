"""What to do next: the experiment that would tell two answers apart, or confirm one."""
