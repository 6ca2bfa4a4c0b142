"""What a stage was made from and what it made."""

from __future__ import annotations

from pzd.schema.model import Frozen


class Manifest(Frozen):
    """What a stage was made from and what it made; the only file with timestamps."""

    stage: str
    key: str
    """Hash of all that the stage depends on."""
    config: str
    """Path of the config."""
    inputs: dict[str, str]
    """Hash of every input file."""
    outputs: dict[str, str]
    """Hash of every output file."""
    versions: dict[str, str]
    """Version of pzd, Python and the numerical libraries."""
    finished: str
    """When, in UTC."""
    seconds: float
    """How long it took."""
    marks: tuple[str, ...] = ()
    """Why the result is not to be trusted (exit 4); carried on by the stages behind."""
