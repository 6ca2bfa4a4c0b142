"""A sweep runs a config many times; where it is stopped it goes on, and it says what decides."""

from __future__ import annotations

import csv
import math
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pzd.artefacts import Diagnosed, ParameterRow
from pzd.config import SweepConfig
from pzd.damper.model import BaseRow, Damper
from pzd.parallel import chunks
from pzd.parallel.engines import Pools, Where
from pzd.parallel.processes import Progress
from pzd.pipeline.command import execute
from pzd.quantities import Control
from pzd.schema.errors import ConfigError, DataError
from pzd.sweep.campaign import SweepRuns
from pzd.sweep.gather import Results, page, write
from pzd.sweep.task import BaseRun, RunResult, check_scatter, design, scattered, tasks

SMALL = """
rig:
  virtual:
    - damper: {base: [{voltage_V: 0, T0_N: 300, C_Ns_per_m: 2700, k_N_per_m: 200000}]}
      voltages_V: [0]
      rate_Hz: 200
      tests:
        - {waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.02}, cycles: 4}
        - {waveform: {kind: sine, frequency_Hz: 2, amplitude_m: 0.02}, cycles: 4}
      noise: {force: {share_of_peak: 0.01}}
sweep:
  until: identify
  chunk: 2
  over:
    rig.virtual.0.damper.base.0.T0_N: [100, 200, 400]
    seed: [1, 2]
"""
UNIFORM = {"uniform": (-math.pi, math.pi)}
UNIT = {"uniform": (0.0, 1.0)}


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(SMALL, encoding="utf-8")
    return path


def swept(path: Path, runs: Path, *overrides: str, jobs: int = 1) -> tuple[SweepRuns, tuple[RunResult, ...]]:
    campaign = SweepRuns.of(BaseRun(path, runs, overrides))
    shared = campaign.last_shared_stage()
    if shared:
        execute(campaign.base.opened, shared, force=False, jobs=1, say=lambda _: None)
    found = campaign.run(jobs)
    campaign.gather(found, path.stem)
    return campaign, found


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


# ------------------------------------------------------------ the plan


def test_every_combination_is_run_with_the_same_draws() -> None:
    sweep = SweepConfig(over={"a": (1, 2), "b": ("x", "y", "z")}, drawn={"c": UNIFORM}, draws=4)
    found = tasks(sweep, seed=1)
    assert [dict(task.over) for task in found[::4]] == [{"a": a, "b": b} for a in (1, 2) for b in "xyz"]
    assert all(task.drawn == other.drawn for task, other in zip(found[:4], found[4:8], strict=True))
    assert found[0].overrides[:2] == ("a=1", "b=x")


def test_draws_have_the_distribution_that_is_asked_for() -> None:
    sweep = SweepConfig(drawn={"u": {"uniform": (2.0, 6.0)}, "n": {"normal": (10.0, 0.5)}}, draws=256)
    found = [dict(task.drawn) for task in tasks(sweep, seed=3)]
    u, n = (np.array([each[key] for each in found]) for key in "un")
    assert 2.0 < u.min() < 2.05
    assert 5.95 < u.max() < 6.0
    assert np.mean(n) == pytest.approx(10.0, abs=0.01)
    assert np.std(n) == pytest.approx(0.5, rel=0.02)


def test_the_design_takes_one_column_at_a_time_from_the_other_half() -> None:
    rows = design(SweepConfig(drawn=dict.fromkeys("abc", UNIFORM), draws=8), seed=1)
    a, b, *mixed = rows.reshape(5, 8, 3)
    for i, one in enumerate(mixed):
        assert np.array_equal(one[:, i], b[:, i])
        others = [j for j in range(3) if j != i]
        assert np.array_equal(one[:, others], a[:, others])


