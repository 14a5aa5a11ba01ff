"""What `discovery record` does: options into orders, orders into files, a line of progress for each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from discovery.errors import UsageError, UserError
from discovery.files import read_toml
from discovery.recordings.campaignfile import CampaignForm
from discovery.virtual.effects import EFFECTS
from discovery.virtual.nmv5000.campaign import CAMPAIGNS
from discovery.virtual.nmv5000.plant import five_axis
from discovery.virtual.record import (
    FAULTS,
    Order,
    draw_effect,
    file_name,
    parse_fault,
    parse_request,
    write_answers,
    write_campaign,
)


def orders_of(
    campaign: str | None,
    recordings: int,
    cycle: str,
    seed: int,
    hours: float,
    nozzle_height_mm: float,
    nozzle_side: float,
    effects: Sequence[str],
    faults: Sequence[str],
    conceal: bool,
) -> tuple[str, tuple[Order, ...]]:
    """Title and orders of a campaign.

    Raises UsageError: an unknown campaign, effect, fault, body or channel.
    """
    if campaign is not None:
        if campaign not in CAMPAIGNS:
            known = ", ".join(CAMPAIGNS)
            raise UsageError(f"There is no campaign '{campaign}' to record; choose one of: {known}.")
        return CAMPAIGNS[campaign]
    if conceal and effects:
        raise UsageError("--conceal draws the effect that it hides; leave out --effect, or --conceal")
    requests = tuple(parse_request(text) for text in effects)
    if conceal:
        requests += (draw_effect(seed),)
    chain_faults = tuple(parse_fault(text) for text in faults)
    names = ["recording"] if recordings == 1 else [f"recording_{i + 1}" for i in range(recordings)]
    return f"virtual machine, seed {seed}", tuple(
        Order(
            name,
            cycle,
            seed + i,
            hours,
            nozzle_height_mm,
            nozzle_side,
            requests,
            chain_faults if i == 0 else (),
            age=float(i),
        )
        for i, name in enumerate(names)
    )


def record_orders(
    out: Path, title: str, orders: Sequence[Order], *, reveal: bool, envelope: bool
) -> Iterator[str]:
    """Write the campaign and, with `envelope`, the answers next to it; yields what was done, line by line.

    Raises UserError: `out` holds a campaign of other recordings, or cannot be written.
    """
    _refuse_another_campaign(out, orders)
    answers = write_campaign(out, title, orders)
    yield f"{len(orders)} recording{'s' if len(orders) > 1 else ''} and campaign.toml in {out}"
    envelope_file = out.resolve().parent / f"{out.resolve().name}.answer.json"
    if not any(a["effects"] or a["faults"] for a in answers):
        if envelope:  # an answer to recordings that were just replaced would be a lie
            envelope_file.unlink(missing_ok=True)
            (out / "answer.json").unlink(missing_ok=True)
        return
    if envelope:
        write_answers(envelope_file, answers)
        yield f"what is concealed is in {envelope_file}"
    if reveal:
        write_answers(out / "answer.json", answers)
        yield f"the answer is in {out / 'answer.json'}"


def _refuse_another_campaign(out: Path, orders: Sequence[Order]) -> None:
    """The same recordings may be taken again; others would no longer fit the campaign file."""
    there = out / "campaign.toml"
    if not there.exists():
        return
    try:
        files = {one.file for one in read_toml(there, CampaignForm).recordings.values()}
    except UserError:
        files = {there.name}
    others = sorted(files - {file_name(order) for order in orders})
    if others:
        raise UserError(
            f"{out}: this folder holds another campaign (with {others[0]}); name another folder with --out"
        )


def effect_list() -> str:
    """The effects and faults with unit, default place and law, one a line."""
    machine = five_axis()
    effects = [
        (
            word,
            f"up to {e.reach(machine, places[0]):.3g} {e.unit}".removesuffix(" 1"),
            f"at {'+'.join(places[0])}",
            e.law,
        )
        for word, e in EFFECTS.items()
        if (places := e.places(machine))
    ]
    faults = [
        (name, f"e.g. {example:g} {unit}", f"on {channel}" if channel else "", "")
        for name, (_, channel, unit, example) in FAULTS.items()
    ]
    widths = [max(map(len, column)) for column in zip(*effects, *faults, strict=True)]
    lines = [
        "  " + "  ".join(f"{cell:{w}}" for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in (*effects, *faults)
    ]
    return "\n".join(
        [
            "choose an effect, then give its size:",
            *lines[: len(effects)],
            "or a fault of the measuring chain:",
            *lines[len(effects) :],
        ]
    )
