"""Equations (1) to (6) of the paper: variants of eq. (6), validity, what nozzle height and flow show."""

from __future__ import annotations

import warnings
from dataclasses import replace

from discovery.errors import RunsAwayError, UserError
from discovery.evaluation.tables import Table
from discovery.fitting import fit_model
from discovery.models import Model, Parameter
from discovery.models.convection import (
    BIOT,
    EKMAN,
    PRANDTL,
    REYNOLDS,
    TABLE_THICKNESS,
    OutsideValidity,
    Speeding,
    biot_number,
    ekman,
    film_coefficient,
    jet_velocity,
    prandtl_number,
    rad_per_s,
)
from discovery.models.thermobalance import thermobalance
from discovery.paper.chapter import Chapter, Material

_SPEEDS = (100.0, 400.0, 600.0, 750.0, 800.0, 1000.0, 1200.0)
_VARIANTS: tuple[tuple[str, Speeding], ...] = (
    ("off", "none"),
    ("as printed", "printed"),
    ("exponent 1.5", "1.5"),
)
_NU, _LAMBDA_F, _LAMBDA_S, _D_N, _R_D = 1.2e-6, 0.58, 45.0, 0.010, 0.25


def equation_6(m: Material) -> Chapter:
    """h by speed with the variants of eq. (6), what the variants leave, and where eq. (1) holds."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OutsideValidity)
        curves = {
            label: [film_coefficient(n, 0.05, 1000, variant=variant) for n in _SPEEDS]
            for label, variant in _VARIANTS
        }
    tables = [
        Table(
            "h [W/m²K] of eq. (1) by speed [rpm], nozzle at 50 mm, Re 1000",
            ("Eq. (6)", *(f"{n:g}" for n in _SPEEDS)),
            tuple((label, *values) for label, values in curves.items()),
        ),
        _validity(),
    ]
    shows = []
    if m.form.speeding:
        rows: list[tuple[str | float | None, ...]] = []
        spans: dict[str, list[float]] = {}
        for recording in (*m.results["fit"], *m.judged_on()):
            for name in m.form.speeding:
                scores = m.results["models"][name]["recordings"].get(recording, {})
                rows.append((recording, name, *(scores[e]["rms"] if e in scores else None for e in m.errors)))
                for e in scores:
                    spans.setdefault(f"{recording}, {e}", []).append(scores[e]["rms"])
        header = ("rms", "model", *(f"{e} [{m.unit(e)}]" for e in m.errors))
        tables.append(Table("What the models leave that differ in eq. (6) alone", header, tuple(rows)))
        where, span = max(spans.items(), key=lambda pair: max(pair[1]) - min(pair[1]))
        shows.append(
            f"Eq. (6) changes what is left by at most {max(span) - min(span):.2g} (of {min(span):.2g}, "
            f"at {where}): "
            "above 750 rpm the table follows the fluid whichever factor h has."
        )
    shows.append(
        f"As printed, eq. (6) makes h {curves['as printed'][-1] / curves['off'][-1]:.1f} times larger at "
        "1200 rpm; with "
        f"the exponent 1.5 it is {curves['exponent 1.5'][-1] / curves['off'][-1]:.2f} times."
    )
    return Chapter(
        "equation-6",
        "Equations (1) to (6): the film coefficient",
        "Above 750 rpm Ω is replaced by 4 (Ω − 750)⁵ + 750, 'based on measurements'. Ranges of validity "
        "are listed.",
        tuple(tables),
        shows=tuple(shows),
        not_shown=(
            "The coefficient and exponents of eq. (1) come only from the paper. ν_f is read as the "
            "kinematic viscosity.",
            "The plant's own film law is another one, so no variant can be 'the true one' here.",
        ),
    )


def _validity() -> Table:
    """Numbers of this machine against the ranges of the paper."""
    fast, slow = (ekman(_NU, rad_per_s(n), _R_D) for n in (1200.0, 100.0))
    reynolds = [jet_velocity(q, _D_N) * _D_N / _NU for q in (2.0, 14.0)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OutsideValidity)
        h = [film_coefficient(n, 0.05, 1000) for n in (100.0, 1200.0)]
    pr = prandtl_number(_NU, _LAMBDA_F)
    bi = [biot_number(one, TABLE_THICKNESS, _LAMBDA_S) for one in h]
    here: tuple[tuple[str, float, float, tuple[float, float]], ...] = (
        ("Ekman number, 1200 to 100 rpm", fast, slow, EKMAN),
        ("Reynolds number, 2 to 14 l/min", reynolds[0], reynolds[1], REYNOLDS),
        ("Prandtl number", pr, pr, PRANDTL),
        ("Biot number, 100 to 1200 rpm", bi[0], bi[1], BIOT),
    )
    rows: list[tuple[str | float | None, ...]] = []
    for name, low, high, (least, most) in here:
        holds = "inside" if least <= low and high <= most else "outside"
        rows.append((name, holds, low, high, least, most))
    header = ("Quantity", "", "here from", "to", "paper from", "paper to")
    return Table("Where eq. (1) is claimed to hold, and where this table is", header, tuple(rows))


def nozzle(m: Material) -> Chapter | None:
    """Exponents of height and fluid velocity, from a recording in which they matter and one in which not."""
    wanted = [(label, r) for label, r in (("matters", m.form.nozzle), ("flooded", m.form.flooded)) if r]
    if not wanted:
        return None
    campaign, base = m.experiment.campaign, m.fitted[m.form.thermobalance]
    rows: list[tuple[str | float | None, ...]] = []
    shows = []
    for _, recording in wanted:
        start = _started(base.model.values())
        outputs = base.fit.problem.outputs
        try:
            fit = fit_model(start, campaign, [recording], outputs)
        except (RunsAwayError, UserError) as error:
            shows.append(f"{recording}: the fit failed: {error}")
            continue
        for name, what in (("b", "nozzle height"), ("m", "fluid velocity V_j")):
            p = fit.model.parameters[name]
            word = "identified" if identified(p) else "not identified"
            rows.append((recording, what, p.value, p.low, p.high, word))
            shows.append(
                f"{recording}: the exponent of the {what} is {p.value:.2f} ({_interval(p)})"
                + ("." if identified(p) else ": not identified.")
            )
    return Chapter(
        "nozzle",
        "Equations (1) and (4): nozzle height and fluid velocity",
        "The model adapts to a nozzle at 100 mm, because the height is an input of eq. (4): β^0.0909; "
        "V_j enters by Re^0.75.",
        (
            Table(
                "Exponents found in one recording each, 95 % intervals with the correlation of the residuals",
                ("Recording", "of", "value", "low", "high", ""),
                tuple(rows),
            ),
        ),
        shows=tuple(shows),
        not_shown=(
            "The exponents of eq. (1) for a turning table: where it is flooded, it follows the fluid "
            "whatever h is.",
        ),
    )


def identified(p: Parameter) -> bool:
    """Whether an exponent is identified: its 95 % interval excludes zero.

    >>> identified(Parameter(0.4, low=0.3, high=0.5)), identified(Parameter(0.4, low=-0.3, high=1.1))
    (True, False)
    """
    return p.low is not None and p.high is not None and (p.low > 0.0 or p.high < 0.0)


def _interval(p: Parameter) -> str:
    return "no interval" if p.low is None or p.high is None else f"{p.low:.2f} to {p.high:.2f}"


def _started(values: dict[str, float]) -> Model:
    """The thermobalance with free exponents, at the values found so far."""
    model = thermobalance(jet=True)
    shared = {n: v for n, v in values.items() if n in model.parameters and not model.parameters[n].fixed}
    inside = {n: min(max(v, model.parameters[n].min), model.parameters[n].max) for n, v in shared.items()}
    return replace(model.with_values(inside), name="thermobalance with free exponents")
