"""The command line: no physics and no file formats, only commands, what they print and how they exit."""

from __future__ import annotations

import os

# Our matrices are small: threads of the linear algebra only get into each other's way. Set before numpy is imported.
for _pool in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_pool, "1")

from pzd.cli.app import main  # noqa: E402  # numpy reads the above when it is imported

__all__ = ["main"]