@pytest.mark.parametrize(
    ("block", "says"),
    [
        ({}, "nothing differs from run to run"),
        ({"over": {"a": ()}}, "over.a has no values"),
        ({"over": {"a": (1,)}, "drawn": {"a": UNIFORM}}, "under over and under drawn"),
        ({"drawn": {"a": UNIFORM}, "draws": 12}, "power of two"),
        ({"drawn": {"a": {"uniform": (2.0, 1.0)}}}, "below the second"),
        ({"drawn": {"a": {"normal": (2.0, 0.0)}}}, "above 0"),
        ({"damper": {"T0": 0.1}, "until": "identify"}, "scatters behind diagnose"),
        ({"over": {"a": (1,)}, "address": "tcp://x"}, "belongs to engine: dask"),
    ],
)
def test_a_block_that_makes_no_sense_is_refused(block: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        SweepConfig(**block)


# ------------------------------------------------------------ dampers of a series


def diagnosed(*, k_low: float | None = 180e3) -> Diagnosed:
    rows = [BaseRow(voltage_V=v, T0_N=300.0 + v, C_Ns_per_m=2700.0, k_N_per_m=2e5) for v in (0.0, 100.0)]
    damper = Damper(base=tuple(rows)).with_effect("orifice_quadratic", {"q": 2500.0})
    known = tuple(
        ParameterRow(
            setting=None,
            voltage_V=row.voltage_V,
            temperature_degC=None,
            **{f"{name}{end}": None for name in ("C_Ns_per_m",) for end in ("_low95", "_high95")},
            T0_N=row.T0_N,
            T0_N_low95=row.T0_N - 1.96,
            T0_N_high95=row.T0_N + 1.96,
            C_Ns_per_m=row.C_Ns_per_m,
            k_N_per_m=row.k_N_per_m,
            k_N_per_m_low95=k_low,
            k_N_per_m_high95=220e3,
            W_s=0.0,
            rmse_N=0.0,
            status="ok",
        )
        for row in rows
    )
    found = Diagnosed.undiagnosed(damper)
    return Diagnosed(found.diagnosis, damper, damper, known)


def test_a_parameter_scatters_by_its_share_at_every_voltage_alike() -> None:
    moved = scattered(diagnosed(), {"T0": 0.1, "orifice_quadratic.q": 0.2}, {"T0": 1.0, "orifice_quadratic.q": -2.0})
    assert [row.T0_N for row in moved.damper.base] == pytest.approx([300.0 * math.exp(0.1), 400.0 * math.exp(0.1)])
    assert moved.damper.effects["orifice_quadratic"]["q"] == pytest.approx(2500.0 * math.exp(-0.4))
    assert [row.C_Ns_per_m for row in moved.damper.base] == [2700.0, 2700.0]
    assert moved.baseline == moved.damper


def test_a_parameter_moves_in_its_interval_by_its_standard_error() -> None:
    moved = scattered(diagnosed(), {"T0": "interval"}, {"T0": 2.0})
    assert [row.T0_N for row in moved.damper.base] == pytest.approx([302.0, 402.0], abs=1e-4)


def test_what_is_not_there_or_has_no_interval_cannot_scatter() -> None:
    with pytest.raises(ConfigError, match=r"there is T0, C, k, orifice_quadratic\.q \(got T_0\)"):
        check_scatter({"T_0": 0.1}, diagnosed())
    with pytest.raises(DataError, match=r"sweep\.damper\.k: the tests leave no interval"):
        check_scatter({"k": "interval"}, diagnosed(k_low=None))
    with pytest.raises(DataError, match=r"sweep\.damper\.orifice_quadratic\.q: the tests leave no interval"):
        check_scatter({"orifice_quadratic.q": "interval"}, diagnosed())


# ------------------------------------------------------------ what decides


def test_the_indices_are_those_published_for_ishigamis_function() -> None:
    """Sobol and Levitan 1999: a = 7, b = 0.1; first order 0.3139, 0.4424, 0, total order 0.5576, 0.4424, 0.2437."""
    sweep = SweepConfig(drawn=dict.fromkeys("xyz", UNIFORM), draws=2048)
    runs = tasks(sweep, seed=5)

    def ishigami(x: float, y: float, z: float) -> float:
        return math.sin(x) + 7.0 * math.sin(y) ** 2 + 0.1 * z**4 * math.sin(x)

    outcomes = tuple(RunResult(task=run.number, rows=({"f": ishigami(**dict(run.drawn))},)) for run in runs)
    found = {row.quantity: row for row in Results(sweep, runs, outcomes).indices}
    assert [found[name].first_order for name in "xyz"] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.01)
    assert [found[name].total_order for name in "xyz"] == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.01)
    assert all(
        row.total_order_low95 is not None
        and row.total_order_high95 is not None
        and row.total_order_low95 < row.total_order < row.total_order_high95
        for row in found.values()
    )


