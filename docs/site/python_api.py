"""The page of Python, from signatures and docstrings of the public names."""

from __future__ import annotations

import inspect
import re
from typing import Any

TEMPLATE = """# Python

Every public name of `discovery`. `dir(discovery)` lists them, all are typed (`py.typed`), and a mistake of
the caller raises `discovery.UserError` with one sentence. Examples: [Use from Python](../python.md).

"""
SECTIONS = ("Args", "Returns", "Raises", "Attributes", "Example", "Examples", "Limits")


def pages() -> dict[str, str | bytes]:
    """reference/python.md: a section for each public name."""
    import discovery

    lines = []
    for name in sorted(discovery.__all__, key=str.lower):
        lines += _entry(name, getattr(discovery, name), "##")
    lines += ["", "# Results", "", "What the functions above return.", ""]
    from discovery.diagnosis import Diagnosis
    from discovery.fitting import Fit
    from discovery.models import Model
    from discovery.recordings import Campaign, Recording

    for one in (Fit, Diagnosis, Model, Campaign, Recording):
        lines += _entry(one.__name__, one, "##")
    return {"reference/python.md": TEMPLATE + "\n".join(lines)}


def _entry(name: str, thing: Any, level: str) -> list[str]:
    lines = [f"{level} {name}", "", "```python", _signature(name, thing), "```", "", *_docstring(thing), ""]
    if inspect.isclass(thing) and not issubclass(thing, Exception):
        for member, value in vars(thing).items():
            function = value.fget if isinstance(value, property) else value
            if member.startswith("_") or not inspect.isfunction(function):
                continue
            called = f"{name}.{member}"
            shown = called if isinstance(value, property) else _signature(called, function)
            lines += ["```python", shown, "```", "", *_docstring(function), ""]
    return lines


def _signature(name: str, thing: Any) -> str:
    try:
        parameters = list(inspect.signature(thing).parameters.values())
    except (TypeError, ValueError):
        return name
    shown = [
        re.sub(r"=<.*>$", "=...", str(p.replace(annotation=p.empty))) for p in parameters if p.name != "self"
    ]
    line = f"{name}({', '.join(shown)})"
    return line if len(line) < 90 else f"{name}(\n    " + ",\n    ".join(shown) + ",\n)"


def _docstring(thing: Any) -> list[str]:
    """A docstring of the form that Google uses, as Markdown."""
    lines: list[str] = []
    section, indent = "", 0
    for line in (inspect.getdoc(thing) or "").splitlines():
        heading = re.fullmatch(rf"({'|'.join(SECTIONS)}):", line.strip())
        if heading and not line.startswith(" "):
            section, indent = heading[1], 0
            lines += ["", f"**{section}**", ""]
        elif section and line.strip() and line.startswith(" "):
            depth = len(line) - len(line.lstrip())
            indent = indent or depth
            entry = re.match(r"\s*([\w, *]+): (.*)", line)
            if depth == indent and entry and section != "Returns":
                lines.append(f"- `{entry[1]}`: {_text(entry[2])}")
            else:
                lines.append(f"  {_text(line.strip())}" if section != "Returns" else _text(line.strip()))
        elif line.lstrip().startswith(">>>"):
            lines.append(f"    {line.strip()}")
        else:
            section = section if not line.strip() else ""
            lines.append(_text(line))
    return lines


def _text(line: str) -> str:
    return line.replace("<", "&lt;").replace("[", "\\[").replace("*", "\\*")
