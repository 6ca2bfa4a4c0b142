"""Time and memory of diagnose alone on a config: run in a process of its own, it prints them as JSON.

    python tests/studies/bench_diagnose.py CONFIG [--records N] [--samples N]

Records and parameters are made first and diagnose is compiled by an earlier process, so that neither counts.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import time
from dataclasses import replace
from pathlib import Path

import pzd.cli  # noqa: F401  # before numpy: as in the command, the linear algebra has one thread
from pzd.artefacts import Identified, Rig
from pzd.diagnosis.stage import diagnose
from pzd.identification.stage import identify
from pzd.pipeline.command import opened
from pzd.pipeline.execution import InMemory
from pzd.pipeline.stages import stages
from pzd.record import sliced


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("config", type=Path)
    parser.add_argument("--records", type=int)
    parser.add_argument("--samples", type=int)
    asked = parser.parse_args()
    given = opened(asked.config, Path("runs"))
    config = given.config
    chain = InMemory(config, given.run, stages(config), lambda _: None)
    chain.through("identify")
    rig, identified = chain.of(Rig), chain.of(Identified)
    if asked.records or asked.samples:
        some = (
            rig.records[:: max(len(rig.records) // asked.records, 1)][: asked.records] if asked.records else rig.records
        )
        some = tuple(sliced(r, r.time <= r.time[min(asked.samples or r.time.size, r.time.size) - 1]) for r in some)
        kept = {record.name for record in some}
        rig = replace(rig, records=some, entries=tuple(e for e in rig.entries if e.name in kept))
        identified = identify(config.identify, rig, config.seed)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    wall, cpu = time.perf_counter(), time.process_time()
    found = diagnose(config.diagnose, config.identify, config.rig, rig, identified, given.run.control, None, jobs=2)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    told = {
        "seconds": wall,
        "cpu_seconds": cpu,
        "peak_memory_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        "memory_before_MB": before / 1024.0,
        "verdict": found.diagnosis.verdict,
        "effects": found.diagnosis.effects,
    }
    sys.stdout.write(json.dumps(told) + "\n")


if __name__ == "__main__":
    main()
