"""Discovery of a sparse model: recordings to fit in, a model with its evidence out."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from discovery.dynamics import make_grid
from discovery.errors import UserError
from discovery.fitting import fit_model
from discovery.models import Model, Parameter, State
from discovery.models.check import check_model
from discovery.models.modelfile import read_model
from discovery.recordings import Campaign
from discovery.sparse.bymasses import MassData, discover_error
from discovery.sparse.byrates import Growth, discover_rates
from discovery.sparse.discovery import Discovery, joined
from discovery.sparse.drives import AMBIENT, Inputs, make_inputs
from discovery.sparse.families import candidates
from discovery.sparse.folds import make_blocks
from discovery.sparse.gram import solve, total
from discovery.sparse.masses import make_mass_library, respond
from discovery.sparse.options import SparseOptions
from discovery.sparse.ratedata import RateData, make_rate_data, nearer
from discovery.sparse.rates import Candidate, with_candidates, without_idle
from discovery.sparse.weak import weak_gram, weak_rows
from discovery.terms import Name, Term, names, parse, text
from discovery.threads import one_thread

Progress = Callable[[str], None]

FILE_FAMILIES = ("wet", "rotation", "coupling")
LABORATORY = ("linear", "coupling", "radiation", "load", "second mass")
# s, time constants of the masses behind each body: two of a series in steps of four, in proportion to the
# recordings, of which the slower one shall see the sixth part
SECOND_MASS, _STEP, _SEEN = (300.0, 1200.0), 4.0, 6.0
QUICK = (60.0, 240.0)  # s
SENSOR_LAG = (1.0, 20.0, 300.0)  # s: least, start, most
START_SD = 5.0  # K: a first reading may be an artefact of switching on


@one_thread
def discover(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    options: SparseOptions,
    progress: Progress | None = None,
    folder: Path | None = None,
) -> Discovery:
    """Discover a sparse model of `outputs` from `recordings`; no other recording is looked at.

    Errors become sums of hidden thermal masses; measured temperatures, user-given expressions and baseline
    files get terms in the rates of their states. Sizes are chosen by free runs on what was left out, one
    recording at a time (or by blocks of a single one); numbers are fitted by output error and carry 95 %
    intervals.

    Args:
        recordings: names of the recordings to fit.
        outputs: channels of role error or temperature.
        progress: told in a few words what is being done.
        folder: where a relative baseline file is looked for; default the campaign's folder.

    Raises:
        UserError: an option that does not fit the campaign.
    """
    began = clock.perf_counter()
    tell = progress or (lambda _: None)
    inputs = make_inputs(campaign, recordings, options.inputs)
    if options.built_on_file:
        tell("terms on the baseline")
        parts = [_on_file(campaign, recordings, outputs, inputs, options, folder or campaign.path.parent)]
    elif all(campaign.channels[name].role == "temperature" for name in outputs):
        tell("terms of " + ", ".join(outputs))
        parts = [_temperatures(campaign, recordings, outputs, inputs, options)]
    elif options.form == "rates" or (options.form == "auto" and options.library):
        parts = []
        for name in outputs:
            tell(f"terms of {name}")
            parts.append(_error_rates(campaign, recordings, name, inputs, options))
    else:
        tell("filtered inputs")
        data = _mass_data(campaign, recordings, outputs, inputs, options)
        parts = []
        for name in outputs:
            tell(f"masses of {name}")
            parts.append(discover_error(data, campaign, recordings, name, options))
    return joined("discovered", parts, clock.perf_counter() - began)


def _mass_data(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    inputs: Inputs,
    options: SparseOptions,
) -> MassData:
    quick = QUICK if inputs.bodies else ()  # an error follows the temperature of its own body at once
    constants = sorted({*quick, *options.time_constants})
    library = make_mass_library(inputs, constants, options.pump_ratios, options.library or ())
    grids = {r: make_grid(campaign, r, inputs.names, outputs) for r in recordings}
    blocks = make_blocks([grids[r].time[grids[r].read] for r in recordings], options.blocks)
    return MassData(library, grids, tuple(respond(library, grids[r]) for r in recordings), blocks)


def _error_rates(
    campaign: Campaign, recordings: Sequence[str], output: str, inputs: Inputs, options: SparseOptions
) -> Discovery:
    """Terms in the rate of one error: eq. (9) and what the library adds, started from the weak form."""
    unit = campaign.channels[output].unit
    state = State(output, unit, None, None, max(1.0, campaign.channels[output].noise or 0.0), 1 / 3600)
    empty = Model(output, {}, {output: state}, (), {}, "h")
    baseline = ["y", "1", *inputs.of(AMBIENT, "heat load", "fluid temperature")]
    words = list(dict.fromkeys([*baseline, *(options.library or ("linear", "wet", "rotation"))]))
    found = candidates([output], empty, campaign, inputs, words, options)
    data = make_rate_data(campaign, recordings, [output], inputs.names, options.blocks)
    model, labels = with_candidates(empty, _started(found, data, {output: output}))
    always = [
        name
        for name, label in labels.items()
        if options.keep_baseline and label.split(": ", 1)[1] in (output, *baseline)
    ]
    return discover_rates(data, model, labels, always, options)


def _room(outputs: Sequence[str], inputs: Inputs, count: int) -> tuple[str, dict[str, State]]:
    """The temperature of the room: its channel where it moves, else a constant of each of `count` recordings.

    Where the sensors start near what is known of the room they stand in it at rest, and their mean tells the
    room's temperature of that day. A single recording does not tell it from steady heat: its readings would
    pull it away from where free runs, which see the first reading alone, begin.
    """
    if air := inputs.of(AMBIENT):
        return air[0], {}
    mean = f"({' + '.join(outputs)})/{len(outputs)}"
    start = parse(f"where({mean} < {inputs.reference + 2:g}, {mean}, {inputs.reference:g})")
    return "room", {"room": State("room", "degC", None, start, 0.5 if count > 1 else 0.1, 1 / 3600)}


def _started(
    found: Sequence[Candidate],
    data: RateData,
    channel: Mapping[str, str],
    constants: Mapping[str, float] | None = None,
) -> list[Candidate]:
    """Candidates with start values from the weak form; `channel` says which readings stand for each state.

    Hidden masses keep theirs: the weak form sees what is measured alone.
    """
    placed: dict[Candidate, float] = {}
    for state, output in channel.items():
        mine = [c for c in found if c.into == state and "_mass" not in c.label]
        rows = [
            weak_rows(data.grids[r], output, [c.expression for c in mine], constants, aliases=channel)
            for r in data.recordings
        ]
        low, high = (np.array([getattr(c, side) for c in mine]) for side in ("low", "high"))
        theta = 3600 * solve(total([weak_gram(one) for one in rows]), range(len(mine)), low, high)
        placed |= {c: float(np.clip(value, c.low, c.high)) for c, value in zip(mine, theta, strict=True)}
    return [replace(c, start=placed.get(c, c.start)) for c in found]


def _temperatures(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    inputs: Inputs,
    options: SparseOptions,
) -> Discovery:
    """Measured temperatures: a body behind each sensor, all bodies together."""
    room, states = _room(outputs, inputs, len(recordings))
    longest = max(float(campaign.recordings[r].time[-1]) for r in recordings)
    masses = second_masses(longest) if "second mass" in (options.library or LABORATORY) else ()
    least, lag, most = (min(t, longest / 4) for t in SENSOR_LAG)
    parameters, terms = {}, []
    bodies = [f"{name}_body" for name in outputs]
    for name, body in zip(outputs, bodies, strict=True):
        parameters[f"{name}_lag"] = Parameter(lag, "s", least, most)
        states[name] = State(name, "degC", None, None, START_SD, 1.0)
        terms.append(Term(f"sensor {name} follows", name, parse(f"({body} - {name})/{name}_lag")))
        states[body] = State(body, "degC", None, Name(name), START_SD, 1 / 3600)
        for k, tau in enumerate(masses, start=1):
            mass = f"{body}_mass{k}"
            states[mass] = State(mass, "degC", None, Name(name), 0.0, 1.0)
            terms.append(Term(f"{mass} follows", mass, parse(f"({body} - {mass})/{tau:g}")))
    empty = Model("temperatures", parameters, states, tuple(terms), {}, "h")
    words = options.library or LABORATORY
    own = [Candidate(body, parse(f"{room} - {body}"), 0.0) for body in bodies]
    given = candidates(bodies, empty, campaign, inputs, words, options, room)
    offered = [*own, *(c for c in given if (c.into, c.label) not in {(o.into, o.label) for o in own})]
    data = make_rate_data(campaign, recordings, outputs, inputs.names, options.blocks)
    channel, known = dict(zip(bodies, outputs, strict=True)), {room: inputs.reference}
    loads = inputs.of("heat load", "cooling power") or inputs.of("rotation speed", "other input")
    simple = {text(o.expression) for o in own} | set(loads)
    basis = [c for c in offered if c.label in simple]
    cautious = {(c.into, c.label): c for c in _started(basis, data, channel, known)}
    begun = _started(offered, data, channel, known)
    model, labels = with_candidates(empty, begun)
    slow, _ = with_candidates(
        empty, [cautious.get((c.into, c.label), replace(c, start=0.0)) for c in offered]
    )
    decay = [n for n, label in labels.items() if label.endswith(f": {room} - {label.split(': ')[0]}")]
    plain = [n for n, label in labels.items() if label.split(": ", 1)[1] in simple]
    first = {"1", *simple, *(text(parse(f"{a} - {b}")) for a in bodies for b in bodies if a != b)}
    easy = [n for n, label in labels.items() if label.split(": ", 1)[1] in first]
    found = discover_rates(data, nearer(data, model, slow), labels, decay, options, plain=plain, easy=easy)
    return replace(found, model=without_idle(found.model, outputs))


def second_masses(longest: float) -> tuple[float, ...]:
    """Time constants [s] of the masses behind a body that recordings of this length [s] can show.

    >>> second_masses(7200.0), second_masses(86400.0)
    ((300.0, 1200.0), (4800.0, 19200.0))
    """
    slower = max(longest, 1.0) / _SEEN / SECOND_MASS[-1]
    scale = _STEP ** round(float(np.log(slower) / np.log(_STEP)))
    return tuple(tau * scale for tau in SECOND_MASS)


def _on_file(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    inputs: Inputs,
    options: SparseOptions,
    folder: Path,
) -> Discovery:
    """A gray-box model file and what the library adds to its states."""
    path = Path(options.baseline) if Path(options.baseline).is_absolute() else folder / options.baseline
    baseline = read_model(path)
    check_model(baseline, {n: c.unit for n, c in campaign.channels.items()}, path)
    for name in options.into or ():
        if name not in baseline.states:
            raise UserError(
                f"{path}: the discovery adds terms into '{name}', which is no state of this model "
                f"({', '.join(baseline.states)}); mend the name under into"
            )
    bodies = [name for name, state in baseline.states.items() if state.capacity] or list(baseline.states)
    found = candidates(
        list(options.into or bodies), baseline, campaign, inputs, options.library or FILE_FAMILIES, options
    )
    channels = sorted({*inputs.names, *baseline.inputs} & set(campaign.channels) - set(outputs))
    data = make_rate_data(campaign, recordings, outputs, channels, options.blocks)
    fitted = fit_model(baseline, data.campaign, recordings, outputs, grids=data.grids).model
    model, labels = with_candidates(fitted, found)
    if options.keep_baseline is False:
        used = baseline.start_names.union(*(names(e) for e in baseline.outputs.values()))
        labels |= {
            n: n
            for n in baseline.free
            if baseline.parameters[n].min <= 0 <= baseline.parameters[n].max and n not in used
        }
    growth = Growth(most=options.max_terms, restart=baseline.values())
    return discover_rates(
        data, model, labels, (), options, None if options.keep_baseline is False else growth
    )
