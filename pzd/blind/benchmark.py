"""Runs the cases: each is drawn, then diagnosed, on any engine; on this machine by processes that do one of the two.

The truth is opened last, here. Each worker has one case at a time, so that the seconds of a diagnosis are its own.
"""

from __future__ import annotations

import shutil
import time
import traceback
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from pzd.artefacts import Diagnosed, Diagnosis
from pzd.blind.case import Clean, Cost, Places, Scored, Truth, read_clean
from pzd.blind.config import BlindConfig
from pzd.blind.hide import BenchmarkSetup, hide
from pzd.blind.hide_independent import hide_independent, plan_independent
from pzd.blind.plan import PlannedCase, plan
from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.diagnosis.config import DiagnoseConfig
from pzd.identification.config import IdentifyConfig
from pzd.identification.prepared_record import warm_up
from pzd.parallel.chunks import ChunkedWork
from pzd.parallel.config import Where
from pzd.parallel.processes import Listener, Progress, no_listener
from pzd.quantities import Control
from pzd.rig.config import FilesEntry, Limits, RigConfig
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.errors import ConfigError, DataError
from pzd.schema.model import Frozen
from pzd.schema.validate import read_json, write_json

# ----------------------------------------------------------------------------------------------------
# Diagnoses a case from its rig files alone.


COST = "cost.json"


@dataclass(frozen=True)
class Methods:
    """How a case is diagnosed: the config's ordinary blocks."""

    identify: IdentifyConfig
    diagnose: DiagnoseConfig
    limits: Limits
    """What the stand can do."""
    control: Control
    seed: int
    """Of the evolutionary search, where identify uses it."""


def diagnose_case(methods: Methods, folder: Path) -> None:
    """Run ingest, identify and diagnose on the files of `folder`/rig, and write the diagnosis into `folder`.

    What goes wrong is written down as the case's failure.

    Parameters
    ----------
    methods : how
    folder : holds the rig files and nothing else
    """
    begun = time.perf_counter()
    spent, failure = 0.0, None
    try:
        spent = _diagnosed(methods, folder)
    except Exception as error:  # noqa: BLE001  # whatever fails counts against the diagnosis
        failure = "".join(traceback.format_exception_only(error)).strip() + f" ({_place(error)})"
    cost = Cost(
        seconds=round(time.perf_counter() - begun, 3),
        diagnose_seconds=round(spent, 3),
        peak_memory_MB=round(_peak_memory(), 1),
        failure=failure,
    )
    write_json(folder / COST, cost, methods.control)


def _diagnosed(methods: Methods, folder: Path) -> float:
    """Write the diagnosis; the seconds that diagnose took."""
    from pzd.diagnosis.stage import diagnose
    from pzd.identification.stage import identify
    from pzd.rig.stage import ingest

    config = RigConfig(files=(FilesEntry(path="rig/*.csv"),), limits=methods.limits)
    rig = ingest(config, methods.control, folder)
    identified = identify(methods.identify, rig, methods.seed)
    begun = time.perf_counter()
    found = diagnose(methods.diagnose, methods.identify, config, rig, identified, methods.control, None, jobs=1)
    spent = time.perf_counter() - begun
    found.write(folder, methods.control)
    return spent


def _place(error: BaseException) -> str:
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{Path(last.filename).name}:{last.lineno}"


