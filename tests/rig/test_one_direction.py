"""A record goes through the room of rig files in one direction: no module is entered again from a later one."""

from __future__ import annotations

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest


def test_no_module_of_the_room_is_entered_from_a_later_one(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec = spec_from_file_location("record_trip", root / "tests" / "studies" / "record_trip.py")
    assert spec is not None
    assert spec.loader is not None
    study = module_from_spec(spec)
    spec.loader.exec_module(study)
    study.main("rig")
    said = capsys.readouterr().out
    assert said.count(", 0 returns\n") == said.count(" returns\n") == 2, said
    assert len(said.splitlines()) > 10
