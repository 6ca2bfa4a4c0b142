"""The knee law as rows of text: rebound and compression in the language of the trade, and the force a click or unit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pzd.cli.layout import filled, interval, number

if TYPE_CHECKING:
    from pzd.artefacts.knee import DirectionOfCondition
    from pzd.pipeline.run_summary import RunSummary


def knee_tables(found: RunSummary) -> Iterator[tuple[str, list[list[str]]]]:
    """Titles and rows of the knee law; no rows where the config does not ask for it."""
    knees, control = found.knees, found.control
    places = ["setting", f"{control.name} [{control.unit}]", "T [degC]"]
    yield "law handed on", [[number(row.setting), row.law, row.reason] for row in knees.laws]
    parameters = ["bleed [N s/m]", "knee [N]", "knee [m/s]", "blow-off [N s/m]", "gas force [N]", "seal friction [N]"]
    speeds = [f"{number(speed)} m/s [N]" for speed in knees.speeds]
    head = [*places, "direction", *speeds, *parameters]
    rows = [_direction(each) for each in knees.directions()]
    yield "rebound and compression, forces with the gas force at mid-stroke", filled(head, rows, len(places))
    yield (
        "force a click, without the gas",
        filled(
            [*places, "position", "speed [m/s]", "rebound [N]", "compression [N]"],
            [
                [
                    *_place(row.setting, row.voltage_V, row.temperature_degC),
                    f"{number(row.from_click)} to {number(row.to_click)}",
                    number(row.velocity_m_per_s),
                    number(row.rebound_N_per_click),
                    number(row.compression_N_per_click),
                ]
                for row in knees.clicks
            ],
            len(places),
        ),
    )

    yield (
        "force a unit of pressure or length, without the gas, and of the gas force itself",
        filled(
            [*places, "from", "speed [m/s]", "rebound", "compression", "gas force"],
            [
                [
                    *_place(row.setting, row.voltage_V, row.temperature_degC),
                    f"{number(row.from_value)} to {number(row.to_value)} {row.unit}",
                    number(row.velocity_m_per_s),
                    *(
                        f"{number(force)} N/{row.unit}"
                        for force in (row.rebound_N_per_unit, row.compression_N_per_unit, row.gas_force_N_per_unit)
                    ),
                ]
                for row in knees.per_unit
            ],
            len(places),
        ),
    )


def _direction(each: DirectionOfCondition) -> list[str]:
    row, forces = each.row, [number(force) for force in each.forces]
    return [
        *_place(row.setting, row.voltage_V, row.temperature_degC),
        each.direction,
        *(text if inside or text == "-" else f"({text})" for text, inside in zip(forces, each.inside, strict=True)),
        *(interval(*bounds) for bounds in each.intervals),
    ]


def _place(setting: str | None, voltage: float | None, temperature: float | None) -> list[str]:
    return [number(setting), number(voltage), number(temperature)]
