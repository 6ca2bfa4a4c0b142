"""Artefacts: what each stage writes and the next ones read; from the top, this package is the pipeline.

rig -> identified -> diagnosed -> table -> rides -> report, one file each. Every artefact writes
itself into its stage's folder and reads itself back, checked, with file and line of whatever is
wrong. `control` renames the columns of the control signal.
"""

from pzd.artefacts.diagnosis import (
    Diagnosed,
    Diagnosis,
    Gap,
    HeldOutTest,
    HeldOutVoltage,
    Hypotheses,
    HypothesisPoint,
    HypothesisRow,
    NextTest,
    Prediction,
    Ranked,
    Region,
    Value,
)
from pzd.artefacts.identified import (
    AuxiliaryRow,
    Characteristics,
    Identified,
    MeasureRow,
    ParameterRow,
    base_of,
    identified_damper,
)
from pzd.artefacts.knee import ClickRow, KneeForceRow, KneeRow, Knees, LawRow, PredictedRow, UnitRow
from pzd.artefacts.mounted import MountedDamper, MountedDampers, MountedNotes, damper_without_force
from pzd.artefacts.report import ComfortRow, Manifest, ReferenceRow, Report
from pzd.artefacts.rides import (
    AXLE_COLUMNS,
    AXLES,
    ENERGY_LIMIT,
    RIDE_COLUMNS,
    Ending,
    FoundRow,
    History,
    Response,
    Ride,
    RideRow,
    Rides,
    SpectrumRow,
    SummaryRow,
    WeightedRow,
    WheelRow,
)
from pzd.artefacts.rig import Finding, IngestRow, RecordEntry, Rig, worst
from pzd.artefacts.table import ForceRow, InverseRow, SettingLeftOutRow, SettingRow, Table, TableNotes

Artefact = Rig | Identified | Diagnosed | Table | MountedDampers | Rides | Report
