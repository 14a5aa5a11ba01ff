"""Solving: one process a case, several at a time, resumed where it stopped."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time as clock
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from discovery.challenge.seal import CASES
from discovery.files import write_atomic
from discovery.printed import counted
from discovery.progress import Progress, time_left
from discovery.threads import JOBS, NAMES

SOLVED = "solved"
PATIENCE_S = 1800.0  # for all methods on one case


def missing(folder: Path, cases: Sequence[str], methods: Sequence[str]) -> dict[str, list[str]]:
    """Methods that have no answer yet, by case."""
    todo = {
        case: [m for m in methods if not (folder / SOLVED / case / f"{m}.json").exists()] for case in cases
    }
    return {case: left for case, left in todo.items() if left}


def solve_all(
    folder: Path, cases: Sequence[str], methods: Sequence[str], jobs: int, progress: Progress
) -> dict[str, str]:
    """Solve what is not solved yet.

    Returns:
        What went wrong, by case; such a case is tried again the next time.
    """
    todo = missing(folder, cases, methods)
    failures: dict[str, str] = {}
    if not todo:
        return failures
    began, solved = clock.perf_counter(), list[str]()

    def so_far() -> str:
        left = time_left(len(solved), len(todo), clock.perf_counter() - began)
        return f"solved {len(cases) - len(todo) + len(solved)} of {len(cases)} cases{left}"

    def one(case: str, left: Sequence[str]) -> str:
        progress(f"solving {case} by {counted(len(left), 'method')}; {so_far()}")
        problem = _one(folder, case, left)
        solved.append(case)
        progress(so_far())
        return problem

    with ThreadPoolExecutor(jobs) as pool:
        futures = {pool.submit(one, case, left): case for case, left in todo.items()}
        try:
            for future in as_completed(futures):
                if message := future.result():
                    failures[futures[future]] = message
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return failures


def _one(folder: Path, case: str, methods: Sequence[str]) -> str:
    """Solve a case on a copy far from the answers. Returns what went wrong, or nothing."""
    with tempfile.TemporaryDirectory(prefix="case") as place:
        copy, out = Path(place) / "case", Path(place) / "out"
        shutil.copytree(folder / CASES / case, copy)
        out.mkdir()
        command = [sys.executable, "-P", "-m", "discovery.challenge.solve", str(copy), str(out), *methods]
        try:
            done = subprocess.run(
                command,
                cwd=copy,
                env=_single_thread(),
                capture_output=True,
                text=True,
                timeout=PATIENCE_S,
                check=False,
            )
            problem = (done.stderr.strip().splitlines() or ["no message"])[-1] if done.returncode else ""
        except subprocess.TimeoutExpired:
            problem = f"no answer within {PATIENCE_S:.0f} s"
        for path in _answers(out, methods):
            write_atomic(folder / SOLVED / case / path.name, path.read_bytes())
    return problem


def _answers(out: Path, methods: Sequence[str]) -> Iterator[Path]:
    return (path for m in methods if (path := out / f"{m}.json").exists())


def _single_thread() -> dict[str, str]:
    """The environment: one fit and one thread at a time, and the package where it is found now."""
    import discovery

    home = str(Path(discovery.__file__).parent.parent)
    paths = [home, *(p for p in [os.environ.get("PYTHONPATH")] if p)]
    return {**os.environ, **dict.fromkeys(NAMES, "1"), JOBS: "1", "PYTHONPATH": os.pathsep.join(paths)}
