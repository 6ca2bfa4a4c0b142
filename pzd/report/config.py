"""The block `report` of the config: standards, expected numbers, and what the page shows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

from pydantic import Field, field_validator

from pzd.schema.model import Frozen

Edition = Literal["ISO 2631-1:1997", "ISO 2631:1978", "Directive 2002/44/EC"]


class ReportConfig(Frozen):
    """What the comfort report rates the rides by, and what it shows."""

    former_keys: ClassVar[Mapping[str, str]] = {"published": "reference"}

    editions: tuple[Edition, ...] = Field(default=("ISO 2631-1:1997", "ISO 2631:1978"), min_length=1)
    """Standards by which the rides are rated. The boundaries of 1978, which the paper used, are an
    unverified transcription of a withdrawn standard, and are always called so."""
    daily_exposure_h: float = Field(default=8.0, gt=0.0, le=24.0)
    """Hours of riding per day, for Directive 2002/44/EC."""
    health_guidance_zone: Literal["0.45-0.90", "0.47-0.93"] | None = None
    """Health guidance caution zone of ISO 2631-1:1997 at 8 h a day, m/s2. Secondary sources disagree on
    its limits, so none is used unless one is chosen here."""
    records_shown: int = Field(default=3, ge=1, le=12)
    """How many rig records the page shows as measured and simulated force, spread over the voltages."""
    about: Mapping[str, str | int | float] = {}
    """What the head of the page says, in words of your own: damper, serial number, operator, date, calibration."""
    reference: str | None = None
    """Expected numbers that reference.csv sets beside those of the run: a CSV file, or `makowski2021`, the
    numbers that the paper prints. pzd/report/reference.py says what stands in such a file."""

    @field_validator("editions")
    @classmethod
    def _once(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        if len(set(names)) < len(names):
            raise ValueError("one is named twice")
        return names
