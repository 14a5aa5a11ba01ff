"""`discovery new`: campaign, model and experiment from an engineer's own files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from discovery.errors import UsageError, UserError
from discovery.files import read_toml, write_atomic
from discovery.firsthour.again import rewrite, touched
from discovery.firsthour.asking import Ask, answered, doubt, questions, read_statements, with_statements
from discovery.firsthour.celsius import in_celsius
from discovery.firsthour.cooldown import cooldowns
from discovery.firsthour.guess import FLUIDS, TEMPERATURES, Guess, drives
from discovery.firsthour.joining import join_all
from discovery.firsthour.measures import DEGREES
from discovery.firsthour.plan import Plan, plan, predicted
from discovery.firsthour.recorded import Recorded, never_moves, recorded
from discovery.firsthour.room import unknown_room
from discovery.firsthour.shapes import shape
from discovery.firsthour.table import OwnTable, read_tables
from discovery.firsthour.tableguess import sensors_as_inputs
from discovery.firsthour.texts import campaign_text, clock_doubt, csv_text
from discovery.firsthour.zeros import again_from_first_readings, from_first_readings, perhaps_own_zeros
from discovery.progress import Progress, silent
from discovery.recordings.campaignfile import CampaignForm
from discovery.runfolder import temporary_folder

GOOD = 0.05  # of the rms without a model: nothing to gain with one more unknown of each recording
KEPT = 0.8  # of the rms: one more unknown of each recording is worth it


def new(
    folder: Path,
    sources: Sequence[Path],
    joins: Sequence[Path] = (),
    statements: Sequence[str] = (),
    room: str | None = None,
    ask: Ask | None = None,
    progress: Progress = silent,
    *,
    again: bool = False,
    quick: bool = False,
) -> list[str]:
    """Write recordings, ``campaign.toml``, models and ``experiment.toml`` into a folder.

    Several files are recordings of one machine, the last one kept unseen; of a single file the last third is.

    Args:
        folder: what is written stands in it at the end, or nothing.
        sources: own tables. joins: for each of them the table of a second logger.
        statements: NAME=ROLE,UNIT of columns that a person knows.
        room: column used as the air around the machine.
        ask: asks a person about doubtful guesses; without, they are marked in the campaign file.
        again: the folder is there already; what a person wrote in it stays.
        quick: models are written without comparing them.

    Returns:
        Lines that say what was guessed, why, and what comes next.

    Raises:
        UserError: the folder has a campaign already, or a file cannot be read.
    """
    there = (folder / "campaign.toml").exists()
    _check_request(folder, sources, joins, there=there, again=again)
    if not sources:
        if statements or room:
            raise UsageError(
                f"--is and --room need --from; without it, write the roles into {folder}/campaign.toml "
                '(a room is role = "ambient temperature"), then `discovery new DIR --again`'
            )
        return _planned_again(folder, progress, quick=quick)
    said, clock = read_statements(statements)
    tables = _tables(sources, joins, progress)
    found = recorded(tables, clock, [*said, *([room] if room else [])])
    guesses = with_statements(found.seen, found.guesses, said, room)
    if ask is not None:
        guesses = answered(guesses, questions(found.seen, guesses), ask)
    found, guesses = in_celsius(found, sensors_as_inputs(guesses))
    found, zeros = from_first_readings(found, guesses)
    outputs = _outputs(found, guesses)
    if not outputs:
        raise UserError(
            f"{sources[0]}: no column looks like a measured temperature or error; say which one is to be "
            f'predicted, as in --is "{_example(found)}=temperature,degC" or "...=error,um"; the '
            f"columns are {', '.join(column.header for column in found.seen)}"
        )
    runs = list(found.recordings.values())
    air, about_room = unknown_room(runs[:-1], guesses, outputs)
    kept = _written(folder) if there else {}
    names = list(found.recordings)
    with temporary_folder(folder) as temporary:
        for name, table in found.recordings.items():
            write_atomic(temporary / f"{name}.csv", csv_text(table))
        text = campaign_text(folder.resolve().name, found, guesses, air, about_room, kept, zeros)
        write_atomic(temporary / "campaign.toml", text)
        made = plan(temporary, folder.resolve().name, names, progress, quick=quick)
        own_zeros = perhaps_own_zeros(found, guesses, zeros)
        if own_zeros and made.scores and made.scores[0].ratio > GOOD:
            progress("trying an own zero of each recording")
            own = campaign_text(
                folder.resolve().name, found, guesses, air, about_room, kept, zeros | own_zeros
            )
            write_atomic(temporary / "campaign.toml", own)
            other = plan(temporary, folder.resolve().name, names, progress, quick=quick)
            if other.scores[0].ratio < KEPT * made.scores[0].ratio:
                found = replace(found, notes=(*found.notes, _set_to_zero(own_zeros, made, other)))
                text, made = own, other
        folder.mkdir(parents=True, exist_ok=True)
        for name in found.recordings:
            (temporary / f"{name}.csv").replace(folder / f"{name}.csv")
        write_atomic(folder / "campaign.toml", text)
        notes = rewrite(folder, made)
    room_line = [about_room] if about_room else []
    return [
        *room_line,
        *_said(tables, found, guesses),
        _predicted(outputs, found, guesses),
        *made.said,
        *notes,
        "",
        *_next(folder, guesses, found),
    ]


def _example(found: Recorded) -> str:
    """Header of the column that answers most slowly: a person sees at once how to name one of the own."""
    forms = {column.header: shape(column.values) for column in found.seen}
    jumps = {name: form.jump for name, form in forms.items() if form is not None and form.span > 0}
    return min(jumps, key=lambda name: jumps[name], default=found.seen[-1].header)


def _set_to_zero(errors: Iterable[str], before: Plan, after: Plan) -> str:
    less, more = (f"{plan.scores[0].ratio:.0%}" for plan in (after, before))
    return (
        f"{', '.join(errors)}: the probe seems to have been set to zero before each file. `spread` in the "
        "campaign file gives each recording a zero of its own: on recordings left out, "
        f"{less} of the rms without a model remain instead of {more}"
    )


def _check_request(
    folder: Path, sources: Sequence[Path], joins: Sequence[Path], *, there: bool, again: bool
) -> None:
    """Refuse a request that cannot be fulfilled. Raises the errors that `new` lists."""
    if there and not again:
        raise UserError(
            f"{folder}: campaign.toml is there already; use --again to make model and experiment again "
            "(what you wrote stays), or name another folder"
        )
    if not sources and not there:
        raise UsageError("say --from FILE: which recording is the campaign made of?")
    if joins and len(joins) != len(sources):
        raise UsageError(f"{len(sources)} --from and {len(joins)} --join: say one --join for each --from")


def _tables(sources: Sequence[Path], joins: Sequence[Path], progress: Progress) -> list[OwnTable]:
    """The tables of all files, each joined with that of its second logger, if there is one."""
    progress("reading the files")
    tables = [table for source in sources for table in read_tables(Path(source))]
    if not joins:
        return tables
    seconds = [table for source in joins for table in read_tables(Path(source))]
    progress("finding the shift between the loggers")
    return join_all(tables, seconds)


def _planned_again(folder: Path, progress: Progress, *, quick: bool) -> list[str]:
    """Models and experiment of a campaign whose roles a person has corrected."""
    campaign = read_toml(folder / "campaign.toml", CampaignForm)
    names = list(campaign.recordings)
    before = touched(folder)
    if before is not None:
        names = [*(n for n in names if n not in before.held_out), *(n for n in names if n in before.held_out)]
    counted, about_zeros = again_from_first_readings(folder, campaign, names)
    with temporary_folder(folder) as temporary:
        for recording in campaign.recordings.values():
            source, target = (folder / recording.file).resolve(), temporary / recording.file
            target.parent.mkdir(parents=True, exist_ok=True)
            if recording.file in counted:
                write_atomic(target, counted[recording.file])
            elif source.is_file():
                target.symlink_to(source)
        (temporary / "campaign.toml").write_text((folder / "campaign.toml").read_text("utf-8"), "utf-8")
        made = plan(temporary, folder.resolve().name, names, progress, quick=quick)
        for file in counted:
            (temporary / file).replace(folder / file)
        notes = rewrite(folder, made)
    return [*about_zeros, *made.said, *notes, "", *_next(folder, {}, None)]


def _written(folder: Path) -> dict[str, dict[str, object]]:
    """Return the channels of the existing campaign, without guesses that nobody has confirmed."""
    form = read_toml(folder / "campaign.toml", CampaignForm)
    return {
        name: one.model_dump(exclude_defaults=True)
        for name, one in form.channels.items()
        if one.guessed is None
    }


def _outputs(found: Recorded, guesses: Mapping[str, Guess]) -> list[str]:
    """Return what is predicted. Outputs that never move are left out, if another one moves."""
    names = predicted({column.name: guesses[column.name].role for column in found.seen})
    known = [column for column in found.seen if column.name in names]
    return [column.name for column in known if not never_moves(column)] or names


def _said(tables: Sequence[OwnTable], found: Recorded, guesses: Mapping[str, Guess]) -> list[str]:
    lines = []
    for table in tables:
        runs = [r for r in found.recordings.values() if (r.path, r.name) == (table.path, table.name)]
        length = sum(float(run.time[-1] - run.time[0]) for run in runs)
        sheet = f", sheet '{table.name}'" if table.name else ""
        lines.append(
            f"{table.path.name}{sheet}: {len(table.time)} rows over {_duration(length)}; "
            f"time {runs[-1].about_time}"
        )
        lines += [f"  {note}" for note in table.notes]
    lines += found.notes
    lines.append("guessed (? = have a look):")
    rows = [
        (c.header, f"{c.name}: {one.role}, {one.unit}", "" if one.sure else "?", one.why)
        for c in found.seen
        for one in [guesses[c.name]]
    ]
    width, inner = (max(len(row[place]) for row in rows) for place in (0, 1))
    lines += [f"  {header:{width}} -> {what:{inner}} {mark:1} {why}" for header, what, mark, why in rows]
    for quantity, (unit, values) in found.constants.items():
        lines.append(
            f"  {quantity} in {unit} from the names of the files, held for the whole recording: "
            + ", ".join(f"{v:g}" for v in values.values())
        )
    lines += cooldowns(found, guesses)
    warmed = any(
        one.role in FLUIDS or (one.role == "other input" and one.unit in DEGREES) for one in guesses.values()
    )
    thermal = any(one.role == "error" or one.role in TEMPERATURES for one in guesses.values())
    if thermal and not drives(guesses) and not warmed and not found.constants:
        lines.append(
            "no column says what heats the machine: a model can only follow its surroundings; "
            "record a power, current, speed or switch as well"
        )
    loads = [column for column in found.seen if column.name in drives(guesses)]
    if loads and all(never_moves(column) for column in loads):
        still = ", ".join(column.name for column in loads)
        lines.append(
            f"{still} never {'moves' if len(loads) == 1 else 'move'} in the recordings to fit, so they say "
            "little of what heats the machine: record steps and pauses as well"
        )
    lines += [
        f"'{name}' is below zero in {one.below_zero:.0%} of its readings, so its gain may have either sign; "
        "a heat load below zero cools: where it is heat (a discharge, a brake), write its magnitude"
        for name, one in guesses.items()
        if one.below_zero
    ]
    names = list(found.recordings)
    lines.append(f"recordings: fit {', '.join(names[:-1])}; held out {names[-1]}")
    return lines


def _predicted(outputs: Sequence[str], found: Recorded, guesses: Mapping[str, Guess]) -> str:
    """Say which columns the models predict. If no error was recognised, also say how to name one."""
    line = f"predicted: {', '.join(outputs)}"
    roles = {name: guesses[name].role for name in outputs}
    headers = {column.name: column.header for column in found.seen}
    others = [headers.get(name, name) for name, role in roles.items() if role == "other output"]
    if others and len(others) < len(roles):  # thermal masses explain no voltage
        leave = " ".join(f'--is "{header}=other input"' for header in others)
        return f"{line}; for first models of thermal masses leave out what is none: {leave}"
    if others or "error" in roles.values():
        return line
    other = [
        column.header
        for column in found.seen
        if (guesses[column.name].role, guesses[column.name].unit) == ("other input", "1")
        and guesses[column.name].quantity not in ("fan", "flow", "state")
    ]
    example = f'--is "{(*other, "CH1")[0]}=error,um"'
    return f"{line}; no column was recognised as an error: if one is, say so, as in {example}"


def _duration(seconds: float) -> str:
    return (
        f"{seconds / 3600:.3g} h"
        if seconds >= 7200
        else f"{seconds / 60:.3g} min"
        if seconds >= 120
        else f"{seconds:.3g} s"
    )


def _next(folder: Path, guesses: Mapping[str, Guess], found: Recorded | None) -> list[str]:
    doubtful = [name for name, one in guesses.items() if doubt(one)]
    clock = found is not None and clock_doubt(found) is not None
    lines = [f"written to {folder}: campaign.toml, experiment.toml, models. Next:"]
    if doubtful or clock:
        what = [*doubtful, *(["the unit of time"] if clock else [])]
        lines.append(f"  look at {', '.join(what)} in {folder / 'campaign.toml'}: guessed (? above)")
    return [*lines, f"  discovery check {folder}", f"  discovery run {folder}/experiment.toml"]


__all__ = ["Plan", "new"]
