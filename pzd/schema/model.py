"""The base of every validated model: frozen, strict, without unknown keys or infinities."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import BaseModel, ConfigDict


class Frozen(BaseModel):
    """A block of the config or of an artefact; the docstring under a field documents it."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
    )

    former_keys: ClassVar[Mapping[str, str]] = {}
    """Keys that a config had once, each with the one that stands in its place: a hint where the old one is written."""
