"""When nothing is missing, does pzd say so? `make plain-study`: plain Bingham dampers from everywhere.

    PYTHONPATH=. python tests/studies/plain_study.py [--cases 600] [--seed 20261126] [--jobs 2] [--list]

Each case is a damper of one to five levels of the control signal, drawn by Sobol points: friction alone to viscous
alone, rigid to a fifth of the stroke; measured by one to six tests a level, at 100 Hz to 5 kHz, with noise of 0.02 to
3 % of peak, noise, resolution and zero of the displacement, gains, offsets and delays of the tests. The records are
made by an integrator of their own (`plain_damper.py`) on the stand of the second generator. The stages rig, identify
and diagnose then say what they make of it. Printed are the verdicts, where they come from, and how often intervals hold
the truth; `--list` prints every case that was not judged right, with why.
"""

from __future__ import annotations

import argparse
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator, SeedSequence, default_rng
from scipy.optimize import least_squares
from scipy.stats import qmc

from pzd.artefacts import ParameterRow, Rig
from pzd.blind.independent import stand
from pzd.blind.independent.damper_space import GROWTH, log_between
from pzd.blind.independent.stand import Actuator, Driven, LaboratoryCampaign, LaboratoryTest, MotionKind
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.stage import diagnose
from pzd.identification.bingham_fit import Bingham, Objective, descend
from pzd.identification.condition import estimate_of
from pzd.identification.config import IdentifyConfig
from pzd.identification.prepared_record import fitted_records, prepare
from pzd.identification.stage import identify
from pzd.identification.stiffness import settle_stiffness
from pzd.quantities import Control
from pzd.record import Array, Record, conditions
from pzd.rig.config import FilesEntry, RigConfig
from pzd.rig.preflight import PreflightRecord, examined
from pzd.schema.errors import DataError
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics
from pzd.signals.nuisance import NuisanceConfig
from tests.studies.plain_damper import bingham_levels, plain_force

SEED = 20261126
CASES = 600
KINDS: tuple[MotionKind, ...] = ("sine", "sine", "sine", "triangle", "sweep", "two_tone", "random")
"""Motions of the tests; every second one of a rig is a sine."""
RATES = (100.0, 128.0, 200.0, 256.0, 500.0, 512.0, 1000.0, 1024.0, 2000.0, 2048.0, 4000.0, 5000.0)
MOST_SAMPLES = 25_000
"""In all tests of a case, unless said otherwise, so that one takes seconds; what is beyond is not run."""
SAMPLES_A_CYCLE = 40.0
"""Least number: fewer are refused."""
COARSEST = 0.01
"""Largest resolution of the displacement, as a share of the stroke."""
COLUMNS = ("T0_N", "C_Ns_per_m", "k_N_per_m")


# --- A case: a plain damper, its tests, its sensors ---


@dataclass(frozen=True, eq=False)
class Case:
    """A plain damper at every level of the control signal, its tests, and what its sensors do."""

    number: int
    dampers: tuple[Bingham, ...]
    """At every level; a rigid oil spring is infinite."""
    campaign: LaboratoryCampaign
    noise: float
    """Of the force, r.m.s. as a share of the peak of the rig."""
    correlation: float
    """Of that noise, from sample to sample."""
    displacement_noise: float
    """[m]"""
    displacement_step: float
    """[m]; 0 where there is none."""

    @property
    def regions(self) -> Iterator[str]:
        """Yield the regions that it counts in."""
        friction, damping, stiffness = self.dampers[0]
        yield "rigid" if np.isinf(stiffness) else "elastic"
        yield "friction alone" if damping == 0.0 else "viscous alone" if friction == 0.0 else "friction and viscous"
        yield "noise to 0.3 %" if self.noise <= 0.003 else "noise to 1 %" if self.noise <= 0.01 else "noise above 1 %"
        fine = self.displacement_step <= 5e-6
        yield "no steps in x" if self.displacement_step == 0.0 else "x to 5 um" if fine else "x above 5 um"
        yield "to 256 Hz" if self.campaign.rate <= 256.0 else "above 256 Hz"
        yield "periodic tests" if all(t.kind in ("sine", "triangle") for t in self.campaign.tests) else "other motions"
        yield "one test" if len(self.campaign.tests) == 1 else "several tests"

    def __str__(self) -> str:
        dampers = "; ".join(f"T0 {d.friction:.4g} C {d.damping:.4g} k {d.stiffness:.4g}" for d in self.dampers)
        tests = ", ".join(f"{t.kind} {t.frequency:.3g} Hz {1e3 * t.amplitude:.3g} mm" for t in self.campaign.tests)
        return (
            f"{dampers} | {self.campaign.rate:g} Hz, noise {100 * self.noise:.2g} % rho {self.correlation:.2f}, "
            f"x noise {1e6 * self.displacement_noise:.2g} um step {1e6 * self.displacement_step:.3g} um | {tests}"
        )


