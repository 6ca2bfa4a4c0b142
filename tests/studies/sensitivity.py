"""What the verdicts owe to each threshold, halved and doubled on the cases of a benchmark: `make sensitivity`.

    python tests/studies/sensitivity.py [cases, default 24] [seed, default 1]

The cases are the first ones of configs/blind.yaml on a seed for tuning: single effects, pairs, none, and what is not
in the library. Each is drawn and identified once. Where a threshold acts after the search, the verdict is reached anew
from the search that stands there; where it acts in the search, that is done again, and only what it asks of the tests
for the first time is computed: every fit is kept. Printed are, for every threshold, the cases whose verdict, names or
rivals change, and the changes in how many are right and wrong. Counts are rounded up when halved; of a level of chance
the logarithm is halved and doubled.
"""

from __future__ import annotations

import pickle
import re
import sys
import tempfile
import time
from collections.abc import Callable, Hashable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache, partial
from hashlib import sha256
from inspect import getsource
from math import ceil
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from pzd.artefacts import base_of
from pzd.blind import rates
from pzd.blind.case import CaseFiles, Scored, Truth
from pzd.blind.hide import BenchmarkSetup, hide
from pzd.blind.plan import PlannedCase, plan
from pzd.blind.score import counted_effects
from pzd.config import RunConfig, load
from pzd.damper.effect import Effect
from pzd.damper.model import Damper
from pzd.diagnosis import cross_validation, gap, thresholds
from pzd.diagnosis.campaign import Campaign, evidence_of
from pzd.diagnosis.cleaned_records import centred_on, clean, unsaturated_records
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import CrossValidation
from pzd.diagnosis.fit.least_squares import FitResult, fit, profiled_misfit
from pzd.diagnosis.fit.likelihood import WeightedRecord
from pzd.diagnosis.fit.problem import Problem
from pzd.diagnosis.roles import split
from pzd.diagnosis.search.acceptance import Selection
from pzd.diagnosis.search.candidates import promised_drop
from pzd.diagnosis.search.forward_selection import select_effects
from pzd.diagnosis.verdict import conclude, judge
from pzd.identification.stage import identify
from pzd.record import mid_stroke
from pzd.rig.config import FilesEntry, RigConfig
from pzd.rig.stage import ingest
from pzd.schema.validate import read_json

CONFIG = Path(__file__).resolve().parents[2] / "configs" / "blind.yaml"
TABLE = tuple(name for name in vars(thresholds) if name.isupper())
IN_CONFIG = (
    *("significance", "visible", "negligible", "unexplained_share"),
    *("adopt_bic", "rival_bic", "most_effects", "most_added"),
)
CHANCES = ("significance", "HALVES_SIGNIFICANCE", "CYCLE_CHANGE_SIGNIFICANCE")
AFTER = ("verdict", "cross_validation", "adoption", "hypotheses.regression")
"""Modules of pzd.diagnosis that act on a search that is over."""
AFTER_IN_CONFIG = ("unexplained_share", "most_added")

Answer = tuple[str, frozenset[str], frozenset[str]]
"""Verdict, effects and rivals."""


@dataclass(frozen=True)
class Case:
    """A case as far as no threshold acts."""

    truth: Truth
    campaign: Campaign
    plain: Damper


