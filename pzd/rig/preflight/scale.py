"""Whether the numbers are of the size that a damper's are: a unit read wrongly is off by 1000."""

from __future__ import annotations

import numpy as np

from pzd.artefacts import Finding
from pzd.rig.preflight import Measured

LEAST_STROKE = 2e-4
"""A smaller stroke [m] is more likely a wrong unit than a test."""
FORCES = (2.0, 5e5)
"""Peak forces [N] outside this range are more likely a wrong unit."""
SPEEDS = (5e-4, 5.0)
"""Peak speeds [m/s] outside this range are more likely a wrong unit of time."""

HINTS = {"degC": "degC, degF or K", "V": "V or mV", "A": "A or mA", "": "mm or m, N or kN, s or ms"}
SHORT_STROKE = 0.05
"""Dampers of vehicles move no further [m]"""
VEHICLE_FORCE = 5e4
"""and give no larger forces [N]; those of bridges and buildings move further."""
TEMPERATURES = (-60.0, 150.0)
"""Beyond these [degC] seals and oil of a damper fail: kelvin or degrees Fahrenheit are likelier."""
CONTROLS = {"V": 1e4, "A": 1e2}
"""Largest control signal by its unit: piezo valves take up to 1 kV, electrorheological ones 5 kV, coils some A."""


def check(test: Measured) -> list[Finding]:
    """Strokes, forces, speeds, temperatures and control signals that look like a unit read wrongly."""
    record, stroke = test.record, float(np.ptp(test.record.displacement))
    forces = (FORCES[0], VEHICLE_FORCE) if stroke < SHORT_STROKE else FORCES
    sizes = [
        ("stroke", stroke, (LEAST_STROKE, np.inf), "m"),
        ("peak force", float(np.abs(test.record.force).max()), forces, "N"),
        ("peak speed", float(np.abs(test.clean.velocity).max()), SPEEDS, "m/s"),
    ]
    temperature, voltage = record.median_temperature(), record.median_voltage()
    if temperature is not None:
        sizes.append(("temperature", temperature, TEMPERATURES, "degC"))
    if voltage is not None and test.control.unit in CONTROLS:
        sizes.append((test.control.name, abs(voltage), (0.0, CONTROLS[test.control.unit]), test.control.unit))
    return [
        Finding(
            check="scale",
            where=f"{what} of the whole record",
            size=size,
            unit=unit,
            follows=f"{low:g} to {high:g} {unit} is usual: check the units ({HINTS.get(unit, HINTS[''])})",
        )
        for what, size, (low, high), unit in sizes
        if not low <= size <= high
    ]
