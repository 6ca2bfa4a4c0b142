"""Force over speed, gas force, friction, response to steps and warm-up, as rows of text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pzd.artefacts.characteristics import AVERAGED, courses
from pzd.artefacts.matching import force_behind
from pzd.cli.layout import filled, number, number_as

if TYPE_CHECKING:
    from pzd.artefacts import Characteristics
    from pzd.pipeline.run_summary import RunSummary


def characteristics_tables(found: RunSummary) -> Iterator[tuple[str, list[list[str]]]]:
    """Titles and rows of what the tests show without a model; no rows where there are no such tests."""
    here, control = found.characteristics, found.control
    signal = f"{control.name} [{control.unit}]"
    places = ["setting", signal, "T [degC]"]
    yield (
        "force at peak speed (PVP), rebound is extension and positive",
        filled(
            [*places, "test", "speed [m/s]", "rebound [N]", "compression [N]", "record"],
            [
                [
                    *_place(row.setting, row.voltage_V, row.temperature_degC),
                    row.kind,
                    number(row.speed),
                    number(row.rebound_force_N),
                    number(row.compression_force_N),
                    row.record,
                ]
                for row in here.peak_velocity
            ],
            len(places),
        ),
    )
    yield (
        "gas force and friction at mid-stroke",
        filled(
            [*places, "gas force [N]", "friction [N]", "from"],
            [
                [
                    *_place(row.setting, row.voltage_V, row.temperature_degC),
                    *(number_as(force, force_behind(here, row)) for force in (row.gas_force_N, row.friction_N)),
                    f"{number(row.velocity_m_per_s)} m/s, {row.method}",
                ]
                for row in here.gas_and_friction
            ],
            len(places),
        ),
    )
    yield (
        f"steps of the {control.name}",
        filled(
            ["setting", "T [degC]", "step", "speed [m/s]", "to 63 % [ms]", "to 90 % [ms]", "record", "status"],
            [
                [
                    number(row.setting),
                    number(row.temperature_degC),
                    f"{number(row.from_voltage_V)} to {number(row.to_voltage_V)} {control.unit}",
                    number(row.velocity_m_per_s),
                    *(number(None if t is None else 1000.0 * t) for t in (row.to_63_percent_s, row.to_90_percent_s)),
                    f"{row.record} at {number(row.time_s)} s",
                    row.status,
                ]
                for row in here.steps
            ],
            2,
        ),
    )
    yield f"warm-up: from the first {AVERAGED} cycles of a long test to its last", _warm_up(here, signal)
    yield "none of these tests, as it stands: extremes of all samples", _as_it_stands(here, places)


def _warm_up(here: Characteristics, signal: str) -> list[list[str]]:
    rows = [
        [
            number(one.first.setting),
            number(one.first.voltage_V),
            number(one.first.velocity_m_per_s),
            str(one.cycles),
            _course(one.first.temperature_degC, one.last.temperature_degC),
            _course(one.first.rebound_force_N, one.last.rebound_force_N),
            _course(one.first.compression_force_N, one.last.compression_force_N),
            one.first.record,
        ]
        for one in courses(here.warm_up)
    ]
    head = ["setting", signal, "speed [m/s]", "cycles", "T [degC]", "rebound [N]", "compression [N]", "record"]
    return filled(head, rows, 2)


def _as_it_stands(here: Characteristics, places: list[str]) -> list[list[str]]:
    rows = [
        [
            *_place(row.setting, row.voltage_V, row.temperature_degC),
            _course(row.compression_force_N, row.rebound_force_N),
            _course(row.compression_velocity_m_per_s, row.rebound_velocity_m_per_s),
            number(row.stroke_m),
            number(row.duration_s),
            row.record,
        ]
        for row in here.as_it_stands
    ]
    return filled([*places, "force [N]", "velocity [m/s]", "stroke [m]", "duration [s]", "record"], rows, len(places))


def _course(first: float | None, last: float | None) -> str:
    return number(None) if first is None else f"{number(first)} to {number(last)}"


def _place(setting: str | None, voltage: float | None, temperature: float | None) -> list[str]:
    return [number(setting), number(voltage), number(temperature)]
