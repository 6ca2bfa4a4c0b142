"""The benchmark keeps the truth apart, goes on where it was, and gives the same whatever the number of processes.

A seed is scored once: the ledger refuses it for other code, and lets the same run go on.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pzd.artefacts import Diagnosed, Diagnosis
from pzd.artefacts.diagnosis import Gap
from pzd.blind.benchmark import Benchmark, ScoredSeed, diagnose_case, enter, read_ledger
from pzd.blind.case import COST, CaseFiles, NoiseFreeRecord, Scored, Truth
from pzd.blind.hide import BenchmarkSetup, draw_case, hide
from pzd.blind.plan import plan
from pzd.blind.score import gap_cut, gap_cut_of_truth, told_apart
from pzd.cli.app import status
from pzd.config import RunConfig
from pzd.damper.compose import respond
from pzd.damper.effects import nameable
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.parallel import chunks, engines
from pzd.parallel.chunks import ChunkedWork
from pzd.parallel.engines import Pools, Where
from pzd.parallel.processes import spawned_pool
from pzd.schema.errors import ConfigError, DataError

ROOT = Path(__file__).resolve().parents[2]

Small = Callable[..., RunConfig]
SetupOf = Callable[[RunConfig], BenchmarkSetup]
BenchmarkOf = Callable[[RunConfig, Path], Benchmark]

SMALL = """
rig:
  virtual:
    - {damper: {base: [{T0_N: 301, C_Ns_per_m: 2720, k_N_per_m: 199000}]}, tests: [{waveform: WAVE}]}
blind:
  seed: 77
  tuned_on: [1, 2]
  campaigns: [{name: one, tests: [{waveform: WAVE}]}]
""".replace("WAVE", "{kind: sine, frequency_Hz: 1, amplitude_m: 0.02}")
SECOND = SMALL.splitlines()[3].replace("{damper", "{setting: other, damper") + "\n"
NOTHING_HIDDEN = """
rig:
  virtual:
    - damper: {base: [{voltage_V: 0, T0_N: 301, C_Ns_per_m: 2720, k_N_per_m: 199000}]}
      voltages_V: [0]
      rate_Hz: 250
      tests: [{waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.02}}]
blind:
  seed: 77
  cases: 8
  kinds: {single: 0, pair: 0, none: 1, outside: 0}
  campaigns:
    - name: two_tests
      tests:
        - {waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.02}, cycles: 4}
        - {waveform: {kind: sine, frequency_Hz: 2, amplitude_m: 0.01}, cycles: 6}
