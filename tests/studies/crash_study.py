"""Runs killed at instants of their course (SIGKILL, with all their processes), and finished by the same command.

    python tests/studies/crash_study.py --kills 100

A small config is run once undisturbed; its files are the reference. Then, each time in a new folder, it is killed at an
instant drawn over the length of the run. Whatever has its final name then must be whole, byte for byte that of the
reference; the same command, given again, must end as the undisturbed one did and leave the same files and none beside.
Manifests hold times: they must read as JSON. It ends with status 1 where anything else happens.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import numpy as np

CONFIG = """
rig:
  virtual:
    - damper:
        base: [{voltage_V: 0, T0_N: 301, C_Ns_per_m: 2720, k_N_per_m: 199000}]
        effects: {orifice_quadratic: {q: 6000}}
      voltages_V: [0]
      rate_Hz: 250
      tests:
        - {waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.02}, duration_s: 4}
        - {waveform: {kind: sine, frequency_Hz: 2, amplitude_m: 0.02}, duration_s: 4}
      noise: {force: {share_of_peak: 0.005}}
identify: {law: bingham}
diagnose: {most_effects: 1}
simulate: {policies: [passive], duration_s: 2, settle_s: 0.5}
"""
MANIFEST = "manifest.json"


def command(config: Path, runs: Path) -> list[str]:
    """The command that is killed."""
    return [sys.executable, "-m", "pzd", "run", str(config), "--runs", str(runs), "--quiet"]


def files(runs: Path) -> dict[str, bytes]:
    """Every file of a run that is no manifest, lock or half-written one, by its path."""
    found = (path for path in sorted(runs.rglob("*")) if path.is_file())
    short = {path.relative_to(runs): path for path in found if path.name != MANIFEST}
    return {
        str(name): path.read_bytes() for name, path in short.items() if not any(p.startswith(".") for p in name.parts)
    }


def faults(runs: Path, whole: dict[str, bytes], *, finished: bool) -> list[str]:
    """What is torn in a run, or, once it is finished, unlike the undisturbed one."""
    here = files(runs)
    said = [f"{name}: other bytes" for name in here if name in whole and here[name] != whole[name]]
    if finished:
        said += [f"{name}: missing" for name in whole if name not in here]
        said += [f"{name}: left over" for name in here if name not in whole]
    for manifest in runs.rglob(MANIFEST):
        try:
            json.loads(manifest.read_text(encoding="utf-8"))
        except ValueError:
            said.append(f"{manifest.relative_to(runs)}: torn")
    return said


def killed(asked: list[str], after: float) -> bool:
    """Run a command and kill it with its processes after so many seconds; whether it was still running."""
    running = subprocess.Popen(  # our own command
        asked, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    with suppress(subprocess.TimeoutExpired):
        running.wait(after)
    alive = running.poll() is None
    with suppress(ProcessLookupError):
        os.killpg(running.pid, signal.SIGKILL)
    running.wait()
    return alive


def main() -> int:
    """Kill as often as asked, and print what came of it."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    bad: list[str] = []
    reached: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as place:
        config = Path(place) / "small.yaml"
        config.write_text(CONFIG, encoding="utf-8")
        for _ in range(2):  # the first compiles, and its length says nothing
            undisturbed = Path(place) / f"undisturbed{_}"
            begun = time.monotonic()
            done = subprocess.run(command(config, undisturbed), check=False, capture_output=True, text=True)
            length = time.monotonic() - begun
            if done.returncode not in (0, 4):
                sys.stdout.write(done.stderr)
                return 1
        whole = files(undisturbed)
        for number, share in enumerate(rng.random(asked.kills)):
            runs = Path(place) / f"runs{number}"
            alive = killed(command(config, runs), share * length)
            stages = sorted(path.parent.name for path in runs.rglob(MANIFEST))
            reached[f"after {stages[-1]}" if stages else "before the first stage"] += alive
            said = faults(runs, whole, finished=False)
            again = subprocess.run(command(config, runs), check=False, capture_output=True, text=True)
            if again.returncode != done.returncode:
                said.append(f"exit {again.returncode}: {again.stderr[-300:]}")
            said += faults(runs, whole, finished=True)
            bad += [f"kill {number}, after {share * length:.2f} s of {length:.2f} s: {one}" for one in said]
    told = ", ".join(f"{count} {stage}" for stage, count in sorted(reached.items()))
    sys.stdout.write(
        "\n".join(
            [*bad, f"{asked.kills} kills over {length:.1f} s ({told}): {len(bad)} faults, {len(whole)} files", ""]
        )
    )
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
