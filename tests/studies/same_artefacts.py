"""Whether two checkouts of pzd make the same artefacts from every config and from the first blind cases.

    python tests/studies/same_artefacts.py BEFORE AFTER                    byte for byte
    python tests/studies/same_artefacts.py BEFORE AFTER --relative 1e-6    numbers within 1e-6 of their size
    python tests/studies/same_artefacts.py BEFORE                          only make BEFORE's artefacts

    --only quickstart,paper   these configs alone; the default is every config that BEFORE has
    --blind 60                so many cases of configs/blind.yaml; 0 leaves them out
    --jobs 2                  processes that pzd may use
    --results DIR             where artefacts are kept, runs/same_artefacts of BEFORE by default

BEFORE and AFTER are folders; `git worktree add ../before COMMIT` makes one. Each config of each checkout goes through
`pzd run`; configs/paper.yaml through `pzd figures` and configs/blind.yaml through `pzd blind` as well. What was made
is kept by the content of pzd/ and configs/, so that the second comparison with the same BEFORE makes AFTER's alone.
Configs whose measured records are not there are skipped, and the output says so. Configs that AFTER has in addition
are not looked at.

Manifests and hidden files are left out, since they hold times, paths and hashes of the code; so are the entries in
UNREPEATABLE. Everything else is compared: byte for byte, or with --relative texts exactly and numbers within the
share given, in which case HTML, SVG and PNG that differ are listed but do not count. Verdicts, effects and statuses
that differ are printed in either case. Exits with 1 where anything differs, is missing or is new, or where a command
exits with something other than 0 and 4 (a result that is marked as not to be trusted).
"""

from __future__ import annotations

import argparse
import csv
import glob
import hashlib
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from itertools import zip_longest
from pathlib import Path
from typing import Any

import yaml

DRAWN_FROM = "paper"
"""The config that `pzd figures` is run on as well."""
HIDDEN_IN = "blind"
"""The config that `pzd blind` is run on as well."""
FINE = (0, 4)
"""Exit codes of pzd that come with a whole result."""
MANIFEST = "manifest.json"
PICTURES = (".html", ".svg", ".png")
"""What holds numbers only as text or pixels, so that no tolerance can be applied."""
UNREPEATABLE = ("seconds", "diagnose_seconds", "peak_memory_MB", "made_from")
"""Entries of a blind case's cost and score that no two runs share: time, memory, and the hash of config and code."""
DECISIVE = ("verdict", "effects", "rivals", "status", "met")
"""Entries and columns whose change is printed whatever the mode: what a reader acts on."""
ABSENT = "absent"
"""Printed where only one of two files has a value."""
SHOWN = 10
"""Differing files, and differing decisions, that are printed for each config; the rest is counted."""


@dataclass(frozen=True)
class Step:
    """One command of pzd that was run."""

    command: str
    exit: int
    seconds: float


@dataclass(frozen=True)
class Made:
    """What a checkout made of one config."""

    folder: Path
    steps: tuple[Step, ...]

    @property
    def seconds(self) -> float:
        """How long all commands took."""
        return sum(step.seconds for step in self.steps)

    def files(self) -> dict[str, Path]:
        """Every file that is compared, by its path below the folder."""
        found = ((path.relative_to(self.folder), path) for path in sorted(self.folder.rglob("*")) if path.is_file())
        return {
            short.as_posix(): path
            for short, path in found
            if path.name != MANIFEST and not any(part.startswith(".") for part in short.parts)
        }


@dataclass
class Outcome:
    """How the artefacts of one config compare."""

    files: int = 0
    equal: int = 0
    close: int = 0
    """Not the same bytes, but every number within the tolerance."""
    differing: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    new: list[str] = field(default_factory=list)
    pictures: list[str] = field(default_factory=list)
    """Not the same bytes, in a format that a tolerance cannot be applied to."""
    decisions: list[str] = field(default_factory=list)

    @property
    def same(self) -> bool:
        """Whether nothing counts against the change."""
        return not (self.differing or self.missing or self.new)

    def lines(self) -> Iterator[str]:
        """What is printed below the counts."""
        labelled = {
            "decided otherwise": self.decisions,
            "differs": self.differing,
            "missing": self.missing,
            "new": self.new,
            "picture differs": self.pictures,
        }
        for label, entries in labelled.items():
            yield from (f"    {label}: {entry}" for entry in entries[:SHOWN])
            if len(entries) > SHOWN:
                yield f"    {label}: {len(entries) - SHOWN} more"


