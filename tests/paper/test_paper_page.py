"""No number of the page about the paper that the commands named there do not print."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
REFERENCES = {31, 34}
"""Entries of the paper's list of references, which it alone prints."""


@pytest.mark.ci
def test_every_number_of_the_page_is_printed_by_a_command_that_it_names(
    root: Path, tmp_path: Path, pzd: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    page = (root / "pzd" / "paper" / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```sh\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    assert pzd("run", "configs/paper.yaml", "--runs", tmp_path).returncode == 0
    printed = (root / "configs" / "paper.yaml").read_text(encoding="utf-8")
    printed += (root / "pzd" / "paper" / "published.csv").read_text(encoding="utf-8")
    printed += (tmp_path / "paper" / "6-report" / "reference.csv").read_text(encoding="utf-8")
    for line in block.splitlines():
        words = shlex.split(line, comments=True)
        if words[0] == "pzd":
            done = pzd(*words[1:], "--runs", tmp_path)
        else:
            command = [sys.executable, *words[1:]]
            done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        printed += done.stdout
    known = [float(number) for number in NUMBER.findall(printed)]

    def is_known(number: str) -> bool:
        places = len(number.partition(".")[2]) if "e" not in number else 0
        return any(abs(round(value, places) - float(number)) < 1e-9 for value in known) or float(number) in REFERENCES

    prose = re.sub(r"^```.*?^```", "", page, flags=re.MULTILINE | re.DOTALL).replace(",000", "000")
    assert [number for number in NUMBER.findall(prose) if not is_known(number)] == []
