"""Time and memory of diagnose alone on a config: run in a process of its own, it prints them as JSON.

    python tests/studies/bench_diagnose.py CONFIG [--records N] [--samples N]

Records and parameters are made first and diagnose is compiled by an earlier process, so that neither counts. While it
works, a thread looks every 5 ms where each of the others is: in a force (`pzd/damper`), in cleaning (`pzd/signals`,
`pzd/diagnosis/data.py`), or elsewhere. A thread that waits for another one does not count.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import threading
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import FrameType

import pzd.cli  # noqa: F401  # before numpy: as in the command, the linear algebra has one thread
from pzd.artefacts import Identified, Rig
from pzd.diagnosis.stage import diagnose
from pzd.identification.stage import identify
from pzd.pipeline.command import opened
from pzd.pipeline.execution import InMemory
from pzd.pipeline.stages import stages
from pzd.record import sliced

EVERY_S = 0.005
CLEANING = ("pzd/signals/", "pzd/diagnosis/data.py")
KERNELS = ("pzd/damper/",)
WAITING = ("/threading.py", "/concurrent/futures/thread.py", "/concurrent/futures/_base.py")


def waits(frame: FrameType) -> bool:
    """Whether a stack stands still until another thread has done something."""
    return frame.f_code.co_filename.endswith(WAITING)


def part_of(frame: FrameType | None) -> str:
    """What the work of a stack belongs to, by its innermost frame of pzd."""
    while frame is not None:
        path = frame.f_code.co_filename
        if any(place in path for place in KERNELS):
            return "kernels"
        if any(place in path for place in CLEANING):
            return "cleaning"
        if "/pzd/" in path:
            return "glue"
        frame = frame.f_back
    return "glue"


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
    seen: Counter[str] = Counter()
    done = threading.Event()

    def look() -> None:
        while not done.wait(EVERY_S):
            own = threading.get_ident()
            seen.update(part_of(f) for thread, f in sys._current_frames().items() if thread != own and not waits(f))

    threading.Thread(target=look, daemon=True).start()
    wall, cpu = time.perf_counter(), time.process_time()
    found = diagnose(config.diagnose, config.identify, config.rig, rig, identified, given.run.control, None, jobs=2)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    done.set()
    whole = max(sum(seen.values()), 1)
    told = {
        "seconds": wall,
        "cpu_seconds": cpu,
        "peak_memory_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        "memory_before_MB": before / 1024.0,
        "verdict": found.diagnosis.verdict,
        "effects": found.diagnosis.effects,
        "shares": {part: seen[part] / whole for part in ("kernels", "glue", "cleaning")},
    }
    sys.stdout.write(json.dumps(told) + "\n")


if __name__ == "__main__":
    main()
