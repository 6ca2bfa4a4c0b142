"""All policies beside each other: at which fidelity, which of them none beats, and when there is nothing to choose."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from typing import Any

import pytest

from pzd.artefacts import FoundRow

ROAD = "sine-2.25Hz"
RIDDEN = {
    "comfort": (1.00, 1000.0),
    "skyhook": (0.80, 900.0),
    "add": (0.90, 700.0),
    "wheel_load": (0.95, 950.0),
    "passive": (1.20, 600.0),
}
"""Peak of a_K [m/s2] and r.m.s. wheel load [N], at `dynamic`; wheel_load is beaten by skyhook, comfort by three."""


def rides_of(made_ride: Any, chosen: dict[str, tuple[float, float]], fidelity: str) -> list[Any]:
    found = []
    for policy, (peak, load) in chosen.items():
        one = made_ride(f"{ROAD}-{policy}-{fidelity}", ROAD, policy, fidelity, {2.25: peak}, 2.25)
        found.append(replace(one, row=one.row.model_copy(update={"rms_wheel_load_N": load})))
    return found


def page_of(run: Any, made: list[Any]) -> str:
    return unescape(run.with_rides(made).told().page).replace("\u00a0", " ").replace("\u202f", " ")


@pytest.fixture(scope="module")
def page(run: Any, made_ride: Any) -> str:
    """At `ideal` all are alike, so that whatever is told apart comes from `dynamic`."""
    alike = dict.fromkeys(RIDDEN, (0.5, 500.0))
    return page_of(run, [*rides_of(made_ride, alike, "ideal"), *rides_of(made_ride, RIDDEN, "dynamic")])


def test_the_page_names_the_policies_that_none_beats_in_both(page: str) -> None:
    assert f"<li>{ROAD}, dynamic: skyhook, add and passive</li>" in page


def test_the_picture_tells_every_policy_in_the_order_of_comfort(page: str) -> None:
    alt = re.search(r'alt="a_w and r\.m\.s\. wheel load on 2\.25 Hz sine: ([^"]*)"', page)
    assert alt is not None
    told = alt[1].split("; ")
    assert [text.split(" 0.")[0] for text in told] == ["skyhook", "add", "wheel load", "comfort", "passive"]
    assert [text.split("and ")[1].rstrip(".") for text in told] == ["900 N", "700 N", "950 N", "1 000 N", "600 N"]


def test_the_table_holds_every_policy_at_every_fidelity(page: str) -> None:
    for fidelity, load in (("ideal", "500"), ("dynamic", "950")):
        table = page.partition(f'<table aria-label="2.25 Hz sine, {fidelity}">')[2].partition("</table>")[0]
        assert all(f'<th scope="col">{name.replace("_", " ")}' in re.sub(' class="n"', "", table) for name in RIDDEN)
        assert f">{load}<" in table.partition("wheel load, r.m.s. [N]")[2]


def test_where_one_policy_controls_there_is_nothing_to_choose(run: Any, made_ride: Any) -> None:
    alone = {name: RIDDEN[name] for name in ("comfort", "passive")}
    page = page_of(run, rides_of(made_ride, alone, "dynamic"))
    assert "All policies beside each other" not in page
    assert page.count("Comfort against wheel load") == 1  # on the first screen alone


@pytest.mark.ci
def test_the_best_that_was_found_is_told_with_how_far_the_controlled_policy_goes(run: Any, made_ride: Any) -> None:
    """a_w goes with the peak here: from 1.2 at the fixed voltage over 1.0 to 0.7, two fifths of the way."""
    ridden = {**RIDDEN, "best_fixed_voltage": (1.20, 800.0), "best_found": (0.70, 880.0)}
    made = run.with_rides(rides_of(made_ride, ridden, "dynamic"))
    row = FoundRow(
        case=f"{ROAD}-best_found-dynamic",
        found_by="search",
        evaluations=487,
        most_load_N=880.0,
        from_share_of_period=0.0,
        voltage_1_V=0.0,
        voltage_2_V=150.0,
    )
    page = unescape(replace(made, rides=replace(made.rides, found=(row,))).told().page)
    page = page.replace("\u00a0", " ").replace("\u202f", " ")
    assert "Star: the best that was found, with a wheel load at most 1.1 times that at the best fixed voltage" in page
    assert "by a schedule, after 487 rides; comfort goes 40 % of the way to it from the best fixed voltage" in page
    assert f"<li>{ROAD}, dynamic: best found, add and passive</li>" in page
