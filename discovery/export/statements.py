"""A program as statements of a language: what C and structured text share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from discovery.export.identifiers import formula
from discovery.export.program import Instruction, Program


@dataclass(frozen=True)
class Language:
    """How a language says the pieces of a program; {} is a place, then a value."""

    literal: Callable[[float], str]
    loads: Mapping[str, str | Sequence[str]]  # operation: where its value stands, by index
    expression: Callable[[Instruction, Sequence[str]], str]  # from the words of all numbers before it
    definition: str
    assignment: str
    comment: str


def statements(program: Program, results: Sequence[str], language: Language) -> list[str]:
    """Statements that compute a program and store its results in the places named."""
    words: list[str] = []
    lines: list[str] = []
    for k, instruction in enumerate(program.instructions):
        lines += [language.comment.format(formula(note)) for note in program.notes.get(k, ())]
        if instruction.operation == "constant":
            words.append(language.literal(instruction.value))
        elif instruction.operation in language.loads:
            place = language.loads[instruction.operation]
            words.append(
                place.format(instruction.index) if isinstance(place, str) else place[instruction.index]
            )
        else:
            words.append(f"v{k}")
            lines.append(language.definition.format(f"v{k}", language.expression(instruction, words)))
    return lines + [
        language.assignment.format(place, words[node])
        for place, node in zip(results, program.results, strict=True)
    ]
