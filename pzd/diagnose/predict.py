"""What a damper predicts for a record, and the plain damper refitted to some of the samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import Identified, Rig, base_of
from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.diagnose.inputs import Prepared
from pzd.diagnose.split import stretches
from pzd.identify.config import IdentifyConfig
from pzd.identify.stage import identify as fit
from pzd.identify.trial import fine_motion, trial_of, warm_up
from pzd.record import Record

Array = NDArray[np.float64]

ENDS = 0.02
"""Share of a record at either end where its smoothed displacement rests on one side alone: not judged."""


def predicted_force(damper: Damper, prepared: Prepared) -> Array:
    """(n,) force that the damper gives under the record's cleaned motion [N]."""
    record = prepared.lead or prepared.record
    force = respond(damper, fine_motion(record), float(record.force[0]))
    return trial_of(record).at_samples(force)[prepared.lead_samples :]


def counted(prepared: Prepared) -> NDArray[np.bool_]:
    """(n,) whether the prediction no longer depends on how the record began."""
    size = prepared.record.time.size
    if prepared.lead is not None:
        return np.ones(size, dtype=np.bool_)
    ends = int(ENDS * size)
    order = np.arange(size)
    return (order >= max(warm_up(prepared.record.displacement), ends)) & (order < size - ends)


def refitted(
    config: IdentifyConfig,
    prepared: Sequence[Prepared],
    wanted: Sequence[NDArray[np.bool_]],
    identified: Identified,
    setting: str | None,
) -> Damper:
    """The plain damper fitted to the wanted samples alone, on the conditions and nodes that identify found.

    Parameters
    ----------
    config : of identify; the search is `separable` whatever it says, since both find the same optimum
    prepared : the records of the setting
    wanted : (n,) mask of each record
    identified : for the nodes of moving voltages
    setting : of the records

    Returns
    -------
    the damper; the identified one where no stretch is long enough to be fitted
    """
    records: list[Record] = []
    for p, mask in zip(prepared, wanted, strict=True):
        records += stretches(p.record, mask)
    if not records:
        return base_of(identified.rows, setting)
    nodes = sorted({r.voltage_V for r in identified.rows if r.setting == setting and r.voltage_V is not None})
    fixed = config.model_copy(update={"method": "separable", "nodes": tuple(nodes) or None})
    return base_of(fit(fixed, Rig(tuple(records), ()), 1).rows, setting)
