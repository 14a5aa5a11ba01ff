"""Cross-validation over roles: each part that recordings play is left out in turn, every model found anew.

A role is a part of the experiment: fitting cycle, validation cycle, left nozzle, nozzle at 100 mm, warm-up. A
fold sees the recordings of all other roles and nothing else: structure, parameters, start values and
thresholds come from these. What it leaves on each role is the matrix "found without / judged on"; on its
diagonal stands what nobody has seen. A model that is made from recordings of its own has seen no role at all.
"""

from __future__ import annotations

import math
import pickle
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from discovery.errors import RunsAwayError, UserError
from discovery.experiment.experiment import Experiment
from discovery.experiment.fitted import Fitted
from discovery.experiment.form import ModelEntry, separate
from discovery.experiment.modelfits import fit_entry
from discovery.models import Model
from discovery.progress import Progress, silent
from discovery.terms import names
from discovery.threads import jobs

Roles = Mapping[str, Sequence[str]]


@dataclass(frozen=True)
class Fold:
    """One model found without one role. `rms[error][role]`: of reading minus model; `terms[term][parameter]`:
    the values found; `unseen`: roles of which it saw no recording; `lost`: what went wrong.
    """

    model: str
    without: str
    rms: Mapping[str, Mapping[str, float]]
    terms: Mapping[str, Mapping[str, float]]
    unseen: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()


def begin_folds(experiment: Experiment) -> Iterator[Fold]:
    """Begin to find every model without each role, as many at a time as `threads.jobs` says, in the
    background; one at a time, each is found when it is asked for.

    The folds come in the order in which they are done.
    """
    import cloudpickle
    from joblib import Parallel, delayed

    models = experiment.form.models
    # the longest first, so that no core waits at the end
    tasks = sorted(
        ((m, r) for r in experiment.form.roles or {} for m in models),
        key=lambda t: models[t[0]].kind != "sindy",
    )
    work = Parallel(n_jobs=max(1, min(jobs(), len(tasks))), return_as="generator_unordered")
    # Pickled now: joblib would pickle it later, in its own thread, while the fits fill its caches.
    frozen = cloudpickle.dumps(experiment)
    found: Iterator[Fold] = work(delayed(_fold_of_pickled)(frozen, name, role) for name, role in tasks)
    return found


def _fold_of_pickled(experiment: bytes, name: str, role: str) -> Fold:
    return fold_of(pickle.loads(experiment), name, role)


def leave_roles_out(
    experiment: Experiment, begun: Iterator[Fold] | None = None, progress: Progress = silent
) -> dict[str, Any]:
    """Every model of the experiment without each role in turn.

    Args:
        begun: folds under way, see `begin_folds`.

    Returns:
        What `results.json` holds under "role_matrix": recordings of each role, and for each model the matrix
        rms[error][found without][judged on], the terms with the share of folds that hold them, and the spread
        of each parameter over the folds.
    """
    roles: Roles = experiment.form.roles or {}
    models = experiment.form.models
    folds: list[Fold] = []
    for fold in begun if begun is not None else begin_folds(experiment):
        folds.append(fold)
        progress(
            f"{fold.model} found without {fold.without}: {len(folds)} of {len(roles) * len(models)} folds"
        )
    order = list(roles)
    return {
        "recordings": {role: list(recordings) for role, recordings in roles.items()},
        "models": {
            name: summary(
                sorted((f for f in folds if f.model == name), key=lambda f: order.index(f.without)), order
            )
            for name in models
        },
    }


def fold_of(experiment: Experiment, name: str, without: str) -> Fold:
    """Model `name` found without a role, and what it leaves on each."""
    seen = without_role(experiment, without)
    entry = seen.form.models[name]
    try:
        fitted = fit_entry(seen, name, entry)
    except (RunsAwayError, UserError) as error:
        return Fold(name, without, {}, {}, lost=(str(error),))
    lost = tuple(note for note in fitted.notes if "diverges" in note)
    roles: Roles = experiment.form.roles or {}
    made_from = {one for names in separate(entry).values() for one in names} or set(seen.fit)
    unseen = tuple(role for role, recordings in roles.items() if made_from.isdisjoint(recordings))
    return Fold(name, without, _rms(fitted, roles), terms_of(fitted.model), unseen, lost)


