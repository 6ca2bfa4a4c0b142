"""A seed is scored once: the ledger refuses it for other code, and lets the same run go on."""

from __future__ import annotations

from pathlib import Path

import pytest

from pzd.blind.benchmark import ScoredSeed, enter, read
from pzd.cli.app import status
from pzd.schema.errors import ConfigError, DataError

ROOT = Path(__file__).resolve().parents[2]


def run(seed: int = 5, generator: str = "own", made_from: str = "a", cases: int = 60) -> ScoredSeed:
    return ScoredSeed(seed=seed, generator=generator, made_from=made_from, cases=cases, date="2026-11-22")


def test_a_seed_of_other_code_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.csv"
    enter(ledger, run())
    before = ledger.read_bytes()
    with pytest.raises(ConfigError, match="seed 5 was scored with another config or other code on 2026-11-22"):
        enter(ledger, run(made_from="b"))
    assert ledger.read_bytes() == before


def test_the_same_run_goes_on_and_one_of_more_cases_is_entered(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.csv"
    for one in (run(), run(cases=20), run(), run(cases=200), run(seed=6), run(generator="independent", made_from="b")):
        enter(ledger, one)
    assert [(one.seed, one.generator, one.cases) for one in read(ledger)] == [
        (5, "own", 60),
        (5, "own", 200),
        (6, "own", 60),
        (5, "independent", 60),
    ]


def test_a_ledger_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.csv"
    ledger.write_text("seed,what\n1,2\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"ledger\.csv"):
        enter(ledger, run())


def test_the_command_refuses_a_seed_that_the_ledger_holds_for_other_code(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "blind.yaml"
    text = (ROOT / "configs" / "blind.yaml").read_text(encoding="utf-8")
    config.write_text(text, encoding="utf-8")
    enter(tmp_path / "blind-ledger.csv", run(seed=777))
    given = ["blind", str(config), "--runs", str(tmp_path / "runs"), "--set", "blind.seed=777"]
    assert status(given) == ConfigError.exit_code
    assert "seed 777 was scored with another config or other code" in capsys.readouterr().err
    assert not list(tmp_path.rglob("cases"))


def test_the_committed_ledger_can_be_read() -> None:
    assert all(one.cases > 0 for one in read(ROOT / "configs" / "blind-ledger.csv"))
    assert read(ROOT / "configs" / "blind-ledger.csv")
