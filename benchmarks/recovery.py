"""How often the exact set of terms is found, and its coefficients, next to plain PySINDy and its weak
form.

    python benchmarks/recovery.py [--sets 25] [--peers]

Each data set has two recordings of 72 h to fit and a third, never fitted nor chosen by, to test on; four
outputs with different supports; 20 candidate terms; readings every 5 to 15 minutes at irregular instants with
1 um noise; inputs every 10 s. See `recovery_data.py`.
"""

from __future__ import annotations

import argparse
import time as clock
import warnings
from collections.abc import Callable

import numpy as np
from recovery_data import LIBRARY, TRUTH, make_campaign

from discovery.recordings import Campaign
from discovery.sparse.discover import discover
from discovery.sparse.options import SparseOptions

FIT = ("r0", "r1")
Found = dict[str, float]
LEVELS = np.geomspace(1e-3, 3.0, 40)


def ours(campaign: Campaign, output: str) -> Found:
    """The workbench: chosen by free runs on what was left out of the two recordings."""
    library = tuple(word for word in LIBRARY)
    found = discover(campaign, FIT, [output], SparseOptions(form="rates", library=library, bootstraps=0))
    coefficients = {}
    for term in found.model.terms:
        label = term.name.removesuffix(f" in {output}").replace(output, "y")
        name = next(n for n in found.model.parameters if n in str(term.expression))
        coefficients[label] = found.model.parameters[name].value
    return coefficients


