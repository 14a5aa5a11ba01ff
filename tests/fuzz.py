"""Files changed at random: what is wrong with them is said, without a traceback, a hang or much memory.

    python -m tests.fuzz --seconds 300 --seed 1

prints how many inputs of each kind were tried, the longest time and the largest memory. An input that raised
something else than UserError or took longer than a second is kept in build/fuzz.
"""

from __future__ import annotations

import argparse
import gzip
import hashlib
import io
import json
import random
import resource
import shlex
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.tables import keep
from discovery.errors import UsageError, UserError

if TYPE_CHECKING:
    from discovery.export.document import Exported
    from discovery.runtime.guards import Reading

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "build" / "fuzz"
MOST_SECONDS, MOST_MEGABYTES = 1.0, 500
WORDS = (
    *(b"nan", b"inf", b"-inf", b"1e400", b"-", b"", b",", b";", b"\t", b'"', b"'", b"\n", b"\r", b"\0"),
    *(b"[", b"]]", b"{", b"}", b"=", b"#", b"[[terms]]", b"name = ", b"time", b"1" * 400, b"9" * 30),
    *(b"0x1", b"2026-02-30", b"24:61:61", b"\xff\xfe", b"\xef\xbb\xbf", b"\x82\xb5", b"degF", b"T_env**9999"),
    *(b"exp(exp(exp(T)))", b"../../etc/passwd", b"1_000", b"true", b"null", b"1.2.3", b"-999", b"3.4e38"),
    *(b"2.5 um", b"[x10 mV]", b"1/10 degC", b"1e999 um", b"10^99 W", b"2026-03-29 01:59:30", b"Nm"),
)


def changed(data: bytes, rng: random.Random) -> bytes:
    """A few cuts, repeats, flipped bits, swapped lines and odd words."""
    found = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        if not found:
            break
        a = rng.randrange(len(found))
        b = min(len(found), a + rng.choice((1, 2, 5, 20, 200)))
        match rng.randrange(7):
            case 0:
                found[a] ^= 1 << rng.randrange(8)
            case 1:
                del found[a:b]
            case 2:
                found[a:b] = rng.choice(WORDS)
            case 3:
                found[a:a] = rng.choice(WORDS)
            case 4:
                found[a:a] = found[a:b] * rng.choice((1, 2, 10))
            case 5:
                del found[a:]
            case 6:
                lines = bytes(found).split(b"\n")
                i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
                lines[i], lines[j] = lines[j], lines[i]
                found = bytearray(b"\n".join(lines))
    return bytes(found)


