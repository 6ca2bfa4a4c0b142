"""A benchmark small enough to run in seconds, and scored cases made by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from pzd.blind.benchmark import Benchmark, Methods
from pzd.blind.case import CaseFiles, Scored
from pzd.blind.hide import BenchmarkSetup
from pzd.config import RunConfig, load
from pzd.parallel.engines import Where

SMALL = """
rig:
  virtual:
    - damper: {base: [{voltage_V: 0, T0_N: 301, C_Ns_per_m: 2720, k_N_per_m: 199000}]}
      voltages_V: [0]
      rate_Hz: 250
      tests: [{waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.02}}]
blind:
  seed: 77
  tuned_on: [1, 2]
  cases: 2
  sizes: [0.05, 0.05]
  kinds: {single: 1, pair: 0, none: 1, outside: 0}
  campaigns:
    - name: two_tests
      tests:
        - {waveform: {kind: sine, frequency_Hz: 1, amplitude_m: 0.02}, cycles: 4}
        - {waveform: {kind: sine, frequency_Hz: 2, amplitude_m: 0.02}, cycles: 6}
        - {waveform: {kind: sine, frequency_Hz: 2, amplitude_m: 0.01}, cycles: 6}
"""


@pytest.fixture
def small(tmp_path: Path) -> Callable[..., RunConfig]:
    """The small config, with values overridden."""
    path = tmp_path / "small.yaml"
    path.write_text(SMALL, encoding="utf-8")
    return lambda *overrides: load(path, overrides)


@pytest.fixture
def setup_of() -> Callable[[RunConfig], BenchmarkSetup]:
    """What the cases of a config start from."""

    def made(config: RunConfig) -> BenchmarkSetup:
        assert config.blind is not None
        assert config.rig.virtual is not None
        return BenchmarkSetup(config.blind, config.rig.virtual[0], config.diagnose.nuisance, config.control.signal())

    return made


@pytest.fixture
def benchmark_of(setup_of: Callable[[RunConfig], BenchmarkSetup]) -> Callable[[RunConfig, Path], Benchmark]:
    """The benchmark of a config in a folder."""

    def made(config: RunConfig, folder: Path) -> Benchmark:
        setup = setup_of(config)
        methods = Methods(config.identify, config.diagnose, config.rig.limits, setup.control, config.seed)
        return Benchmark(setup, methods, CaseFiles(folder), "test", Where(setup.blind, "blind", folder, folder))

    return made


@pytest.fixture
def case() -> Callable[..., Scored]:
    """A scored case: a visible asymmetry, rightly named, but for what is said."""

    def made(**said: object) -> Scored:
        usual: dict[str, object] = {
            "id": "00000",
            "made_from": "test",
            "kind": "single",
            "campaign": "two_by_two",
            "one_frequency": False,
            "hidden": "asymmetry",
            "truth": ("asymmetry",),
            "force_noise": 0.01,
            "noise_rho": 0.0,
            "displacement_noise_m": 1e-6,
            "visible_gap": 0.02,
            "gap_given_other": {},
            "verdict": "named",
            "effects": ("asymmetry",),
            "rivals": (),
            "confidence": 0.97,
            "shapes": (),
            "inside": {"asymmetry.alpha": True},
            "gap_cut": 0.95,
            "gap_cut_gains_out": 0.97,
            "gap_cut_of_truth": 0.96,
            "next_test": False,
            "seconds": 2.0,
            "diagnose_seconds": 1.0,
            "peak_memory_MB": 200.0,
            "failure": None,
        }
        return Scored.model_validate({**usual, **said})

    return made
