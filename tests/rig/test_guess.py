"""`pzd init` on what is no rig file: refused in one line a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from pzd.rig.files.guess import guessed
from pzd.schema.errors import DataError

NO_RIG_FILES = {
    "a letter": ("Dear Sir,\n\nthe damper, as agreed, works.\nYours\n", "letter.csv:"),
    "columns of people": ("name,age,town\na,1,x\n", "people.csv:1: no header names time, displacement or force"),
    "nothing": ("\n", "no header line"),
}


@pytest.mark.parametrize("kind", NO_RIG_FILES)
def test_what_is_no_rig_file_is_refused_in_one_line(tmp_path: Path, kind: str) -> None:
    text, said = NO_RIG_FILES[kind]
    path = tmp_path / f"{kind.rsplit(maxsplit=1)[-1]}.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DataError) as caught:
        guessed([path])
    (line,) = caught.value.messages
    assert said in line


def test_every_such_file_is_named(tmp_path: Path) -> None:
    for name in ("one.csv", "two.csv"):
        (tmp_path / name).write_text("name,age\na,1\n", encoding="utf-8")
    with pytest.raises(DataError) as caught:
        guessed([tmp_path / "one.csv", tmp_path / "two.csv"])
    assert len(caught.value.messages) == 2
