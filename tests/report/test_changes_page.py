"""What changed, in the terminal and on the page: signs as the trade reads them, and no row that contradicts itself."""

from __future__ import annotations

from dataclasses import replace
from html import unescape

import numpy as np
import pytest

from pzd.artefacts.changes import Change, Changes, Difference, Unchanged
from pzd.diagnosis.changes.comparison import Compared, ComparedCycle
from pzd.quantities import Control
from pzd.report.changes_page import changes_page
from pzd.report.changes_text import changes_lines

PHASE = 2.0 * np.pi * np.arange(8) / 8.0
VOLTS = Control()


def cycle(name: str, speed: float, before: tuple[float, float], after: tuple[float, float]) -> ComparedCycle:
    """A motion with these forces at the peak speeds of rebound and compression [N]."""
    one, other = (np.where(np.cos(PHASE) > 0.0, *forces) for forces in (before, after))
    return ComparedCycle(name, name, None, 0.01 * np.sin(PHASE), speed * np.cos(PHASE), one, other, np.zeros(8))


def changed(name: str, share: float) -> Change:
    return Change(
        name=name, parameter=name, of="damper", unit="N", from_=60.0, to=78.0, low95=77.0, high95=79.0, share=share,
        reason="adopted",
    )  # fmt: skip


def same(name: str, to: float, half_width: float) -> Unchanged:
    return Unchanged(
        name=name, parameter=name, unit="N", from_=0.0, to=to, low95=to - half_width, high95=to + half_width
    )


def found(*cycles: ComparedCycle, shares: tuple[float, ...] = (0.9,)) -> Compared:
    changes = Changes(
        verdict="changed",
        from_="new",
        to="aged",
        compared="cycles",
        difference=Difference(rms_N=70.0, share_of_peak=0.1, noise_N=0.3, left_N=0.3, explained=0.99),
        changes=tuple(changed(f"T{place}", share) for place, share in enumerate(shares)),
        unchanged=(same("lash", 0.5, 0.2), same("orifice", 0.5, 0.8)),
        rivals=(),
        reason="it differs",
    )
    return Compared(changes, cycles)


def page_of(compared: Compared) -> str:
    """The page as a reader sees it."""
    text = unescape(changes_page(compared, VOLTS))
    return text.replace("\u00a0", " ").replace("\u202f", " ").replace("\u2212", "-").replace("\u2013", "-")


def cells(page: str, name: str) -> list[str]:
    """The cells behind the name of a row of a table."""
    row = page.partition(f">{name}</t")[2].partition("</tr>")[0]
    return [cell.partition(">")[2].partition("<")[0].strip() for cell in row.split("<td")[1:]]


def test_a_force_that_grew_in_either_direction_stands_with_a_plus_as_the_trade_reads_it() -> None:
    page = page_of(found(cycle("slow", 0.1, (400.0, -313.0), (380.0, -339.0))))
    assert cells(page, "slow") == ["0.1 m/s", "400 N", "380 N", "-20 N", "-5 %", "-313 N", "-339 N", "26 N", "8.3 %"]


def test_a_force_whose_sign_turned_grew_by_no_percentage() -> None:
    page = page_of(found(cycle("slow", 0.1, (400.0, -20.0), (400.0, 30.0))))
    assert cells(page, "slow")[-4:] == ["-20 N", "30 N", "-50 N", "-"]


def test_the_motions_that_changed_most_are_drawn_in_the_order_of_their_speed() -> None:
    cycles = [
        cycle(f"at {speed}", speed, (400.0, -300.0), (400.0 + more, -300.0))
        for speed, more in ((0.3, 20.0), (0.1, 40.0), (0.4, 1.0), (0.2, 30.0))
    ]
    page = page_of(found(*cycles))
    places = [page.index(f"Both states, {speed} m/s") for speed in (0.1, 0.2, 0.3)]
    assert places == sorted(places)
    assert "Both states, 0.4 m/s" not in page


def test_an_unchanged_quantity_whose_interval_leaves_its_first_value_out_is_called_too_small_to_matter() -> None:
    lines = list(changes_lines(found().changes, VOLTS))
    (lash,) = [line for line in lines if line.startswith("  lash")]
    (orifice,) = [line for line in lines if line.startswith("  orifice")]
    assert lash == "  lash: 0 N -> 0.5 (0.3 to 0.7) N, too small to matter"
    assert orifice == "  orifice: 0 N -> 0.5 (-0.3 to 1.3) N"
    page = page_of(found())
    assert (cells(page, "lash")[-1], cells(page, "orifice")[-1]) == ("too small to matter", "-")


@pytest.mark.parametrize(("shares", "told"), [((0.937, 0.107, 0.0158), 1), ((0.9, 0.104), 0), ((1.0,), 0)])
def test_why_shares_come_to_more_than_the_whole_is_said_where_they_do(shares: tuple[float, ...], told: int) -> None:
    said = "  shares: what is left without each, the others fitted again; so they come to more than 100 % together"
    assert list(changes_lines(found(shares=shares).changes, VOLTS)).count(said) == told


def of_stop(parameter: str, before: float, to: float) -> Change:
    return changed("end_stop", 0.9).model_copy(update={"parameter": parameter, "from_": before, "to": to})


@pytest.mark.parametrize("stiffness", [0.0, 2e6])
def test_where_a_stop_begins_has_no_first_value_where_there_was_no_stop(stiffness: float) -> None:
    """In the JSON it has the neutral value, `x_e 0.02 m`: no place of that damper."""
    stop = (of_stop("k_e", stiffness, 5e6), of_stop("x_e", 0.02, 0.025))
    compared = found()
    compared = replace(compared, changes=compared.changes.model_copy(update={"changes": stop}))
    (line,) = (each for each in changes_lines(compared.changes, VOLTS) if "end_stop x_e" in each)
    assert ("0.02 N -> 0.025" in line) == (stiffness > 0.0)
    assert ("by +25 %" in line) == (stiffness > 0.0)
    assert cells(page_of(compared), "end stop x_e")[0] == ("0.02 N" if stiffness else "-")
    assert not any("more than 100 %" in each for each in changes_lines(compared.changes, VOLTS))  # told twice


@pytest.mark.parametrize(
    ("to", "said"), [(45.0, ", by -25 %, "), (130.0, ", by +117 %, "), (0.0, ", by -100 %, "), (-78.0, ") N, 90 % of")]
)
def test_a_change_is_told_in_percent_of_what_was_where_its_sign_stays(to: float, said: str) -> None:
    compared = found()
    change = changed("T0", 0.9).model_copy(update={"to": to})
    (line,) = (
        each
        for each in changes_lines(compared.changes.model_copy(update={"changes": (change,)}), VOLTS)
        if "T0:" in each
    )
    assert said in line
