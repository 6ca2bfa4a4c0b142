"""The score of a case: its diagnosis compared with the truth that was hidden."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from pzd.artefacts import Diagnosed, Diagnosis
from pzd.blind.case import COST, CaseFiles, Cost, NoiseFreeRecord, Scored, Truth, read_noise_free
from pzd.blind.hide import gap_after_refit
from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.thresholds import TRIVIAL_SIZE
from pzd.identification.prepared_record import warm_up
from pzd.quantities import Control
from pzd.schema.validate import read_json, write_json
from pzd.signals.nuisance import NuisanceConfig

_OF_THE_TRUTH = {
    *("id", "kind", "campaign", "one_frequency", "described_by", "visible_gap", "gap_given_other"),
    *("force_noise", "noise_rho", "displacement_noise_m"),
}
"""Fields that a score takes over from the truth."""

NoiseFree = Mapping[str, NoiseFreeRecord]
"""The noise-free records of a case by name."""


def score_case(files: CaseFiles, name: str, made_from: str, control: Control, *, keep_files: bool) -> Scored:
    """Score a diagnosed case, and write the score whole or not at all.

    Parameters
    ----------
    files : of the benchmark
    name : id of the case
    made_from : hash of the config and the code it was made with
    control : the control signal
    keep_files : whether rig files, diagnosis and noise-free records stay
    """
    truth = read_json(files.truth(name), Truth, control)
    cost = read_json(files.case(name) / COST, Cost, control)
    diagnosed = None if cost.failure else Diagnosed.read(files.case(name), control)
    noise_free = {} if diagnosed is None else read_noise_free(files.noise_free(name))
    result = scored(truth, cost, diagnosed, noise_free, made_from)
    target = files.scored(name)
    target.parent.mkdir(parents=True, exist_ok=True)
    unfinished = target.with_suffix(".new")
    write_json(unfinished, result, control)
    unfinished.replace(target)
    if not keep_files:
        shutil.rmtree(files.rig(name))
        files.noise_free(name).unlink()
    return result


def scored(truth: Truth, cost: Cost, diagnosed: Diagnosed | None, noise_free: NoiseFree, made_from: str) -> Scored:
    """Compare a diagnosis with the truth.

    Parameters
    ----------
    truth : what was hidden
    cost : of the diagnosis, and how it failed
    diagnosed : the diagnosis; None where it failed
    noise_free : the noise-free records by name
    made_from : hash of the config and the code the case was made with
    """
    diagnosis = diagnosed.diagnosis if diagnosed else None
    adopted = diagnosed if diagnosed and diagnosed.diagnosis.effects else None
    true_effects = counted_effects(truth)
    is_open = diagnosis is not None and diagnosis.verdict == "ambiguous" and not diagnosis.effects
    nothing_hidden = truth.kind != "outside" and not true_effects
    return Scored(
        **truth.model_dump(include=_OF_THE_TRUTH),
        **cost.model_dump(),
        made_from=made_from,
        hidden=truth.form or "+".join(truth.effects) or "none",
        truth=true_effects,
        verdict=diagnosis.verdict if diagnosis else None,
        effects=diagnosis.effects if diagnosis else (),
        rivals=diagnosis.rivals if diagnosis else (),
        confidence=diagnosis.confidence if diagnosis else None,
        shapes=tuple(row.shape for row in diagnosed.hypotheses.alone) if diagnosed else (),
        inside=_inside(diagnosis, truth) if diagnosis and set(diagnosis.effects) == set(true_effects) else {},
        gap_cut=gap_cut(adopted, noise_free) if adopted else None,
        gap_cut_gains_out=gap_cut(adopted, noise_free, gains_out=True) if adopted else None,
        gap_cut_of_truth=gap_cut_of_truth(adopted, noise_free) if adopted else None,
        next_test=bool(diagnosis and diagnosis.next_test),
        told_apart=not (diagnosis and is_open and nothing_hidden) or told_apart(truth, noise_free, diagnosis.rivals),
    )


def counted_effects(truth: Truth) -> tuple[str, ...]:
    """Return the hidden effects that are large enough to count."""
    small = {
        effect
        for (effect, parameter), limit in _least_that_counts(truth).items()
        if effect in truth.damper.effects and np.max(np.abs(truth.damper.effects[effect][parameter])) < limit
    }
    return tuple(name for name in truth.damper.effects if name not in small)


def _least_that_counts(truth: Truth) -> dict[tuple[str, str], float]:
    """Return by effect and parameter the size from which on an effect counts."""
    unit = {"F_0": truth.lowest_peak_N}
    return {(effect, name): size * unit.get(name, 1.0) for (effect, name), size in TRIVIAL_SIZE.items()}


def told_apart(truth: Truth, noise_free: NoiseFree, rivals: Sequence[str]) -> bool:
    """Return whether the tests tell the true damper, in which nothing is missing, from that with one of the rivals.

    A rival is held at the smallest size that counts, either way, and T0, C and k are refitted to the noise-free force:
    what is left beyond the noise is what the likelihood loses. Each test may have as much of an offset or a delay for
    itself; that loses what its prior says.

    Equation: min(n (g / s)^2 (1 - r) / (1 + r), N (v / p)^2) >= B; n samples of N tests, g gap after the refit, s and r
    size and correlation of the noise, v the smallest size that counts, p its prior, B `rival_bic` of diagnose

    Parameters
    ----------
    truth : of a case in which nothing that counts is hidden
    noise_free : its noise-free records by name
    rivals : effects that the diagnosis names; one whose every size counts is always told apart
    """
    tests, limit, prior = len(noise_free), DiagnoseConfig().rival_bic, NuisanceConfig()
    priors = {"preload_offset": prior.offset, "sensor_delay": prior.delay_s}
    own = {effect: size / priors[effect] for (effect, _), size in TRIVIAL_SIZE.items() if effect in priors}
    if any(name not in own for name in rivals):
        return True
    losses = [loss for name in rivals for loss in (*_losses(truth, noise_free, name), tests * own[name] ** 2)]
    return min(losses, default=limit) >= limit


def _losses(truth: Truth, noise_free: NoiseFree, rival: str) -> Iterator[float]:
    """Yield what the likelihood loses with a rival of the smallest size that counts, to either side."""
    records = list(noise_free.values())
    samples = sum(record.force.size for record in records)
    independent = samples * (1.0 - truth.noise_rho) / (1.0 + truth.noise_rho)
    for (effect, parameter), least in _least_that_counts(truth).items():
        for side in (least, -least) if effect == rival else ():
            effects = {**truth.damper.effects, effect: {parameter: side}}
            gap = gap_after_refit(records, truth.damper.model_copy(update={"effects": effects}))
            yield independent * (gap / truth.force_noise) ** 2


def _inside(diagnosis: Diagnosis, truth: Truth) -> dict[str, bool]:
    """Return of each parameter with one value and an interval whether the true value lies in it."""
    inside = {}
    for effect, parameters in diagnosis.parameters.items():
        for name, value in parameters.items():
            low, high, true = value.low95, value.high95, truth.damper.effects[effect][name]
            if isinstance(low, float) and isinstance(high, float) and isinstance(true, float):
                inside[f"{effect}.{name}"] = low <= true <= high
    return inside


# --- How much of the gap to the noise-free force is closed ---


def gap_cut(diagnosed: Diagnosed, noise_free: NoiseFree, *, gains_out: bool = False) -> float:
    """Compute how much of the gap to the noise-free force the adopted effects close on the held-out records.

    Equation: 1 - W_s after / W_s before                    Source: Makowski and Knap 2021, eq. (4)

    Parameters
    ----------
    diagnosed : with the baseline damper and the final one
    noise_free : the noise-free records by name
    gains_out : compare shapes alone: the best gain of each record taken out, before and after alike
    """
    records = [noise_free[name] for name in _held_out(diagnosed)]
    before, after = (
        sum(_squares(damper, record, gains_out=gains_out) for record in records)
        for damper in (diagnosed.baseline, diagnosed.damper)
    )
    return 1.0 - after / before


def gap_cut_of_truth(diagnosed: Diagnosed, noise_free: NoiseFree) -> float:
    """Compute the same of the true force, scaled at every voltage by the mean gain of the tests that were fitted there.

    About what a fit can reach: a gain that the tests of a voltage share is the same to it as a larger T0, C and k.

    Parameters
    ----------
    diagnosed : with the baseline damper
    noise_free : the noise-free records by name, with what was recorded of them
    """
    held_out = _held_out(diagnosed)
    fitted = {name: record for name, record in noise_free.items() if name not in held_out} or noise_free
    before = after = 0.0
    for record in (noise_free[name] for name in held_out):
        alike = [other.gain for other in fitted.values() if other.voltage == record.voltage]
        error = float(np.mean(alike or [other.gain for other in fitted.values()])) - 1.0
        after += float(np.sum((error * record.force[warm_up(record.motion.displacement) :]) ** 2))
        before += _squares(diagnosed.baseline, record, gains_out=False)
    return 1.0 - after / before


def _held_out(diagnosed: Diagnosed) -> tuple[str, ...]:
    gap = diagnosed.diagnosis.gap
    if gap is None:
        raise ValueError("the gap could not be measured, so nothing is known of what is taken away")
    return gap.held_out


def _squares(damper: Damper, record: NoiseFreeRecord, *, gains_out: bool) -> float:
    first = warm_up(record.motion.displacement)
    simulated = respond(damper, record.motion, float(record.force[0]), 1e-7)
    own = simulated[first:]
    gain = float(record.force[first:] @ own / (own @ own)) if gains_out else 1.0
    return float(np.sum(record.missed_by(gain * simulated)[first:] ** 2))