"""
COSTS = {"seconds", "diagnose_seconds", "peak_memory_MB"}


def content(case: Scored) -> dict[str, object]:
    return case.model_dump(exclude=COSTS)


@pytest.mark.ci
@pytest.mark.usefixtures("threads")
def test_a_run_stops_and_goes_on_and_does_not_hang_on_the_number_of_processes(
    small: Small, benchmark_of: BenchmarkOf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    two = benchmark_of(small(), tmp_path / "two").run(jobs=2)
    first = benchmark_of(small("blind.cases=1"), tmp_path / "one").run(jobs=1)
    kept = (tmp_path / "one" / "scored" / "00000.json").stat().st_mtime_ns
    both = benchmark_of(small(), tmp_path / "one").run(jobs=1)
    assert (tmp_path / "one" / "scored" / "00000.json").stat().st_mtime_ns == kept
    assert [content(case) for case in both] == [content(case) for case in two]
    assert content(first[0]) == content(both[0])
    assert [case.failure for case in both] == [None, None]

    assert {path.name for path in tmp_path.rglob("*.csv")} <= {"parameters.csv"}  # the records are not kept
    assert not list(tmp_path.rglob("*.npz"))

    def refuse(*_: object) -> None:
        raise AssertionError("a finished case was begun again")

    monkeypatch.setattr(ChunkedWork, "do", refuse)
    assert benchmark_of(small(), tmp_path / "one").run(jobs=1) == both


@pytest.mark.ci
def test_cases_are_drawn_and_diagnosed_in_processes_of_their_own(
    small: Small, benchmark_of: BenchmarkOf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[int] = []

    def counting_pool(count: int) -> Executor:
        begun.append(count)
        return spawned_pool(count)

    monkeypatch.setattr(engines, "spawned_pool", counting_pool)
    (case,) = benchmark_of(small("blind.cases=1"), tmp_path).run(jobs=2)
    assert begun == [1, 1]
    assert case.failure is None
    assert case.peak_memory_MB > 0.0


@pytest.mark.ci
def test_a_dask_cluster_gives_the_same_scores(small: Small, benchmark_of: BenchmarkOf, tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="pip install pzd[cluster]")
    here = benchmark_of(small(), tmp_path / "here").run(jobs=2)
    there = benchmark_of(small("blind.engine=dask"), tmp_path / "there").run(jobs=2)
    assert [content(case) for case in there] == [content(case) for case in here]
    assert [case.failure for case in there] == [None, None]


def test_the_diagnosis_is_given_a_folder_without_the_truth(
    small: Small, setup_of: SetupOf, benchmark_of: BenchmarkOf, tmp_path: Path
) -> None:
    config = small()
    setup, files = setup_of(config), CaseFiles(tmp_path / "here")
    (planned, _) = plan(setup.blind)
    hide(setup, planned, files)
    given = files.case(planned.id)
    assert {path.relative_to(given).as_posix() for path in given.rglob("*.*")} == {
        "rig/r01.csv",
        "rig/r02.csv",
        "rig/r03.csv",
    }
    header = (given / "rig" / "r01.csv").read_text(encoding="utf-8").partition("\n")[0]
    assert set(header.split(",")) <= {"time_s", "displacement_m", "force_N", "voltage_V", "temperature_degC"}
    hidden = json.loads(files.truth(planned.id).read_text(encoding="utf-8"))
    assert hidden["effects"] == list(planned.hidden)

    files.truth(planned.id).parent.rename(tmp_path / "elsewhere")
    diagnose_case(benchmark_of(config, tmp_path).methods, given)
    assert json.loads((given / COST).read_text(encoding="utf-8"))["failure"] is None
    assert (given / "diagnosis.json").exists()


def test_a_failed_diagnosis_is_a_case_with_its_message(
    small: Small, setup_of: SetupOf, benchmark_of: BenchmarkOf, tmp_path: Path
) -> None:
    config, files = small(), CaseFiles(tmp_path)
    (planned, _) = plan(setup_of(config).blind)
    hide(setup_of(config), planned, files)
    for path in files.rig(planned.id).iterdir():
        path.write_text("time_s,force_N\n0,1\n", encoding="utf-8")
    diagnose_case(benchmark_of(config, tmp_path).methods, files.case(planned.id))
    cost = json.loads((files.case(planned.id) / COST).read_text(encoding="utf-8"))
    assert "DataError" in cost["failure"] or "ConfigError" in cost["failure"]


def test_a_drawn_case_depends_on_seed_and_number_alone(small: Small, setup_of: SetupOf) -> None:
    short, long = setup_of(small()), setup_of(small("blind.cases=5"))
    for setup in (short, long):
        assert plan(setup.blind)[:2] == plan(short.blind)
    one, same = (draw_case(setup, plan(setup.blind)[0]) for setup in (short, long))
    assert one.truth == same.truth
    assert all(np.array_equal(a["force_N"], b["force_N"]) for a, b in zip(one.rig_files, same.rig_files, strict=True))
    other_seed = draw_case(setup_of(small("blind.seed=78")), plan(short.blind)[0])
    assert other_seed.truth.damper != one.truth.damper


def test_an_effect_has_the_size_that_was_drawn(
    small: Small, setup_of: SetupOf, seeds: Callable[[int], list[int]]
) -> None:
    # Of a damper from everywhere an effect may change less at its most.
    near = "blind.base_spread=0.1"
    setup = setup_of(small(f"blind.seed={seeds(1)[0]}", "blind.kinds.none=0", "blind.cases=12", near))
    for planned in plan(setup.blind)[1:12:5]:
        truth = draw_case(setup, planned).truth
        assert truth.sizes[planned.hidden[0]] == pytest.approx(0.05, rel=0.02)


def test_the_first_cases_are_fairly_mixed(small: Small) -> None:
    shares = ("blind.kinds.single=0.45", "blind.kinds.pair=0.1", "blind.kinds.none=0.25", "blind.kinds.outside=0.2")
    config = small(*shares, "blind.cases=400")
    assert config.blind is not None
    cases = plan(config.blind)
    for count in (20, 60, 400):
        found = Counter(case.kind for case in cases[:count])
        assert found == {"single": 0.45 * count, "pair": 0.1 * count, "none": 0.25 * count, "outside": 0.2 * count}
    singles = Counter(case.hidden for case in cases if case.kind == "single")
    assert max(singles.values()) - min(singles.values()) <= 1
    assert len(singles) == len([e for e in nameable().values() if e.needs != "voltage" and not e.beside_gas])


def test_a_seed_that_was_tuned_on_gives_no_result(small: Small) -> None:
    with pytest.raises(ConfigError, match="seed 2 is one that thresholds were tuned on"):
        small("blind.seed=2")
    assert small("blind.seed=2", "blind.tuning=true").blind is not None
    with pytest.raises(ConfigError, match="seed 77 is none of tuned_on"):
        small("blind.tuning=true")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SMALL.split("blind:")[0], "the config has no such block"),
        (SMALL.replace("  virtual:\n", "  virtual:\n" + SECOND), "pzd blind needs one virtual stand"),
        (SMALL.replace("seed: 77", "seed: 1"), "seed 1 is one that thresholds were tuned on"),
    ],
)
def test_a_config_that_cannot_be_used_is_refused(
    text: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "wrong.yaml"
    path.write_text(text, encoding="utf-8")
    assert status(["blind", str(path), "--runs", str(tmp_path / "runs")]) == ConfigError.exit_code
    assert said in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()


def test_no_process_outlives_a_benchmark_that_is_killed() -> None:
    text = """
