"""Stages on tests or dampers in memory: the config that arguments make, and the pipeline that a command would run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pzd.artefacts import Artefact, Rig
from pzd.config import RunConfig, validated
from pzd.front.records import rig_of
from pzd.pipeline.execution import InMemory
from pzd.pipeline.stages import stages
from pzd.quantities import Control
from pzd.runs import Run
from pzd.schema.yamlfile import document_of

_IN_HAND = {"files": [{"path": "tests"}]}
"""The source of records that a config must name; here they are given, and nothing is read."""


def config_of(control: Control, setting: str | None = None, **blocks: Any) -> RunConfig:
    """Return the config that arguments make, with the defaults of a config for all that is not said.

    Parameters
    ----------
    control : the control signal
    setting : of the tests, the one that diagnose and everything behind it use
    blocks : of the config, as plain data; empty values are left out

    Raises
    ------
    ConfigError : when a value is none that a config may have
    TypeError : when it is no plain data
    """
    rig = {**_IN_HAND, **blocks.pop("rig", {})}
    data = {"control": {"name": control.name, "unit": control.unit}, "rig": rig, "setting": setting, **blocks}
    return validated(document_of(data))


def pipeline_of(config: RunConfig, artefacts: Mapping[str, Artefact]) -> InMemory:
    """Return the pipeline of a config in which some artefacts are made already, by their folders."""
    here = Path()
    run = Run(here, here / "config.yaml", config.control.signal())
    return InMemory(config, run, stages(config), _nothing_said, artefacts=dict(artefacts))


def _nothing_said(line: str) -> None:
    """Leave out what a command prints; no lambda, so that a result can be pickled."""


def pipeline_on(
    tests: Any, control: Control, setting: str | None, limits: Any = None, called: str = "tests", **blocks: Any
) -> InMemory:
    """Return the pipeline on tests.

    Parameters
    ----------
    tests : one or several `Test`
    control : the control signal
    setting : the one in use
    limits : of the stand, keys of `rig.limits`
    called : name of the argument with the tests, for messages
    blocks : of the config

    Raises
    ------
    TypeError : when an argument is of the wrong type
    UserError : when a value is none that a config may have, or the tests cannot be used together
    """
    if setting is not None and not isinstance(setting, str):
        raise TypeError(f"setting: must be text (got {type(setting).__name__})")
    if limits is not None and not isinstance(limits, Mapping):
        raise TypeError(f"limits: must be a mapping such as {{'stroke_m': 0.1}} (got {type(limits).__name__})")
    config = config_of(control, setting, rig={"limits": dict(limits or {})}, **blocks)
    return pipeline_of(config, {Rig.folder: rig_of(tests, config.measured_rig.limits, control, called)})
