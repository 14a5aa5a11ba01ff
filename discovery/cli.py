"""The command line: which verbs there are (each stands in `commands`), and how a failure is said."""

import atexit
import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from discovery import __version__
from discovery.commands import machine, proof, recordings, runs, words
from discovery.errors import UsageError, UserError
from discovery.threads import FIT, say_one_thread

say_one_thread()  # nothing above imports numpy
atexit.register(gc.freeze)  # at its end Python would look for garbage among all that was built, for 0.3 s


@contextmanager
def _terminated_like_interrupted() -> Iterator[None]:
    """SIGTERM unwinds as Ctrl-C does, so that half-written files are removed."""
    if threading.current_thread() is not threading.main_thread():  # signals cannot be caught elsewhere
        yield
        return

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _leave_fits_behind() -> None:
    """End the process at once where fits are under way in threads: Python would wait for them."""
    if any(thread.name.startswith(FIT) for thread in threading.enumerate()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(130)


def _interrupted(error: BaseException | None) -> bool:
    """Whether an interrupt is behind a failure: one that comes while a compiled kernel hands back its result
    is reported by Python as a SystemError.
    """
    while isinstance(error, SystemError):
        error = error.__cause__ or error.__context__
    return isinstance(error, KeyboardInterrupt)


class _Sentences(TyperGroup):
    """The one place where a failure becomes a sentence and an exit status."""

    def invoke(self, ctx: Any) -> Any:
        try:
            with _terminated_like_interrupted():
                return super().invoke(ctx)
        except UserError as error:
            typer.echo(f"error: {error}", err=True)
            raise typer.Exit(2 if isinstance(error, UsageError) else 1) from None
        except (KeyboardInterrupt, SystemError) as error:
            if not _interrupted(error):
                raise
            typer.echo("\nstopped; no half-written files are left; you can run the command again", err=True)
            _leave_fits_behind()
            raise typer.Exit(130) from None
        except OSError as error:
            if error.filename is None:
                raise
            typer.echo(f"error: {error.filename}: {error.strerror}", err=True)
            raise typer.Exit(1) from None


app = typer.Typer(
    cls=_Sentences,
    no_args_is_help=True,
    add_completion=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Begin with three commands: `discovery new DIR --from FILE` makes campaign, model and experiment "
    "from your recordings, `discovery check DIR` checks them, `discovery run DIR/experiment.toml` compares "
    "and diagnoses models. Details: `discovery COMMAND --help`. "
    "Exit status: 0 done, 1 not possible (the message says why), 2 wrong usage.",
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"discovery {__version__}")
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and stop.")
    ] = False,
) -> None:
    """Fit, discover, compare and diagnose models of the thermal errors of a machine tool."""


# In the order in which `discovery --help` lists them.
VERBS: dict[str, Callable[..., None]] = {
    "check": recordings.check,
    "new": recordings.new,
    "list": words.list_words,
    "explain": words.explain,
    "schema": words.schema,
    "record": recordings.record,
    "diagnose": runs.diagnose,
    "run": runs.run,
    "compare": runs.compare,
    "report": runs.report,
    "export": machine.export,
    "compensate": machine.compensate,
    "watch": machine.watch,
    "challenge": proof.challenge,
    "update": machine.update,
}
for _name, _verb in VERBS.items():
    app.command(_name)(_verb)

opcua = typer.Typer(no_args_is_help=True, help="Commission an OPC UA connection: certificates, nodes.")
opcua.command("certificate")(machine.opcua_certificate)
opcua.command("browse")(machine.opcua_browse)
app.add_typer(opcua, name="opcua")


if __name__ == "__main__":
    sys.exit(app())
