"""The guards, limits and fades of the C code are those of the Python runtime, tick by tick."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from discovery.export.c import c_files, c_prefix
from discovery.export.document import Exported, from_document, render
from discovery.export.makedocument import make_document
from discovery.export.ranges import sampled_inputs
from discovery.export.replay import CFLAGS
from discovery.export.seal import open_seal
from discovery.export.stepper import free_run
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.terms import Term, parse
from tests.export.conftest import make_campaign, make_model, needs_gcc
from tests.export.guarded import by_the_runtime, faulty, table

MAIN = """
#include "PREFIX.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
int main(void)
{
    static PREFIX_compensator c;
    PREFIX_reading in[UP_INPUTS + 1];
    int i, s[3];
    char v[64], a[64];
    PREFIX_begin(&c);
    for (;;) {
        for (i = 0; i < UP_INPUTS; ++i) {
            if (scanf("%63s %63s %d", v, a, &in[i].good) != 3) { return 0; }
            in[i].value = strtod(v, NULL);
            in[i].age = strtod(a, NULL);
        }
        if (scanf("%d %d %d", &s[0], &s[1], &s[2]) != 3) { return 1; }
        PREFIX_tick(&c, in, s[0], s[1], s[2]);
        printf("%d %.17g", c.status, c.gain);
        for (i = 0; i < UP_OFFSETS; ++i) { printf(" %.17g", c.offset[i]); }
        printf("\\n");
    }
}
"""


def sealed(model: Model, campaign: Campaign) -> Exported:
    body, seal = open_seal(render(make_document(model, campaign, ["fit"])), "test")
    return from_document(body, seal, "test")


def quiet(campaign: Campaign) -> Campaign:
    """The drive never gives more than 690 W."""
    fit = campaign.recordings["fit"]
    values = {**fit.values, "P_drive": np.minimum(fit.values["P_drive"], 690.0)}
    return replace(campaign, recordings={"fit": replace(fit, values=values)})


def failing() -> Model:
    """The model of everything, without a number where the drive gives more than 700 W."""
    model = make_model()
    terms = (*model.terms, Term("edge", "a", parse("0*log(where(P_drive > 700, 0 - 1, 1))")))
    return Model(model.name, model.parameters, model.states, terms, model.outputs)


def compiled(exported: Exported, folder: Path, *flags: str) -> str:
    prefix = c_prefix(exported)
    for name, text in c_files(exported).items():
        (folder / name).write_text(text)
    (folder / "main.c").write_text(MAIN.replace("PREFIX", prefix).replace("UP_", f"{prefix.upper()}_"))
    command = ["gcc", *CFLAGS, *flags, "main.c", f"{prefix}.c", "-lm", "-o", "main"]
    subprocess.run(command, cwd=folder, check=True)
    return str(folder / "main")


@needs_gcc
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("model", [make_model(), failing()], ids=["everything", "failing"])
def test_c_guards_as_the_runtime_does(model: Model, seed: int, tmp_path: Path) -> None:
    campaign = make_campaign(hours=9.0, seed=2)
    if len(model.terms) > 6:  # the export runs the model over its recordings: there it must have numbers
        campaign = quiet(campaign)
    exported = sealed(model, campaign)
    inputs = sampled_inputs(campaign, "fit", exported.compiled.inputs, 10.0)
    given = faulty(exported, inputs, seed)
    offsets, status, gains = by_the_runtime(exported, given)
    program = compiled(exported, tmp_path)
    done = subprocess.run([program], input=table(given), capture_output=True, text=True, check=True)
    found = np.array([row.split() for row in done.stdout.splitlines()], dtype=float)
    assert len(found) == len(offsets)
    states = {int(word) & 0xFF for word in status}
    assert {0, 4} <= states
    assert len(states) >= 3
    assert np.array_equal(found[:, 0].astype(int), status)
    assert np.max(np.abs(found[:, 1] - gains)) < 1e-12
    assert np.max(np.abs(found[:, 2:] - offsets)) < 1e-9


@needs_gcc
def test_options_switch_guards_limits_and_fade_off(tmp_path: Path) -> None:
    campaign = make_campaign(hours=2.0)
    exported = sealed(make_model(), campaign)
    prefix = c_prefix(exported)
    inputs = sampled_inputs(campaign, "fit", exported.compiled.inputs, 10.0)
    given = faulty(exported, inputs, 0, episodes=0)
    given.value[300:, list(exported.compiled.inputs).index("T_env")] += 15.0
    offsets, status, _ = by_the_runtime(exported, given)
    assert status[400] & 1 << 12
    compiled(exported, tmp_path)
    main = (tmp_path / "main.c").read_text()
    main = main.replace(
        f"{prefix}_begin(&c);", f"{prefix}_begin(&c); c.set.guards = c.set.limits = c.set.fade = 0;"
    )
    (tmp_path / "main.c").write_text(main)
    subprocess.run(["gcc", *CFLAGS, "main.c", f"{prefix}.c", "-lm", "-o", "main"], cwd=tmp_path, check=True)
    done = subprocess.run(
        [str(tmp_path / "main")], input=table(given), capture_output=True, text=True, check=True
    )
    found = np.array([row.split() for row in done.stdout.splitlines()], dtype=float)
    y = free_run(exported.compiled, given.value)
    assert np.max(np.abs(found[:, 2:] + y)) < 1e-9
    assert np.max(np.abs(offsets[400:] + y[400:])) > 1.0


@needs_gcc
def test_a_parameter_keeps_its_name_and_can_be_tuned(tmp_path: Path) -> None:
    """`G` of the model is `model.k.G` of the compensator, with its unit and terms in a comment."""
    campaign = make_campaign(hours=6.0)
    exported, changed = sealed(make_model(), campaign), make_model()
    tuned = replace(
        changed, parameters={**changed.parameters, "G": replace(changed.parameters["G"], value=30.0)}
    )
    prefix = c_prefix(exported)
    header = c_files(exported)[f"{prefix}.h"]
    source = c_files(exported)[f"{prefix}.c"]
    assert "_real G; /* G [1]: conduction */" in header
    for term in exported.model.terms:
        assert source.count(f"/* {term.name}: ") == 1
    inputs = sampled_inputs(campaign, "fit", exported.compiled.inputs, 10.0)
    given = faulty(exported, inputs, 0, episodes=0)
    compiled(exported, tmp_path)
    main = (tmp_path / "main.c").read_text()
    main = main.replace(f"{prefix}_begin(&c);", f"{prefix}_begin(&c); c.set.limits = 0; c.model.k.G = 30.0;")
    (tmp_path / "main.c").write_text(main)
    subprocess.run(["gcc", *CFLAGS, "main.c", f"{prefix}.c", "-lm", "-o", "main"], cwd=tmp_path, check=True)
    done = subprocess.run(
        [str(tmp_path / "main")], input=table(given), capture_output=True, text=True, check=True
    )
    found = np.array([row.split() for row in done.stdout.splitlines()], dtype=float)
    y = free_run(sealed(tuned, campaign).compiled, inputs)
    assert np.max(np.abs(found[:, 2:] + y)) < 1e-9
