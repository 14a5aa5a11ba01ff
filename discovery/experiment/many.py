"""A folder of experiments, one after another on this machine or side by side on a Dask cluster.

Each experiment is one task. Its results take their place as a whole at its end, so a worker that dies leaves
nothing half-written: the scheduler gives its experiment to another one. An experiment whose results are there
and whose files have not changed since is not run again.
"""

from __future__ import annotations

import hashlib
import time as clock
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from discovery.errors import UserError
from discovery.extras import need
from discovery.progress import Progress, silent, time_left
from discovery.recordings.campaignfile import campaign_path
from discovery.runfolder import RESULTS, default_folder, read_results
from discovery.threads import use_jobs

_PATIENCE_S = 10.0  # for a scheduler to answer
_KEYS = {"campaign", "fit", "models"}  # that make a TOML file an experiment


@dataclass(frozen=True)
class Done:
    """What became of an experiment: its folder, the lines that end its run, or why it could not be done."""

    experiment: str
    folder: Path
    lines: tuple[str, ...] = ()
    failure: str = ""
    skipped: bool = False


def experiments_in(folder: Path) -> list[Path]:
    """The experiment files in a folder and below, in order. Raises UserError: there is none."""
    found = [path for path in sorted(folder.rglob("*.toml")) if _is_experiment(path)]
    if not found:
        raise UserError(f"{folder}: no experiment in this folder or below; `discovery new` makes one")
    return found


def run_many(
    folder: Path,
    out: Path | None = None,
    address: str | None = None,
    progress: Progress = silent,
    *,
    force: bool = False,
) -> list[Done]:
    """Run every experiment in a folder that is not finished yet.

    Args:
        folder: its experiments share nothing but the place.
        out: folder of the results, one folder for each experiment; default runs/<name of the folder>.
        address: of a Dask scheduler, whose workers see the same files; default none, one after another here.
        force: use recordings that are wrong all the same.

    Returns:
        What became of each, in order.

    Raises:
        UserError: no experiment, no scheduler at the address, Dask not installed.
    """
    place = (out or default_folder(folder.resolve().name)).resolve()
    paths = experiments_in(folder)
    found: dict[Path, Done] = {}
    for path in paths:
        target = place / path.relative_to(folder).with_suffix("")
        found[path] = _kept(path, target) if is_finished(path, target) else Done(str(path), target)
    todo = [path for path in paths if not found[path].skipped]
    tasks = [(str(path.resolve()), str(found[path].folder), force) for path in todo]
    began = clock.perf_counter()
    results = _here(tasks) if address is None else _on(address, tasks)
    for count, (k, (lines, failure)) in enumerate(results, start=1):
        one = found[todo[k]]
        found[todo[k]] = Done(one.experiment, one.folder, lines, failure)
        left = time_left(count, len(tasks), clock.perf_counter() - began)
        progress(f"{len(paths) - len(todo) + count} of {len(paths)} experiments done{left}")
    return list(found.values())


def run_one(experiment: str, out: str, force: bool) -> tuple[tuple[str, ...], str]:
    """Run an experiment. Returns the lines that end it, and why it could not be done."""
    from discovery.experiment.ending import ending
    from discovery.experiment.pipeline import run

    try:
        return tuple(ending(run(Path(experiment), Path(out), force=force)).lines()), ""
    except UserError as error:
        return (), str(error)


def is_finished(experiment: Path, out: Path) -> bool:
    """Whether the results of an experiment are there and every file that it reads is as it was then."""
    if not (out / RESULTS).is_file():
        return False
    try:
        inputs: Mapping[str, str] = read_results(out)["inputs"]
        campaign = campaign_path(experiment.parent / tomllib.loads(experiment.read_text())["campaign"])
        places = [experiment.parent, campaign.parent]
        return all(
            any(_hash(place / name) == known for place in places if (place / name).is_file())
            for name, known in inputs.items()
        )
    except (UserError, OSError, ValueError, KeyError):
        return False


def _kept(experiment: Path, out: Path) -> Done:
    from discovery.experiment.ending import ending

    return Done(str(experiment), out, tuple(ending(out).lines()), skipped=True)


def _hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _is_experiment(path: Path) -> bool:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig")).keys() >= _KEYS
    except (OSError, ValueError):
        return False


Task = tuple[str, str, bool]
Result = tuple[int, tuple[tuple[str, ...], str]]


def _here(tasks: Sequence[Task]) -> Iterator[Result]:
    for k, task in enumerate(tasks):
        yield k, run_one(*task)


def _on(address: str, tasks: Sequence[Task]) -> Iterator[Result]:
    """Results as they come from the workers of a scheduler."""
    distributed: Any = need("distributed", "dask", "`discovery run --dask` needs")
    try:
        client = distributed.Client(address, timeout=_PATIENCE_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError):
        raise UserError(
            f"no Dask scheduler answers at {address}; start `dask scheduler` and a `dask worker "
            f"{address}` on each machine"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE_S)
        except TimeoutError:
            raise UserError(
                f"the Dask scheduler at {address} has no worker; start `dask worker {address}`"
            ) from None
        futures = {
            client.submit(_on_one_core, *task, pure=False, key=f"{Path(task[1]).name}-{k}"): k
            for k, task in enumerate(tasks)
        }
        for future in distributed.as_completed(futures, loop=client.loop):
            error = future.exception()
            yield futures[future], future.result() if error is None else ((), _reason(error))


def _on_one_core(experiment: str, out: str, force: bool) -> tuple[tuple[str, ...], str]:
    """As `run_one`: a worker is a process on one core."""
    use_jobs(1)
    return run_one(experiment, out, force)


def _reason(error: BaseException) -> str:
    if type(error).__name__ == "KilledWorker":
        return "the workers that tried it died (killed, or out of memory); see their logs"
    return f"it failed on its worker: {type(error).__name__}: {error}"
