"""The comparison of two checkouts sees what a change of the code may not do, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.studies.same_artefacts import Made, Outcome, compare

FILES = {
    "blind/scored/00000.json": '{\n  "verdict": "none",\n  "seconds": 1.5,\n  "failure": null\n}\n',
    "1-rig/manifest.json": '{"finished": "2026-01-01"}\n',
    "1-rig/record.csv": "time_s,force_N\n0.0,1000.0\n0.1,1e-9\n",
    "2-identify/parameters.csv": "voltage_V,T0_N,status\n0.0,301.0,ok\n",
    "3-diagnose/diagnosis.json": '{\n  "verdict": "named",\n  "effects": ["gas_spring"],\n  "gap": 0.0\n}\n',
    "6-report/report.html": "<p>2.27 m/s2</p>\n",
}


def made(folder: Path, **changes: tuple[str, str]) -> Made:
    """Artefacts in a folder; a change names a file by its stem, and gives the text that is replaced and the new one."""
    for name, text in FILES.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        old, new = changes.get(path.stem, ("", ""))
        assert old in text
        path.write_text(text.replace(old, new) if old else text, encoding="utf-8")
    return Made(folder, ())


def outcome(folder: Path, relative: float | None = None, **changes: tuple[str, str]) -> Outcome:
    return compare(made(folder / "before"), made(folder / "after", **changes), relative)


def test_manifests_and_what_no_two_runs_share_are_left_out(tmp_path) -> None:
    found = outcome(tmp_path, manifest=("2026", "2027"), **{"00000": ("1.5", "9.9")})
    assert (found.files, found.equal, found.same) == (5, 5, True)


@pytest.mark.parametrize(
    ("stem", "old", "new"),
    [
        ("00000", "null", '"fit.py:3"'),
        ("record", "1000.0", "1000.0000000000001"),
        ("parameters", "ok", "on_bound"),
        ("report", "2.27", "2.28"),
    ],
)
def test_one_byte_is_a_difference(tmp_path, stem, old, new) -> None:
    found = outcome(tmp_path, **{stem: (old, new)})
    assert len(found.differing) == 1
    assert not found.same


@pytest.mark.parametrize(("share", "same"), [(1e-5, True), (1e-7, False)])
def test_a_number_may_move_within_the_tolerance(tmp_path, share, same) -> None:
    found = outcome(tmp_path, relative=share, parameters=("301.0", "301.0003"))
    assert (found.same, found.close) == (same, int(same))


def test_a_signal_over_time_is_measured_by_its_peak(tmp_path) -> None:
    assert outcome(tmp_path, relative=1e-6, record=("1e-9", "2e-9")).same
    assert not outcome(tmp_path, relative=1e-6, record=("1e-9", "2e-3")).same


def test_the_tolerance_holds_for_numbers_and_not_for_texts_or_shapes(tmp_path) -> None:
    assert not outcome(tmp_path, relative=0.5, parameters=("ok", "on_bound")).same
    assert not outcome(tmp_path, relative=0.5, record=("0.1,1e-9\n", "")).same
    assert not outcome(tmp_path, relative=0.5, diagnosis=('"gap"', '"GAP"')).same


@pytest.mark.parametrize("relative", [None, 1e-6])
@pytest.mark.parametrize(
    ("stem", "old", "new"),
    [
        ("00000", '"none"', '"named"'),
        ("diagnosis", '"gas_spring"', '"lash"'),
        ("parameters", "ok", "on_bound"),
    ],
)
def test_a_decision_that_changed_is_said_in_either_mode(tmp_path, relative, stem, old, new) -> None:
    found = outcome(tmp_path, relative=relative, **{stem: (old, new)})
    assert len(found.decisions) == 1
    assert new.strip('"') in found.decisions[0]
