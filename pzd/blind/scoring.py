"""The score of a case: its diagnosis compared with the truth that was hidden."""

from __future__ import annotations

import shutil
from collections.abc import Mapping

from pzd.artefacts import Diagnosed, Diagnosis
from pzd.blind.case import Cost, Places, Scored, Truth
from pzd.blind.clean import Clean, read_clean
from pzd.blind.cuts import gap_cut, gap_cut_of_truth
from pzd.blind.diagnosis import COST
from pzd.quantities import Control
from pzd.schema.jsonfile import read_json, write_json

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