import os, time
from pzd.parallel.processes import spawned_pool
if __name__ == "__main__":
    pool = spawned_pool(1)
    print(pool.submit(os.getpid).result(), flush=True)
    time.sleep(600)
"""
    with subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, text=True, cwd=ROOT) as benchmark:
        assert benchmark.stdout is not None
        worker = int(benchmark.stdout.readline())
        benchmark.kill()
    deadline = time.monotonic() + 60.0
    while running(worker):
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.ci
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="finds processes in /proc")
def test_scores_are_the_same_though_a_worker_and_then_the_benchmark_are_killed(tmp_path: Path) -> None:
    path = tmp_path / "killed.yaml"
    path.write_text(NOTHING_HIDDEN, encoding="utf-8")

    def command(folder: str) -> list[str]:
        return [sys.executable, "-m", "pzd", "blind", str(path), "--runs", str(tmp_path / folder), "--jobs", "2", "-q"]

    def scores(folder: str) -> dict[str, dict[str, object]]:
        found = {each.name: json.loads(each.read_text("utf-8")) for each in tmp_path.glob(f"{folder}/**/scored/*.json")}
        return {name: {key: z for key, z in score.items() if key not in COSTS} for name, score in found.items()}

    def wait_for(count: int) -> None:
        deadline = time.monotonic() + 300.0
        while len(scores("killed")) < count:
            assert time.monotonic() < deadline
            time.sleep(0.02)

    subprocess.run(command("whole"), check=True, cwd=ROOT)
    with subprocess.Popen(command("killed"), cwd=ROOT) as benchmark:
        wait_for(1)
        os.kill(workers_of(benchmark.pid)[0], signal.SIGKILL)
        wait_for(3)
        left = workers_of(benchmark.pid)
        benchmark.kill()
    assert len(scores("killed")) < 8
    deadline = time.monotonic() + 60.0
    while any(running(worker) for worker in left):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    subprocess.run(command("killed"), check=True, cwd=ROOT)
    assert len(scores("whole")) == 8
    assert scores("killed") == scores("whole")
    assert all(score["failure"] is None for score in scores("killed").values())


def test_a_diagnosis_that_kills_its_process_every_time_is_a_failed_case(
    small: Small, benchmark_of: BenchmarkOf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _with_losses(monkeypatch, step=1)
    benchmark = benchmark_of(small("blind.cases=1"), tmp_path)
    (case,) = benchmark.run(jobs=1)
    assert case.failure == "the process that did it was lost 3 times: it was killed"
    assert case.verdict is None
    assert benchmark.finished(plan(benchmark.setup.blind)) == {case.id: case}


def test_a_case_that_cannot_be_drawn_has_no_score_and_is_reported(
    small: Small, benchmark_of: BenchmarkOf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _with_losses(monkeypatch, step=0)
    benchmark = benchmark_of(small("blind.cases=1"), tmp_path)
    assert benchmark.run(jobs=1) == ()
    assert benchmark.undrawn == {"00000": "the process that did it was lost 3 times: it was killed"}


def _with_losses(monkeypatch: pytest.MonkeyPatch, step: int) -> None:
    """Let every process of one step be lost."""

    class Lost(ThreadPoolExecutor):
        def submit(self, *given: Any, **more: Any) -> Future[Any]:
            future: Future[Any] = Future()
            future.set_exception(BrokenProcessPool())
            return future

    @contextmanager
    def engine(where: Where, jobs: int, steps: int) -> Iterator[Pools]:
        with Lost(jobs) as lost, ThreadPoolExecutor(jobs) as sound:
            yield Pools([lost if i == step else sound for i in range(steps)], jobs)

    monkeypatch.setattr(chunks, "ENGINES", {"local": engine})


def workers_of(parent: int) -> list[int]:
    """The processes of its pools."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            above = int((place / "stat").read_text().rpartition(")")[2].split()[1])
            if above == parent and b"spawn_main" in (place / "cmdline").read_bytes():
                found.append(int(place.name))
    return found