def _peak_memory() -> float:
    """Largest memory of this process so far [MB]; 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0.0
    import sys

    unit = 1e-6 if sys.platform == "darwin" else 1024e-6
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


# ----------------------------------------------------------------------------------------------------
# How much of the gap to the noise-free force is taken away, by what was found and by the truth itself.


def gap_cut(found: Diagnosed, clean: Mapping[str, Clean], *, gains_out: bool = False) -> float:
    """How much of the gap to the noise-free force the found effects take away on the held-out records.

    Equation: 1 - W_s after / W_s before                    Source: Makowski and Knap 2021, eq. (4)

    Parameters
    ----------
    found : the diagnosis with the damper before and after
    clean : the noise-free records by name
    gains_out : compare shapes alone: the best gain of each record taken out, before and after alike
    """
    held_out = [clean[name] for name in _held_out(found)]
    before, after = (
        sum(_squares(damper, record, gains_out=gains_out) for record in held_out)
        for damper in (found.baseline, found.damper)
    )
    return 1.0 - after / before


def gap_cut_of_truth(found: Diagnosed, clean: Mapping[str, Clean]) -> float:
    """What the truth itself would take away, its force at every voltage with the mean gain of the tests fitted there.

    About what a fit can reach: a gain that the tests of a voltage share is the same to it as a larger T0, C and k.

    Parameters
    ----------
    found : the diagnosis with the damper before
    clean : the noise-free records by name, with what was recorded of them
    """
    held_out = _held_out(found)
    fitted = {name: record for name, record in clean.items() if name not in held_out} or clean
    before = after = 0.0
    for record in (clean[name] for name in held_out):
        alike = [other.gain for other in fitted.values() if other.voltage == record.voltage]
        error = float(np.mean(alike or [other.gain for other in fitted.values()])) - 1.0
        after += float(np.sum((error * record.force[warm_up(record.motion.displacement) :]) ** 2))
        before += _squares(found.baseline, record, gains_out=False)
    return 1.0 - after / before


def _held_out(found: Diagnosed) -> tuple[str, ...]:
    gap = found.diagnosis.gap
    if gap is None:
        raise ValueError("the gap could not be measured, so nothing is known of what is taken away")
    return gap.held_out


def _squares(damper: Damper, record: Clean, *, gains_out: bool) -> float:
    first = warm_up(record.motion.displacement)
    force = record.force[first:]
    simulated = respond(damper, record.motion, float(record.force[0]), 1e-7)[first:]
    gain = float(force @ simulated / (simulated @ simulated)) if gains_out else 1.0
    return float(np.sum((force - gain * simulated) ** 2))


# ----------------------------------------------------------------------------------------------------
# The score of a case: its diagnosis compared with the truth that was hidden.


SMALL_OFFSET = 0.01
"""A preload_offset below this share of the softest record's peak counts as nothing missing."""
SMALL_DELAY = 1e-3
"""So does a sensor_delay shorter than this [s]."""


def score_case(places: Places, name: str, made_from: str, control: Control, *, keep_files: bool) -> Scored:
    """Score a diagnosed case and keep the score for good.

    Parameters
    ----------
    places : where its files are
    name : id of the case
    made_from : what config and code it was made with
    control : the control signal
    keep_files : whether rig files, diagnosis and noise-free records stay
    """
    truth = read_json(places.truth(name), Truth, control)
    cost = read_json(places.case(name) / COST, Cost, control)
    found = None if cost.failure else Diagnosed.read(places.case(name), control)
    result = scored(truth, cost, found, {} if found is None else read_clean(places.clean(name)), made_from)
    _kept(places, result, control)
    if not keep_files:
        shutil.rmtree(places.rig(name))
        places.clean(name).unlink()
    return result


def _kept(places: Places, result: Scored, control: Control) -> None:
    """Write the score whole or not at all."""
    target = places.scored(result.id)
    target.parent.mkdir(parents=True, exist_ok=True)
    fresh = target.with_suffix(".new")
    write_json(fresh, result, control)
    fresh.replace(target)