# -------------------------------------------------------------------------------------------- making


def content_key(checkout: Path) -> str:
    """Hash of the code and configs of a checkout as they lie on the disk, and of the libraries that compute."""
    digest = hashlib.sha256(" ".join(version(name) for name in ("numpy", "scipy", "numba", "matplotlib")).encode())
    for folder in ("pzd", "configs"):
        for path in sorted((checkout / folder).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                digest.update(f"{path.relative_to(checkout).as_posix()}\0".encode())
                digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:12]


def absent_records(config: Path) -> str | None:
    """The first pattern of `rig.files` that no file matches; None where all records are there."""
    rig = yaml.safe_load(config.read_text(encoding="utf-8")).get("rig") or {}
    patterns = (entry["path"] for entry in rig.get("files") or ())
    return next((p for p in patterns if not glob.glob(str(config.parent / p), recursive=True)), None)  # noqa: PTH207  # a Path's glob takes no pattern with ..


def commands(stem: str, cases: int) -> Iterator[tuple[str, ...]]:
    """Arguments of pzd, one tuple a command, for one config."""
    config = f"configs/{stem}.yaml"
    yield ("run", config)
    if stem == DRAWN_FROM:
        yield ("figures", config)
    if stem == HIDDEN_IN and cases:
        yield ("blind", config, "--set", f"blind.cases={cases}")


def make(checkout: Path, results: Path, stem: str, cases: int, jobs: int) -> Made:
    """The artefacts of one config, made now unless `results` holds them complete and without a fault.

    Parameters
    ----------
    checkout : folder that pzd is run in and imported from
    results : folder for this checkout's content
    stem : name of the config without its ending
    cases : blind cases
    jobs : processes that pzd may use
    """
    name = f"{stem}-{cases}-cases" if stem == HIDDEN_IN else stem
    folder, record = results / name, results / f"{name}.json"
    if record.exists():
        return Made(folder, tuple(Step(**step) for step in json.loads(record.read_text(encoding="utf-8"))))
    folder.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    steps = []
    with (results / f"{name}.log").open("w", encoding="utf-8") as log:
        for arguments in commands(stem, cases):
            whole = [sys.executable, "-m", "pzd", *arguments, "--runs", str(folder), "--jobs", str(jobs)]
            begun = time.perf_counter()
            done = subprocess.run(
                whole, cwd=checkout, env=environment, stdout=log, stderr=subprocess.STDOUT, check=False
            )
            steps.append(Step(" ".join(arguments), done.returncode, round(time.perf_counter() - begun, 1)))
    if all(step.exit in FINE for step in steps):
        record.write_text(json.dumps([asdict(step) for step in steps], indent=2) + "\n", encoding="utf-8")
    return Made(folder, tuple(steps))


# ----------------------------------------------------------------------------------------- comparing


def unrepeatable(path: Path) -> bool:
    """Whether a file is a blind case's cost or score, which hold seconds and megabytes."""
    return path.name == "cost.json" or (path.parent.name == "scored" and path.suffix == ".json")


def content(path: Path) -> bytes:
    """A file's bytes, without the lines that no two runs share."""
    whole = path.read_bytes()
    if not unrepeatable(path):
        return whole
    return re.sub(rb'(?m)^ *"(' + "|".join(UNREPEATABLE).encode() + rb')":.*\n', b"", whole)


def first_difference(before: bytes, after: bytes) -> str:
    """Number of the first line that differs, and both versions of it from a little before where they part."""
    if b"\0" in before or b"\0" in after:
        return f"{len(before)} and {len(after)} bytes"
    texts = (whole.decode(errors="replace").splitlines() for whole in (before, after))
    for number, (old, new) in enumerate(zip_longest(*texts, fillvalue=""), 1):
        if old != new:
            alike = next((i for i, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), 0)
            shown = slice(max(0, alike - 40), alike + 50)
            return f"line {number}: {old[shown]!r} -> {new[shown]!r}"
    return "line ends"


