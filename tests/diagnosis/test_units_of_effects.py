"""Parameters of effects are told in the unit of the control signal where they count in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from campaign import damper_of

from pzd.artefacts import Diagnosed, Value
from pzd.damper.effects import library
from pzd.diagnosis.search.acceptance import Selection
from pzd.diagnosis.stage import parameters_of
from pzd.quantities import Control

CONTROLS = [(Control(), "V"), (Control("current", "A"), "A")]


@pytest.mark.parametrize(("control", "unit"), CONTROLS)
def test_a_play_is_found_in_the_unit_of_the_control_and_an_orifice_in_its_own(
    control: Control, unit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    damper = damper_of((0.0, 150.0)).with_effect("piezo_hysteresis", {"r": 5.0})
    damper = damper.with_effect("orifice_quadratic", {"q": 900.0})
    names = {"piezo_hysteresis": 5.0, "orifice_quadratic": 900.0}
    unknowns: list[Any] = [
        SimpleNamespace(effect=name, parameter=library()[name].parameters[0], of=lambda _, value=value: value)
        for name, value in names.items()
    ]
    monkeypatch.setattr("pzd.diagnosis.verdict.standard_errors", lambda _: (0.1, 10.0))
    selection = cast("Selection", SimpleNamespace(fitted=SimpleNamespace(damper=damper, unknowns=unknowns)))
    found = parameters_of(selection, control)
    assert (found["piezo_hysteresis"]["r"].value, found["piezo_hysteresis"]["r"].unit) == (5.0, unit)
    assert found["orifice_quadratic"]["q"].unit == "N s2/m2"


@pytest.mark.parametrize(("control", "unit"), CONTROLS)
def test_a_play_that_was_edited_by_hand_is_read_in_the_unit_of_the_control(
    control: Control, unit: str, tmp_path: Path
) -> None:
    name, plain = "piezo_hysteresis", damper_of((0.0, 150.0))
    made = Diagnosed.undiagnosed(plain.with_effect(name, {"r": 6.0}), plain)
    found = {name: {"r": Value(value=5.0, low95=4.0, high95=6.0, unit=unit)}}
    replace(made, diagnosis=made.diagnosis.model_copy(update={"effects": (name,), "parameters": found})).write(
        tmp_path, control
    )
    told = Diagnosed.read(tmp_path, control).diagnosis.parameters[name]["r"]
    assert (told.value, told.low95, told.unit) == (6.0, None, unit)
