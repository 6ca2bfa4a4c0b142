"""The diagnose stage: where simulation and measurement disagree, and which effect is missing.

Only its declaration stands here. The work is in `workflow.py`, which is imported when the stage runs: a command that
finds all results fresh reads the declaration, and need not load numba and scipy for it.
"""

from __future__ import annotations

from pzd.artefacts import Diagnosed, Identified, Rig
from pzd.diagnosis.config import DiagnoseConfig
from pzd.identification.config import IdentifyConfig
from pzd.quantities import Control
from pzd.rig.config import RigConfig


def diagnose(
    diagnose: DiagnoseConfig,
    identify: IdentifyConfig,
    stand: RigConfig,
    rig: Rig,
    identified: Identified,
    control: Control,
    setting: str | None,
    jobs: int,
) -> Diagnosed:
    """Find what the identified damper lacks, name it where the data allow, and return the damper with it added.

    Parameters
    ----------
    diagnose : the config's block
    identify : that of identify, for what counts as one condition
    stand : that of the rig, for what the stand can do
    rig : the records
    identified : the Bingham parameters
    control : the control signal, for names and units
    setting : of the rig's settings, the one in use
    jobs : candidates fitted at the same time

    Returns
    -------
    the verdict, and the damper with the adopted effects; unchanged where none is adopted, and where a knee law misses
    nothing visible
    """
    from pzd.diagnosis.workflow import diagnose_setting

    return diagnose_setting(diagnose, identify, stand, rig, identified, control, setting, jobs)
