"""End the program within a second of Ctrl-C, also where threads or compiled code would go on for longer.

An interrupt reaches Python's main thread alone, and only between two of its instructions; pools of
threads wait for their work on the way out. Results are written so that a killed run leaves the old or
the new, so what does not end by itself can be ended from outside.
"""

from __future__ import annotations

import os
import signal

TYPE_CHECKING = False
if TYPE_CHECKING:  # before an interrupt is heeded, as little as possible is imported
    from types import FrameType

INTERRUPTED = 130
"""The exit code, as a shell has it for a program that SIGINT ended."""
_GRACE_S = 0.4
"""How long the program may take to tidy up; with what it takes to notice, it is gone within a second."""
_MESSAGE = "interrupted; finished stages stand, the one at work left what was there before"
_printed: list[str] = []


def say_interrupted() -> None:
    """Print what an interrupt leaves behind."""
    from pzd.cli.output import complain

    _printed.append(_MESSAGE)
    complain([_MESSAGE])


def end_at_once_when_interrupted() -> None:
    """Make an interrupt end the program in one line: for what runs before and behind a command.

    Imports cannot be tidied up, and an exception out of them shows a traceback. Where interrupts are ignored, as a
    shell starts what runs in the background, they remain so.
    """
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _end_at_once)


def raise_when_interrupted() -> None:
    """Make an interrupt raise KeyboardInterrupt, as usual in Python."""
    if signal.getsignal(signal.SIGINT) is _end_at_once:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _end_at_once(_number: int, _frame: FrameType | None) -> None:
    os.write(2, f"{_MESSAGE}\n".encode())
    os._exit(INTERRUPTED)


def end_soon_after_interrupt() -> None:
    """Start a thread that ends the program soon after an interrupt, whatever the main thread does with it."""
    if os.name == "nt":
        return  # there no pipe is written to when a signal arrives
    import threading

    receive, send = os.pipe()
    os.set_blocking(send, False)
    signal.set_wakeup_fd(send, warn_on_full_buffer=False)
    threading.Thread(target=_end, args=(receive,), daemon=True).start()


def _end(receive: int) -> None:
    import time

    while os.read(receive, 1) != bytes([signal.SIGINT]):
        pass
    time.sleep(_GRACE_S)
    if not _printed:
        say_interrupted()
    os._exit(INTERRUPTED)
