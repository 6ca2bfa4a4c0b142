"""The folder of a run lies in the folder of runs, whatever its config is called."""

from __future__ import annotations

from pathlib import Path

import pytest

from pzd.quantities import Control
from pzd.runs.folder import Run
from pzd.schema.errors import ConfigError


@pytest.mark.parametrize("name", ["...yaml", "..yaml", "....yaml", "..."])
def test_a_config_whose_stem_is_dots_would_write_outside_and_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigError, match="rename the config"):
        Run.of(tmp_path / name, tmp_path / "runs", Control())


@pytest.mark.parametrize("name", ["a.yaml", ".yaml", "a..yaml", "...a.yaml"])
def test_any_other_name_has_a_folder_of_its_own(tmp_path: Path, name: str) -> None:
    run = Run.of(tmp_path / name, tmp_path / "runs", Control())
    assert run.folder.resolve().parent == (tmp_path / "runs").resolve()
