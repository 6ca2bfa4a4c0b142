"""Small rig files written to disk, and how they are read: a sine of 10 mm at 5 Hz on a damper with friction."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pzd.artefacts import Rig
from pzd.quantities import Control
from pzd.rig.config import RigConfig
from pzd.rig.stage import ingest
from pzd.schema.errors import ConfigError, DataError

TIME = np.arange(500) * 2e-3
X = 0.01 * np.sin(2 * np.pi * 5.0 * TIME)
V = 0.01 * 2 * np.pi * 5.0 * np.cos(2 * np.pi * 5.0 * TIME)
FORCE = 900.0 * V + 200.0 * np.tanh(V / 0.01)
VOLTAGE = Control()
CANONICAL = {"time_s": TIME, "displacement_m": X, "force_N": FORCE, "voltage_V": np.full(500, 100.0)}


def lines(columns: dict[str, Any], separator: str = ",", decimal: str = ".") -> list[str]:
    rows = [
        separator.join(f"{c:.9g}".replace(".", decimal) if not isinstance(c, str) else c for c in row)
        for row in zip(*columns.values(), strict=True)
    ]
    return [separator.join(columns), *rows]


def write(path: Path, text: list[str], encoding: str = "utf-8") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(text) + "\n", encoding=encoding)
    return path


def run(folder: Path, *entries: dict[str, Any], control: Control = VOLTAGE) -> Rig:
    config = RigConfig.model_validate_json(json.dumps({"files": entries or [{"path": "*.csv"}]}))
    return ingest(config, control, folder)


def refused(folder: Path, *entries: dict[str, Any]) -> tuple[str, ...]:
    with pytest.raises(DataError) as caught:
        run(folder, *entries)
    return caught.value.messages


def wrong(folder: Path, *entries: dict[str, Any], control: Control = VOLTAGE) -> tuple[str, ...]:
    with pytest.raises(ConfigError) as caught:
        run(folder, *entries, control=control)
    return caught.value.messages
