"""Settings between tested ones: their force, between which tests it lies, and how far such a line can be trusted."""

from __future__ import annotations

from collections.abc import Iterator

from pzd.artefacts.table import fastest
from pzd.report.blocks import Block, Paragraph, TextTable
from pzd.report.context import ReportContext
from pzd.report.wording import amount, percent


def settings_blocks(context: ReportContext) -> Iterator[Block]:
    """The settings that the config asks for, and tested ones left out; nothing where it asks for none."""
    if not context.table.settings:
        return
    yield Paragraph(
        "The settings below were not tested. Their force is interpolated, linear in the number of the setting, between "
        "the tested ones to either side, each as identify hands it on, and only where both were tested: "
        f"4-table/settings.csv holds all of it. {_trust(context)}"
    )
    yield _forces(context)
    if context.table.settings_left_out:
        yield _left_out(context)


def _trust(context: ReportContext) -> str:
    if not context.table.settings_left_out:
        return "How good this is cannot be told: for that a third setting must be tested, between two others."
    return (
        "How good this is tell tested settings that are left out and predicted in the same way; their neighbours lie "
        "further apart than those used above."
    )


def _forces(context: ReportContext) -> TextTable:
    places = ("temperature", context.control.name)
    rows = tuple(
        (
            rebound.setting,
            amount(rebound.temperature_degC, "degC"),
            context.voltage(rebound.voltage_V),
            amount(rebound.velocity_m_per_s, "m/s"),
            *(amount(row.force_N + row.static_force_N, "N") for row in (rebound, compression)),
            f"{rebound.lower_setting} and {rebound.upper_setting}",
        )
        for rebound, compression in fastest(context.table.settings)
    )
    header = ("setting", *places, "speed", "rebound", "compression", "interpolated between")
    title = "Settings that were not tested: interpolated force at the largest speed that both neighbours reached"
    return TextTable(title, header, rows).without_empty(*places)


def _left_out(context: ReportContext) -> TextTable:
    rows = tuple(
        (
            row.setting,
            f"{row.lower_setting} and {row.upper_setting}",
            amount(row.peak_force_N, "N"),
            percent(row.rms_share_of_peak),
            percent(row.largest_share_of_peak),
        )
        for row in context.table.settings_left_out
    )
    header = ("left out", "predicted from", "its peak force", "missed by (r.m.s.)", "at most")
    return TextTable("Tested settings predicted from their neighbours, missed in % of peak force", header, rows)