def _columns(campaign: Campaign, recording: str, output: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # type: ignore[type-arg]
    """Stamps of the readings [h], readings, and the inputs at these stamps, as PySINDy needs them."""
    data = campaign.recordings[recording]
    read = np.isfinite(data.values[output])
    names = ("u1", "u2", "u3", "speed", "pump", "decoy")
    return (
        data.time[read] / 3600,
        data.values[output][read],
        np.column_stack([data.values[n][read] for n in names]),
    )


def _library() -> list[Callable[..., object]]:
    source = [word.replace("1", "1", 1) if word != "1" else "1 + 0*y" for word in LIBRARY]
    return [eval(f"lambda y, u1, u2, u3, speed, pump, decoy: {word}") for word in source]


def plain(campaign: Campaign, output: str, truth: Found) -> Found:
    """PySINDy as it comes: finite differences, STLSQ; the threshold that comes nearest to the truth (an
    oracle).
    """
    import pysindy

    t, x, u = zip(*(_columns(campaign, r, output) for r in FIT), strict=True)
    best: Found = {}
    for level in LEVELS:
        model = pysindy.SINDy(
            optimizer=pysindy.STLSQ(threshold=level, alpha=0.05, normalize_columns=False),
            feature_library=pysindy.CustomLibrary(library_functions=_library()),
            differentiation_method=pysindy.FiniteDifference(),
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model.fit([v[:, None] for v in x], t=list(t), u=list(u))
        best = _nearer(best, np.ravel(model.coefficients()), truth)
    return best


def weak_rows(campaign: Campaign, output: str) -> list[tuple[np.ndarray, np.ndarray]]:  # type: ignore[type-arg]
    """Rows of PySINDy's weak form, one library a recording."""
    import pysindy

    rows = []
    for seed, recording in enumerate(FIT):
        t, x, u = _columns(campaign, recording, output)
        np.random.seed(seed)  # noqa: NPY002  (its test functions are drawn from numpy's global generator)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            form = pysindy.WeakPDELibrary(
                function_library=pysindy.CustomLibrary(library_functions=_library()),
                spatiotemporal_grid=t, K=1000, include_bias=False,
            )  # fmt: skip
            joint = pysindy.AxesArray(np.column_stack([x, u]), {"ax_time": 0, "ax_coord": 1})
            form.fit([joint])
            rows.append(
                (
                    np.asarray(form.transform([joint])[0]),
                    np.asarray(form.convert_u_dot_integral(joint))[:, :1],
                )
            )
    return rows


def _thresholded(rows: list[tuple[np.ndarray, np.ndarray]]) -> list[np.ndarray]:  # type: ignore[type-arg]
    """Coefficients of STLSQ on columns of unit length, for each of 60 thresholds."""
    import pysindy

    theta, b = (np.concatenate(part) for part in zip(*rows, strict=True))
    scale = np.linalg.norm(theta, axis=0)
    found = []
    for level in np.geomspace(1e-4, 1, 60) * float(np.linalg.norm(b)):
        optimizer = pysindy.STLSQ(threshold=level, alpha=1e-8)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            optimizer.fit(theta / scale, b)
        found.append(np.ravel(optimizer.coef_) / scale)
    return found


def weak(campaign: Campaign, output: str, _: Found) -> Found:
    """PySINDy's weak form; the sparsest threshold within 2 % of the best on the recording left out."""
    rows = weak_rows(campaign, output)
    errors = np.zeros(60)
    for k in range(len(rows)):
        theta, b = rows[k]
        for i, coefficients in enumerate(_thresholded([r for j, r in enumerate(rows) if j != k])):
            errors[i] += float(np.sum((b[:, 0] - theta @ coefficients) ** 2))
    near = np.flatnonzero(np.sqrt(errors) <= 1.02 * np.sqrt(errors.min()))
    whole = _thresholded(rows)
    chosen = min((whole[i] for i in near), key=np.count_nonzero)
    return {word: float(value) for word, value in zip(LIBRARY, chosen, strict=True) if value}


def weak_oracle(campaign: Campaign, output: str, truth: Found) -> Found:
    """The same with the threshold that comes nearest to the truth, which nobody has."""
    best: Found = {}
    for coefficients in _thresholded(weak_rows(campaign, output)):
        best = _nearer(best, coefficients, truth)
    return best


def _nearer(best: Found, theta: np.ndarray, truth: Found) -> Found:  # type: ignore[type-arg]
    found = {word: float(value) for word, value in zip(LIBRARY, theta, strict=True) if value}
    return found if not best or len(set(found) ^ set(truth)) < len(set(best) ^ set(truth)) else best


def main() -> None:
    """Run and print a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sets", type=int, default=25)
    parser.add_argument("--peers", action="store_true", help="also PySINDy and its weak form")
    arguments = parser.parse_args()
    methods: dict[str, Callable[..., Found]] = {"discovery": lambda c, o, _: ours(c, o)}
    if arguments.peers:
        methods |= {
            "PySINDy weak": weak,
            "PySINDy weak, oracle threshold": weak_oracle,
            "PySINDy, oracle threshold": plain,
        }
    for name, method in methods.items():
        exact, errors, poles, seconds = [], [], [], 0.0
        for seed in range(arguments.sets):
            campaign, truth, _ = make_campaign(seed, len(FIT))
            for output in TRUTH:
                began = clock.process_time()
                found = method(campaign, output, truth[output])
                seconds += clock.process_time() - began
                exact.append(set(found) == set(truth[output]))
                errors += [abs(found.get(k, 0.0) / v - 1) for k, v in truth[output].items()]
                poles.append(abs(found.get("y", 0.0) / truth[output]["y"]) - 1)
                if not exact[-1]:
                    extra, lost = set(found) - set(truth[output]), set(truth[output]) - set(found)
                    print(f"  {name} {seed} {output}: extra {sorted(extra)}, lost {sorted(lost)}", flush=True)
        count = len(exact)
        print(
            f"{name}: exact {sum(exact)} of {count}, "
            f"median coefficient error {100 * np.median(errors):.2f} %, "
            f"mean pole bias {100 * np.mean(poles):+.2f} % "
            f"(standard error {100 * np.std(poles) / count**0.5:.2f}), {seconds / count:.2f} CPU s an output",
            flush=True,
        )


if __name__ == "__main__":
    main()
