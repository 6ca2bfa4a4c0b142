"""The base of every validated model: frozen, strict, without unknown keys or infinities."""

from __future__ import annotations

import copy
import re
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field

from pzd.quantities import VOLTAGE


def for_editors(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """Describe each key, and let keys of the control signal be called after any one, which no editor knows.

    Parameters
    ----------
    schema : JSON schema of a block; beside `voltage_V` stands a pattern that `current_A` and `rebound_clicks` meet, and
        no other key of the block
    model : the block
    """
    from pzd.schema.docstrings import describe_keys

    describe_keys(schema, model)
    properties: dict[str, Any] = schema.get("properties", {})
    others = "|".join(map(re.escape, properties))
    for name, body in properties.items():
        before, named, after = name.partition(VOLTAGE.name)
        if named:
            unit = f"_{VOLTAGE.unit}"
            after = after.removesuffix(unit) + (r"_\w+" if after.endswith(unit) else "")
            pattern = rf"^(?!(?:{others})$){before}[A-Za-z]\w*{after}$"
            schema.setdefault("patternProperties", {})[pattern] = copy.deepcopy(body)


class Frozen(BaseModel):
    """A block of the config or of an artefact; the docstring under a field documents it."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        json_schema_extra=for_editors,
    )

    former_keys: ClassVar[Mapping[str, str]] = {}
    """Keys that a config had once, each with the one that stands in its place: a hint where the old one is written."""


class OneOfAKind(Frozen):
    """A block of which there are several kinds, one file each, and which names what is made of it."""

    kind: str
    """Which kind."""
    label: str | None = Field(default=None, pattern=r"^[A-Za-z0-9._-]+$")
    """Name in the names of records and cases; by default made from kind and size."""

    @property
    def name(self) -> str:
        """How records and cases call it."""
        return self.label or self.own_name()

    @abstractmethod
    def own_name(self) -> str:
        """The name made from kind and size."""
