"""A measured curve is read as its file means it, whatever its form; what the file leaves open is asked, all at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pzd.damper.curve import ForceCurve
from pzd.force_table.config import OneDamper
from pzd.force_table.curve_file import AT_REST, read_curve
from pzd.quantities import Control
from pzd.schema.errors import ConfigError, DataError

VELOCITY = np.array([-1.05, -0.52, -0.13, 0.0, 0.13, 0.52, 1.05])
FORCE = np.array([-1180.0, -690.0, -330.0, 0.0, 710.0, 1440.0, 2260.0])
"""Rebound positive, and harder in rebound, as of most road cars."""
CURRENT = Control("current", "A")


def rows(*columns: np.ndarray, separator: str = ",") -> str:
    return "".join(separator.join(f"{cell:.10g}" for cell in row) + "\n" for row in zip(*columns, strict=True))


def read(folder: Path, text: str | bytes, control: Control | None = None, **asked: object) -> ForceCurve:
    path = folder / "curve.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_curve(OneDamper(curve="curve.csv", **asked), "damper", control or Control(), folder).curve


def assert_is_the_curve(found: ForceCurve, share: float = 1e-9) -> None:
    np.testing.assert_allclose(found.at(VELOCITY, 0.0), FORCE, atol=share * 2260.0 + 1e-6)


POUNDS, INCHES = 4.4482216152605, 0.0254
FORMS = {
    "canonical": ("velocity_m_per_s,force_N\n" + rows(VELOCITY, FORCE), {"sign": 1}),
    "millimetres": ("Velocity (mm/s),Force (kN)\n" + rows(1e3 * VELOCITY, 1e-3 * FORCE), {"sign": 1}),
    "compression positive, as simulators have it": (
        "compression rate [mm/s];force [N]\n" + rows(-1e3 * VELOCITY, -FORCE, separator=";"),
        {"sign": -1},
    ),
    "force against the velocity": ("v [m/s],F [N]\n" + rows(VELOCITY, -FORCE), {"sign": 1}),
    "force against the velocity, which compresses": ("v [m/s],F [N]\n" + rows(-VELOCITY, FORCE), {"sign": -1}),
    "falling velocities": ("v [m/s],F [N]\n" + rows(VELOCITY[::-1], FORCE[::-1]), {"sign": 1}),
    "inches and pounds": ("Vel [in/s],Load [lbf]\n" + rows(VELOCITY / INCHES, FORCE / POUNDS), {"sign": 1}),
    "units said": ("v,F\n" + rows(1e3 * VELOCITY, FORCE), {"sign": 1, "units": {"velocity": "mm/s", "force": "N"}}),
    "no header": (
        rows(VELOCITY, FORCE),
        {
            "sign": 1,
            "columns": {"velocity": "column1", "force": "column2"},
            "units": {"velocity": "m/s", "force": "N"},
        },
    ),
    "German, decimal commas, units below": (
        "Geschwindigkeit;Kraft\nmm/s;kN\n" + rows(1e3 * VELOCITY, 1e-3 * FORCE, separator=";").replace(".", ","),
        {"sign": 1},
    ),
    "directions as magnitudes": (
        "Speed [m/s],Rebound [N],Compression [N]\n" + rows(VELOCITY[3:], FORCE[3:], -FORCE[3::-1]),
        {},
    ),
    "directions with signs": (
        "Speed [m/s],Jounce [N],Rebound [N]\n" + rows(VELOCITY[3:], FORCE[3::-1], FORCE[3:]),
        {},
    ),
    "a preamble": ("Damper: 4711\nOperator: NN\n\nv [m/s],F [N]\n" + rows(VELOCITY, FORCE), {"sign": 1}),
}

CANONICAL = FORMS["canonical"][0]


@pytest.mark.parametrize("form", FORMS)
def test_each_form_is_the_same_curve(form: str, tmp_path: Path) -> None:
    text, asked = FORMS[form]
    assert_is_the_curve(read(tmp_path, text, **asked))


def test_the_other_sign_turns_the_damper_over(tmp_path: Path) -> None:
    text = "v [m/s],F [N]\n" + rows(VELOCITY, FORCE)
    turned = read(tmp_path, text, sign=-1)
    np.testing.assert_allclose(turned.at(-VELOCITY, 0.0), -FORCE, atol=1e-6)


def test_friction_at_rest_of_both_directions_is_a_jump(tmp_path: Path) -> None:
    text = "speed [m/s],rebound [N],compression [N]\n0,60,40\n0.5,900,500\n"
    found = read(tmp_path, text)
    np.testing.assert_allclose(found.at(np.array([-0.5, -AT_REST, AT_REST, 0.5]), 0.0), [-500.0, -40.0, 60.0, 900.0])


def test_two_rows_at_rest_are_the_two_sides_of_a_jump(tmp_path: Path) -> None:
    text = "velocity_m_per_s,force_N,inside\n-0.5,-500,1\n-0.0,-40,1\n0.0,60,1\n0.5,900,1\n"
    found = read(tmp_path, text, sign=1)
    np.testing.assert_allclose(found.at(np.array([-AT_REST, AT_REST, 0.5]), 0.0), [-40.0, 60.0, 900.0])
    once = read(tmp_path, text.replace("-40", "0").replace(",60", ",0"), sign=1)
    np.testing.assert_allclose(once.at(np.array([0.0, 0.5]), 0.0), [0.0, 900.0])


WIDE = "v [m/s],F at 0 A [N],F at 0.5 A [N],F at 1 A [N]\n" + rows(VELOCITY, FORCE, 2.0 * FORCE, 4.0 * FORCE)
LONG = "v [m/s],F [N],current [A]\n" + "".join(
    f"{v:g},{scale * f:g},{current:g}\n"
    for current, scale in ((1.0, 4.0), (0.0, 1.0), (0.5, 2.0))
    for v, f in zip(VELOCITY, FORCE, strict=True)
)
BARE = "v [m/s],soft [N],middle [N],hard [N]\n" + WIDE.partition("\n")[2]


@pytest.mark.parametrize(
    ("text", "asked"),
    [
        (WIDE, {}),
        (LONG, {}),
        (BARE, {"voltages_V": (0.0, 0.5, 1.0)}),
        (LONG.replace("current [A]", "I_mA").replace(",0.5\n", ",500\n").replace(",1\n", ",1000\n"),
         {"columns": {"current": "I_mA"}, "units": {"current": "mA"}}),
    ],
    ids=["a column for each current", "a column of currents", "currents said", "milliamperes"],
)  # fmt: skip
def test_one_curve_for_each_control_value(text: str, asked: dict[str, object], tmp_path: Path) -> None:
    found = read(tmp_path, text, CURRENT, sign=1, **asked)
    assert found.voltages.tolist() == [0.0, 0.5, 1.0]
    for current, scale in ((0.0, 1.0), (0.5, 2.0), (0.75, 3.0), (1.0, 4.0), (2.0, 4.0)):
        np.testing.assert_allclose(found.at(VELOCITY, current), scale * FORCE, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "asked", "words"),
    [
        (CANONICAL, {}, ["damper.sign: which direction is rebound?", "harder in rebound, which would be sign: 1"]),
        ("v [m/s],F [N]\n" + rows(-VELOCITY, -FORCE), {}, ["which would be sign: -1"]),
        ("v,F\n" + rows(VELOCITY, FORCE), {}, ["velocity: the header v names no unit", "units: force: ", "sign: "]),
        ("a,b\n" + rows(VELOCITY, FORCE), {"sign": 1}, ["columns: velocity: no header names it", "one of a, b"]),
        (BARE, {"sign": 1}, ["voltages_V", "3 columns of force"]),
        (WIDE, {"sign": 1}, ["voltages_V", "3 columns of force"]),
        (BARE, {"sign": 1, "voltages_V": (0.0, 1.0)}, ["2 values for 3 columns"]),
        (CANONICAL, {"sign": 1, "columns": {"force": "Load"}}, ["no column has this header"]),
        (CANONICAL, {"sign": 1, "units": {"force": "mm"}}, ["units: force: force: 'mm' is no unit"]),
        (CANONICAL, {"sign": 1, "units": {"speed": "mm"}}, ["units: speed: one of velocity"]),
        (FORMS["directions as magnitudes"][0], {"sign": 1}, ["sign: the columns say which force is that of rebound"]),
    ],
)  # fmt: skip
def test_what_the_file_leaves_open_is_asked_at_once(
    text: str, asked: dict[str, object], words: list[str], tmp_path: Path
) -> None:
    with pytest.raises(ConfigError) as refused:
        read(tmp_path, text, **asked)
    for word in words:
        assert word in str(refused.value)


def test_doing_what_is_asked_works(tmp_path: Path) -> None:
    text = "v,F\n" + rows(VELOCITY, FORCE)
    with pytest.raises(ConfigError, match=r"units: \{velocity: m/s\}.*\n.*units: \{force: N\}.*\n.*sign: 1"):
        read(tmp_path, text)
    assert_is_the_curve(read(tmp_path, text, units={"velocity": "m/s", "force": "N"}, sign=1))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("v [m/s],F [N]\n0.1,100\n0.5,300\n", "below and above 0"),
        ("v [m/s],F [N]\n-0.1,-100\n0.1,100\n0.1,120\n", "stands twice"),
        ("v [m/s],F [N]\n-0.1,-100\n0.1,\n0.5,300\n", "csv:3: an empty cell"),
        ("v [m/s],F [N]\n-0.1,-100\n0.1,x\n0.5,300\n", "a number is needed"),
    ],
)
def test_what_is_no_curve_is_refused(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match=words):
        read(tmp_path, text, sign=1)
