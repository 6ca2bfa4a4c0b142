"""Damaged files of every format, and texts as units: no fault of pzd, nothing slower than 5 s, nothing above 1 GB.

    PYTHONPATH=.:tests/rig python tests/studies/fuzz.py --seconds 900

A small file of each format is written by the tests of the formats, and damaged: bytes changed, cut out, doubled, put
elsewhere, the file cut off. Each is given to `pzd init` and to the reading of a run. Whatever is not read has to be
refused in the words of a refusal. Every tenth trial is a text as a unit. It ends with status 1 where anything else
happened, and prints the seed by which it happens again.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
from test_formats import WRITERS
from written_files import CANONICAL, lines, run, write

from pzd.quantities import FORCE
from pzd.rig.files.child import end_child
from pzd.rig.files.guess import guessed
from pzd.rig.files.units import UnitError, constant, to_canonical
from pzd.schema.errors import UserError

SLOWEST = 5.0
"""Longest time that a file or unit may take beyond that of the whole file, read by a fresh child [s]."""
LARGEST = 1e9
"""Most memory that may be taken beyond that of the start [bytes]."""
_READERS = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
"""Files of text are read here, those of a library in a child."""
ALPHABET = "mNkg VsA/*^()[].,0123456789-+e\"'%\u00b0\u00b5 about the mean of first x10"
"""What a unit may be made of."""


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """A file with one to four damages."""
    found = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        if len(found) < 8:
            break
        first, length = int(rng.integers(len(found))), int(2 ** rng.uniform(0.0, 9.0))
        piece = bytes(found[first : first + length])
        match int(rng.integers(6)):
            case 0:  # most headers stand at the start
                first = int(rng.integers(min(len(found), 1024)))
                found[first] = int(rng.integers(256))
            case 1:
                found[first : first + length] = rng.integers(256, size=len(piece), dtype=np.uint8).tobytes()
            case 2:
                del found[first : first + length]
            case 3:
                found[first:first] = piece * int(rng.integers(1, 4))
            case 4:
                del found[first:]
            case _:
                other = int(rng.integers(len(found)))
                found[other : other + len(piece)] = piece
    return bytes(found)


def unit(rng: np.random.Generator) -> str:
    """A text as a unit."""
    return "".join(rng.choice(list(ALPHABET), int(rng.integers(1, 60))))


def tried(folder: Path, name: str, content: bytes, entry: dict[str, object]) -> str:
    """What happened to a file: read, refused, or the fault."""
    path = folder / name
    path.write_bytes(content)
    outcome = "read"
    for read in (lambda: guessed([path]), lambda: run(folder, {"path": name} | entry)):
        try:
            read()
        except UserError:
            outcome = "refused"
        except BaseException as error:  # noqa: BLE001  # pytest's own outcomes are none of Exception
            return f"{type(error).__name__}: {str(error)[:200]}"
    return outcome


def whole(folder: Path, name: str, content: bytes, entry: dict[str, object]) -> float:
    """How long an undamaged file takes a fresh child [s]."""
    end_child()
    at = time.monotonic()
    tried(folder, name, content, entry)
    return time.monotonic() - at


def main() -> int:
    """Try until the time is over, and print what happened."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=900.0)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    bad: list[str] = []
    counts: Counter[str] = Counter()
    begun, number = time.monotonic(), 0
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        originals = {"text": ("a.csv", write(folder / "a.csv", lines(CANONICAL)).read_bytes(), {})}
        for name, (file, written, entry) in WRITERS.items():
            written(folder / file)
            originals[name] = (file, (folder / file).read_bytes(), entry)
        usual = {"unit": 0.0} | {name: whole(folder, *original) for name, original in originals.items()}
        started = {who: resource.getrusage(who).ru_maxrss for who in _READERS}
        while time.monotonic() - begun < asked.seconds:
            rng = np.random.default_rng([asked.seed, number])
            name = list(originals)[number % len(originals)]
            at = time.monotonic()
            if number % 10 == 9:
                name, text = "unit", unit(rng)
                try:
                    to_canonical(np.ones(20), text, FORCE)
                    constant(f"1 {text}", FORCE)
                    outcome = "read"
                except UnitError:
                    outcome = "refused"
                except Exception as error:  # noqa: BLE001  # what is looked for
                    outcome = f"{type(error).__name__} of {text!r}"
            else:
                file, content, entry = originals[name]
                outcome = tried(folder, file, damaged(content, rng), entry)
            took = time.monotonic() - at
            if took > usual[name] + SLOWEST and name in originals:  # the machine may have become slow
                usual[name] = whole(folder, *originals[name])
            if outcome not in ("read", "refused") or took > usual[name] + SLOWEST:
                bad.append(f"seed {asked.seed}, trial {number}, {name}: {outcome}, {took:.1f} s")
            counts[outcome if outcome in ("read", "refused") else "fault"] += 1
            number += 1
    grown = 1024.0 * max(resource.getrusage(who).ru_maxrss - begun_with for who, begun_with in started.items())
    if grown > LARGEST:
        bad.append(f"memory grew by {grown / 1e9:.2f} GB")
    sys.stdout.write("\n".join([*bad, f"{number} trials: {dict(counts)}, memory grew by {grown / 1e6:.0f} MB", ""]))
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