def test_a_quantity_that_changes_nothing_has_an_index_of_zero_and_no_interval() -> None:
    sweep = SweepConfig(drawn=dict.fromkeys("xy", UNIT), draws=64)
    runs = tasks(sweep, seed=5)
    outcomes = tuple(RunResult(task=run.number, rows=({"f": dict(run.drawn)["x"]},)) for run in runs)
    of_x, of_y = Results(sweep, runs, outcomes).indices
    assert of_x.total_order == pytest.approx(1.0, abs=0.02)
    assert (of_y.total_order, of_y.total_order_low95) == (0.0, None)
    assert Results(sweep, runs, outcomes).indices == (of_x, of_y)  # resampled from the seed


def test_the_spread_counts_the_independent_draws_alone() -> None:
    sweep = SweepConfig(drawn=dict.fromkeys("xy", UNIT), draws=64)
    runs = tasks(sweep, seed=5)
    outcomes = tuple(RunResult(task=run.number, rows=({"f": dict(run.drawn)["x"]},)) for run in runs)
    (row,) = Results(sweep, runs, outcomes).spread
    assert row.draws == 128
    assert row.mean == pytest.approx(0.5, abs=0.02)
    assert (row.percent_5, row.percent_95) == pytest.approx((0.05, 0.95), abs=0.03)


def test_a_run_without_a_result_is_told_and_leaves_no_indices(tmp_path: Path) -> None:
    sweep = SweepConfig(drawn=dict.fromkeys("xy", UNIT), draws=2)
    runs = tasks(sweep, seed=5)
    whole = tuple(RunResult(task=run.number, rows=({"f": dict(run.drawn)["x"]},)) for run in runs)
    assert Results(sweep, runs, whole).indices
    results = Results(sweep, runs, (RunResult(task=1, failure="too heavy"), *whole[1:]))
    write(results, tmp_path, Control())
    assert results.indices == ()
    assert '1,"x=' in (tmp_path / "failed.csv").read_text()
    assert "too heavy" in page(results, "a sweep")


# ------------------------------------------------------------ running it


@pytest.mark.ci
@pytest.mark.usefixtures("threads")
def test_a_run_of_a_sweep_is_the_run_with_these_values_set(
    small: Path, tmp_path: Path, pzd_here: Callable[..., Any]
) -> None:
    campaign, _ = swept(small, tmp_path / "runs")
    with (campaign.folder / "results.csv").open() as file:
        row = list(csv.DictReader(file))[3]
    key = "rig.virtual.0.damper.base.0.T0_N"
    assert (row["task"], row[key], row["seed"]) == ("4", "200", "2")
    done = pzd_here("identify", small, "--runs", tmp_path / "other", "--set", f"{key}=200", "--set", "seed=2", "-q")
    assert done.returncode == 0, done.stderr
    with (tmp_path / "other" / "small" / "2-identify" / "parameters.csv").open() as file:
        (alone,) = csv.DictReader(file)
    assert {name: row[name] for name in alone} == alone
    assert abs(float(row["T0_N"]) - 200.0) < 20.0


@pytest.mark.ci
@pytest.mark.usefixtures("threads")
def test_a_sweep_goes_on_where_it_was_and_does_not_hang_on_how_it_is_run(small: Path, tmp_path: Path) -> None:
    campaign, found = swept(small, tmp_path / "a")
    others, same = swept(small, tmp_path / "b", "sweep.chunk=4", jobs=3)
    assert found == same
    assert files(campaign.folder) == files(others.folder)
    kept, lost, *_ = sorted((campaign.folder / "chunks").iterdir())
    before, stamp = lost.read_bytes(), kept.stat().st_mtime_ns
    lost.write_bytes(before[:40])
    assert len(campaign.finished()) == 4
    assert campaign.run(1) == found
    assert lost.read_bytes() == before
    assert kept.stat().st_mtime_ns == stamp


@pytest.mark.usefixtures("threads")
def test_other_values_are_another_sweep(small: Path, tmp_path: Path) -> None:
    swept(small, tmp_path)
    assert SweepRuns.of(BaseRun(small, tmp_path, ("rig.virtual.0.rate_Hz=250",))).finished() == ()