def running(process: int) -> bool:
    """Whether a process of that number is there."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_when_within_a_sample_a_friction_turns_is_no_gap() -> None:
    """A spring of a micrometre decides whether the sample at a reversal has the force from before it or from after."""
    t, w = np.arange(0.001, 4.0, 0.002), 2.0 * np.pi
    motion = Motion(t, 0.02 * np.sin(w * t), 0.02 * w * np.cos(w * t), -0.02 * w**2 * np.sin(w * t))
    force = 300.0 * np.sign(motion.velocity) + 100.0 * motion.velocity
    record = NoiseFreeRecord(motion, force, force)
    sooner, much_sooner = np.roll(force, 1), np.roll(force, 8)
    assert np.max(np.abs(force - sooner)) > 500.0
    assert np.max(np.abs(record.missed_by(sooner))) < 0.02 * 300.0
    assert np.max(np.abs(record.missed_by(much_sooner))) > 500.0


def test_the_gap_cut_is_one_when_the_truth_is_found_and_nothing_when_nothing_changes() -> None:
    row = BaseRow(T0_N=500.0, C_Ns_per_m=3000.0, k_N_per_m=3e5)
    plain = Damper(base=(row,))
    true = plain.with_effect("asymmetry", {"alpha": 0.1})
    t = np.arange(0.0, 2.0, 1e-3)
    w = 2.0 * np.pi
    motion = Motion(t, 0.02 * np.sin(w * t), 0.02 * w * np.cos(w * t), -0.02 * w**2 * np.sin(w * t))
    force = respond(true, motion)
    clean = {"r01": NoiseFreeRecord(motion, force, 1.02 * force - 5.0)}
    stronger = Damper(base=(row.model_copy(update={"T0_N": 510.0, "C_Ns_per_m": 3060.0, "k_N_per_m": 3.06e5}),))

    def said(damper: Damper) -> Diagnosed:
        gap = Gap(before=1.0, after=0.0, noise_floor=0.0, standard_error=0.0, held_out=("r01",), hold_out="records")
        diagnosis = Diagnosis(
            verdict="named",
            reason="",
            effects=("asymmetry",),
            confidence=None,
            gap=gap,
            parameters={},
            ranking=(),
            rivals=(),
            where=(),
            next_test=None,
        )
        return Diagnosed(diagnosis, damper, plain)

    def cut(damper: Damper, *, gains_out: bool = False) -> float:
        return gap_cut(said(damper), clean, gains_out=gains_out)

    assert cut(true) == pytest.approx(1.0, abs=1e-9)
    assert cut(plain) == pytest.approx(0.0, abs=1e-9)
    assert cut(stronger.with_effect("asymmetry", {"alpha": 0.1})) < 0.99
    assert cut(stronger.with_effect("asymmetry", {"alpha": 0.1}), gains_out=True) == pytest.approx(1.0, abs=1e-3)
    # A force that is recorded 2 % too large is that of a damper whose T0, C and k are.
    most = gap_cut_of_truth(said(plain), clean)
    assert most == pytest.approx(cut(stronger.with_effect("asymmetry", {"alpha": 0.1})), abs=1e-3)


def test_a_late_force_is_told_from_a_viscous_damper_on_a_soft_spring_by_its_flank_or_several_frequencies() -> None:
    """At one frequency a viscous damper behind a spring lags as a late force does; a friction shows the spring."""

    def told(friction: float, frequencies: tuple[float, ...], noise: float = 0.01) -> bool:
        damper = Damper(base=(BaseRow(T0_N=friction, C_Ns_per_m=3000.0, k_N_per_m=2e5),))
        t, records = np.arange(0.0, 2.0, 2e-3), {}
        for number, frequency in enumerate(frequencies):
            w = 2.0 * np.pi * frequency
            motion = Motion(t, 0.02 * np.sin(w * t), 0.02 * w * np.cos(w * t), -0.02 * w**2 * np.sin(w * t))
            force = respond(damper, motion)
            records[f"r{number}"] = NoiseFreeRecord(motion, force, force)
        truth = Truth(
            id="00000", seed=1, kind="none", campaign="", effects=(), form=None, form_values={}, damper=damper,
            sizes={}, force_noise=noise, noise_rho=0.0, displacement_noise_m=0.0, warming=False,
            one_frequency=len(set(frequencies)) == 1, lowest_peak_N=min(r.peak for r in records.values()),
            visible_gap=0.0, gap_given_other={},
        )  # fmt: skip
        assert told_apart(truth, records, ("sensor_delay", "lash"))  # a play counts at any size
        return told_apart(truth, records, ("sensor_delay",))

    assert not told(0.0, (1.0, 1.0, 1.0))
    assert told(0.0, (0.5, 1.0, 4.0))
    assert told(400.0, (1.0, 1.0, 1.0))
    assert not told(400.0, (1.0, 1.0, 1.0), noise=0.3)
    assert not told(400.0, (1.0,))  # the delay of a single test may be its own


# --- The ledger ---


def scored_run(seed: int = 5, generator: str = "own", made_from: str = "a", cases: int = 60) -> ScoredSeed:
    return ScoredSeed(seed=seed, generator=generator, made_from=made_from, cases=cases, date="2026-11-22")


def test_a_seed_of_other_code_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.csv"
    enter(ledger, scored_run())
    before = ledger.read_bytes()
    with pytest.raises(ConfigError, match="seed 5 was scored with another config or other code on 2026-11-22"):
        enter(ledger, scored_run(made_from="b"))
    assert ledger.read_bytes() == before


def test_the_same_run_goes_on_and_one_of_more_cases_is_entered(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.csv"
    for one in (
        scored_run(),
        scored_run(cases=20),
        scored_run(),
        scored_run(cases=200),
        scored_run(seed=6),
        scored_run(generator="independent", made_from="b"),
    ):
        enter(ledger, one)
    assert [(one.seed, one.generator, one.cases) for one in read_ledger(ledger)] == [
        (5, "own", 60),
        (5, "own", 200),
        (6, "own", 60),
        (5, "independent", 60),
    ]


def test_a_ledger_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.csv"
    ledger.write_text("seed,what\n1,2\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"ledger\.csv"):
        enter(ledger, scored_run())


def test_the_command_refuses_a_seed_that_the_ledger_holds_for_other_code(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "blind.yaml"
    text = (ROOT / "configs" / "blind.yaml").read_text(encoding="utf-8")
    config.write_text(text, encoding="utf-8")
    enter(tmp_path / "blind-ledger.csv", scored_run(seed=777))
    given = ["blind", str(config), "--runs", str(tmp_path / "runs"), "--set", "blind.seed=777"]
    assert status(given) == ConfigError.exit_code
    assert "seed 777 was scored with another config or other code" in capsys.readouterr().err
    assert not list(tmp_path.rglob("cases"))


def test_the_committed_ledger_can_be_read() -> None:
    assert all(one.cases > 0 for one in read_ledger(ROOT / "configs" / "blind-ledger.csv"))
    assert read_ledger(ROOT / "configs" / "blind-ledger.csv")
