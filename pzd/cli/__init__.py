"""The command line: no physics and no file formats, only commands, what they print and how they exit."""

from __future__ import annotations

import os

from pzd.cli.interrupt import end_at_once_when_interrupted

TYPE_CHECKING = False
if TYPE_CHECKING:  # before an interrupt is heeded, as little as possible is imported
    from typing import NoReturn

# Our matrices are small: threads of the linear algebra only get into each other's way. Set before numpy is imported.
for _pool in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_pool, "1")


def main() -> NoReturn:
    """Run the command line and exit by the codes of the contract."""
    end_at_once_when_interrupted()  # the imports take half a second, in which Ctrl-C would show a traceback
    from pzd.cli.app import main as run

    run()


__all__ = ["main"]
