"""Where the time of a command goes: its threads are looked at every few milliseconds.

    PYTHONPATH=. python tests/studies/bench_profile.py identify configs/quickstart.yaml --force --jobs 1

The last line is JSON: the share of the looks at each function of pzd, the innermost that was at work, the most first.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections import Counter
from pathlib import Path
from types import FrameType

EVERY_S = 0.005
TOLD = 12
WAITING = ("threading.py", "queue.py", "selectors.py", "_base.py", "thread.py", "interrupt.py", "process.py")
"""Modules in which a thread that has nothing to do stands."""


def at_work(frame: FrameType | None) -> str | None:
    """Return the innermost function of pzd of a thread, that which calls a compiled one; None where it waits."""
    if frame is None or Path(frame.f_code.co_filename).name in WAITING:
        return None
    while frame is not None:
        path = Path(frame.f_code.co_filename)
        if "pzd" in path.parts and path.parent.name != "cli" and path.name != "compiled.py":
            return f"{frame.f_code.co_name} of {path.parent.name}/{path.name}"
        frame = frame.f_back
    return "imports and others"


def main() -> None:
    """Run a command and print its profile."""
    seen: Counter[str] = Counter()
    ended = threading.Event()

    def look() -> None:
        own = threading.get_ident()
        while not ended.is_set():
            places = (at_work(frame) for thread, frame in sys._current_frames().items() if thread != own)
            seen.update(place for place in places if place)
            time.sleep(EVERY_S)

    looking = threading.Thread(target=look, daemon=True)
    looking.start()
    sys.argv = ["pzd", *sys.argv[1:]]
    code: int | str | None = 0
    try:
        from pzd.cli import main as command

        command()
    except SystemExit as ended_with:
        code = ended_with.code
    ended.set()
    looking.join()
    whole = max(1, seen.total())
    sys.stdout.write(json.dumps([(name, count / whole) for name, count in seen.most_common(TOLD)]) + "\n")
    sys.exit(code)


if __name__ == "__main__":
    main()
