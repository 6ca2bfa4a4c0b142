"""What each stage hands on: read this package from the top and you know the pipeline.

rig -> identified -> diagnosed -> table -> rides -> report, one file each. Every artefact writes
itself into its stage's folder and reads itself back, checked, with file and line of whatever is
wrong. `control` renames the columns of the control signal.
"""

from pzd.artefacts.characteristics import (
    AsItStandsRow,
    Characteristics,
    ContinuousVelocityRow,
    GasAndFrictionRow,
    PeakVelocityRow,
    StepRow,
    WarmUpRow,
)
from pzd.artefacts.diagnosed import Diagnosed
from pzd.artefacts.diagnosis import (
    Diagnosis,
    Gap,
    KeptBack,
    LeftOut,
    NextTest,
    Prediction,
    Ranked,
    Region,
    Value,
)
from pzd.artefacts.hypotheses import Hypotheses, HypothesisPoint, HypothesisRow
from pzd.artefacts.identified import (
    FALLBACK,
    AuxiliaryRow,
    Identified,
    MeasureRow,
    ParameterRow,
    base_of,
    identified_damper,
)
from pzd.artefacts.knee import ClickRow, KneeForceRow, KneeRow, Knees, LawRow, PredictedRow, UnitRow
from pzd.artefacts.knee_as_damper import knee_damper
from pzd.artefacts.manifest import Manifest
from pzd.artefacts.report import ComfortRow, ReferenceRow, Report
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
from pzd.artefacts.rig import Finding, IngestRow, RecordEntry, Rig, extent
from pzd.artefacts.table import ForceRow, InverseRow, SettingLeftOutRow, SettingRow, Table, TableNotes

Artefact = Rig | Identified | Diagnosed | Table | Rides | Report

__all__ = [
    "AXLES",
    "AXLE_COLUMNS",
    "ENERGY_LIMIT",
    "FALLBACK",
    "RIDE_COLUMNS",
    "Artefact",
    "AsItStandsRow",
    "AuxiliaryRow",
    "Characteristics",
    "ClickRow",
    "ComfortRow",
    "ContinuousVelocityRow",
    "Diagnosed",
    "Diagnosis",
    "Ending",
    "Finding",
    "ForceRow",
    "FoundRow",
    "Gap",
    "GasAndFrictionRow",
    "History",
    "Hypotheses",
    "HypothesisPoint",
    "HypothesisRow",
    "Identified",
    "IngestRow",
    "InverseRow",
    "KeptBack",
    "KneeForceRow",
    "KneeRow",
    "Knees",
    "LawRow",
    "LeftOut",
    "Manifest",
    "MeasureRow",
    "NextTest",
    "ParameterRow",
    "PeakVelocityRow",
    "PredictedRow",
    "Prediction",
    "Ranked",
    "RecordEntry",
    "ReferenceRow",
    "Region",
    "Report",
    "Response",
    "Ride",
    "RideRow",
    "Rides",
    "Rig",
    "SettingLeftOutRow",
    "SettingRow",
    "SpectrumRow",
    "StepRow",
    "SummaryRow",
    "Table",
    "TableNotes",
    "UnitRow",
    "Value",
    "WarmUpRow",
    "WeightedRow",
    "WheelRow",
    "base_of",
    "extent",
    "identified_damper",
    "knee_damper",
]
