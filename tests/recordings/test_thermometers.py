"""A thermometer on the machine that models are fed with is checked as every other sensor."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.pairs import pair_findings
from discovery.recordings.compare.seen import Seen
from discovery.recordings.compare.temperatures import temperature_findings
from tests.recordings.conftest import CAMPAIGN, Write, found

Array = NDArray[np.float64]
BODY = CAMPAIGN.replace("[recordings]", 'body = { role = "other input", unit = "degC"%s }\n\n[recordings]')
WARM = 22.0 + 20.0 * (1.0 - np.exp(-np.arange(200) / 50.0)) + np.random.default_rng(1).normal(0.0, 0.05, 200)


def recorded(body: Array) -> list[str]:
    rows = [
        f"{60 * k},{20 + k % 7 / 10:.1f},{600 * (k // 50 % 2)},{'' if k % 2 else f'{k / 9 + k % 5 / 10:.2f}'}"
        for k in range(body.size)
    ]
    lines = [f"{row},{value:.2f}" for row, value in zip(rows, body, strict=True)]
    return ["time,T_env,speed,E_Y0C,body", *lines]


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda v: np.where(np.arange(v.size) > 99, v[99], v), "'body' stays at "),
        (lambda v: np.where(np.arange(v.size) % 40 == 7, 0.0, v), "'body' is 0, exactly zero between"),
        (lambda v: np.full(v.size, -180.0), "unusual for a temperature"),
        (lambda v: v - 300.0, "no temperature can be that"),
        (lambda v: np.where(np.isin(np.arange(v.size), [60, 61]), v + 400.0, v), "2 readings in a row"),
        (lambda v: v + 15.0 * (np.arange(v.size) > 150), "'body' jumps from "),
    ],
)
def test_a_faulty_thermometer(damage: Callable[[Array], Array], said: str, write: Write) -> None:
    path = write(recorded(damage(WARM.copy())), BODY % ', between = "linear"')
    assert any(said in one for one in found(path)), found(path)


def test_a_thermometer_without_a_reading_in_one_recording(write: Write) -> None:
    """`check` says so, and compares the other recordings without it."""
    rows, measured = recorded(WARM), BODY.replace("other input", "temperature") % ""
    path = write(rows, measured)
    files = {
        "empty": [rows[0], *(row.rsplit(",", 1)[0] + "," for row in rows[1:])],
        "cool": recorded(22.0 + 0.5 * (WARM - 22.0)),
        "hot": recorded(22.0 + 1.5 * (WARM - 22.0)),
    }
    with path.open("a") as campaign:
        for name, lines in files.items():
            (path.parent / f"{name}.csv").write_text("\n".join(lines) + "\n")
            campaign.write(f'{name} = {{ file = "{name}.csv" }}\n')
    told = found(path)
    assert any("empty.csv: 'body' has no readings" in one for one in told), told


def test_a_sound_thermometer_and_a_set_point(write: Write) -> None:
    assert found(write(recorded(WARM), BODY % ', between = "linear"')) == []
    held = np.where(np.arange(200) < 20, 22.0, 60.0)  # what a controller was told stands still
    assert found(write(recorded(held), BODY % "")) == []


def test_fahrenheit_is_checked_as_celsius(write: Write) -> None:
    fahrenheit = BODY.replace('degC"%s', 'degF"%s') % ', between = "linear"'
    assert found(write(recorded(32.0 + 1.8 * WARM), fahrenheit)) == []
    assert any("-180 degC" in one for one in found(write(recorded(np.full(200, -292.0)), fahrenheit)))


def test_a_body_that_warms_as_fast_as_it_cools_elsewhere_is_sound() -> None:
    time = np.linspace(0.0, 3980.0, 200)
    cools, warms = 30.0 + 12.0 * np.exp(-time / 200.0), 42.0 - 12.0 * np.exp(-time / 200.0)
    recordings = [
        Seen(name, Path(f"{name}.csv"), time, {"body": values}, np.arange(200))
        for name, values in (("a", cools), ("b", cools), ("c", warms))
    ]
    body = Channel("body", "other input", "degC", None, "linear")
    assert [one.kind for one in temperature_findings(recordings, {"body": body})] == []


@pytest.mark.parametrize(("reached", "said"), [(110.0, False), (180.0, True)])
def test_a_climb_is_a_fault_only_where_it_leads_to_where_a_body_never_is(reached: float, said: bool) -> None:
    """A lamp heated a plate from 41 to 110 degC; in the other recordings it stayed near 110 degC."""
    time = np.linspace(0.0, 240.0, 120)
    warms = 41.0 + (reached - 41.0) * (1.0 - np.exp(-time / 60.0)) / (1.0 - np.exp(-4.0))
    stays = 110.0 + 2.0 * np.sin(time / 30.0)
    recordings = [
        Seen(name, Path(f"{name}.csv"), time, {"plate": values}, np.arange(120))
        for name, values in (("a", stays), ("b", stays), ("c", warms))
    ]
    plate = Channel("plate", "temperature", "degC", None, "linear")
    found = [one for one in temperature_findings(recordings, {"plate": plate}) if one.kind == "climbs"]
    assert bool(found) == said
    assert all("within 3.9 min" in one.what for one in found)  # no longer than the recording


def test_a_body_that_warms_while_its_readings_are_missing_is_sound(write: Write) -> None:
    quick = WARM + 15.0 * (np.arange(WARM.size) > 150)
    lines = recorded(quick)
    for k in range(146, 157):  # rows without a reading around the step
        lines[k] = lines[k].rsplit(",", 1)[0] + ","
    assert not [one for one in found(write(lines, BODY % ', between = "linear"')) if "jumps from" in one]


@pytest.mark.parametrize("frozen", [True, False])
def test_a_thermometer_that_stands_still_while_its_sibling_goes_on_is_frozen(frozen: bool) -> None:
    """Two modules under one sun, read every 15 min; one keeps a reading for 6 h on the last day."""
    rng, hours = np.random.default_rng(5), np.arange(0.0, 24.0, 0.25)
    channels = {n: Channel(n, "temperature", "degC", None, "linear") for n in ("left", "right")}
    days = []
    for k, sun in enumerate((30.0, 20.0, 26.0)):
        warm = sun * np.maximum(0.0, np.sin(np.pi * (hours - 6) / 12)) + rng.normal(0.0, 1.0, hours.size)
        left, right = (5.0 + warm + rng.normal(0.0, 0.1, hours.size) for _ in range(2))
        if frozen and k == 2:
            left[28:53] = left[28]
        values = {"left": left, "right": right}
        days.append(Seen(f"day{k}", Path(f"day{k}.csv"), 3600.0 * hours, values, np.arange(hours.size)))
    found = [f for f in pair_findings(days, channels) if f.kind == "stuck"]
    assert [(f.file.name, f.channel) for f in found] == ([("day2.csv", "left")] if frozen else [])
