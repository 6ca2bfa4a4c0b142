"""The diagnosis of records, as a run makes it: identified first, then diagnosed."""

from __future__ import annotations

from collections.abc import Iterable

from campaign import damper_of

from pzd.artefacts import Diagnosed, Rig
from pzd.damper.effects import library
from pzd.diagnosis.campaign import Campaign, evidence_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.data import prepare, split
from pzd.diagnosis.fit.problem import Problem
from pzd.diagnosis.stage import diagnose
from pzd.identification.config import IdentifyConfig
from pzd.identification.stage import identify
from pzd.quantities import Control
from pzd.record import Record
from pzd.rig.config import FilesEntry, RigConfig
from pzd.signals.nuisance import NuisanceConfig

STAND = RigConfig(files=(FilesEntry(path="*.csv"),))
"""A rig whose files say nothing of the stand."""


def all_but(*effects: str) -> tuple[str, ...]:
    """What to forbid where the claim needs few candidates: most of a diagnosis is their fits."""
    return tuple(sorted(set(library()) - set(effects)))


def problem_of(records: Iterable[Record]) -> Problem:
    """What a damper of one voltage is fitted to, weighed by what the plain one leaves."""
    prepared = prepare(tuple(records))
    return evidence_of(Campaign(prepared, split(prepared, None, 2.0), NuisanceConfig()), damper_of((0.0,))).whole


def diagnosed(records: Iterable[Record], jobs: int = 2, **config: object) -> Diagnosed:
    """What diagnose says of records of one setting; `config` is its block."""
    rig = Rig(tuple(records), ())
    settings = DiagnoseConfig.model_validate(config)
    return diagnose(settings, IdentifyConfig(), STAND, rig, identify(IdentifyConfig(), rig, 1), Control(), None, jobs)
