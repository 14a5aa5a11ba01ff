"""What to do next: the experiment that would separate two answers, or confirm one."""