def without_role(experiment: Experiment, without: str) -> Experiment:
    """The experiment that is fitted to all roles but one, with that one held out.

    Recordings without a role stay with the models that named them (`separate`, `also`). Where a model named
    recordings with a role, it gets those of all roles that the fold sees: eq. (8) one influence at a time is
    identified again from its own recordings and these.
    """
    roles: Roles = experiment.form.roles or {}
    seen = [name for role, recordings in roles.items() if role != without for name in recordings]
    models = {
        name: _entry(entry, seen, {r for one in roles.values() for r in one})
        for name, entry in experiment.form.models.items()
    }
    form = {
        "fit": seen,
        "held_out": list(roles[without]),
        "models": models,
        "cross_validate": False,
        "roles": None,
        "mismatch": None,
        "export": None,
    }
    return replace(experiment, form=experiment.form.model_copy(update=form))


def _entry(entry: ModelEntry, seen: Sequence[str], played: set[str]) -> ModelEntry:
    """A model's entry as a fold has it: no recording of the role that is left out."""
    changed: dict[str, Any] = {}
    if hasattr(entry, "also"):
        changed["also"] = [name for name in entry.also if name not in played]
    if separate(entry):
        changed["separate"] = {
            channel: [
                *(r for r in recordings if r not in played),
                *(seen if set(recordings) & played else ()),
            ]
            for channel, recordings in separate(entry).items()
        }
    return entry.model_copy(update=changed)


def _rms(fitted: Fitted, roles: Roles) -> dict[str, dict[str, float]]:
    """rms of reading minus model by error and role, over all readings of the role's recordings."""
    found: dict[str, dict[str, float]] = {}
    for role, recordings in roles.items():
        having = [fitted.predictions[name] for name in recordings if name in fitted.predictions]
        for y, error in enumerate(fitted.fit.problem.outputs):
            left = np.concatenate([(p.readings - p.predicted)[:, y] for p in having] or [np.empty(0)])
            left = left[np.isfinite(left)]
            found.setdefault(error, {})[role] = float(np.sqrt(np.mean(left**2))) if len(left) else math.nan
    return found


def terms_of(model: Model) -> dict[str, dict[str, float]]:
    """The values of each term's parameters, by term; a term of one name that enters twice is one."""
    values = model.values()
    found: dict[str, dict[str, float]] = {}
    for term in model.terms:
        used = sorted(name for name in names(term.expression) if name in values)
        mine = {
            n: values[n] for n in used if not (model.parameters[n].fixed and model.parameters[n].low is None)
        }
        found.setdefault(term.name, {}).update(mine)
    return found


def summary(folds: Sequence[Fold], roles: Sequence[str]) -> dict[str, Any]:
    """One model over its folds, as `results.json` holds it.

    A parameter's spread is the standard deviation (n - 1) over the folds that hold its term.
    """
    errors = dict.fromkeys(error for fold in folds for error in fold.rms)
    whole = [fold for fold in folds if fold.rms]
    return {
        "rms": {
            error: {fold.without: {role: fold.rms[error][role] for role in roles} for fold in whole}
            for error in errors
        },
        "terms": {
            term: {
                "share": sum(term in fold.terms for fold in whole) / len(whole),
                "parameters": dict(_spreads(term, whole)),
            }
            for term in dict.fromkeys(term for fold in whole for term in fold.terms)
        },
        "unseen": {fold.without: list(fold.unseen) for fold in whole},
        "lost": [f"without {fold.without}: {what}" for fold in folds for what in fold.lost],
    }


def _spreads(term: str, folds: Sequence[Fold]) -> Iterator[tuple[str, dict[str, Any]]]:
    having = {fold.without: fold.terms[term] for fold in folds if term in fold.terms}
    for name in dict.fromkeys(name for values in having.values() for name in values):
        found = {role: values[name] for role, values in having.items() if name in values}
        numbers = np.array(list(found.values()))
        sd = float(np.std(numbers, ddof=1)) if len(numbers) > 1 else math.nan
        yield name, {"mean": float(np.mean(numbers)), "sd": sd, "without": found}
