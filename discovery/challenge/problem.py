"""What a method is given: the files of one case, read, and what several methods need of them."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from pathlib import Path
from typing import Any

from discovery.diagnosis.context import Context, Form, make_context
from discovery.diagnosis.proof import explained, free_runs, improvement
from discovery.diagnosis.refit import score
from discovery.diagnosis.scored import Scored, scored
from discovery.effects.catalogue import catalogue
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.settings import only
from discovery.experiment import Experiment, load_experiment
from discovery.experiment.modelfits import starting_model
from discovery.fitting import Fit
from discovery.fitting.noise import white_noise
from discovery.models import Model

Answer = dict[str, Any]  # the part of diagnosis.json that is scored
Method = Callable[["Problem"], Answer]


@dataclass(frozen=True)
class Problem:
    """One case as its experiment file describes it."""

    experiment: Experiment

    @cached_property
    def model(self) -> Model:
        """The model that somebody believes in."""
        form = self.experiment.form
        name = form.mismatch.model if form.mismatch else next(iter(form.models))
        return starting_model(self.experiment, name, form.models[name])[0]

    @cached_property
    def context(self) -> Context:
        """Baseline fitted to the recordings that may be seen."""
        outputs = [y for y in self.experiment.outputs if y in self.model.outputs or y in self.model.states]
        fit = self.experiment.fit
        after = {run: tuple(fit[k:]) for k, run in enumerate(fit)}
        return make_context(
            self.experiment.fitting, self.model, fit, outputs, list(catalogue().values()), after
        )

    @cached_property
    def baseline(self) -> Scored:
        """The baseline under the process noise that makes what it leaves most likely."""
        found = score(self.context, (), self.context.usual)
        assert found is not None  # the context has fitted it
        return found

    @cached_property
    def white(self) -> Context:
        """The context with one noise: white, as large as the residual of the baseline."""
        context = self.context
        fit = context.baseline
        stated = {name: context.campaign.channels[name].noise for name in context.outputs}
        residuals = [fit.problem.residual(t) for t in fit.trajectories]
        noise = white_noise(context.outputs, stated, residuals)
        none = tuple(columns[:, :, :0] for columns in context.form.columns)
        exact = Form(none, (0, 0, 0, 0))  # laws of the right form
        return replace(context, settings=only(noise), form=exact, own_form=exact)

    def improvement(self, repaired: Fit | None, chosen: Sequence[Hypothesis]) -> Answer:
        """`improvement` of diagnosis.json for a repaired model with `chosen` in it; nothing without one.

        The noise floor is the process noise with these effects in the model, as in the workbench's proof.
        """
        if repaired is None:
            return {"held_out": {}, "explained": None}
        context, held_out = self.context, self.experiment.held_out
        noise = scored(context, chosen, repaired).noise
        runs = free_runs(self.experiment.campaign, held_out, context.baseline, repaired, noise)
        found = {run: improvement([one], context.outputs) for run, one in runs.items()}
        rows = {
            run: {
                "rms_before": i.before,
                "rms_after": i.after if isfinite(i.after) else None,
                "noise_floor": i.floor,
            }
            for run, i in found.items()
        }
        return {"held_out": rows, "explained": explained(found)}


def read_problem(case: Path) -> Problem:
    """The problem of a case folder. Raises UserError as reading an experiment does."""
    experiment = load_experiment(case / "experiment.toml")
    form = experiment.form.model_copy(update={"cross_validate": False, "export": None})
    return Problem(replace(experiment, form=form))


def timed(method: Method, case: Path) -> Answer:
    """A method's answer to a case with the seconds that it took, by the clock and of the processor."""
    began, busy = clock.perf_counter(), clock.process_time()
    answer = method(read_problem(case))
    return answer | {
        "seconds": clock.perf_counter() - began,
        "processor_seconds": clock.process_time() - busy,
    }