@pytest.mark.usefixtures("threads")
def test_a_value_that_is_no_value_of_the_config_is_refused_before_anything_runs(small: Path, tmp_path: Path) -> None:
    small.write_text(SMALL.replace("seed: [1, 2]", "seed: [1, -2, x]"), encoding="utf-8")
    with pytest.raises(ConfigError) as refused:
        SweepRuns.of(BaseRun(small, tmp_path / "runs", ())).last_shared_stage()
    assert len(refused.value.messages) == 2
    assert not (tmp_path / "runs").exists()


def test_rides_of_a_config_without_a_car_are_refused(small: Path, tmp_path: Path) -> None:
    text = SMALL.replace("until: identify", "until: simulate")
    small.write_text(f"car: false\n{text}", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"sweep\.until: car: false leaves the rides out"):
        SweepRuns.of(BaseRun(small, tmp_path, ()))


def test_a_run_that_kills_its_process_is_set_aside_and_the_others_go_on(
    small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Killed(ThreadPoolExecutor):
        """Loses its process wherever the third run is at work."""

        def submit(self, function: Callable[..., Any], /, *given: Any, **more: Any) -> Future[Any]:
            future: Future[Any] = Future()
            chunk: Sequence[Any] = given[0]
            if any(task.number == 3 for task in chunk):
                future.set_exception(BrokenProcessPool("it was killed"))
                return future
            return super().submit(function, *given, **more)

    @contextmanager
    def engine(where: Where, jobs: int, steps: int) -> Iterator[Pools]:
        with Killed(jobs) as pool:
            yield Pools([pool] * steps, jobs)

    monkeypatch.setattr(chunks, "ENGINES", {"local": engine})
    _, found = swept(small, tmp_path)
    assert [outcome.task for outcome in found if outcome.failure] == [3]
    assert "lost 3 times: it was killed" in str(found[2].failure)
    assert all(outcome.rows for outcome in found if outcome.task != 3)


@pytest.mark.ci
def test_the_command_runs_a_sweep_and_says_what_decides(root: Path, tmp_path: Path, pzd: Callable[..., Any]) -> None:
    few = ("--runs", tmp_path, "--set", "sweep.draws=4")
    done = pzd("sweep", root / "configs" / "sweep.yaml", *few)
    assert done.returncode == 0, done.stderr
    assert "48 runs, 0 without a result" in done.stdout
    assert "of the variance" in done.stdout
    folder = tmp_path / "sweep" / "sweep"
    assert (folder / "sweep.html").read_text().count("data:image/svg+xml") == 5
    status = pzd("sweep", root / "configs" / "sweep.yaml", "--status", *few)
    assert status.stdout == "48 of 48 runs done, 0 of them without a result\n"


@pytest.mark.ci
def test_dask_gives_the_same_bytes_though_a_worker_is_killed(small: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="pip install pzd[cluster]")
    alone, _ = swept(small, tmp_path / "a", "sweep.chunk=1", jobs=2)
    killed: list[int] = []
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as cluster:

        def kill_one(_: Progress) -> None:
            if not killed:
                killed.append(next(iter(cluster.workers.values())).process.pid)
                os.kill(killed[0], signal.SIGKILL)

        overrides = ("sweep.engine=dask", f"sweep.address={cluster.scheduler_address}", "sweep.chunk=1")
        campaign = SweepRuns.of(BaseRun(small, tmp_path / "b", overrides), kill_one)
        campaign.gather(campaign.run(2), "small")
    assert killed
    assert files(campaign.folder) == files(alone.folder)


def test_the_page_says_how_each_quantity_is_drawn_and_names_keys_by_their_last_word() -> None:
    sweep = SweepConfig(
        over={"simulate.car.x_K_m": (0.5, 0.75)},
        drawn={"a": {"normal": (3.0, 0.5)}},
        damper={"T0": 0.05, "k": "interval"},
        draws=2,
    )
    runs = tasks(sweep, seed=5)
    outcomes = tuple(
        RunResult(task=run.number, rows=({"case": "B", "point": "K", "a_w_m_per_s2": dict(run.drawn)["a"]},))
        for run in runs
    )
    text = page(Results(sweep, runs, outcomes), "a sweep")
    for said in (
        "a: drawn about 3 with a standard deviation of 0.5",
        "damper.T0: scatters by 0.05 of its value",
        "damper.k: drawn as uncertain as the tests leave it",
        "x_K_m = 0.75, B",
    ):
        assert said in text
