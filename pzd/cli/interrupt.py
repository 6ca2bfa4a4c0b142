"""Ends the program within a second of Ctrl-C, also where threads or compiled code would go on for longer.

An interrupt reaches Python's main thread alone, and only between two of its instructions; pools of
threads wait for their work on the way out. Results are written so that a killed run leaves the old or
the new, so what does not end by itself can be ended from outside.
"""

from __future__ import annotations

import os
import signal
import threading
import time

from pzd.cli.exits import INTERRUPTED
from pzd.cli.output import complain

_GRACE_S = 0.4
"""How long the program may take to tidy up; with what it takes to notice, it is gone within a second."""
_said = threading.Event()


def say_interrupted() -> None:
    """Say what an interrupt leaves behind."""
    _said.set()
    complain(["interrupted; finished stages stand, the one at work left what was there before"])


def end_soon_after_interrupt() -> None:
    """From now on, end the program soon after an interrupt, however it takes it."""
    if os.name == "nt":
        return  # there a pipe cannot be told of signals
    receive, send = os.pipe()
    os.set_blocking(send, False)
    signal.set_wakeup_fd(send, warn_on_full_buffer=False)
    threading.Thread(target=_end, args=(receive,), daemon=True).start()


def _end(receive: int) -> None:
    while os.read(receive, 1) != bytes([signal.SIGINT]):
        pass
    time.sleep(_GRACE_S)
    if not _said.is_set():
        say_interrupted()
    os._exit(INTERRUPTED)
