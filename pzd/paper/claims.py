"""The paper's words against its own numbers, and against each other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from pzd.paper.published import published, rig_tests, table_damper
from pzd.paper.valve import peak_speed
from pzd.report.reference import same_test

_TO_90_PERCENT = math.log(10.0)
"""Time constants that a first-order lag takes to 90 %."""


@dataclass(frozen=True)
class Claim:
    """What the paper says, and what its own numbers give."""

    says: str
    gives: str


def claims() -> tuple[Claim, ...]:
    """Every claim whose contradiction is arithmetic on published.csv."""
    return (*_forces(), *_heat(), *_tables(), *_control())


def number(name: str) -> float:
    """A published number by its id."""
    return published()[name].number


def slope(name: str) -> float:
    """Force over speed of a published peak [N s/m]."""
    return number(name) / peak_speed(published()[name])


def _share(after: str, before: str) -> float:
    return 100.0 * (number(after) / number(before) - 1.0)


def _over(one: str, other: str) -> float:
    return number(one) / number(other)


def _forces() -> Iterator[Claim]:
    low, high = number("F5-50"), number("F5-150")
    yield Claim("227 N at 100 V (Figure 5)", f"between {low:.0f} and {high:.0f} N it must be 2270: a digit is lost")
    yield Claim(
        "43 % more force at twice the speed (Figure 6)",
        f"870 -> 1530 N is {_share('F6-2', 'F6-1'):.0f} % up; 1530 -> 870 N is {-_share('F6-1', 'F6-2'):.0f} % down",
    )
    same = sorted(row.number for row in rig_tests() if same_test(row, published()["F6-2"]))
    yield Claim(
        "one test, 0 V, 2 Hz, 0.03 m",
        f"three values: {', '.join(f'{value:.0f}' for value in same)} N (Figures 5, 6, 8)",
    )
    equal_speed = number("F8z-23") + (number("F6-1") - number("F8z-23")) / peak_speed(published()["F6-1"]) * peak_speed(
        published()["F4-0"]
    )
    yield Claim(
        "a fivefold force by the initial gap",
        f"2280 / 870 = {number('F4-0') / number('F6-1'):.1f} at 0.14 and 0.19 m/s; "
        f"{number('F4-0') / equal_speed:.1f} at equal speed, along 170 N + {_line():.0f} v",
    )
    yield Claim(
        "the voltage changes the force by 200-250 %",
        f"to {100 + _share('F4-150', 'F4-0'):.0f} and {100 + _share('F5-150', 'F5-0'):.0f} % of that at 0 V: "
        f"a rise of {_share('F4-150', 'F4-0'):.0f} and {_share('F5-150', 'F5-0'):.0f} %",
    )
    yield Claim(
        "force in proportion to the voltage (Figure 4), of second degree (Figure 5): one stack",
        f"Figure 4: {(number('F4-100') - number('F4-0')) / 100:.1f} N/V to 100 V, "
        f"{(number('F4-150') - number('F4-100')) / 50:.1f} beyond; Figure 5: "
        f"{(number('F5-50') - number('F5-0')) / 50:.1f}, {(number('F5-100') - number('F5-50')) / 50:.1f}, "
        f"{(number('F5-150') - number('F5-100')) / 50:.1f} N/V",
    )


def _line() -> float:
    """Slope of the straight line through the force at zero velocity and the peak at 1 Hz [N s/m]."""
    return (number("F6-1") - number("F8z-23")) / peak_speed(published()["F6-1"])


def _heat() -> Iterator[Claim]:
    yield Claim(
        "almost a twofold temperature (Figure 7)",
        f"{number('TEMP-start'):.0f} -> {number('TEMP-end'):.0f} degC is "
        f"{number('TEMP-end') / number('TEMP-start'):.2f} times on a scale whose zero is arbitrary; above the ambient "
        f"22 degC it is {number('TEMP-start') - 22:.0f} -> {number('TEMP-end') - 22:.0f} K",
    )
    yield Claim(
        "320 N, approximately 10 %, by 20 K at 150 V",
        f"{-_share('F9-43', 'F9-23'):.0f} %; at 0 V 300 N are {-_share('F8-43', 'F8-23'):.0f} %",
    )
    rates = {name: math.log(number(a) / number(b)) / 20 for name, a, b in _FALLS}
    yield Claim(
        "the same model at every temperature",
        "; ".join(f"{name} falls by {rate:.3f}/K" for name, rate in rates.items()) + ": no one factor on all",
    )
    yield Claim(
        "T0 changes most without voltage, and drops most at 150 V",
        f"0 V: {number('T2-0-T0'):.0f} -> {number('T3-0-T0'):.0f} N ({_share('T3-0-T0', 'T2-0-T0'):.0f} %), 150 V: "
        f"{number('T2-150-T0'):.0f} -> {number('T3-150-T0'):.0f} N ({_share('T3-150-T0', 'T2-150-T0'):.0f} %), and at "
        f"100 V it rises: {number('T2-100-T0'):.0f} -> {number('T3-100-T0'):.0f} N",
    )


_FALLS = (
    ("the peak at 0 V", "F8-23", "F8-43"),
    ("the peak at 150 V", "F9-23", "F9-43"),
    ("the force at zero velocity", "F8z-23", "F8z-43"),
)


def _tables() -> Iterator[Claim]:
    yield Claim(
        "T0 rises with the voltage (Table 3)", f"{number('T3-100-T0'):.0f} N at 100 V, {number('T3-150-T0'):.0f} at 150"
    )
    yield Claim(
        "the slot closes from 100 to 150 V (Tables 1, 2)",
        f"yet C falls: {number('T1-100-C'):.0f} -> {number('T1-150-C'):.0f} and "
        f"{number('T2-100-C'):.0f} -> {number('T2-150-C'):.0f} N s/m",
    )
    yield Claim(
        "warm oil is thinner (Tables 2, 3)",
        f"yet C rises with heat at 0 V: {number('T2-0-C'):.0f} -> {number('T3-0-C'):.0f} N s/m, and at 150 V: "
        f"{number('T2-150-C'):.0f} -> {number('T3-150-C'):.0f}",
    )


def _control() -> Iterator[Claim]:
    taus = [1000 * row.C_Ns_per_m / row.k_N_per_m for t in ("Table 1", "Table 2", "Table 3") for row in table_damper(t)]
    yield Claim(
        "9 ms over the whole range of force",
        f"C / k of the tables is {min(taus):.0f} to {max(taus):.0f} ms: with their oil springs the force alone takes "
        f"{_TO_90_PERCENT * min(taus):.0f} to {_TO_90_PERCENT * max(taus):.0f} ms to 90 %, the valve at once",
    )
    gaps = {"gap 0.25 mm": ("F5-0", "F5-150"), "gap 0.15 mm": ("F4-0", "F4-150")}
    reached = ", ".join(
        f"{gap} {slope(low):.0f} to {slope(high):.0f} N s/m ({slope(high) / slope(low):.1f})"
        for gap, (low, high) in gaps.items()
    )
    yield Claim(
        "c from 750 to 45,000 N s/m are the limits of the voltage",
        f"a range of {_over('IN-cmax', 'IN-cmin'):.0f}; F / v measured: {reached}; "
        f"c_max is {_over('IN-cmax', 'IN-c'):.0f} times the constant c",
    )
    yield Claim(
        "9 h of comfort with control at 2.25 and at 4.5 Hz alike",
        f"at 4.5 Hz, where the standard is strictest, the peak is {_over('F19b-ctrl', 'F19a-ctrl'):.1f} times as high: "
        "no boundary gives two such tones the same time",
    )
    yield Claim(
        "4 min -> 9 h (2.25 Hz)",
        f"the peaks fall {_over('F19a-c', 'F19a-ctrl'):.1f} times; for the time that the standard's chart then gives "
        "see EXPa in 6-report/reference.csv",
    )
