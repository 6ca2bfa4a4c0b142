"""The path as a look-up of a fixed step: as near to our own as its header tells."""

from __future__ import annotations

import re
import shutil

import numpy as np
import pytest
from exported_dampers import EXPORTED, content_of

from pzd.damper.compose import respond
from pzd.damper.motion import Motion
from pzd.export.certificate import by_program
from pzd.export.formats import formats
from pzd.export.lookup import STEP

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed: apt-get install gcc")
TOLD = re.compile(r"\* (\S+) N of (\S+) N\. \*/")


@needs_gcc
@pytest.mark.parametrize("flags", [(), ("-DDAMPER_SINGLE",)], ids=["double", "single"])
@pytest.mark.parametrize("name", ["plain", "rounded", "single"])
def test_the_error_is_no_larger_than_is_told(name: str, flags: tuple[str, ...], rng: np.random.Generator) -> None:
    content = content_of(EXPORTED[name])
    files = formats()["c-lookup"].files(content)
    error, peak = map(float, TOLD.search(files["lookup_data.h"].decode()).groups())  # type: ignore[union-attr]  # it is there
    assert error <= 0.01 * peak
    run = by_program(files, "-DDAMPER_LOOKUP", *flags)
    time = STEP * np.arange(2000)
    for signal in rng.uniform(0.0, 150.0, 4):
        frequencies, shifts = rng.uniform(0.5, 12.0, 3), rng.uniform(0.0, 6.0, 3)
        speed = sum(np.sin(2.0 * np.pi * f * time[1:] + shift) for f, shift in zip(frequencies, shifts, strict=True))
        speed *= 0.9 * content.grid.velocities[-1] / np.max(np.abs(speed))
        x = np.concatenate([[0.0], np.cumsum(speed) * STEP])
        still = np.zeros(time.size)
        motion = Motion(time, x, still, still, np.full(time.size, signal), np.full(time.size, 22.0))
        assert np.max(np.abs(run(content, motion) - respond(content.damper, motion))) <= 1.5 * error


def test_the_table_is_the_same_twice_and_says_where_it_is_from() -> None:
    content = content_of(EXPORTED["single"])
    files = formats()["c-lookup"].files(content)
    assert files == formats()["c-lookup"].files(content)
    assert content.origin.encode() in files["lookup_data.h"]
