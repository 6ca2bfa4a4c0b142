"""The force at settings between tested ones, as rows of text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pzd.artefacts.table import fastest
from pzd.cli.layout import filled, number

if TYPE_CHECKING:
    from pzd.pipeline.run_summary import RunSummary


def settings_tables(found: RunSummary) -> Iterator[tuple[str, list[list[str]]]]:
    """Titles and rows; no rows where the config asks for no such setting."""
    places = ["T [degC]", f"{found.control.name} [{found.control.unit}]"]
    head = [*places, "setting", "speed [m/s]", "rebound [N]", "compression [N]", "interpolated between"]
    rows = [
        [
            number(rebound.temperature_degC),
            number(rebound.voltage_V),
            rebound.setting,
            number(rebound.velocity_m_per_s),
            number(rebound.force_N + rebound.static_force_N),
            number(compression.force_N + compression.static_force_N),
            f"{rebound.lower_setting} and {rebound.upper_setting}",
        ]
        for rebound, compression in fastest(found.settings)
    ]
    yield (
        "settings between tested ones, interpolated and not tested: force at the largest speed of both",
        filled(head, rows, len(places)),
    )
    yield (
        "tested settings left out and predicted from their neighbours",
        [
            [
                row.setting,
                f"between {row.lower_setting} and {row.upper_setting}",
                f"missed by {100.0 * row.rms_share_of_peak:.2g} % of peak (r.m.s.)",
                f"at most {100.0 * row.largest_share_of_peak:.2g} %",
            ]
            for row in found.settings_left_out
        ],
    )
