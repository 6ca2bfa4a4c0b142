"""Confounders: forces outside the library, computed like its effects."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

from pzd.damper.compose import respond
from pzd.damper.confounders import confounders, known
from pzd.damper.effects import library
from pzd.damper.fitted_laws import fitted_laws
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.config import DiagnoseConfig

TIME = np.arange(1000) * 1e-3
MOTION = Motion(TIME, *(a * np.sin(2 * np.pi * TIME + p) for a, p in ((0.02, 0.0), (0.126, np.pi / 2), (0.79, np.pi))))
PLAIN = Damper(base=(BaseRow(T0_N=300.0, C_Ns_per_m=2700.0, k_N_per_m=2e5),))


def test_a_confounder_is_known_to_the_damper_and_is_no_effect_of_the_library() -> None:
    assert not set(confounders()) & set(library())
    assert set(known()) == {*confounders(), *library(), *fitted_laws()}


@pytest.mark.parametrize("name", confounders())
def test_a_confounder_gives_its_reference_numbers(name: str) -> None:
    law = importlib.import_module(f"pzd.damper.confounders.{name}").law
    for arguments, expected in confounders()[name].tests:
        assert law(**arguments) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", confounders())
def test_a_confounder_adds_its_law_to_the_force(name: str) -> None:
    law, values = (
        importlib.import_module(f"pzd.damper.confounders.{name}").law,
        {confounders()[name].parameters[0].name: 30.0},
    )
    added = respond(PLAIN.with_effect(name, values), MOTION) - respond(PLAIN, MOTION)
    channels = zip(MOTION.displacement, MOTION.velocity, MOTION.acceleration, strict=True)
    assert added == pytest.approx([law(*each, **values) for each in channels], abs=1e-9)


@pytest.mark.parametrize("name", confounders())
def test_a_config_cannot_force_a_confounder(name: str) -> None:
    with pytest.raises(ValueError, match="no effect is called"):
        DiagnoseConfig(force=(name,))
