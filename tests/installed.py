"""The wheel installed in an environment of its own, and how a command is typed there."""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Installed:
    """A virtual environment that holds the wheel and nothing of the repository."""

    folder: Path

    def output(self, program: str, *arguments: object, cwd: Path) -> str:
        """What a program of the environment prints to stdout in a folder; it must exit 0."""
        command = [str(self.folder / "bin" / program), *map(str, arguments)]
        without_sources = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        done = subprocess.run(command, cwd=cwd, env=without_sources, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{program} {' '.join(command[1:])}\n{done.stdout}{done.stderr}"
        return done.stdout
