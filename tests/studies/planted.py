"""What `pzd changes` and `pzd diagnose` make of one force that was added in software to measured tests.

    PYTHONPATH=. python tests/studies/planted.py [--share 0.03] [--diagnose] [--only EFFECT] [CONFIG ...]

By default on the dampers of configs/utfsm.yaml and configs/utfpr.yaml, read from the folder of the measured data. The
second, fourth, ... cycle of every test, with the force added, is the state after; the first, third, ... without it the
state before, so that no noise is shared. `--share` is the largest added force as a share of peak. A line a plant: the
verdict, the names with their share, and the size that was found over the one that was planted. `load_cell_zero` counts
for a preload.

With `--diagnose` the force is added to every test as it was recorded, and the tests are diagnosed alone: an effect is
found where it is adopted, and its size less that in the tests as they are lies within 15 % of what was planted.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pzd.artefacts import Diagnosis, Rig
from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.changes.comparison import changes_between
from pzd.diagnosis.changes.state import State
from pzd.diagnosis.stage import diagnose
from pzd.identification.stage import identify
from pzd.pipeline.command import Opened, execute, opened
from pzd.record import Record, mid_stroke
from pzd.signals.cycles import cycles_of
from pzd.signals.kinematics import kinematics

CONFIGS = ("configs/utfsm.yaml", "configs/utfpr.yaml")
SAME = {"preload_offset": {"preload_offset", "load_cell_zero"}}
"""Names that are right for a plant beside its own."""


def halves(records: Sequence[Record]) -> tuple[list[Record], list[Record]]:
    """Return the odd and the even cycles of every test that repeats, each put one behind the other."""
    found: tuple[list[Record], list[Record]] = ([], [])
    for record in records:
        run = cycles_of(record)
        if run is None or run.count < 4:
            continue
        x, force = (run.fold(record.time, channel) for channel in (record.displacement, record.force))
        for first, half in enumerate(found):
            count = run.count // 2
            rows = slice(first, 2 * count, 2)
            time = np.arange(count * x.shape[1]) * run.period / x.shape[1]
            level = [
                None if c is None else np.full(time.size, np.median(c)) for c in (record.voltage, record.temperature)
            ]
            motion = kinematics(time, x[rows].ravel(), None)
            half.append(Record(record.name, None, time, *motion, force[rows].ravel(), *level))
    return found


def plants(records: Sequence[Record], share: float) -> Mapping[str, Mapping[str, float]]:
    """Return the forces that are added, each with its parameters, as large as a share of the largest force."""
    force = share * max(float(np.max(np.abs(r.force))) for r in records)
    stroke, acceleration, speed = (
        max(float(np.ptp(getattr(r, name))) / 2.0 for r in records)
        for name in ("displacement", "acceleration", "velocity")
    )
    return {
        "preload_offset": {"F_0": force},
        "gas_spring": {"k_g": force / stroke},
        "fluid_inertia": {"m": force / acceleration},
        "stribeck_friction": {"F_s": force, "v_s": 0.2 * speed},
        "end_stop": {"k_e": force / (0.3 * stroke) ** 2, "x_e": 0.7 * stroke},
        "orifice_quadratic": {"q": force / speed**2},
        "accumulator": {"F_g": force, "L": 3.0 * stroke},
        "second_branch": {"T0_2": force, "k_2": force / (0.1 * stroke)},
        "bouc_wen": {"F_h": force, "x_h": 0.1 * stroke, "sigma": 1.0},
        "asymmetry": {"alpha": share},
    }


def planted(records: Sequence[Record], name: str, values: Mapping[str, float]) -> list[Record]:
    """Return the tests with the force of an effect added to what was measured."""
    nothing = Damper(base=(BaseRow(T0_N=0.0, C_Ns_per_m=1.0, k_N_per_m=1e9),))
    zero = mid_stroke(r.displacement for r in records)
    damper = nothing.with_effect(name, values).moved(zero)
    found = []
    for r in records:
        motion = Motion(r.time, r.displacement, r.velocity, r.acceleration)
        # what scales the damper's own force by its direction has none by itself
        scaled = values.get("alpha", 0.0) * np.abs(r.force)
        added = scaled + respond(damper, motion, 0.0) - respond(nothing, motion, 0.0)
        found.append(replace(r, force=r.force + added))
    return found


def study(given: Opened, share: float, only: Sequence[str]) -> None:
    """Print a line for each plant in the tests of a config."""
    config, control = given.config, given.run.control
    execute(given, "ingest", force=False, jobs=1, say=lambda _: None)
    records = [r for r in given.run.read(Rig).records if config.setting in (None, r.setting)]
    before, after = halves(records)

    def state(name: str, tests: Sequence[Record]) -> State:
        rig = Rig(tuple(tests), ())
        return State.of(name, rig, identify(config.identify, rig, 1), None, control)

    first = state("before", before)
    for name, values in plants(before, share).items():
        if only and name not in only:
            continue
        second = state("after", planted(after, name, values))
        found = changes_between(first, second, config.diagnose, config.identify, control).changes
        told = {c.name for c in found.changes} | set(found.rivals)
        right = bool(told & SAME.get(name, {name}))
        (parameter, size), *_ = values.items()
        own = [c.to for c in found.changes if parameter == c.parameter or c.name in SAME.get(name, ())]
        ratio = f"{own[0] / size:.3f}" if own and isinstance(own[0], float) else "-"
        names = ", ".join(f"{c.name} {100.0 * c.share:.0f} %" for c in found.changes)
        sys.stdout.write(
            f"{given.run.config.stem} {name}: {found.verdict}, {'right' if right else 'WRONG'}: {names or 'nothing'}; "
            f"rivals {', '.join(found.rivals) or 'none'}; found over planted {ratio}\n"
        )
        sys.stdout.flush()


WITHIN = 0.15
"""Share of a planted size within which the size found is right."""


def diagnose_study(given: Opened, share: float, only: Sequence[str]) -> None:
    """Print for each plant whether `pzd diagnose` adopts it in the tests of a config, and with which size."""
    config, control = given.config, given.run.control
    execute(given, "ingest", force=False, jobs=1, say=lambda _: None)
    records = [r for r in given.run.read(Rig).records if config.setting in (None, r.setting)]

    def adopted(tests: Sequence[Record]) -> tuple[Damper, Diagnosis]:
        rig = Rig(tuple(tests), ())
        found = diagnose(
            config.diagnose, config.identify, config.rig, rig, identify(config.identify, rig, 1), control,
            config.setting, 1,
        )  # fmt: skip
        return found.damper, found.diagnosis

    before, found = adopted(records)
    right, wanted = 0, {name: values for name, values in plants(records, share).items() if not only or name in only}
    told(given, "nothing", found)
    for name, values in wanted.items():
        damper, found = adopted(planted(records, name, values))
        parameter, size = next(iter(values.items()))
        own, had = (float(np.mean(d.effects.get(name, {}).get(parameter, 0.0))) for d in (damper, before))
        ratio = (own - had) / size
        hit = name in found.effects and abs(ratio - 1.0) <= WITHIN
        right += hit
        told(given, f"{name}, {'found' if hit else 'NOT FOUND'}, {ratio:.3f} of what was planted", found)
    sys.stdout.write(f"{given.run.config.stem}: {right} of {len(wanted)} found\n")


def told(given: Opened, plant: str, found: Diagnosis) -> None:
    """Print what a diagnosis adopts, and what it predicts."""
    criterion = "-" if found.prediction is None else f"{found.prediction.W_s:.4g}"
    names = ", ".join(found.effects) or "nothing"
    sys.stdout.write(f"{given.run.config.stem} {plant}: {found.verdict}, {names}; W_s of kept-back tests {criterion}\n")
    sys.stdout.flush()


def main() -> int:
    """Run the study on every config."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("configs", nargs="*", default=CONFIGS)
    parser.add_argument("--share", type=float, default=0.03)
    parser.add_argument("--diagnose", action="store_true")
    parser.add_argument("--only", action="append", default=[])
    arguments = parser.parse_args()
    shared = Path(os.environ.get("PZD_SHARED", "../shared")).resolve()
    with tempfile.TemporaryDirectory() as folder:
        for config in map(Path, arguments.configs):
            text = config.read_text(encoding="utf-8").replace("../../shared", shared.as_posix())
            (Path(folder) / config.name).write_text(text, encoding="utf-8")
            given = opened(Path(folder) / config.name, Path(folder) / "runs")
            if arguments.diagnose:
                diagnose_study(given, arguments.share, arguments.only)
            else:
                study(given, arguments.share, arguments.only)
    return 0


if __name__ == "__main__":
    sys.exit(main())
