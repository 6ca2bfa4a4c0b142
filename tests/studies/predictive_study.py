"""What `comfort_predictive` gains over the best fixed voltage, and what it costs in wheel load and time.

    PYTHONPATH=. python tests/studies/predictive_study.py [--runs DIR] [--duration S] [--electronics] [CONFIG ...]

By default on the dampers of configs/quickstart.yaml and configs/utfsm.yaml, which are identified first where they are
not. Each rides six roads at fidelity `dynamic`, at the best fixed voltage of that road, then by `comfort_predictive`
with its default parameters, the road known and unknown. Rides last `--duration` seconds, 16 by default, and are judged
over their second half; over the bump until the motion has died away. A line a road: a_w at the best fixed voltage, and
with both; r.m.s. load of the wheel whose load is larger, in relation to the same at the best fixed voltage; time of the
processor for a ms of ride at a fixed voltage and with both. With `--electronics` the policy sees by sensors and sets
its voltage by a supply, as `ELECTRONICS` says. Last, how many roads meet what the policy is meant to do.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pzd.artefacts import Diagnosed, Table
from pzd.comfort.weighting import weighted
from pzd.pipeline.command import execute, opened
from pzd.signals.measures import rms
from pzd.simulate.config import KM_PER_H, SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.ride.model import dynamic_damper_of, grid_of
from pzd.simulate.ride.outcome import Outcome, Window, event_of, of_event, settled
from pzd.simulate.roads import Road, Way
from pzd.simulate.study.plan import Case, checked_temperature
from pzd.simulate.study.tuning import Setup

CONFIGS = ("configs/quickstart.yaml", "configs/utfsm.yaml")
ROADS = (
    {"kind": "sine", "frequency_Hz": 2.25},
    {"kind": "sine", "frequency_Hz": 4.5},
    {"kind": "iso8608", "road_class": "B", "seed": 1, "label": "iso8608-B-1"},
    {"kind": "iso8608", "road_class": "C", "seed": 1, "label": "iso8608-C-1"},
    {"kind": "iso8608", "road_class": "C", "seed": 2, "label": "iso8608-C-2"},
    {"kind": "bump"},
)
ELECTRONICS = {
    "sensors": {
        "period_s": 0.002,
        "delay_s": 0.002,
        "noise": {
            "deflection_m": 1e-4,
            "deflection_rate_m_per_s": 5e-3,
            "heave_m": 1e-4,
            "pitch_rad": 1e-4,
            "heave_rate_m_per_s": 5e-3,
            "pitch_rate_rad_per_s": 2e-3,
            "acceleration_m_per_s2": 0.05,
        },
    },
    "supply": {"slew_per_s": 3e4},
}
"""What a production car carries, in round numbers: a bus of 500 Hz with one message of delay, potentiometers of a tenth
of a millimetre, accelerometers of 50 mm/s2 and what a controller integrates from them; 150 V in 5 ms."""
MORE_LOAD = 1.10
"""What the larger load may be, in relation to that at the best fixed voltage."""
TARGET_US = 150.0
"""Time of the processor for a ms of ride [us]."""


@dataclass(frozen=True)
class Measured:
    """One ride by its figures."""

    a_w: float
    load: float
    """Of the wheel whose r.m.s. load is larger [N]."""
    us_per_ms: float


def setup_of(
    path: Path, runs: Path, duration: float = 16.0, electronics: Mapping[str, object] | None = None, **given: object
) -> Setup:
    """The damper of a config in the car; length of a ride [s], blocks of the ride, parameters of the policy."""
    run = opened(path, runs)
    execute(run, "table", force=False, jobs=2, say=lambda line: sys.stderr.write(f"{path.stem}: {line}\n"))
    lasting = {"duration_s": duration, "settle_s": 0.5 * duration}
    block = {"roads": ROADS, "fidelities": ["dynamic"], **lasting, "comfort_predictive": given, **(electronics or {})}
    config = SimulateConfig.model_validate_json(json.dumps(block))
    diagnosed, table = run.run.read(Diagnosed), run.run.read(Table)
    temperature = checked_temperature(config, table)
    speed = config.vehicle_speed_km_per_h * KM_PER_H
    way = Way(speed, speed * config.duration_s, 1, path.parent)
    return Setup(
        config,
        {road.name: road.profile(way) for road in config.roads},
        grid_of(table, temperature),
        dynamic_damper_of(diagnosed.damper, temperature, config.valve_response_s),
        table.notes.outside == "error",
    )


def window_of(setup: Setup, road: Road, outcome: Outcome) -> Window:
    """The window of a ride by itself."""
    event = event_of(road, setup.config)
    if event is None:
        return settled(setup.config.settle_s, outcome.step, len(outcome.comfort) - 1)
    return of_event(event, outcome.step, [outcome.comfort])[0]


def measured(setup: Setup, road: Road, outcome: Outcome, window: Window, seconds: float) -> Measured:
    """The figures of a ride that took so long."""
    return Measured(
        rms(weighted(outcome.comfort, 1.0 / outcome.step)[window.steps]),
        max(rms(load) for load in outcome.loads[window.steps].T),
        1e3 * seconds / setup.config.duration_s,
    )


def ridden(setup: Setup, road: Road, policy: str, window: Window | None = None) -> tuple[Measured, Window, float]:
    """Ride a road; the voltage that was held is given back as well."""
    case = Case(road, policies()[policy], "dynamic", plain=False)
    held, outcome = setup.ridden(case)
    if policies()[policy].tuned:
        case = replace(case, policy=policies()["passive"])
        setup = replace(setup, config=setup.config.model_copy(update={"passive_voltage_V": held.voltage}))
    start = time.process_time()
    _, outcome = setup.ridden(case)
    seconds = time.process_time() - start
    window = window or window_of(setup, road, outcome)
    return measured(setup, road, outcome, window, seconds), window, held.voltage


def study(path: Path, runs: Path, duration: float, electronics: Mapping[str, object]) -> None:
    """Ride all roads on the damper of a config, and print."""
    sides = {known: setup_of(path, runs, duration, electronics, road=known) for known in ("known", "unknown")}
    better: dict[str, list[float]] = {known: [] for known in sides}
    loads: dict[str, list[float]] = {known: [] for known in sides}
    slowest = dict.fromkeys(sides, 0.0)
    for road in sides["known"].config.roads:
        fixed, window, voltage = ridden(sides["known"], road, "best_fixed_voltage")
        line = f"{path.stem:<11}{road.name:<13}{voltage:7.3g}{fixed.a_w:8.3f}"
        times = f"{fixed.us_per_ms:6.0f}"
        for known, setup in sides.items():
            found, _, _ = ridden(setup, road, "comfort_predictive", window)
            better[known].append(found.a_w / fixed.a_w - 1.0)
            loads[known].append(found.load / fixed.load)
            slowest[known] = max(slowest[known], found.us_per_ms)
            line += f"{found.a_w:9.3f} {better[known][-1]:+6.1%} {loads[known][-1]:5.2f}"
            times += f"{found.us_per_ms:6.0f}"
        sys.stdout.write(f"{line}{times}\n")
        sys.stdout.flush()
    for known, shares in better.items():
        lower, much = sum(s < 0.0 for s in shares), sum(s <= -0.05 for s in shares)
        loaded = sum(r <= MORE_LOAD for r in loads[known])
        sys.stdout.write(
            f"{path.stem}, road {known}: a_w lower on {lower} of {len(shares)}, by 5 % or more on {much}, at worst "
            f"{max(shares):+.1%}; load at most {MORE_LOAD:g} of that at the fixed voltage on {loaded}; slowest "
            f"{slowest[known]:.0f} us a ms, where {TARGET_US:.0f} are meant\n"
        )


def main() -> None:
    """Read the command line."""
    options = argparse.ArgumentParser()
    options.add_argument("--runs", type=Path, default=Path("runs"))
    options.add_argument("--duration", type=float, default=16.0)
    options.add_argument("--electronics", action="store_true")
    options.add_argument("configs", type=Path, nargs="*")
    given = options.parse_args()
    sys.stdout.write(
        f"{'damper':<11}{'road':<13}{'held':>7}{'fixed':>8}{'known':>9}{'':>7}{'load':>6}{'unknown':>9}{'':>7}{'load':>6}"
        "   us a ms\n"
    )
    for path in given.configs or CONFIGS:
        study(Path(path), given.runs, given.duration, ELECTRONICS if given.electronics else {})


if __name__ == "__main__":
    main()
