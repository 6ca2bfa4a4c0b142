"""The `blind` block of the config: what is hidden, in which campaigns, under how much noise."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, field_validator, model_validator

from pzd.parallel.config import EngineConfig
from pzd.rig.stand.config import StandTest, Warming
from pzd.schema.model import Frozen


class Kinds(Frozen):
    """How many cases hide what, as shares of all cases."""

    single: float = Field(default=0.45, ge=0.0)
    """One effect of the library."""
    pair: float = Field(default=0.1, ge=0.0)
    """Two effects of the library."""
    none: float = Field(default=0.25, ge=0.0)
    """Nothing."""
    outside: float = Field(default=0.2, ge=0.0)
    """A force that is not in the library."""


class TestPlan(Frozen):
    """What the stand runs in one case."""

    name: str = Field(pattern=r"^[a-z0-9_]+$")
    """What the tables call it."""
    share: float = Field(default=1.0, gt=0.0)
    """How many of the cases run it, beside the shares of the other campaigns."""
    tests: tuple[StandTest, ...] = Field(min_length=1)
    """What is run; voltages that a test does not name are those of `rig.virtual`."""

    @property
    def moves_voltage(self) -> bool:
        """Whether the voltage moves in some test: without that, no effect of the drive can be seen."""
        return any(not isinstance(voltage, float | int) for test in self.tests for voltage in test.voltages_V or ())

    @property
    def one_frequency(self) -> bool:
        """Whether all tests are sines of one frequency, so that a spring and a mass cannot be told apart."""
        blocks = [test.waveform.model_dump() for test in self.tests]
        return {block["kind"] for block in blocks} == {"sine"} and len({b["frequency_Hz"] for b in blocks}) == 1


class BlindConfig(EngineConfig):
    """A benchmark of the diagnosis.

    The stand and the damper are those of `rig.virtual`, the jitter of the force from test to test that of
    `diagnose.nuisance`.
    """

    generator: Literal["own", "independent"] = "own"
    """Where the rig files come from: the virtual rig, which shares its laws with the diagnosis, or a second generator
    that shares no line with it and draws its own dampers, campaigns and sensors; then `campaigns` and all below it
    but `keep_files` say nothing."""
    seed: int = Field(ge=0)
    """Seed of every draw."""
    tuned_on: tuple[int, ...] = ()
    """Seeds that thresholds were tuned on: a scored run with one of them is refused."""
    tuning: bool = False
    """Whether this run tunes: its seed must be one of `tuned_on`, and its figures are no result."""
    ledger: str | None = None
    """CSV file, relative to the config, of the seeds that were scored: every scored run is entered, and one whose seed
    stands there for another config or other code is refused."""
    cases: int = Field(default=1600, ge=1)
    """How many cases; the first n of them are the same whatever the number, and fairly mixed."""
    kinds: Kinds = Kinds()
    """Shares of what is hidden."""
    campaigns: tuple[TestPlan, ...] = Field(min_length=1)
    """What the stand runs; every case runs one campaign."""
    by_campaign: bool = False
    """Whether each campaign gets rates of its own in what is printed, beside the targets."""
    sizes: tuple[float, float] = (0.02, 0.2)
    """Smallest and largest effect, as a share of the peak of the record that it changes most: the amplitude of the sine
    that has the r.m.s. of the change."""
    base_spread: float | None = Field(default=None, ge=0.0, lt=1.0)
    """T0, C and k of every row lie within this share of those in `rig.virtual`; empty: they are drawn from everywhere,
    friction alone to viscous alone and stiff to soft, for the control signals of `rig.virtual`."""
    force_noise: tuple[float, ...] = Field(default=(0.005, 0.01, 0.02, 0.03), min_length=1)
    """Noise of the force, as shares of the record's peak; a case has one of them."""
    noise_rho: tuple[float, ...] = Field(default=(0.0, 0.5, 0.9), min_length=1)
    """Its correlation from sample to sample; a case has one of them."""
    displacement_noise_m: tuple[float, float] = (1e-6, 1e-4)
    """Smallest and largest noise of the displacement; even in the logarithm."""
    warming: Warming = Warming(kind="warming", start_degC=22.0, heat_capacity_J_per_K=100.0)
    """How the damper warms where its temperature moves; the cases of `temperature_drift` are among those."""
    warming_share: float = Field(default=0.05, ge=0.0, le=1.0)
    """How many of the other cases warm as well, so that a moving temperature does not give the drift away."""
    keep_files: bool = False
    """Whether the rig files and the noise-free forces stay once a case is scored."""

    @field_validator("sizes", "displacement_noise_m")
    @classmethod
    def _positive_and_rising(cls, span: tuple[float, float]) -> tuple[float, float]:
        if not 0.0 < span[0] <= span[1]:
            raise ValueError("two numbers above 0 are needed, the smaller first")
        return span

    @model_validator(mode="after")
    def _fresh(self) -> Self:
        if self.tuning != (self.seed in self.tuned_on):
            wrong = "is one that thresholds were tuned on" if self.seed in self.tuned_on else "is none of tuned_on"
            way = "take a fresh one, or say tuning: true" if self.seed in self.tuned_on else "say tuning: false"
            raise ValueError(f"seed {self.seed} {wrong}; {way}")
        return self

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        names = [campaign.name for campaign in self.campaigns]
        if len(set(names)) < len(names):
            raise ValueError(f"two campaigns have one name (got {', '.join(names)})")
        if not any(self.kinds.model_dump().values()):
            raise ValueError("kinds: at least one share must be above 0")
        return self
