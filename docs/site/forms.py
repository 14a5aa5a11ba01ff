"""The page of files, from their schemas."""

from __future__ import annotations

import json
from typing import Any

TEMPLATE = """# Files

Every file of the workbench is checked against a schema. `discovery schema campaign` (or another word of this
page) prints it. An editor that knows JSON schemas completes keys with it. Unknown keys are refused, with the
nearest right one.

"""


def pages() -> dict[str, str | bytes]:
    """reference/files.md: a section for each file, a table for each of its tables."""
    from discovery.firsthour.schemas import FILES, schema

    lines = []
    for file in FILES:
        document = json.loads(schema(file))
        lines += [f"## {file}", "", *_table(document, document)]
        for name, inner in document.get("$defs", {}).items():
            if "properties" in inner:
                lines += [f"### {file}: {name.removesuffix('Form')}", "", *_table(inner, document)]
    return {"reference/files.md": TEMPLATE + "\n".join(lines)}


def _table(form: dict[str, Any], document: dict[str, Any]) -> list[str]:
    required = form.get("required", [])
    lines = [
        _cell(form.get("description", "")),
        "",
        "| key | type | meaning | default |",
        "|---|---|---|---|",
    ]
    for key, one in form.get("properties", {}).items():
        default = (
            "required" if key in required else f"`{json.dumps(one['default'])}`" if one.get("default") else ""
        )
        lines.append(
            f"| `{key}` | {_type(one, document)} | {_cell(one.get('description', ''))} | {default} |"
        )
    return [*lines, ""]


def _type(one: dict[str, Any], document: dict[str, Any]) -> str:
    if "$ref" in one:
        name = one["$ref"].rsplit("/", 1)[-1]
        inner = document["$defs"][name]
        return name.removesuffix("Form") if "properties" in inner else _type(inner, document)
    if "enum" in one:
        return ", ".join(f"`{value}`" for value in one["enum"])
    if "const" in one:
        return f"`{one['const']}`"
    for union in ("anyOf", "oneOf"):
        if union in one:
            return " or ".join(dict.fromkeys(_type(part, document) for part in one[union]))
    kind = str(one.get("type", "any"))
    if kind == "array":
        return f"list of {_type(one['items'], document)}" if "items" in one else "list"
    if kind == "object":
        inner = one.get("additionalProperties")
        return f"table of {_type(inner, document)}" if isinstance(inner, dict) else "table"
    return {"string": "text", "null": "nothing", "boolean": "true or false"}.get(kind, kind)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")
