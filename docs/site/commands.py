"""The page of commands, from the parsers of the command line."""

from __future__ import annotations

from typing import Any

TEMPLATE = """# Commands

`discovery --help` lists the verbs; `discovery VERB --help` explains one.
Exit status: 0 done, 1 the work could not be done (the message says why), 2 wrong usage.

"""


def pages() -> dict[str, str | bytes]:
    """reference/commands.md: a section for each verb."""
    from typer.main import get_command

    from discovery.cli import app

    return {"reference/commands.md": TEMPLATE + "\n".join(_verbs(get_command(app), "discovery"))}


def _verbs(group: Any, before: str) -> list[str]:
    lines: list[str] = []
    for name, command in group.commands.items():
        called = f"{before} {name}"
        if hasattr(command, "commands"):
            lines += _verbs(command, called)
            continue
        own = [p for p in command.params if "--help" not in p.opts]
        arguments = [p for p in own if p.param_type_name == "argument"]
        usage = " ".join([called, *(_placeholder(p) for p in arguments)])
        lines += [f"## {called}", "", f"    {usage} [options]", "", *_paragraphs(command.help or ""), ""]
        if own:
            lines += ["| argument or option | meaning | default |", "|---|---|---|"]
            lines += [f"| `{_name(p)}` | {_cell(p.help or '')} | {_default(p)} |" for p in own]
        lines.append("")
    return lines


def _paragraphs(text: str) -> list[str]:
    return [line.strip().replace("\b", "").replace("<", "&lt;") for line in text.splitlines()]


def _placeholder(p: Any) -> str:
    name = str(p.metavar or p.name.upper())
    return f"{name}..." if p.nargs == -1 else name


def _name(p: Any) -> str:
    return _placeholder(p).replace("|", "\\|") if p.param_type_name == "argument" else ", ".join(p.opts)


def _default(p: Any) -> str:
    if p.required:
        return "required"
    if (
        p.default is None
        or callable(p.default)
        or p.default in ((), [], False)
        or "Sentinel" in repr(p.default)
    ):
        return ""
    return f"`{p.default}`"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")
