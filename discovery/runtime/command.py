"""`discovery compensate`: from files and streams to offsets."""

from __future__ import annotations

import gzip
import math
import sys
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from discovery.errors import UsageError, UserError
from discovery.export.document import Exported, read_document
from discovery.export.seal import public_key, require_trusted
from discovery.runtime.compensator import Settings
from discovery.runtime.events import instant
from discovery.runtime.output import Output
from discovery.runtime.rows import Dropped, csv_rows, ticks
from discovery.runtime.session import Say, Session, header
from discovery.runtime.shadow import Rule
from discovery.runtime.signals import Stopped, listening
from discovery.runtime.store import step_back
from discovery.runtime.thinking import other_process

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    from discovery.runtime.learning import Learner


def trusted_model(
    model: Path, trust: Path | None, *, allow_unsigned: bool
) -> tuple[Exported, Ed25519PublicKey | None]:
    """The model, if it is signed by the owner of the key `trust`, and that key.

    Raises:
        UserError: unsigned or signed by someone else, and `allow_unsigned` is not said.
    """
    exported = read_document(model)
    if trust is not None:
        key = public_key(trust)
        require_trusted(exported.seal, key, model)
        return exported, key
    if not allow_unsigned:
        raise UserError(
            f"{model}: no key is trusted, so the model is not run; give --trust KEY.pub, the key that "
            "signed it, or --allow-unsigned for a trial without a machine"
        )
    return exported, None


def one_source(
    sources: Mapping[str, object], *, only_opcua: Mapping[str, object], shadow: Mapping[str, float | None]
) -> None:
    """Refuse options of `discovery compensate` that do not go together; None: an option was not given.

    Raises:
        UsageError: no source of readings or two, an option of the other source, a number that cannot be.
    """
    given = [name for name, value in sources.items() if value is not None]
    if not given:
        raise UsageError(
            "give the source of the readings: --inputs FILE, --inputs -, --opcua FILE or --opcua-demo"
        )
    if len(given) > 1:
        raise UsageError(f"{' and '.join(given)}: the readings have one source; leave out the other")
    for name, value in (only_opcua if given == ["--inputs"] else {}).items():
        if value is not None:
            raise UsageError(f"{name} cannot be used with {given[0]}; leave it out")
    for name, number in shadow.items():
        if number is not None and not 0.0 <= number < math.inf:
            raise UsageError(f"{name} is {number:g}; give 0 or more")


def compensate_rows(
    exported: Exported,
    source: str,
    out: Path | None,
    *,
    model: Path,
    folder: Path | None = None,
    trusted: Ed25519PublicKey | None = None,
    rule: Rule | None = None,
    acknowledge: bool = False,
    learn: Learner | None = None,
    say: Say = lambda _: None,
) -> None:
    """Ticks over the rows of a CSV file, or of standard input (`-`), to `out` or standard output.

    With `folder` the state is kept there: a restart goes on after the last state saved, and `out` is cut to
    the tick of that state, so that no line is lost or written twice. `out` is opened with the first
    tick, `folder` with the first row: inputs that cannot be read leave both as they were.

    SIGTERM and SIGINT end the run in state OFF, saved; SIGUSR1 is an operator's acknowledge.

    Raises:
        UserError: `out` is the file of the inputs or of the model, inputs that cannot be read, no offset was
        given out, or the run ended in trouble.
    """
    for option, used in (("--inputs", Path(source)), ("the model", model)):
        if out is not None and out.exists() and used.exists() and out.samefile(used):
            raise UserError(f"{out}: --out names the same file as {option}; name another file")
    step, live, dropped = exported.compiled.step_s, source == "-", Dropped()
    settings = Settings(tick_s=step)
    with ExitStack() as stack:
        lines: Iterable[str] = sys.stdin if live else stack.enter_context(_open(Path(source)))
        oldest = max((i.range.age_s for i in exported.inputs), default=math.inf)
        rows = csv_rows(lines, exported.compiled.inputs, say, dropped, oldest)
        first = next(rows, None)  # inputs that are refused leave no trace in the folder
        if first is None:
            if dropped.counts:
                raise UserError(
                    f"no row of the inputs can be used: {dropped}; give seconds or ISO 8601 instants"
                )
            say("there was no row with a time; nothing was done")
            return
        session = Session(
            exported, model=model, folder=folder, trusted=trusted, settings=settings, rule=rule, learn=learn,
            now=first[0] if live else None, say=say,
            thinking=stack.enter_context(other_process()) if live and learn is not None else None,
        )  # fmt: skip
        session.say_beginning()
        session.opens = partial(_output, session, out, live=live)
        asked, last = stack.enter_context(listening()), None
        asked.acknowledge = acknowledge
        try:
            for now, newest in ticks(chain([first], rows), step, session.resumed):
                with asked.busy():
                    session.tick(newest, now, acknowledge=asked.acknowledged())
                    last = now
        except Stopped:
            say("stopped: the compensation is switched off and its state is saved")
            if last is not None:
                session.tick({}, last, enabled=False)
        except BaseException:
            session.close(last if last is not None else first[0])
            raise
        if last is None:
            after = f" after the saved state of {instant(session.resumed)}" if session.resumed else ""
            say(f"there was no row with a time{after}; nothing was done")
        session.close(last if last is not None else first[0])
        if dropped.counts:
            say(str(dropped))
        if last is not None:
            say(session.summary())
            session.judge()


def _output(session: Session, out: Path | None, *, live: bool) -> Output:
    """The output as the restored state knows it; of a stream no line can be made again, so none is cut."""
    at = session.resume_at if session.resume_at is not None or session.resumed is None else 0
    replay = not live and session.resume_at is not None
    return Output(out, header(session.compensator), at, replay=replay)


def go_back(folder: Path, say: Say) -> None:
    """One step back to the model before."""
    back = step_back(folder)
    say(
        f"revision {back.revision} of '{back.model.name}' is active again; its offsets "
        "start from the present ones"
    )


def _open(path: Path) -> TextIO:
    if path.is_dir():
        raise UserError(f"{path}: this is a folder; name a CSV file in it")
    if not path.is_file():
        raise UserError(
            f"{path}: there is no such file; name a CSV file with the columns time and the "
            "inputs of the model, or -"
        )
    if path.suffix == ".gz":
        return gzip.open(path, "rt", encoding="utf-8", errors="replace", newline="")
    return path.open(encoding="utf-8", errors="replace", newline="")
