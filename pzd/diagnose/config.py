"""The `diagnose` block of the config."""

from __future__ import annotations

from pydantic import Field

from pzd.schema.model import Frozen


class NuisanceConfig(Frozen):
    """What may differ from test to test without being an effect: standard deviations, zero mean."""

    offset: float = Field(default=0.005, ge=0.0)
    """Offset of the force, as a share of the test's peak force."""
    delay_s: float = Field(default=0.0005, ge=0.0)
    """Delay of the force."""
    gain: float = Field(default=0.02, ge=0.0)
    """Gain of the force, as a share of it."""


class DiagnoseConfig(Frozen):
    """When simulation and measurement count as disagreeing."""

    significance: float = Field(default=1e-4, gt=0.0, lt=1.0)
    """A gap is believed when noise alone would show it less often than this."""
    visible: float = Field(default=0.0025, ge=0.0)
    """A gap smaller than this share of the peak force (r.m.s.) counts as nothing missing."""
    nuisance: NuisanceConfig = NuisanceConfig()
    """What may differ from test to test without being an effect."""