def entries(node: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Every value of a JSON or YAML document by its place in it; a list of names counts as one value."""
    if isinstance(node, dict) and node:
        for key, value in node.items():
            yield from entries(value, f"{place}.{key}" if place else str(key))
    elif isinstance(node, list) and not all(isinstance(item, str) for item in node):
        for index, value in enumerate(node):
            yield from entries(value, f"{place}[{index}]")
    else:
        yield place, node


def cells(path: Path) -> tuple[dict[str, Any], dict[str, float]]:
    """The values of a table by row and column, and the peak of each column of a record over time.

    A signal over time passes through zero, so that its peak is what a difference is measured by; elsewhere a
    number is measured by itself, and no peak is given.
    """
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = [*csv.reader(file)] or [[]]
    found = {
        f"row {number}, {column}": number_or_text(cell)
        for number, row in enumerate(rows, 2)
        for column, cell in zip_longest(header, row, fillvalue="")
    }
    peaks: dict[str, float] = {}
    if header[:1] == ["time_s"]:
        for place, value in found.items():
            if isinstance(value, float):
                column = place.partition(", ")[2]
                peaks[column] = max(peaks.get(column, 0.0), abs(value))
    return found, peaks


def number_or_text(cell: str) -> float | str:
    """A cell as a number, where it is one."""
    try:
        return float(cell)
    except ValueError:
        return cell


def values(path: Path) -> tuple[dict[str, Any], dict[str, float]] | None:
    """The values of a CSV, JSON or YAML file by place, and peaks as `cells` gives them; None for other formats."""
    if path.suffix == ".csv":
        return cells(path)
    if path.suffix not in {".json", ".yaml"}:
        return None
    text = path.read_text(encoding="utf-8")
    found = dict(entries(json.loads(text) if path.suffix == ".json" else yaml.safe_load(text)))
    if unrepeatable(path):
        found = {place: value for place, value in found.items() if place not in UNREPEATABLE}
    return found, {}


def apart(before: Any, after: Any, peak: float = 0.0) -> float:
    """How far two values are apart: numbers as a share of the larger one or of the peak, else 0 or infinity."""
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (before, after))
    if before == after or (numbers and before != before and after != after):  # noqa: PLR0124  # nan is what differs from itself
        return 0.0
    if not numbers:
        return float("inf")
    share = abs(before - after) / max(abs(before), abs(after), peak)
    return share if share == share else float("inf")  # noqa: PLR0124  # as above


def decisions(old: dict[str, Any], new: dict[str, Any]) -> Iterator[str]:
    """Places of verdicts, effects and statuses that differ, with both values."""
    for place in old | new:
        words = re.split(r"[.,\[\] ]+", place)
        before, after = old.get(place, ABSENT), new.get(place, ABSENT)
        if apart(before, after) == float("inf") and any(word in DECISIVE for word in words):
            yield f"{place}: {before!r} -> {after!r}"


def furthest(
    old: tuple[dict[str, Any], dict[str, float]], new: tuple[dict[str, Any], dict[str, float]], relative: float
) -> str | None:
    """How many values of two files are further apart than `relative`, and which the most; None where none is."""
    (before, peaks), (after, _) = old, new
    shares = {
        place: apart(before.get(place, ABSENT), after.get(place, ABSENT), peaks.get(place.partition(", ")[2], 0.0))
        for place in before | after
    }
    far = [place for place, share in shares.items() if share > relative]
    if not far:
        return None
    worst = max(far, key=lambda place: shares[place])
    values_there = f"{before.get(worst, ABSENT)!r} -> {after.get(worst, ABSENT)!r}"
    return f"{len(far)} of {len(shares)} values, furthest {worst}: {values_there} ({shares[worst]:.1e})"


def compare(before: Made, after: Made, relative: float | None) -> Outcome:
    """How the artefacts of one config compare, byte for byte where `relative` is None."""
    old, new = before.files(), after.files()
    outcome = Outcome(len(old), missing=sorted(old.keys() - new.keys()), new=sorted(new.keys() - old.keys()))
    for name in sorted(old.keys() & new.keys()):
        bytes_before, bytes_after = content(old[name]), content(new[name])
        if bytes_before == bytes_after:
            outcome.equal += 1
            continue
        line = f"{name}, {first_difference(bytes_before, bytes_after)}"
        values_before, values_after = values(old[name]), values(new[name])
        if values_before is not None and values_after is not None:
            outcome.decisions += (f"{name}, {text}" for text in decisions(values_before[0], values_after[0]))
            far = None if relative is None else furthest(values_before, values_after, relative)
            if relative is not None and far is None:
                outcome.close += 1
            else:
                outcome.differing.append(line if far is None else f"{name}, {far}")
        elif relative is not None and old[name].suffix in PICTURES:
            outcome.pictures.append(line)
        else:
            outcome.differing.append(line)
    return outcome


# ------------------------------------------------------------------------------------------ printing


def say(text: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def unavailable(stem: str, checkouts: Iterable[Path]) -> tuple[str, bool] | None:
    """Why a config cannot be compared, and whether that is a fault of the checkouts; None where it can be."""
    configs = [checkout / "configs" / f"{stem}.yaml" for checkout in checkouts]
    for config in configs:
        if not config.exists():
            return f"MISSING: there is no {config}", True
    for config in configs:
        if pattern := absent_records(config):
            return f"skipped: no file matches {pattern} beside {config}", False
    return None


def report(made: dict[str, Made], relative: float | None) -> tuple[list[str], bool]:
    """What is printed about one config, and whether all is well with it.

    Parameters
    ----------
    made : by side; without an `after` only the exit codes are judged
    relative : as for `compare`
    """
    took = ", ".join(f"{side} {one.seconds:.0f} s" for side, one in made.items())
    faults = [
        f"    {side}: pzd {step.command} exits with {step.exit}"
        for side, one in made.items()
        for step in one.steps
        if step.exit not in FINE
    ]
    if "after" not in made:
        return [f"{len(made['before'].files())} files   ({took})", *faults], not faults
    outcome = compare(made["before"], made["after"], relative)
    close = "" if relative is None else f"{outcome.close} within {relative:g}, "
    counts = f"{len(outcome.differing)} differing, {len(outcome.missing)} missing, {len(outcome.new)} new"
    first = f"{outcome.files} files: {outcome.equal} equal, {close}{counts}   ({took})"
    return [first, *faults, *outcome.lines()], outcome.same and not faults


def arguments() -> argparse.Namespace:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path, nargs="?")
    parser.add_argument("--only", type=lambda text: text.split(","), metavar="NAME,...")
    parser.add_argument("--blind", type=int, default=60, metavar="CASES")
    parser.add_argument("--relative", type=float, metavar="SHARE")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--results", type=Path, metavar="DIR")
    given = parser.parse_args()
    known = [path.stem for path in sorted((given.before / "configs").glob("*.yaml"))]
    unknown = sorted(set(given.only or ()) - set(known))
    if not known or unknown:
        parser.error(f"{given.before}/configs has no {', '.join(unknown) or 'config'}; it has: {', '.join(known)}")
    given.only = given.only or known
    return given


def main() -> int:
    """Make what is not there yet, compare, print."""
    given = arguments()
    results = (given.results or given.before / "runs" / "same_artefacts").resolve()
    sides = {"before": given.before.resolve()}
    if given.after:
        sides["after"] = given.after.resolve()
    folders = {side: results / side / content_key(checkout) for side, checkout in sides.items()}
    for side, checkout in sides.items():
        say(f"{side}: {checkout}, artefacts in {folders[side]}")
    good = True
    for stem in given.only:
        if reason := unavailable(stem, sides.values()):
            lines, well = [reason[0]], not reason[1]
        else:
            made = {side: make(sides[side], folders[side], stem, given.blind, given.jobs) for side in sides}
            lines, well = report(made, given.relative)
        good = good and well
        say("\n".join([f"{stem:<12}{lines[0]}", *lines[1:]]))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
