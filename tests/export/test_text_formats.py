"""The text formats, read by small readers written after the formats' own descriptions, are our own table."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from exported_dampers import DAMPERS, POINTS, content_of, largest

from pzd.export.content import Content
from pzd.export.formats import formats
from pzd.quantities import Control
from pzd.schema.errors import ConfigError


def modelica_tables(text: str) -> dict[str, np.ndarray]:
    """The tables of a file as the Modelica standard library describes it: `#1`, then `double name(rows,columns)`."""
    lines = text.splitlines()
    assert lines[0] == "#1"
    words = " ".join(line.partition("#")[0] for line in lines[1:]).split()
    found = {}
    while words:
        assert words.pop(0) == "double"
        name, rows, columns = re.fullmatch(r"(\w+)\((\d+),(\d+)\)", words.pop(0)).groups()
        size = int(rows) * int(columns)
        found[name] = np.array(words[:size], dtype=float).reshape(int(rows), int(columns))
        words = words[size:]
    return found


def bilinear(table: np.ndarray, u1: np.ndarray, u2: np.ndarray) -> np.ndarray:
    """What CombiTable2Ds makes of a table: linear along both arguments."""
    rows, columns, values = table[1:, 0], table[0, 1:], table[1:, 1:]
    assert np.all(np.diff(rows) > 0.0)
    assert np.all(np.diff(columns) > 0.0)
    i = np.clip(np.searchsorted(rows, u1, side="right") - 1, 0, rows.size - 2)
    j = np.clip(np.searchsorted(columns, u2, side="right") - 1, 0, columns.size - 2)
    a, b = (u1 - rows[i]) / (rows[i + 1] - rows[i]), (u2 - columns[j]) / (columns[j + 1] - columns[j])
    lower = (1.0 - b) * values[i, j] + b * values[i, j + 1]
    upper = (1.0 - b) * values[i + 1, j] + b * values[i + 1, j + 1]
    return (1.0 - a) * lower + a * upper


def test_modelica_interpolates_as_we_do(content: Content, points: tuple[np.ndarray, np.ndarray]) -> None:
    (data,) = formats()["modelica"].files(content).values()
    tables = modelica_tables(data.decode())
    U, v = points
    assert U.size >= 1000
    for n, lookup in enumerate(content.lookups, 1):
        table = tables[f"force_{n}" if len(content.lookups) > 1 else "force"]
        read = bilinear(table, U, v) if content.adjustable else np.interp(v, *table.T)
        assert np.max(np.abs(read - lookup.force(U, v))) <= 1e-9 * largest(content)


def test_the_inverse_of_modelica_gives_the_force_that_was_asked_for_at_its_nodes() -> None:
    content = content_of(DAMPERS["orifice"])
    (data,) = formats()["modelica"].files(content).values()
    tables = modelica_tables(data.decode())
    v, low, high = tables["inverse_range"].T
    shares, signals = tables["inverse"][0, 1:], tables["inverse"][1:, 1:]
    wanted = low[:, np.newaxis] + shares * (high - low)[:, np.newaxis]
    np.testing.assert_array_equal(tables["inverse"][1:, 0], v)
    assert signals.size >= 1000
    missed = content.lookups[0].force(signals, v[:, np.newaxis]) - wanted
    assert np.max(np.abs(missed)) <= 1e-9 * largest(content)


def property_curve(text: str) -> tuple[dict[str, str], np.ndarray]:
    """Keys and the curve of a property file: blocks in brackets, comments behind $ or !, columns named in braces."""
    block, keys, rows = "", {}, []
    for line in text.splitlines():
        if line.startswith(("$", "!")):
            continue
        if head := re.fullmatch(r"\[(\w+)\]", line):
            block = head[1]
        elif "=" in line and block != "CURVE":
            key, _, value = line.partition("=")
            keys[f"{block}.{key.strip()}"] = value.strip().strip("'")
        elif block == "CURVE" and line.startswith("{"):
            assert line.strip("{} ").split() == ["vel", "force"]
        elif block == "CURVE":
            rows.append([float(word) for word in line.split()])
    return keys, np.array(rows)


def conditions(content: Content) -> list[tuple[int, float]]:
    """Temperature by its number, and control signal, of every curve."""
    return [(i, float(u)) for i in range(len(content.lookups)) for u in content.grid.voltages]


def test_every_curve_of_the_property_files_is_ours(content: Content, rng: np.random.Generator) -> None:
    written = formats()["tir"].files(content)
    wanted = conditions(content)
    assert len(written) == len(wanted)
    for (i, U), data in zip(wanted, written.values(), strict=True):
        keys, curve = property_curve(data.decode())
        assert (keys["UNITS.LENGTH"], keys["UNITS.TIME"], keys["UNITS.FORCE"]) == ("meter", "second", "newton")
        check_curve(content, i, U, curve, rng)


def test_every_curve_for_chrono_is_ours(content: Content, rng: np.random.Generator) -> None:
    written = formats()["chrono"].files(content)
    wanted = conditions(content)
    assert len(written) == len(wanted)
    for (i, U), data in zip(wanted, written.values(), strict=True):
        check_curve(content, i, U, np.array(json.loads(data)["Damping Curve Data"]), rng)


def check_curve(content: Content, i: int, U: float, curve: np.ndarray, rng: np.random.Generator) -> None:
    """Hold a curve to our own table at points of every size of velocity, and beyond 1,000 of them."""
    top = content.grid.velocities[-1]
    v = np.append(rng.choice([-1.0, 1.0], POINTS) * top * 10.0 ** rng.uniform(-6.0, 0.0, POINTS), curve[:, 0])
    assert np.all(np.diff(curve[:, 0]) > 0.0)
    ours = content.lookups[i].force(U, v)
    assert np.max(np.abs(np.interp(v, *curve.T) - ours)) <= 1e-9 * largest(content)


def test_a_file_of_a_curve_is_called_after_its_signal_and_temperature() -> None:
    assert next(iter(formats()["tir"].files(content_of(DAMPERS["warm"])))) == "my-run-0V-20degC.dpr"
    assert "my-run-150V-chrono.json" in formats()["chrono"].files(content_of(DAMPERS["plain"]))
    assert list(formats()["tir"].files(content_of(DAMPERS["passive"]))) == ["my-run.dpr"]


@pytest.mark.parametrize("name", ["modelica", "tir", "chrono"])
def test_nothing_is_said_of_a_voltage_where_there_is_none(name: str) -> None:
    assert b"voltage" not in b"".join(formats()[name].files(content_of(DAMPERS["passive"])).values())


@pytest.mark.parametrize("name", ["modelica", "tir", "chrono"])
def test_empty_cells_are_refused(name: str) -> None:
    with pytest.raises(ConfigError, match=f"--to {name} cannot hold the empty cells"):
        formats()[name].files(content_of(DAMPERS["plain"], outside="error"))


@pytest.mark.parametrize("name", ["tir", "chrono"])
def test_the_unit_of_the_signal_makes_no_folder_in_the_name_of_a_file(name: str) -> None:
    content = replace(content_of(DAMPERS["plain"]), control=Control("pump_speed", "1/min"))
    written = formats()[name].files(content)
    assert len(written) == len(conditions(content))
    assert all(re.fullmatch(r"my-run-[0-9]+1_min[a-z.-]+", file) for file in written)
