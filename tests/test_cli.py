"""The command line: quick help, failures as sentences, exit statuses."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

import discovery
from discovery.cli import app
from discovery.errors import UsageError, UserError

runner = CliRunner()


def test_help_is_quick_and_imports_nothing_heavy() -> None:
    code = (
        "import sys, discovery.cli\n"
        "try: discovery.cli.app(['--help'])\n"
        "except SystemExit: pass\n"
        "print(sorted({'numpy', 'pandas', 'scipy', 'pydantic', 'matplotlib', 'pint'} & set(sys.modules)))"
    )
    began = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert time.perf_counter() - began < 2.0  # 0.1 s on a quiet machine
    assert done.stdout.strip().endswith("[]")
    assert "check" in done.stdout


def test_reading_an_experiment_does_not_load_pysindy() -> None:
    code = (
        "import sys\n"
        "from discovery.experiment import load_experiment\n"
        "load_experiment('experiments/nmv5000.toml')\n"
        "from discovery.sparse.options import SparseOptions\n"
        "SparseOptions(optimiser='pysindy:SR3')\n"
        "print('pysindy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_a_diagnosis_loads_no_optimiser_of_scipy_and_no_figures() -> None:
    """Half a second: most diagnoses need neither."""
    code = (
        "import sys, discovery.diagnosis.diagnose, discovery.commands.runs, discovery.experiment.pipeline\n"
        "print(sorted({'scipy.optimize', 'scipy.stats', 'matplotlib', 'sklearn'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_version() -> None:
    result = runner.invoke(app, ["--version"])
    assert result.exit_code == 0
    assert result.stdout == f"discovery {discovery.__version__}\n"


@pytest.mark.parametrize("arguments", [["chekc"], ["check"], ["check", "--loud", "x"], ["compare", "one"]])
def test_wrong_usage_is_2(arguments: list[str]) -> None:
    assert runner.invoke(app, arguments).exit_code == 2


def test_a_mistake_is_a_sentence_and_1(tmp_path: Path) -> None:
    result = runner.invoke(app, ["check", str(tmp_path / "none.toml")])
    assert result.exit_code == 1
    assert result.stderr == f"error: {tmp_path / 'none.toml'}: there is no such file\n"
    assert result.stdout == ""


@pytest.mark.parametrize(
    ("failure", "status", "said"),
    [
        (UserError("this is wrong; do that"), 1, "error: this is wrong; do that"),
        (UsageError("say one of them"), 2, "error: say one of them"),
        (KeyboardInterrupt(), 130, "stopped"),
        (PermissionError(13, "Permission denied", "runs/x"), 1, "error: runs/x: Permission denied"),
    ],
)
def test_failures(failure: BaseException, status: int, said: str) -> None:
    # the same group class as the real command line, around a verb that fails
    small = typer.Typer(cls=app.info.cls, pretty_exceptions_enable=False)

    @small.callback()
    def main() -> None: ...

    @small.command()
    def fail() -> None:
        raise failure

    result = runner.invoke(small, ["fail"])
    assert result.exit_code == status
    assert result.stderr.strip().startswith(said)


@pytest.mark.parametrize("cause", [KeyboardInterrupt(), ValueError("broken")])
def test_an_interrupt_inside_a_kernel_is_an_interrupt(cause: BaseException) -> None:
    """What numba says when Ctrl-C comes while its kernel runs; any other SystemError stays what it is."""
    small = typer.Typer(cls=app.info.cls, pretty_exceptions_enable=False)

    @small.callback()
    def main() -> None: ...

    @small.command()
    def work() -> None:
        raise SystemError("CPUDispatcher(...) returned a result with an exception set") from cause

    result = runner.invoke(small, ["work"])
    stopped = isinstance(cause, KeyboardInterrupt)
    assert result.exit_code == (130 if stopped else 1)
    assert result.stderr.strip().startswith("stopped") == stopped
    assert isinstance(result.exception, SystemExit if stopped else SystemError)


def test_a_terminated_verb_unwinds() -> None:
    small = typer.Typer(cls=app.info.cls, pretty_exceptions_enable=False)
    unwound = []

    @small.callback()
    def main() -> None: ...

    @small.command()
    def work() -> None:
        try:
            signal.raise_signal(signal.SIGTERM)
        finally:
            unwound.append(True)

    before = signal.getsignal(signal.SIGTERM)
    result = runner.invoke(small, ["work"])
    assert (result.exit_code, unwound) == (130, [True])
    assert result.stderr.strip().startswith("stopped")
    assert signal.getsignal(signal.SIGTERM) == before


@pytest.mark.parametrize(("given", "seen"), [(None, "1"), ("3", "3")])
def test_one_thread_a_process_unless_the_user_says_otherwise(given: str | None, seen: str) -> None:
    environment = {key: value for key, value in os.environ.items() if not key.endswith("_NUM_THREADS")}
    environment |= {"OMP_NUM_THREADS": given} if given else {}
    code = (
        "import discovery.cli, os; print(os.environ['OMP_NUM_THREADS'], os.environ['OPENBLAS_NUM_THREADS'])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == [seen, "1"]


@pytest.mark.parametrize(
    ("verb", "words"),
    [
        ("run", "EXPERIMENT"),
        ("diagnose", "EXPERIMENT"),
        ("compare", "RUN RUN"),
        ("export", "RUN"),
        ("compensate", "MODEL"),
        ("check", "CAMPAIGN"),
        ("update", "MODEL CAMPAIGN"),
    ],
)
def test_a_verb_calls_what_it_takes_as_the_documents_do(verb: str, words: str) -> None:
    usage = CliRunner().invoke(app, [verb, "--help"]).output.strip().splitlines()[0]
    taken = usage.partition("[OPTIONS]")[2]
    assert "".join(letter for letter in taken if letter.isalpha() or letter == " ").strip() == words
