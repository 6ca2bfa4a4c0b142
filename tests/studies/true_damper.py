"""Whether the damper that a blind case was drawn from passes as the truth: a fit that begins there leaves noise alone.

Where it does not, the likelihood or its noise is wrong, whatever is named. A case takes three seconds.

    python tests/studies/true_damper.py [configs/blind-motions.yaml] [--seed 1] [--cases 60] [--campaign stepped]
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pzd.cli  # noqa: F401  # before numpy: as in the command, the linear algebra has one thread
from pzd.artefacts import base_of
from pzd.blind.case import CaseFiles, Truth
from pzd.blind.hide import BenchmarkSetup, hide
from pzd.blind.plan import plan
from pzd.config import RunConfig
from pzd.damper.model import Damper
from pzd.diagnosis.campaign import Campaign, evidence_of
from pzd.diagnosis.cleaned_records import centred_on, clean, unsaturated_records
from pzd.diagnosis.fit.least_squares import fit
from pzd.diagnosis.fit.problem import Budget
from pzd.diagnosis.gap import probability_of_noise, visible_gap
from pzd.diagnosis.mains import with_hum
from pzd.diagnosis.roles import split
from pzd.identification.stage import identify
from pzd.pipeline.command import opened
from pzd.record import mid_stroke
from pzd.rig.config import FilesEntry, RigConfig
from pzd.rig.stage import ingest
from pzd.schema.validate import read_json

MOST_STEPS = 60
"""Steps of the fit from the truth: it moves by what noise moves it."""
SUSPECT = 1e-3
"""Probability below which a case is marked: of a hundred cases one in ten times has one by chance."""


class Left(NamedTuple):
    """What a fit that begins at the truth leaves of the records of a case."""

    gap: float
    """R.m.s. above the noise, as a share of peak."""
    probability: float
    """That noise alone leaves so much."""


def left_by_the_truth(config: RunConfig, setup: BenchmarkSetup, folder: Path, truth: Damper) -> Left:
    """Diagnose up to the fit, from the damper that was hidden."""
    stand = RigConfig(files=(FilesEntry(path="rig/*.csv"),), limits=config.rig.limits)
    rig = ingest(stand, setup.control, folder)
    identified = identify(config.identify, rig, config.seed)
    recorded = clean(unsaturated_records(rig, None)[0])
    cleaned = centred_on(recorded, mid_stroke(each.record.displacement for each in recorded))
    parts = split(cleaned, config.identify.group.voltage_V, config.identify.group.temperature_degC)
    baseline = base_of(identified.rows, None)
    cleaned = with_hum(cleaned, baseline)
    campaign = Campaign(cleaned, parts, config.diagnose.nuisance, 1, Budget(config.diagnose.most_evaluations))
    whole = evidence_of(campaign, baseline).whole
    of_voltages = (
        whole if len(whole.base) == len(truth.base) else whole.pooled_temperatures()
    )  # the truth has no temperature axis
    found = fit(of_voltages, tuple(truth.effects), of_voltages.start_with(truth), MOST_STEPS)
    checks = campaign.checks(found.damper)
    return Left(visible_gap(checks), probability_of_noise(checks))


def audited(asked: argparse.Namespace, folder: Path) -> Iterator[tuple[Truth, Left]]:
    """Draw the cases of the library one by one, and try the truth of each."""
    changes = [f"blind.seed={asked.seed}", "blind.tuning=true", f"blind.cases={asked.cases}"]
    config = opened(asked.config, folder, changes).config
    if config.blind is None or config.rig.virtual is None:
        raise SystemExit(f"{asked.config}: needs a block blind and a virtual rig, as configs/blind.yaml has")
    setup = BenchmarkSetup(config.blind, config.rig.virtual[0], config.diagnose.nuisance, config.control.signal())
    places = CaseFiles(folder)
    for case in plan(setup.blind):
        if case.kind == "outside" or asked.campaign not in (None, case.campaign):
            continue
        hide(setup, case, places)
        truth = read_json(places.truth(case.id), Truth, setup.control)
        yield truth, left_by_the_truth(config, setup, places.case(case.id), truth.damper)


def main() -> None:
    """Try and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("config", type=Path, nargs="?", default=Path("configs/blind-motions.yaml"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--campaign")
    asked = parser.parse_args()
    suspect = tried = 0
    with tempfile.TemporaryDirectory() as folder:
        for truth, left in audited(asked, Path(folder)):
            tried += 1
            suspect += left.probability < SUSPECT
            mark = "  <- not by noise" if left.probability < SUSPECT else ""
            hidden = "+".join(truth.effects) or "nothing"
            print(  # noqa: T201  # this is what the study is for
                f"{truth.id} {truth.campaign} {hidden}: gap {100 * left.gap:.2g} %, p {left.probability:.2g}{mark}",
                flush=True,
            )
    print(f"{suspect} of {tried} true dampers do not pass for true")  # noqa: T201  # as above


if __name__ == "__main__":
    main()
