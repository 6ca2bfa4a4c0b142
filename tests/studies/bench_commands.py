"""How long a user waits: commands, many rig files, diagnose, a campaign of a sweep."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml
from bench_table import Row

from pzd.damper.element import element_force

ROOT = Path(__file__).resolve().parents[2]
STUDIES = ROOT / "tests" / "studies"
CONFIG = ROOT / "configs" / "quickstart.yaml"


class Done(NamedTuple):
    """A command that has ended."""

    wall: float
    """Seconds by the clock."""
    cpu: float
    """Seconds of processors, those of its own processes included."""
    said: str
    """What it printed."""
    peak_MB: float
    """Memory of the largest of its processes."""


def run(*arguments: object, folder: Path, module: str = "pzd", afresh: bool = False) -> Done:
    """Run a command to its end; it must exit 0.

    Parameters
    ----------
    arguments : of the command
    folder : in which it runs
    module : that is run; empty where the first argument is a script
    afresh : whether its kernels are those of the folder alone
    """
    command = [sys.executable, *(("-m", module) if module else ()), *map(str, arguments)]
    folder.mkdir(exist_ok=True)
    path = f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
    own = {"XDG_CACHE_HOME": str(folder / "cache")} if afresh else {}
    environment = {**os.environ, **own, "PYTHONPATH": path}
    with tempfile.TemporaryFile("w+") as printed:
        start = time.perf_counter()
        process = subprocess.Popen(command, env=environment, cwd=folder, stdout=printed, stderr=subprocess.STDOUT)
        _, status, used = os.wait4(process.pid, 0)
        wall, process.returncode = time.perf_counter() - start, os.waitstatus_to_exitcode(status)
        printed.seek(0)
        said = printed.read()
    if process.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: {said}")
    return Done(wall, used.ru_utime + used.ru_stime, said, used.ru_maxrss / 1024.0)


LARGEST = 3
"""Functions of a profile that are told."""
PROFILED = {
    "quickstart": ("run", CONFIG, "--force", "--jobs", 1),
    "a sweep of identifications": ("sweep", STUDIES / "campaign" / "identify.yaml", "--set", "sweep.draws=8"),
    "a ride": ("simulate", STUDIES / "campaign" / "rides.yaml", "--set", "simulate.duration_s=60", "--force"),
    "a diagnosis": ("diagnose", STUDIES / "speed" / "clean.yaml", "--force", "--jobs", 1),
}
"""Commands behind the figures that miss what is wanted, in one process."""


def profiles(folder: Path) -> Iterator[Row]:
    """Where the time of the longest waits goes: the functions of pzd that are most often found at work."""
    for name, arguments in PROFILED.items():
        run(*arguments, folder=folder)  # compiles
        again = ("--runs", "anew") if arguments[0] == "sweep" else ()
        done = run(STUDIES / "bench_profile.py", *arguments, *again, folder=folder, module="")
        found: list[tuple[str, float]] = json.loads(done.said.splitlines()[-1])
        for function, share in found[:LARGEST]:
            yield Row(f"  {name}: {function}", 100.0 * share, "%", about=f"of {done.cpu:.3g} CPU-s")


def waits(folder: Path) -> Iterator[Row]:
    """What a user types first."""

    def row(work: str, least: float, *arguments: object) -> Row:
        done = run(*arguments, folder=folder, afresh=True)
        return Row(work, done.wall, "s", least, at_least=False, about=f"{done.cpu:.3g} CPU-s")

    yield min((row("pzd --help, best of 5", 0.2, "--help") for _ in range(5)), key=lambda row: row.figure)
    yield row("quickstart, nothing compiled", 20.0, "run", CONFIG)
    yield row("quickstart again, all fresh", 0.6, "run", CONFIG)
    yield row("quickstart anew, compiled", 8.0, "run", CONFIG, "--runs", "anew")


FILES, ROWS = 1000, 10_000
PART = 4
"""A part of them, one in so many, tells how the time grows and what a second process is worth."""
IDENTIFY_MB = 220.0
MANY_MB = 500.0
RIG = """
rig:
  files:
    - {path: files/*.csv}
"""


def files(folder: Path) -> Iterator[Row]:
    """Rig CSVs to parameters.csv, their copies written."""
    place = folder / "many"
    (place / "files").mkdir(parents=True)
    rng = np.random.default_rng(22)
    t = np.arange(ROWS) * 1e-3
    header = "time_s,displacement_m,force_N,voltage_V"
    for number in range(FILES):
        voltage = 25.0 * (number % 5)
        x = (0.01 + 0.02 * rng.random()) * np.sin(2.0 * np.pi * (0.5 + 2.0 * rng.random()) * t)
        force = element_force(x, 1e-3, 300.0 + 5.0 * voltage, 2700.0, 2e5, 0.0)
        force += 5.0 * rng.standard_normal(ROWS)
        path = place / "files" / f"{'abbb'[number % PART]}{number:04d}.csv"
        columns = np.column_stack([t, x, force, np.full(ROWS, voltage)])
        np.savetxt(path, columns, fmt="%.7g", delimiter=",", header=header, comments="")
    for name, stems in (("few", "a00*"), ("part", "a*"), ("many", "*")):
        (place / f"{name}.yaml").write_text(RIG.replace("*", stems), encoding="utf-8")
    few = run("identify", place / "few.yaml", folder=place)  # compiles
    few = run("identify", place / "few.yaml", "--force", folder=place)
    part, part_by_two, two = (
        run("identify", place / f"{name}.yaml", "--force", "--runs", f"{name}-{jobs}", "--jobs", jobs, folder=place)
        for name, jobs in (("part", 1), ("part", 2), ("many", 2))
    )
    fitting = float(re.search(r"identify\s+done in ([\d.]+) s", two.said)[1])
    exponent = float(np.log(two.cpu / part_by_two.cpu) / np.log(PART))
    about = f"{two.cpu:.3g} CPU-s; growth of time with files: exponent {exponent:.2f}"
    yield Row("1,000 rig CSVs of 10^4 rows to parameters.csv", two.wall, "s", 15.0, at_least=False, about=about)
    yield Row("  of which the stage identify", fitting, "s", 2.0, at_least=False)
    yield Row(f"  {FILES // PART} of them, with two processes beside one", part.wall / part_by_two.wall, "x", 1.7)
    peaks = f"with {FILES // PART} files {part_by_two.peak_MB:.0f} MB"
    yield Row("  its largest process", two.peak_MB, "MB", MANY_MB, at_least=False, about=peaks)
    yield Row("  that of 25 files", few.peak_MB, "MB", IDENTIFY_MB, at_least=False)


CAMPAIGNS = {"clean": 4.0, "rich": 20.0, "switching": 30.0}
WHOLE = {"samples": 6000, "records": 22}
"""Sizes of the clean campaign as it stands, which are measured once."""
MEMORY_MB = 400.0


def diagnoses(folder: Path) -> Iterator[Row]:
    """Diagnose alone on the three campaigns of tests/studies/speed."""
    script = STUDIES / "bench_diagnose.py"
    folder.mkdir(exist_ok=True)

    def measured(name: str, *more: object) -> dict[str, object]:
        said = run(script, STUDIES / "speed" / f"{name}.yaml", *more, folder=folder, module="").said
        told: dict[str, object] = json.loads(next(line for line in said.splitlines() if line.startswith("{")))
        return told

    measured("clean", "--records", 4, "--samples", 2000)  # compiles
    whole = 0.0
    for name, target in CAMPAIGNS.items():
        told = measured(name)
        whole = float(told["cpu_seconds"]) if name == "clean" else whole
        about = f"{told['cpu_seconds']:.3g} CPU-s; {told['verdict']} {' '.join(told['effects'])}"
        yield Row(f"diagnose, {name}", told["seconds"], "s", target, at_least=False, about=about)
        yield Row("  peak memory", told["peak_memory_MB"], "MB", MEMORY_MB, at_least=False,
                  about=f"{told['memory_before_MB']:.0f} MB before it began")  # fmt: skip
    for what, parts in (("samples", (1500, 3000)), ("records", (6, 11))):
        times = [*(float(measured("clean", f"--{what}", size)["cpu_seconds"]) for size in parts), whole]
        sizes = (*parts, WHOLE[what])
        exponent = float(np.polyfit(np.log(sizes), np.log(times), 1)[0])
        about = ", ".join(f"{size}: {spent:.3g} CPU-s" for size, spent in zip(sizes, times, strict=True))
        yield Row(f"  growth with {what}, clean, exponent", exponent, "", 1.1, at_least=False, about=about)


HOUR_S, HOUR_RIDES, HOUR_TARGET_S = 3600.0, 20, 240.0
ROADS = 2
"""Of the shorter rides, so that both processes have work."""
PARTS_S = (300.0, 900.0)
"""Lengths of the rides from which those of an hour are told."""


def road_hour(folder: Path) -> Iterator[Row]:
    """Twenty rides of an hour with two processes, told from two shorter ones on two roads."""
    config = yaml.safe_load((STUDIES / "campaign" / "rides.yaml").read_text(encoding="utf-8"))
    (road,) = config["simulate"]["roads"]
    config["simulate"]["roads"] = [{**road, "seed": seed, "label": f"road{seed}"} for seed in range(1, ROADS + 1)]
    folder.mkdir(exist_ok=True)
    rides = folder / "rides.yaml"
    rides.write_text(yaml.safe_dump(config), encoding="utf-8")

    def ridden(seconds: float) -> Done:
        long = ("--set", f"simulate.duration_s={seconds}")
        return run("simulate", rides, *long, "--force", "--jobs", 2, folder=folder)

    ridden(PARTS_S[0] / 10.0)  # compiles
    few, many = (ridden(seconds) for seconds in PARTS_S)
    each = (many.wall - few.wall) / (PARTS_S[1] - PARTS_S[0]) / ROADS
    whole = many.wall + each * (HOUR_RIDES * HOUR_S - ROADS * PARTS_S[1])
    exponent = float(np.log(many.cpu / few.cpu) / np.log(PARTS_S[1] / PARTS_S[0]))
    about = f"{1e3 * each:.3g} us a ms of a ride; growth with its length: exponent {exponent:.2f}"
    yield Row(f"one hour of road, {HOUR_RIDES} rides", whole, "s", HOUR_TARGET_S, at_least=False, about=about)
    yield Row("  peak memory, 15 minutes", many.peak_MB, "MB", about=f"5 minutes: {few.peak_MB:.0f} MB")


CAMPAIGN = {"identify": (2048, 128, "runs of 5 identifications"), "rides": (2048, 32, "rides of 60 s")}
"""How many runs there are, how many are done, after half of them to see that the time of a run is constant."""
WHOLE_S = 300.0
MOST_MB = 2000.0


def campaign(folder: Path) -> Iterator[Row]:
    """10,240 identifications and 2048 rides of one minute, told from a part of them."""
    whole, peak = 0.0, 0.0
    for name, (count, draws, what) in CAMPAIGN.items():
        config = STUDIES / "campaign" / f"{name}.yaml"
        run("sweep", config, "--set", "sweep.draws=2", folder=folder)  # compiles
        spent = []
        for some in (draws // 2, draws):
            place = ("--runs", f"runs-{some}")
            run("sweep", config, *place, "--set", "sweep.draws=2", folder=folder)  # makes what all runs share
            spent.append(run("sweep", config, *place, "--set", f"sweep.draws={some}", "--jobs", 2, folder=folder))
        half, full = spent
        each, each_cpu = (2.0 * (total - part) / draws for total, part in zip(full[:2], half[:2], strict=True))
        start = half.cpu - 0.5 * draws * each_cpu
        took = full.wall + each * (count - draws)
        whole += took
        peak = max(peak, full.peak_MB)
        about = f"{each_cpu:.3g} CPU-s a run, {start:.2g} CPU-s once; {count} in {took:.0f} s"
        yield Row(f"campaign, {draws} {what}", full.wall, "s", about=about)
    yield Row("campaign of 10,240 identifications and 2048 rides", whole, "s", WHOLE_S, at_least=False)
    yield Row("  parent and two workers, as if each were the largest", 3.0 * peak, "MB", MOST_MB, at_least=False)