def drawn(seed: int, count: int, most_samples: int = MOST_SAMPLES) -> list[Case]:
    """Draw the cases."""
    points = qmc.Sobol(16, seed=seed).random_base2(int(np.ceil(np.log2(max(count, 2)))))[:count]
    rngs = [default_rng(SeedSequence(seed, spawn_key=(i,))) for i in range(count)]
    return [case(i, point.tolist(), rngs[i], most_samples) for i, point in enumerate(points)]


def case(number: int, u: Sequence[float], rng: Generator, most_samples: int) -> Case:
    """Draw one case from a point of the unit cube; what is left goes by chance."""
    levels, each = 1 + int(5.0 * u[0] ** 1.5), 1 + int(6.0 * u[1])
    amplitude, rate = log_between(u[2], 0.005, 0.05), RATES[int(len(RATES) * u[3])]
    least = max(0.2, 6.0 * levels * rate / most_samples)
    slowest = log_between(u[4], least, max(least, min(2.0, rate / SAMPLES_A_CYCLE / 1.5)))
    values = tuple(float(v) for v in np.linspace(0.0, 10.0, levels)) if levels > 1 else (0.0,)
    tests = _tests(rng, each, amplitude, (slowest, rate), values, most_samples)
    speed = max(2.0 * np.pi * t.frequency * t.amplitude for t in tests)
    stroke = 2.0 * min(t.amplitude for t in tests)
    of_damper = [u[i] for i in (5, 6, 7, 8, 9, 14)]
    rows = bingham_levels(of_damper, rng.uniform(*GROWTH, 2).tolist(), levels, speed, stroke)
    return Case(
        number,
        tuple(Bingham(*row) for row in rows.tolist()),
        LaboratoryCampaign(tuple(tests), values, rate),
        log_between(u[10], 2e-4, 0.03),
        0.9 * u[11],
        0.0 if u[12] < 0.2 else log_between((u[12] - 0.2) / 0.8, 2e-7, 2e-5),
        0.0 if u[13] < 0.6 else min(log_between((u[13] - 0.6) / 0.4, 1e-6, 2e-4), 2.0 * COARSEST * amplitude),
    )