def scored(truth: Truth, cost: Cost, found: Diagnosed | None, clean: Mapping[str, Clean], made_from: str) -> Scored:
    """The score of a case.

    Parameters
    ----------
    truth : what was hidden
    cost : what the diagnosis took, and how it failed
    found : the diagnosis; None where it failed
    clean : the noise-free records by name
    made_from : what config and code the case was made with
    """
    diagnosis = found.diagnosis if found else None
    counted_truth = counted(truth)
    return Scored(
        id=truth.id,
        made_from=made_from,
        kind=truth.kind,
        campaign=truth.campaign,
        one_frequency=truth.one_frequency,
        hidden=truth.form or "+".join(truth.effects) or "none",
        described_by=truth.described_by,
        truth=counted_truth,
        force_noise=truth.force_noise,
        noise_rho=truth.noise_rho,
        displacement_noise_m=truth.displacement_noise_m,
        visible_gap=truth.visible_gap,
        gap_given_other=truth.gap_given_other,
        verdict=diagnosis.verdict if diagnosis else None,
        effects=diagnosis.effects if diagnosis else (),
        rivals=diagnosis.rivals if diagnosis else (),
        confidence=diagnosis.confidence if diagnosis else None,
        shapes=tuple(row.shape for row in found.hypotheses.alone) if found else (),
        inside=_inside(diagnosis, truth) if diagnosis and set(diagnosis.effects) == set(counted_truth) else {},
        gap_cut=gap_cut(found, clean) if found and found.diagnosis.effects else None,
        gap_cut_gains_out=gap_cut(found, clean, gains_out=True) if found and found.diagnosis.effects else None,
        gap_cut_of_truth=gap_cut_of_truth(found, clean) if found and found.diagnosis.effects else None,
        next_test=bool(diagnosis and diagnosis.next_test),
        seconds=cost.seconds,
        diagnose_seconds=cost.diagnose_seconds,
        peak_memory_MB=cost.peak_memory_MB,
        failure=cost.failure,
    )


def counted(truth: Truth) -> tuple[str, ...]:
    """The hidden effects that are large enough to be anything at all."""
    least = {("preload_offset", "F_0"): SMALL_OFFSET * truth.lowest_peak_N, ("sensor_delay", "tau"): SMALL_DELAY}
    small = {
        effect
        for (effect, parameter), limit in least.items()
        if effect in truth.damper.effects and abs(_one(truth.damper.effects[effect][parameter])) < limit
    }
    return tuple(name for name in truth.damper.effects if name not in small)


def _one(value: float | tuple[float, ...]) -> float:
    return value if isinstance(value, float) else value[0]


def _inside(diagnosis: Diagnosis, truth: Truth) -> dict[str, bool]:
    """Of each parameter with one value and an interval: whether the true value lies in it."""
    found = {}
    for effect, parameters in diagnosis.parameters.items():
        for name, value in parameters.items():
            low, high, true = value.low95, value.high95, truth.damper.effects[effect][name]
            if isinstance(low, float) and isinstance(high, float) and isinstance(true, float):
                found[f"{effect}.{name}"] = low <= true <= high
    return found


# ----------------------------------------------------------------------------------------------------
# Which seeds were scored with which code: a seed is fresh once, so no rule is chosen on what it is scored on.


class ScoredSeed(Frozen):
    """One scored run."""

    seed: int
    generator: str
    made_from: str
    """Hash of the config and the code; empty where it was not written down."""
    cases: int
    date: str
    """The day on which it began, in UTC (ISO 8601)."""


def read(path: Path) -> tuple[ScoredSeed, ...]:
    """Every scored run of a ledger; none where there is no such file."""
    return read_rows(path, ScoredSeed, Control()) if path.is_file() else ()


def enter(path: Path, run: ScoredSeed) -> None:
    """Write a scored run down before its first case is drawn, so that one that is stopped uses its seed up as well.

    Parameters
    ----------
    path : the ledger
    run : what begins

    Raises
    ------
    ConfigError : when the ledger holds the seed for another config or other code
    """
    known = read(path)
    same = [one for one in known if (one.seed, one.generator) == (run.seed, run.generator)]
    if other := next((one for one in same if one.made_from != run.made_from), None):
        raise ConfigError(
            f"blind.seed: seed {run.seed} was scored with another config or other code on {other.date} ({path}); "
            "take one that is not in this ledger, or one of tuned_on with tuning: true"
        )
    if all(one.cases < run.cases for one in same):
        write_rows(path, ScoredSeed, [*known, run], Control())


# ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Benchmark:
    """What is hidden, how it is sought, and where the files go."""

    setup: BenchmarkSetup
    methods: Methods
    places: Places
    made_from: str
    """Hash of everything that a case depends on but its number: cases with another one are done again."""
    where: Where
    """Where the cases are drawn and diagnosed."""
    progress: Listener = no_listener
    """Hears of every case that is done."""
    undrawn: dict[str, str] = field(default_factory=dict)
    """Why a case could not be drawn, by its id; filled by `run`."""

    def run(self, jobs: int, *, afresh: bool = False) -> tuple[Scored, ...]:
        """Every case's score but of those that could not be drawn; those that stand there finished are not done again.

        Parameters
        ----------
        jobs : processes that work at a time
        afresh : do the finished ones again as well
        """
        cases = self.plan()
        done = {} if afresh else self.finished(cases)
        waiting = [case for case in cases if case.id not in done]
        if waiting:
            self._prepare(waiting)
            done |= self._worked(waiting, len(cases), jobs)
        return tuple(done[case.id] for case in cases if case.id in done)

    def plan(self) -> tuple[PlannedCase, ...]:
        """Every case, in the order in which they are done."""
        independent = self.setup.blind.generator == "independent"
        return plan_independent(self.setup.blind) if independent else plan(self.setup.blind)

    def finished(self, cases: Iterable[PlannedCase]) -> dict[str, Scored]:
        """The scores that stand there and were made from the same config and code."""
        found = {}
        for case in cases:
            with suppress(DataError):
                score = read_json(self.places.scored(case.id), Scored, self.setup.control)
                if score.made_from == self.made_from:
                    found[case.id] = score
        return found

    def _prepare(self, waiting: Iterable[PlannedCase]) -> None:
        """Take away what an earlier run left of the cases."""
        for case in waiting:
            shutil.rmtree(self.places.case(case.id), ignore_errors=True)
            for path in (self.places.truth(case.id), self.places.clean(case.id), self.places.scored(case.id)):
                path.unlink(missing_ok=True)

    def _worked(self, waiting: list[PlannedCase], whole: int, jobs: int) -> dict[str, Scored]:
        begun = time.monotonic()
        found: dict[str, Scored] = {}

        def keep(chunk: tuple[PlannedCase, ...], failures: Sequence[str | None]) -> None:
            for case, failure in zip(chunk, failures, strict=True):
                if failure is not None:
                    self.undrawn[case.id] = failure
                else:
                    found[case.id] = score_case(
                        self.places, case.id, self.made_from, self.setup.control, keep_files=self.setup.blind.keep_files
                    )
                    left = (time.monotonic() - begun) / len(found) * (len(waiting) - len(found))
                    done = whole - len(waiting) + len(found)
                    self.progress(Progress(done, whole, f"cases, {_duration(left)} left"))

        places = self.places.absolute
        steps = (partial(_draw, self.setup, places), partial(_diagnose, self.methods, places))
        ChunkedWork(steps, keep, self._lost, self.where).do([(case,) for case in waiting], jobs)
        return found

    def _lost(self, case: PlannedCase, step: int, reason: str) -> str | None:
        """Set a case aside: without a truth it has no score, without a diagnosis it is one that failed."""
        if step == 0:
            return reason
        cost = Cost(seconds=0.0, diagnose_seconds=0.0, peak_memory_MB=0.0, failure=reason)
        write_json(self.places.case(case.id) / COST, cost, self.setup.control)
        return None


def _draw(setup: BenchmarkSetup, places: Places, chunk: tuple[PlannedCase, ...]) -> None:
    """Draw some cases."""
    draws = hide_independent if setup.blind.generator == "independent" else hide
    for case in chunk:
        draws(setup, case, places)


def _diagnose(methods: Methods, places: Places, chunk: tuple[PlannedCase, ...]) -> tuple[None, ...]:
    """Diagnose some cases; nothing that a score would need is handed back."""
    for case in chunk:
        diagnose_case(methods, places.case(case.id))
    return (None,) * len(chunk)


def _duration(seconds: float) -> str:
    return f"{seconds / 60.0:.0f} min" if seconds > 90.0 else f"{seconds:.0f} s"


def folder_of(root: Path, blind: BlindConfig) -> Places:
    """Where a benchmark lies below the benchmarks' folder, by its seed and its generator."""
    kind = "" if blind.generator == "own" else f"{blind.generator}-"
    return Places(root / f"{kind}seed-{blind.seed}")
