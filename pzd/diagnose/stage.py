"""The diagnose stage: where simulation and measurement disagree above the noise, and by how much."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import Diagnosed, Diagnosis, Gap, Identified, Region, Rig, base_of
from pzd.damper.model import Damper
from pzd.diagnose.config import DiagnoseConfig
from pzd.identify.config import IdentifyConfig
from pzd.quantities import Control

Mask = NDArray[np.bool_]

log = logging.getLogger(__name__)


def diagnose(
    diagnose: DiagnoseConfig,
    identify: IdentifyConfig,
    rig: Rig,
    identified: Identified,
    control: Control,
    setting: str | None,
) -> Diagnosed:
    """Whether the identified damper misses the measurement above the noise, where, and how far on held-out data.

    Parameters
    ----------
    diagnose : the config's block
    identify : that of identify, for refitting the base to the training samples alone
    rig : the records
    identified : the Bingham parameters
    control : the control signal, for the words
    setting : of the rig's settings, the one in use

    Returns
    -------
    the verdict `none` or `unexplained`, and the identified damper unchanged
    """
    from pzd.diagnose.gap import gap_of, probability_of_noise, visible_gap
    from pzd.diagnose.inputs import prepare
    from pzd.diagnose.joint import with_nuisances
    from pzd.diagnose.judge import judge
    from pzd.diagnose.predict import refitted
    from pzd.diagnose.split import TRAINING, UNTOUCHED, split
    from pzd.diagnose.where import regions

    prepared = prepare([record for record in rig.records if record.setting == setting])
    parts = split(prepared, identify.group.voltage_V, identify.group.temperature_degC)
    seen = [roles != UNTOUCHED for roles in parts.roles]

    def fitted(wanted: Sequence[Mask]) -> Damper:
        plain = refitted(identify, prepared, wanted, identified, setting)
        return with_nuisances(plain, prepared, wanted, diagnose.nuisance)

    base = fitted(seen)
    judged = [judge(base, p, mask, diagnose.nuisance) for p, mask in zip(prepared, seen, strict=True) if mask.any()]
    probability, size = probability_of_noise(judged), visible_gap(judged)
    log.info("diagnose: gap %.2f %% of peak above the noise, probability by noise alone %.1e", 100 * size, probability)

    trained = fitted([roles == TRAINING for roles in parts.roles])
    unseen = [(p, roles == UNTOUCHED) for p, roles in zip(prepared, parts.roles, strict=True)]
    figures = gap_of([judge(trained, p, mask, diagnose.nuisance) for p, mask in unseen if mask.any()], parts)
    missed = probability < diagnose.significance and size >= diagnose.visible
    where = regions(judged, control.unit) if missed else ()
    damper = base_of(identified.rows, setting)
    return Diagnosed(_diagnosis(diagnose, missed, probability, size, figures, where), damper, damper)


def _diagnosis(
    config: DiagnoseConfig, missed: bool, probability: float, size: float, gap: Gap, where: Sequence[Region]
) -> Diagnosis:
    return Diagnosis(
        verdict="unexplained" if missed else "none",
        reason=_reason(config, probability, size, gap),
        effects=(),
        confidence=None,
        gap=gap,
        parameters={},
        ranking=(),
        rivals=(),
        where=tuple(where),
        next_test=None,
    )


def _reason(config: DiagnoseConfig, probability: float, size: float, gap: Gap) -> str:
    told = f"a gap of {100 * size:.2g} % of peak force (r.m.s. above the noise)"
    if probability >= config.significance:
        words = f"{told} that noise alone shows with probability {probability:.2g}: within the noise"
    elif size < config.visible:
        words = f"{told}, repeatable but smaller than {100 * config.visible:g} % of peak: counts as nothing missing"
    else:
        words = f"{told} that repeats (probability by noise alone {max(probability, 1e-300):.1g})"
    weak = gap.hold_out in {"cycles", "segments", "mixed"}
    return words + (
        f"; held out were {gap.hold_out} of tests that were also fitted, which is weak evidence" if weak else ""
    )