class Kept:
    """Gives what a function of a problem or of a campaign gave before, where all that it depends on is the same."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function
        self.found: dict[object, Any] = {}
        self.held: dict[int, tuple[object, str]] = {}

    def __call__(self, problem: Problem | Campaign, *given: Any, **named: Any) -> Any:
        key = (
            self._thresholds(),
            self._said(problem),
            *map(self._said, given),
            *((name, self._said(one)) for name, one in named.items()),
        )
        if key not in self.found:
            self.found[key] = self.function(problem, *given, **named)
        return self.found[key]

    def _thresholds(self) -> str:
        """Those that act inside of the function."""
        module = sys.modules[self.function.__module__]
        return repr([getattr(thresholds, name) for name in TABLE if module in users(name)])

    def _said(self, given: Any) -> object:
        """What tells an argument from another one."""
        if isinstance(given, np.ndarray):
            return given.tobytes()
        if isinstance(given, Damper):
            return given.model_dump_json()
        if isinstance(given, Effect):
            return given.name
        if isinstance(given, Problem | WeightedRecord | FitResult | Campaign):
            if id(given) not in self.held:  # the object is held as well, so that no other one takes its number
                self.held[id(given)] = given, sha256(pickle.dumps(self._content(given))).hexdigest()
            return self.held[id(given)][1]
        return given if isinstance(given, Hashable) else tuple(given)

    def _content(self, given: Problem | WeightedRecord | FitResult | Campaign) -> tuple[object, ...]:
        if isinstance(given, Campaign):
            return (id(given),)
        if isinstance(given, Problem):
            rows = tuple(row.model_dump_json() for row in given.base)
            rest = given.scales, given.reference_temperature, sorted(given.per_voltage)
            return (*map(self._said, given.observations), rows, repr(rest))
        if isinstance(given, FitResult):
            return given.damper.model_dump_json(), given.effects, given.optimum.tobytes(), repr(given.misfit)
        before = given.nuisances.before
        nuisances = given.nuisances.inner, np.zeros(0) if before is None else before.inner.data
        arrays = given.sample_indices, given.compared, given.measured, given.weights, *nuisances
        return given.name, given.base_row, given.initial_force, *(array.tobytes() for array in arrays)


def keep_fits() -> None:
    """Let every module of the diagnosis ask for its fits where they are kept."""
    for function in (fit, profiled_misfit, promised_drop, evidence_of, cross_validation.cross_validation_of):
        kept = Kept(function)
        for key, module in list(sys.modules.items()):
            for name, value in list(vars(module).items()) if key.startswith("pzd.diagnosis.") else ():
                if value is function:
                    setattr(module, name, kept)


@dataclass(frozen=True)
class Searched:
    """A search that is over."""

    selection: Selection
    validation: CrossValidation


def names() -> tuple[str, ...]:
    """Every threshold: those of the table, then those of the config."""
    return (*TABLE, *IN_CONFIG)


@cache
def users(name: str) -> tuple[ModuleType, ...]:
    """The modules of the diagnosis that name a threshold of the table."""
    named, package = re.compile(rf"\bthresholds\.{name}\b"), "pzd.diagnosis."
    return tuple(m for key, m in sys.modules.items() if key.startswith(package) and named.search(getsource(m)))


def acts_after(name: str) -> bool:
    """Whether a threshold acts on a search that is over and nowhere else."""
    if name in IN_CONFIG:
        return name in AFTER_IN_CONFIG
    return {module.__name__.removeprefix("pzd.diagnosis.") for module in users(name)} <= set(AFTER)


def scaled(name: str, value: Any, factor: float) -> Any:
    """A threshold at half or twice its value."""
    if isinstance(value, Mapping):
        return {key: scaled(name, one, factor) for key, one in value.items()}
    if isinstance(value, tuple):
        return tuple(scaled(name, one, factor) for one in value)
    if isinstance(value, int):
        return max(ceil(factor * value), 1)
    return value ** (1.0 / factor) if name in CHANCES else factor * value


@contextmanager
def instead(name: str, factor: float, config: DiagnoseConfig) -> Iterator[DiagnoseConfig]:
    """The config with a threshold at a multiple of its value, which stands in the config or in the table."""
    if name in IN_CONFIG:
        yield config.model_copy(update={name: scaled(name, getattr(config, name), factor)})
        return
    value = getattr(thresholds, name)
    setattr(thresholds, name, scaled(name, value, factor))
    try:
        yield config
    finally:
        setattr(thresholds, name, value)


def searched(case: Case, config: DiagnoseConfig, *, checked: bool) -> Searched:
    """The search of a case, as the stage does it; with the residuals that were checked before, where these stand."""
    campaign = case.campaign if checked else replace(case.campaign, _predictions={}, _checks={})
    validation = cross_validation.cross_validation_of(campaign, case.plain, config.visible)
    return Searched(select_effects(campaign, case.plain, config, 1), validation)


def answered(found: Searched, config: DiagnoseConfig) -> Answer:
    """What is said of a search."""
    handed, decision = conclude(judge(found.selection, found.validation, config, "V"), found.validation, config)
    return decision.verdict, frozenset(handed.selection.adopted), frozenset(handed.selection.rivals)


def outcome(case: PlannedCase, truth: Truth, answer: Answer) -> str:
    """`right`, `wrong` or, where it is neither, `open`."""
    verdict, effects, rivals = answer
    score = Scored.model_construct(
        kind=case.kind,
        hidden=truth.form or "",
        described_by=truth.described_by,
        truth=counted_effects(truth),
        failure=None,
        verdict=verdict,
        effects=tuple(effects),
        rivals=tuple(rivals),
        told_apart=True,
    )
    judged: dict[str, tuple[rates.Predicate, rates.Predicate]] = {
        "none": (rates.says_none, rates.false_name),
        "outside": (rates.rightly_outside, rates.wrong_single),
    }
    well, ill = judged.get(case.kind, (lambda s: rates.right(s) or rates.ambiguous_with_truth(s), rates.wrong_name))
    return "right" if well(score) else "wrong" if ill(score) else "open"


def prepared_case(config: RunConfig, setup: BenchmarkSetup, case: PlannedCase) -> Case:
    """A case drawn, ingested, identified and cleaned."""
    with tempfile.TemporaryDirectory() as folder:
        places = CaseFiles(Path(folder))
        hide(setup, case, places)
        truth = read_json(places.truth(case.id), Truth, setup.control)
        rig = ingest(RigConfig(files=(FilesEntry(path="rig/*.csv"),)), setup.control, places.case(case.id))
        identified = identify(config.identify, rig, config.seed)
        recorded = clean(unsaturated_records(rig, None)[0])
    cleaned = centred_on(recorded, mid_stroke(each.record.displacement for each in recorded))
    group = config.identify.group
    parts = split(cleaned, group.voltage_V, group.temperature_degC)
    return Case(truth, Campaign(cleaned, parts, config.diagnose.nuisance), base_of(identified.rows, None))


def replayed(seed: int, cases: int, number: int) -> tuple[str, dict[tuple[str, float], str], set[tuple[str, float]]]:
    """One case: its outcome, that with every threshold halved and doubled, and where the answer changes."""
    config = load(CONFIG)
    assert config.blind is not None
    assert config.rig.virtual is not None
    blind = config.blind.model_copy(update={"seed": seed, "cases": cases, "tuning": True})
    setup = BenchmarkSetup(blind, config.rig.virtual[0], config.diagnose.nuisance, config.control.signal())
    case = plan(blind)[number]
    keep_fits()
    cleaned = prepared_case(config, setup, case)
    judged: Callable[[Answer], str] = partial(outcome, case, cleaned.truth)
    stands = searched(cleaned, config.diagnose, checked=True)
    usual = answered(stands, config.diagnose)
    outcomes, changed = {}, set()
    for name in names():
        for factor in (0.5, 2.0):
            with instead(name, factor, config.diagnose) as other:
                checked = gap not in users(name)
                found = stands if acts_after(name) else searched(cleaned, other, checked=checked)
                answer = answered(found, other)
            outcomes[name, factor] = judged(answer)
            if answer != usual:
                changed.add((name, factor))
    return judged(usual), outcomes, changed


def say(line: str) -> None:
    """Print at once: this takes long."""
    print(line, flush=True)  # noqa: T201  # this is what the study is for


def main(cases: int = 24, seed: int = 1) -> None:
    """Print a row a threshold."""
    begun = time.monotonic()
    usual: list[str] = []
    gained = {(name, factor, kind): 0 for name in names() for factor in (0.5, 2.0) for kind in ("right", "wrong")}
    changes = dict.fromkeys(((name, factor) for name in names() for factor in (0.5, 2.0)), 0)
    with ProcessPoolExecutor(2, max_tasks_per_child=1) as pool:  # what is kept of a case goes with it: a GB
        for stood, outcomes, changed in pool.map(partial(replayed, seed, cases), range(cases)):
            usual.append(stood)
            for key, now in outcomes.items():
                changes[key] += key in changed
                for kind in ("right", "wrong"):
                    gained[*key, kind] += int(now == kind) - int(stood == kind)
            say(f"case {len(usual)} of {cases}, {time.monotonic() - begun:.0f} s")
    say(f"\n{cases} cases of seed {seed}: {usual.count('right')} right, {usual.count('wrong')} wrong as it stands")
    say(f"{'threshold':28} {'acts':7} {'halved: changed right wrong':>28} {'doubled: changed right wrong':>30}")
    for name in names():
        told = [
            f"{changes[name, f]:18d} {gained[name, f, 'right']:+5d} {gained[name, f, 'wrong']:+5d}" for f in (0.5, 2.0)
        ]
        say(f"{name:28} {'after' if acts_after(name) else 'search':7} {told[0]} {told[1]}")
    still = [name for name in names() if not changes[name, 0.5] + changes[name, 2.0]]
    say(f"\n{len(still)} of {len(names())} thresholds change no answer, halved or doubled")
    say(f"{np.ceil((time.monotonic() - begun) / 60.0):.0f} min")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
