"""How many rules and constants decide in a diagnosis: `python -m benchmarks.rules`.

A constant is a number (or a tuple or a table of numbers) in capitals at the top of a file of
`discovery/evidence` or `discovery/diagnosis`. It decides unless it stands below among those that do not:
numbers that give integrals or a search its resolution (finer gives the same answer in more time), numbers of
what is shown, and numbers made of another one. A rule is a comparison with a constant that decides, a veto,
or a comparison with zero in the verdict.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1] / "discovery"
FOLDERS = ("evidence", "diagnosis")
VERDICTS = ("diagnosis/verdict.py", "diagnosis/withdrawal.py")
AIM_RULES, AIM_CONSTANTS = 15, 20
TODAY_RULES, TODAY_CONSTANTS = 15, 20  # what a test holds

RESOLUTION = {  # finer gives the same answer in more time
    "evidence/bayes.py": "_BATCH _NARROW ROUNDING",
    "evidence/events.py": "COARSE FINE CLOSER TOGETHER",
    "evidence/form_error.py": "LAWS PLACES INNER DEPTH",
    "evidence/latent_force.py": "BLOCKS SIZES MEMORY_BLOCKS",
    "evidence/noisy.py": "_TOGETHER",
    "evidence/process_noise.py": "_TRIED",
    "evidence/settings.py": "JITTER",
    "evidence/whitening.py": "_AT_BOUND _UNSEEN _ROUNDING _REMEMBERED _TOGETHER",
    "diagnosis/context.py": "MOST_READINGS NODES",
    "diagnosis/diagnose.py": "ANOTHER_NOISE",
    "diagnosis/posterior.py": "FAR MOST IN_PLAY SETTINGS",
    "diagnosis/coarse_bodies.py": "OPENED",
    "diagnosis/crossvalidation.py": "_NONE",
    "diagnosis/proof.py": "DRAWS BLOCKS",
    "diagnosis/centred.py": "ROUNDS PARTS",
    "diagnosis/refit.py": "ENOUGH LONGEST ROUNDS",
    "diagnosis/scored.py": "MOVED",
    "diagnosis/walk.py": "KEPT SMALL",
    "diagnosis/selection.py": "MOST REFITS RIVALS HOPE HALF NEAR FAR",
    "diagnosis/tree.py": "_SAME",
    "diagnosis/thresholds.py": "DRAWS BLOCKS",
}
SHOWN = {  # what is shown with an answer, not the answer
    "evidence/late.py": "SAID SMALL",
    "diagnosis/description.py": "MOST_TERMS LIMITS LAGS",
    "diagnosis/document.py": "CONSIDERED WRONG_READINGS",
    "diagnosis/location.py": "*",
    "diagnosis/proof.py": "CLOSABLE",
    "diagnosis/ratios.py": "*",
    "diagnosis/response.py": "*",
    "diagnosis/regime.py": "ACTS MOST HOLDS",
    "diagnosis/summary.py": "_OPEN",
    "diagnosis/thresholds.py": "RIVAL RIVALS_SHOWN",
}


@dataclass(frozen=True)
class Constant:
    """A number at the top of a file."""

    file: str
    name: str
    value: str
    made_of: str = ""  # another constant

    @property
    def decides(self) -> bool:
        """Whether an answer hangs on it."""
        for listed in (RESOLUTION, SHOWN):
            names = listed.get(self.file, "").split()
            if self.name in names or names == ["*"]:
                return False
        return True


def _files() -> Iterator[tuple[str, ast.Module]]:
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).glob("*.py")):
            yield f"{folder}/{path.name}", ast.parse(path.read_text("utf-8"))


def constants() -> list[Constant]:
    """Every number at the top of a file."""
    found = []
    for file, tree in _files():
        for node in tree.body:
            if not isinstance(node, ast.Assign):
                continue
            names = [n.id for target in node.targets for n in ast.walk(target) if isinstance(n, ast.Name)]
            if all(name.lstrip("_").isupper() for name in names) and _is_number(node.value):
                made_of = " ".join(_names(node.value))
                found += [Constant(file, name, ast.unparse(node.value), made_of) for name in names]
    return found


def _is_number(value: ast.expr) -> bool:
    """A number, a tuple of them, a table of values and weights, or what is made of another constant."""
    leaves = [n for n in ast.walk(value) if isinstance(n, ast.Constant)]
    plain = (ast.Constant, ast.Tuple, ast.Dict, ast.UnaryOp, ast.BinOp)
    numbers = all(isinstance(n.value, (int, float)) for n in leaves)
    if isinstance(value, ast.Call):
        return numbers and any(name.lstrip("_").isupper() for name in _names(value))
    return bool(leaves) and isinstance(value, plain) and numbers


def rules() -> list[str]:
    """Every rule, as the file and the words of the code."""
    deciding = {(c.file, c.name) for c in constants() if c.decides}
    thresholds = {name for file, name in deciding if file == "diagnosis/thresholds.py"}
    found = []
    for file, tree in _files():
        if SHOWN.get(file) == "*":
            continue
        limits = _limits(tree, thresholds) | {name for f, name in deciding if f == file}
        limits |= {name for one in deciding if (name := one[1]) in _imported(tree, one)}
        said = {id(n) for f in ast.walk(tree) if _says(file, f) for n in ast.walk(f)}
        for node in ast.walk(tree):
            by_constant = (
                isinstance(node, ast.Compare)
                and id(node) not in said
                and (_used(node, thresholds) or not limits.isdisjoint(_names(node)))
            )
            if by_constant or (file in VERDICTS and _withdraws(node)):
                found.append(f"{file}: {ast.unparse(node)}")
            elif isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == "VETOES":
                found += [f"{file}: veto {ast.unparse(veto)}" for veto in getattr(node.value, "elts", [])]
    return found


def _says(file: str, node: ast.AST) -> bool:
    """A veto, a function that returns a text, or the file of the thresholds, which decides nothing itself."""
    if file == "diagnosis/thresholds.py":
        return isinstance(node, ast.Module)
    if not isinstance(node, ast.FunctionDef) or node.returns is None:
        return False
    return ast.unparse(node.returns) == "str" or file == "diagnosis/vetoes.py"


def _imported(tree: ast.Module, constant: tuple[str, str]) -> set[str]:
    """The name of a constant of another file, where a file imports it from there."""
    file, name = constant
    module = "discovery." + file.removesuffix(".py").replace("/", ".")
    found = [n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.module == module]
    return {a.name for n in found for a in n.names if a.name == name}


def _limits(tree: ast.Module, thresholds: set[str]) -> set[str]:
    """Functions of a file that return a limit made of thresholds, and names that hold what they return."""
    limits = {
        f.name
        for f in tree.body
        if isinstance(f, ast.FunctionDef)
        and any(
            isinstance(n, ast.Return)
            and isinstance(n.value, ast.Call)
            and ast.unparse(n.value.func) == "max"
            and _used(n, thresholds)
            for n in ast.walk(f)
        )
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and _called(node.value) in limits:
            limits |= _names(node.targets[0])
    return limits


def _called(value: ast.expr) -> str:
    return ast.unparse(value.func) if isinstance(value, ast.Call) else ""


def _names(node: ast.AST) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}


def _used(node: ast.AST, thresholds: set[str]) -> bool:
    return any(
        isinstance(n, ast.Attribute) and ast.unparse(n.value) == "thresholds" and n.attr in thresholds
        for n in ast.walk(node)
    )


def _withdraws(node: ast.AST) -> bool:
    """A comparison with zero, or the question whether recordings contradict a name."""
    if isinstance(node, ast.Compare):
        return any(isinstance(c, ast.Constant) and c.value == 0 for c in node.comparators)
    return isinstance(node, ast.Attribute) and node.attr == "contradicts"


def main() -> None:
    """Print what is counted."""
    every = constants()
    deciding = [c for c in every if c.decides and not c.made_of]
    print(f"{len(deciding)} constants decide (aim {AIM_CONSTANTS}), of {len(every)}:")
    for c in deciding:
        print(f"  {c.file}: {c.name} = {c.value}")
    found = rules()
    print(f"{len(found)} rules decide (aim {AIM_RULES}):")
    for rule in found:
        print(f"  {rule}")


if __name__ == "__main__":
    main()