def _tests(
    rng: Generator,
    each: int,
    amplitude: float,
    rates: tuple[float, float],
    values: Sequence[float],
    most_samples: int,
) -> list[LaboratoryTest]:
    """Plan the tests, the same at every level, as many as the samples allow; rates: slowest test and sampling."""
    slowest, rate = rates
    fastest = rate / SAMPLES_A_CYCLE
    tests: list[LaboratoryTest] = []
    for i in range(each):
        kind = "sine" if i % 2 == 0 else KINDS[int(rng.integers(len(KINDS)))]
        frequency = float(np.clip(slowest * log_between(rng.random(), 1.0, 6.0), slowest, fastest))
        frequency = frequency if kind in ("sine", "triangle") else min(frequency, fastest / 3.0)
        size = amplitude * float(rng.uniform(0.4, 1.0)) * min(1.0, (2.0 / frequency) ** 0.7)
        length = int(rng.integers(4, 9)) if kind not in ("sweep", "random") else int(rng.integers(8, 16))
        frequency = frequency if kind != "sweep" else max(frequency, 1.0)
        tests.append(LaboratoryTest(kind, size, frequency, length))
    every = [replace(t, value=value) for t in tests for value in values]
    samples = np.cumsum([t.seconds * rate for t in every])
    fits = int(np.searchsorted(samples, most_samples))
    return every[: max(len(values) * (fits // len(values)), len(values))]


# --- Its records ---


def rig_of(case_: Case, seed: int) -> Rig:
    """Return the records of a case as the rig stage hands them on."""
    rng, motions, forces = _noise_free(case_, seed)
    nuisance = NuisanceConfig()
    peak = max(float(np.max(np.abs(f))) for f in forces)
    zero = float(rng.normal(0.0, 0.01))
    records = []
    for i, (motion, force) in enumerate(zip(motions, forces, strict=True)):
        at = motion.recorded
        instants, own = motion.time[at], float(np.max(np.abs(force)))
        gain, offset, delay = np.clip(rng.standard_normal(3), -2.5, 2.5)
        late = np.interp(instants - nuisance.delay_s * delay, motion.time[::2], force)
        reading = (1.0 + nuisance.gain * gain) * late + nuisance.offset * offset * own
        reading = reading + case_.noise * peak * _coloured(rng, at.size, case_.correlation)
        x = motion.displacement[at] + zero + case_.displacement_noise * rng.standard_normal(at.size)
        if case_.displacement_step > 0.0:
            x = np.round(x / case_.displacement_step) * case_.displacement_step
        voltage = np.full(at.size, motion.test.value) if len(case_.dampers) > 1 else None
        records.append(_record(f"t{i:02d}-{motion.test.kind}", instants, x, reading, voltage))
    return examined([lambda made=made: made for made in records], 1)  # type: ignore[misc]  # a default binds made


def _noise_free(case_: Case, seed: int) -> tuple[Generator, list[Driven], list[Array]]:
    """Return a generator for what the sensors do, the motion of every test, and its force as `_force` gives it [N]."""
    rng = default_rng(SeedSequence(seed, spawn_key=(case_.number, 1)))
    actuator = Actuator.drawn(rng)
    motions = [stand.driven(case_.campaign, t, actuator, rng) for t in case_.campaign.tests]
    return rng, motions, [_force(_damper(case_, m), m) for m in motions]


def _damper(case_: Case, motion: Driven) -> Bingham:
    return case_.dampers[case_.campaign.values.index(motion.test.value)]


def _force(damper: Bingham, motion: Driven) -> Array:
    """Return the force at every second instant of the fine grid [N]."""
    return plain_force(motion.time, motion.displacement, damper.friction, damper.damping, 1.0 / damper.stiffness)


def _coloured(rng: Generator, count: int, correlation: float) -> Array:
    """Draw (n,) noise of unit variance, e_i = rho e_(i-1) + w_i."""
    from scipy.signal import lfilter

    white = rng.standard_normal(count + 200)
    return np.asarray(np.sqrt(1.0 - correlation**2) * lfilter([1.0], [1.0, -correlation], white)[200:])


def _record(name: str, instants: Array, x: Array, force: Array, voltage: Array | None) -> PreflightRecord:
    run = cycles(instants, x)
    clean = kinematics(instants, x, run)
    record = Record(name, None, instants, x, clean.velocity, clean.acceleration, force, voltage)
    return PreflightRecord(record, run, clean, RigConfig(files=(FilesEntry(path="*.csv"),)).limits)


LATE_AS_WELL = 10.0
"""Drop of minus twice the logarithm of the likelihood that separates two laws, as `rival_bic` of diagnose."""


def late_does_as_well(case_: Case, seed: int) -> bool:
    """Whether the noise of a case hides the difference between its oil springs and one delay of the force.

    The noise-free forces are fitted by rigid dampers whose force is late; each test has its gain, offset and delay.
    """
    _, motions, forces = _noise_free(case_, seed)
    peak, nuisance = max(float(np.max(np.abs(f))) for f in forces), NuisanceConfig()
    unit = case_.noise * peak * np.sqrt(1.0 - case_.correlation**2)

    def whitened(values: Array, motion: Driven) -> Array:
        seen = np.interp(motion.time[motion.recorded], motion.time[::2], values)
        return np.asarray((seen[1:] - case_.correlation * seen[:-1]) / unit)

    def residual(q: Array) -> Array:
        parts = []
        for motion, force in zip(motions, forces, strict=True):
            level, time = case_.campaign.values.index(motion.test.value), motion.time[::2]
            rigid = Bingham(float(q[2 * level]), float(q[2 * level + 1]), np.inf)
            late = np.interp(time - q[-1], time, _force(rigid, motion))
            own = nuisance.offset * float(np.max(np.abs(force)))
            allowed = (nuisance.gain * late, np.full(time.size, own), nuisance.delay_s * np.gradient(late, time))
            columns = np.column_stack([whitened(each, motion) for each in allowed])
            ridge, left = np.vstack([columns, np.eye(3)]), np.append(whitened(force - late, motion), np.zeros(3))
            parts.append(left - ridge @ np.linalg.lstsq(ridge, left, rcond=None)[0])
        return np.concatenate(parts)

    lag = float(np.mean([d.damping / d.stiffness for d in case_.dampers]))
    start = np.array([*(v for d in case_.dampers for v in d[:2]), lag])
    speed = max(float(np.max(np.abs(np.gradient(m.displacement, m.time)))) for m in motions)
    units = np.array([*(peak, peak / speed) * len(case_.dampers), 1e-3])
    fitted = least_squares(residual, start, x_scale=units, max_nfev=30)
    return bool(2.0 * fitted.cost < LATE_AS_WELL)


# --- What the stages say ---


@dataclass(frozen=True)
class Outcome:
    """What pzd says of a case."""

    case: Case
    verdict: str
    """Of diagnose; `refused` with the reason."""
    effects: tuple[str, ...]
    reason: str
    rows: tuple[ParameterRow, ...]
    needless: tuple[str, ...]
    """T0 and C that are empty or weak, row by row, where a fit that begins at the truth has them."""
    seconds: float
    late_or_elastic: bool = False
    """Whether it says that a late force would do as well as the oil spring, and the true likelihood says so too."""

    @property
    def kind(self) -> str:
        """Return how it counts."""
        if self.effects:
            return "adopted"
        return "none" if self.late_or_elastic else self.verdict


def judged(case_: Case, seed: int) -> Outcome:
    """Identify and diagnose a case."""
    begin = time.perf_counter()
    rows: tuple[ParameterRow, ...] = ()
    needless: tuple[str, ...] = ()
    late_or_elastic = False
    said: tuple[str, tuple[str, ...], str]
    try:
        rig = rig_of(case_, seed)
        settings, config = IdentifyConfig(), RigConfig(files=(FilesEntry(path="*.csv"),))
        identified = identify(settings, rig, 1)
        rows = identified.rows
        needless = tuple(_needless(case_, rig, rows, settings))
        found = diagnose(DiagnoseConfig(), settings, config, rig, identified, Control(), None, 1).diagnosis
        said = found.verdict, tuple(found.effects), found.reason
        asked = found.verdict == "ambiguous" and found.rivals == ("sensor_delay",)
        late_or_elastic = asked and late_does_as_well(case_, seed)
    except DataError as error:
        said = "refused", (), str(error)
    except Exception:  # noqa: BLE001  # a study goes on, and the case counts as failed
        said = "failed", (), traceback.format_exc()
    verdict, effects, reason = said
    seconds = time.perf_counter() - begin
    return Outcome(case_, verdict, effects, reason, rows, needless, seconds, late_or_elastic)


def _needless(case_: Case, rig: Rig, rows: Sequence[ParameterRow], settings: IdentifyConfig) -> Iterator[str]:
    """Yield T0 and C where identify leaves them empty or weak, and a fit that begins at the truth does not."""
    found, _ = conditions(rig.records, None, settings.group.temperature_degC)
    for row, condition in zip(rows, found, strict=True):
        level = int(np.argmin(np.abs(np.array(case_.campaign.values) - (row.voltage_V or 0.0))))
        objective = Objective(tuple(prepare(record) for record in condition.records))
        fit = descend(objective, objective.clipped(case_.dampers[level]))
        fit, stiffest = settle_stiffness(condition.records, objective, fit, settings.nuisance)
        by_record = objective.fitted_by_record(fit.parameters)
        fitted = fitted_records(condition.records, objective.prepared, by_record, settings.nuisance)
        optimum = [(condition.labels, fit.parameters)]
        (reference,) = estimate_of(objective, optimum, fitted, stiffest=stiffest).rows()
        yield from (name for name in ("T0", "C") if name in _doubted(row) and name not in _doubted(reference))


def _judged(given: tuple[Case, int]) -> Outcome:
    return judged(*given)


# --- What is printed ---

WANTED = {"none": 0.95, "adopted": 0.01, "unexplained": 0.01, "refused": 0.01}
KINDS_OF_OUTCOME = ("none", "adopted", "ambiguous", "unexplained", "refused", "failed")


def table(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """Yield the counts by region."""
    yield f"{'':<22} cases " + " ".join(f"{kind:>12}" for kind in KINDS_OF_OUTCOME)
    regions: dict[str, list[Outcome]] = {"all": list(outcomes)}
    for outcome in outcomes:
        for region in outcome.case.regions:
            regions.setdefault(region, []).append(outcome)
    for region, mine in regions.items():
        counts = [sum(o.kind == kind for o in mine) for kind in KINDS_OF_OUTCOME]
        shares = " ".join(f"{n:4d} {100.0 * n / len(mine):5.1f} %" for n in counts)
        yield f"{region:<22} {len(mine):5d} {shares}"


def coverage(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """Yield how often intervals of T0, C and k hold the truth, off the limits and at them."""
    for place, wanted in (("off the limits", False), ("at the limits", True)):
        for i, column in enumerate(COLUMNS):
            held = [h for o in outcomes for h, at in _held(o, i, column) if at is wanted]
            share = f"{100.0 * np.mean(held):5.1f} %" if held else "     -"
            yield f"rows not weak, {place}: {column.partition('_')[0]:<2} inside its interval {share} of {len(held)}"
    rows = [row for o in outcomes for row in o.rows]
    for column in COLUMNS[:2]:
        name = column.partition("_")[0]
        empty, weak = sum(getattr(r, column) is None for r in rows), sum(name in _doubted(r) for r in rows)
        needless = sum(o.needless.count(name) for o in outcomes)
        from_truth = f"{needless} of them not by a fit that begins at the truth"
        yield f"rows: {name} empty {empty}, empty or weak {weak} of {len(rows)}, {from_truth}"


def _doubted(row: ParameterRow) -> str:
    """Return the names of the parameters that the status doubts."""
    heads = (clause.partition(":")[2].partition("(")[0] for clause in row.status.split(";"))
    return " ".join(heads)


def _held(outcome: Outcome, i: int, column: str) -> Iterator[tuple[bool, bool]]:
    """Yield for each row that is sure of a parameter whether its interval holds the truth, and whether at a limit."""
    for row in outcome.rows:
        low, high = getattr(row, f"{column}_low95"), getattr(row, f"{column}_high95")
        if low is None or high is None or column.partition("_")[0] in _doubted(row):
            continue
        level = int(np.argmin(np.abs(np.array(outcome.case.campaign.values) - (row.voltage_V or 0.0))))
        truth = outcome.case.dampers[level]
        limit = truth.friction == 0.0 or truth.damping == 0.0 or bool(np.isinf(truth.stiffness))
        yield bool(low <= truth[i] <= high), limit


def listed(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """Yield every case that was not judged right, with why."""
    for o in outcomes:
        if o.kind != "none":
            yield f"\n#{o.case.number} {o.kind} {o.effects} ({o.seconds:.1f} s) {o.case}\n    {o.reason}"
            for row in o.rows:
                T0, C, k = (getattr(row, column) for column in COLUMNS)
                yield f"    identify: T0 {T0} C {C} k {k} W_s {row.W_s:.3g} {row.status}"


def outcomes_of(cases: Sequence[Case], seed: int, jobs: int, heard: Callable[[Outcome], None]) -> list[Outcome]:
    """Judge the cases, several at the same time."""
    found = []
    with ProcessPoolExecutor(jobs) as pool:
        for outcome in pool.map(_judged, [(c, seed) for c in cases]):
            heard(outcome)
            found.append(outcome)
    return found


def main() -> None:
    """Judge and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=CASES)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", type=int, nargs="*", help="numbers of the cases to judge")
    parser.add_argument("--list", action="store_true", help="print the cases that were not judged right")
    asked = parser.parse_args()

    def heard(outcome: Outcome) -> None:
        sys.stderr.write(f"{outcome.case.number}: {outcome.kind} ({outcome.seconds:.1f} s)\n")

    cases = [c for c in drawn(asked.seed, asked.cases) if not asked.only or c.number in asked.only]
    outcomes = outcomes_of(cases, asked.seed, asked.jobs, heard)
    lines = [*table(outcomes), "", *coverage(outcomes), *(listed(outcomes) if asked.list else ())]
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