TABLE = b"time,T_env,speed,P [kW],pump,E_Y0C\n" + b"".join(
    b"%d,%.2f,%d,%.2f,%s,%s\n"
    % (60 * k, 20 + k % 7 / 10, 600 * (k // 20 % 2), k % 9 / 10, b"ON" if k % 30 < 9 else b"OFF",
       b"" if k % 2 else b"%.2f" % (k / 9))
    for k in range(60)
)  # fmt: skip
CAMPAIGN = b"""name = "fuzz"
[channels]
T_env = { role = "ambient temperature", unit = "degC" }
speed = { role = "rotation speed", unit = "rpm" }
E_Y0C = { role = "error", unit = "um", noise = 0.5 }
[recordings]
fit = { file = "fit.csv", set = { T_env = 21.0 } }
"""
MODEL = b"""name = "one body"
[parameters]
decay = { start = 1e-4, unit = "1/s", min = 1e-6 }
gain = { start = 0.0, unit = "um/rpm/s" }
[states]
E_Y0C = { unit = "um" }
[[terms]]
name = "decay"
into = "E_Y0C"
expression = "-decay*E_Y0C"
[[terms]]
name = "speed"
into = "E_Y0C"
expression = "gain*speed"
"""
EXPERIMENT = b"""name = "fuzz"
campaign = "campaign.toml"
outputs = ["E_Y0C"]
fit = ["fit"]
held_out = []
[models]
one = { file = "model.toml" }
"""
LONG = b"device,timestamp,quantity,value,unit\n" + b"".join(
    b"%s,2026-03-01T08:%02d:00,%s,%.2f,%s\n" % (b"A", k, q, 20 + k / 9, u)
    for k in range(40)
    for q, u in ((b"temperature", b"degC"), (b"power", b"W"))
)
GERMAN = b"Zeit;Temp. [\xb0C];Drehzahl [1/min];Verlagerung Z [\xb5m]\n" + b"".join(
    b"%02d.03.2026 08:%02d:00;%d,5;%d;%d,25\n" % (1 + k // 40, k % 40, 20 + k % 9, 100 * (k % 7), k % 11)
    for k in range(60)
)


def _parquet() -> bytes:
    import pandas as pd

    frame = pd.read_csv(io.BytesIO(TABLE))
    out = io.BytesIO()
    frame.to_parquet(out)
    return out.getvalue()


def _workbook() -> bytes:
    import pandas as pd

    out = io.BytesIO()
    pd.read_csv(io.BytesIO(TABLE)).to_excel(out, index=False)
    return out.getvalue()


def _results() -> bytes:
    return json.dumps(
        {"experiment": "x", "fit": ["fit"], "held_out": [], "models": {"one": {"a": 1.5}}}
    ).encode()


@cache
def _exported() -> Exported:
    """The model of this page, fitted to its table and exported."""
    from discovery.export.document import from_document, render
    from discovery.export.makedocument import make_document
    from discovery.export.seal import open_seal
    from discovery.fitting import fit_model
    from discovery.models import read_model
    from discovery.recordings import load_campaign

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, data in (("fit.csv", TABLE), ("campaign.toml", CAMPAIGN), ("model.toml", MODEL)):
            (folder / file).write_bytes(data)
        campaign = load_campaign(folder)
        found = fit_model(read_model(folder / "model.toml"), campaign, ["fit"]).model
        data = render(make_document(found, campaign, ["fit"]))
    return from_document(*open_seal(data, "fuzz"), "fuzz")


def _document() -> bytes:
    return json.dumps(_exported().document, indent=1).encode()


def _readings(now: float) -> dict[str, Reading]:
    from discovery.runtime.guards import Reading

    return {i.name: Reading(i.range.low, now) for i in _exported().inputs}


def _state() -> bytes:
    from discovery.runtime.compensator import Compensator
    from discovery.runtime.persistence import NAMES, save

    at_work = Compensator(_exported())
    for k in range(9):
        at_work.tick(_readings(60.0 * k), 60.0 * k)
    with tempfile.TemporaryDirectory() as name:
        save(at_work, Path(name))
        body: str = json.loads((Path(name) / NAMES[0]).read_bytes())["body"]
    return body.encode()


def _learning() -> bytes:
    from discovery.runtime.compensator import Compensator
    from discovery.runtime.guards import Reading
    from discovery.runtime.learning import Learner

    learner, at_work = Learner(None), Compensator(_exported())
    for k in range(2000):
        at_work.tick(_readings(60.0 * k), 60.0 * k)
        learner.observe(at_work, _readings(60.0 * k) | {"E_Y0C": Reading(0.1, 60.0 * k)}, 60.0 * k)
    return learner.kept(at_work)


def read_own(path: Path) -> None:
    """What `discovery new` does with a table before it fits."""
    from discovery.firsthour.recorded import recorded
    from discovery.firsthour.table import read_tables

    recorded(read_tables(path), None)


def check(path: Path) -> None:
    from discovery.recordings.check import check_campaign

    check_campaign(path.parent)


def model(path: Path) -> None:
    from discovery.models import read_model

    read_model(path)


def experiment(path: Path) -> None:
    from discovery.experiment import load_experiment

    load_experiment(path)


def document(path: Path) -> None:
    """An exported model of which somebody renewed the seal, since an old seal refuses every change."""
    from discovery.export.document import read_document
    from discovery.export.seal import seal_bytes

    path.write_bytes(seal_bytes(path.read_bytes()))
    read_document(path)


def state(path: Path) -> None:
    """A saved state, its checksum renewed: what does not fit is left aside."""
    from discovery.runtime.compensator import Compensator
    from discovery.runtime.persistence import peek, restore

    body = path.read_text("utf-8", errors="replace")
    said = {"sha256": hashlib.sha256(body.encode()).hexdigest(), "body": body}
    path.write_text(json.dumps(said), "utf-8")
    compensator = Compensator(_exported())
    if peek(compensator, path.parent) is None or restore(compensator, path.parent) is None:
        raise UserError("left aside")


def learning(path: Path) -> None:
    from discovery.runtime.compensator import Compensator
    from discovery.runtime.learning import Learner

    learner = Learner(None)
    learner.load(Compensator(_exported()), path.parent)
    if not learner.seen.times:
        raise UserError("left aside")
    learner.seen.campaign(_exported())


def results(path: Path) -> None:
    from discovery.runfolder import read_results

    read_results(path.parent)


Kind = tuple[str, Callable[[], bytes], Callable[[Path], None]]
KINDS: dict[str, Kind] = {
    "csv of one's own": ("own.csv", lambda: TABLE, read_own),
    "csv in latin-1": ("zeit.csv", lambda: GERMAN, read_own),
    "long csv": ("long.csv", lambda: LONG, read_own),
    "gzip of one's own": ("own.csv.gz", lambda: gzip.compress(TABLE), read_own),
    "workbook": ("own.xlsx", _workbook, read_own),
    "parquet of one's own": ("own.parquet", _parquet, read_own),
    "recording csv": ("fit.csv", lambda: TABLE, check),
    "campaign": ("campaign.toml", lambda: CAMPAIGN, check),
    "model": ("model.toml", lambda: MODEL, model),
    "experiment": ("experiment.toml", lambda: EXPERIMENT, experiment),
    "results": ("results.json", _results, results),
    "exported model": ("model.json", _document, document),
    "saved state": ("state.json", _state, state),
    "what was learnt": ("learning.json", _learning, learning),
}
DEARER = {"workbook": 20, "parquet of one's own": 5, "recording csv": 5}  # tried so much less often


def main() -> int:
    """Fuzz for so long; status 1 where anything went wrong."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--seconds", type=float, default=60.0)
    asked.add_argument("--inputs", type=int, default=10**9)
    asked.add_argument("--seed", type=int, default=1)
    asked.add_argument("--kind", action="append", choices=list(KINDS))
    asked.add_argument("--store", action="store_true", help="keep the figures for benchmarks/fuzzing.md")
    given = asked.parse_args()
    rng = random.Random(given.seed)
    kinds = given.kind or list(KINDS)
    weights = [1 / DEARER.get(kind, 1) for kind in kinds]
    sound = {kind: KINDS[kind][1]() for kind in kinds}
    counts: Counter[str] = Counter()
    read: Counter[str] = Counter()
    wrong, slowest = 0, dict.fromkeys(kinds, 0.0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, data in (("fit.csv", TABLE), ("campaign.toml", CAMPAIGN), ("model.toml", MODEL)):
            (folder / file).write_bytes(data)
        for kind in kinds:  # imports and compiling are no part of an input
            _try(folder, kind, sound[kind])
        end = time.monotonic() + given.seconds
        while time.monotonic() < end and counts.total() < given.inputs:
            kind = rng.choices(kinds, weights)[0]
            data = changed(sound[kind], rng)
            took, said = _try(folder, kind, data)
            counts[kind] += 1
            read[kind] += said == ""
            slowest[kind] = max(slowest[kind], took)
            if took > MOST_SECONDS:
                said = said or f"took {took:.1f} s of computing"
            if took > MOST_SECONDS or "\n" in said:
                wrong += 1
                _keep(kind, data, said, counts.total())
    rows = [(kind, counts[kind], read[kind], f"{slowest[kind]:.2f}") for kind in kinds]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    after = f"{counts.total()} inputs, seed {given.seed}: {wrong} wrong; memory at most {memory:.0f} MB."
    for row in rows:
        print(*row, sep=" | ")
    print(after)
    if given.store:
        head = ("kind", "inputs", "read as sound", "longest, s")
        keep("fuzzing", f"python -W ignore -m tests.fuzz {shlex.join(sys.argv[1:])}", head, rows, after)
    return int(wrong > 0 or memory > MOST_MEGABYTES)


def _try(folder: Path, kind: str, data: bytes) -> tuple[float, str]:
    """Seconds of computing, and what was said: "" for nothing, a line of UserError, lines of a traceback."""
    name, _, work = KINDS[kind]
    path, sound = folder / name, folder / f"{name}.sound"
    if path.exists():
        shutil.copy(path, sound)
    path.write_bytes(data)
    began = time.process_time()
    try:
        work(path)
        said = ""
    except (UserError, UsageError) as error:
        said = str(error).partition("\n")[0] or "nothing was said"
    except Exception:
        said = traceback.format_exc()
    took = time.process_time() - began
    path.unlink()
    if sound.exists():
        sound.replace(path)
    return took, said


def _keep(kind: str, data: bytes, said: str, number: int) -> None:
    KEPT.mkdir(parents=True, exist_ok=True)
    stem = f"{number:07d}_{kind.replace(' ', '_')}"
    (KEPT / f"{stem}_{KINDS[kind][0]}").write_bytes(data)
    (KEPT / f"{stem}.txt").write_text(said, "utf-8")
    print(f"{kind}: {said.strip().splitlines()[-1]}", file=sys.stderr)


if __name__ == "__main__":
    raise SystemExit(main())
