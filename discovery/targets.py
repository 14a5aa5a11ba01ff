"""The forms that a model is exported to, and the tools that each needs: known before anything is computed."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from typing import Literal, get_args

from discovery.errors import UsageError, UserError
from discovery.extras import need

Target = Literal["json", "c", "fmu", "fmu3", "st", "plcopen", "scl"]
TARGETS: tuple[Target, ...] = get_args(Target)
_COMPILED = ("c", "fmu", "fmu3")  # to be replayed against the Python model


def check_targets(targets: Sequence[str]) -> None:
    """Can these be written on this computer?

    Raises:
        UsageError: an unknown target.
        UserError: a package or compiler that is not installed.
    """
    from discovery.schema import suggest  # pydantic, which `--help` does without

    for target in targets:
        if target not in TARGETS:
            raise UsageError(f"unknown export target '{target}'; {suggest(target, list(TARGETS))}")
    need("jsonschema", "export", "exported models need")
    compiled = [target for target in targets if target in _COMPILED]
    if compiled and shutil.which("gcc") is None:
        raise UserError(
            f"export target '{compiled[0]}' is compiled to be proved equal to the model, and no C compiler "
            "(gcc) is installed; install gcc, or leave this target out"
        )
    if {"fmu", "fmu3"} & set(targets):
        need("fmpy", "export", "FMI export needs")
