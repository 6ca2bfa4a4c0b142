"""`python -m pzd.paper claims`, `calibration` and `contradiction` print what they find."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from pzd.damper.compiled.columns import value_of
from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper
from pzd.paper.contradiction import BASES, Attempt, Base, attempts, claims, condition, excluded, misses
from pzd.paper.published import LARGE_GAP, PEAK, SMALL_GAP, loop_in, rig_tests, span
from pzd.paper.valve import STIFFNESS, Valve, calibrate, least_stiffness, stand_damper
from pzd.report.reference import same_test

# ----------------------------------------------------------------------------------------------------
# The `rig.virtual` entries of configs/paper.yaml as text, from the calibrated valve.


def rounded(damper: Damper) -> Damper:
    """The damper in the digits that a config is written with: 0.1 N, 1 N s/m, 0.001."""
    rows = tuple(
        row.model_copy(update={"T0_N": round(row.T0_N, 1), "C_Ns_per_m": round(row.C_Ns_per_m)}) for row in damper.base
    )
    return Damper(base=rows).with_effect("shear_thinning", {"n": round(_index(damper), 3)})


def written(valve: Valve) -> str:
    """The damper of both settings as YAML, in the digits of the config."""
    return "\n".join(line for setting in (SMALL_GAP, LARGE_GAP) for line in _entry(setting, valve))


def _entry(setting: str, valve: Valve) -> Iterator[str]:
    damper = rounded(stand_damper(valve, setting))
    yield f"    - setting: {setting}"
    yield "      damper:"
    yield "        base:"
    yield from (_row(row) for row in damper.base)
    yield "        effects:"
    yield f"          shear_thinning: {{n: {_index(damper):g}}}"


def _row(row: BaseRow) -> str:
    fields = ", ".join(f"{name}: {value:.7g}" for name, value in row.model_dump().items())
    return f"          - {{{fields}}}"


def _index(damper: Damper) -> float:
    return value_of(damper, "shear_thinning", "n")


# ----------------------------------------------------------------------------------------------------
# What the calibration and the contradiction come to, as text.


@dataclass(frozen=True)
class Verdict:
    """Which effects could close the gap between the published model and the published measurements."""

    verdict: Literal["named", "ambiguous", "unexplained"]
    closing: dict[Base, tuple[str, ...]]
    """Over each base, what meets all forces, best first; `no effect` where the base alone does."""
    reason: str


def verdict_on(tried: Sequence[Attempt]) -> Verdict:
    """The verdict on the attempts: named only where one explanation is left.

    Parameters
    ----------
    tried : every effect over every base
    """
    closing = {base: tuple(one.effect for one in tried if one.base == base and one.closes) for base in BASES}
    explanations = [one for one in tried if one.closes]
    if not explanations:
        return Verdict("unexplained", closing, "no effect meets the published forces, whatever the parameters")
    if len(explanations) == 1:
        return Verdict("named", closing, f"{explanations[0].effect} alone meets the published forces")
    unknowns = min(one.unknowns for one in explanations)
    forces = condition()
    numbers = sum(not any(same_test(row, earlier) for earlier in forces[:n]) for n, row in enumerate(forces))
    reason = (
        f"{len(explanations)} of {len(tried)} attempts meet the forces, with {unknowns} unknowns or more for {numbers} "
        "numbers: none of them is put to a test, so no probability can be given to any"
    )
    return Verdict("ambiguous", closing, reason)


def contradiction() -> str:
    """The published model against the published measurements, and what could close the gap."""
    return "\n".join(_contradiction())


def _contradiction() -> Iterator[str]:
    yield "The element with T0, C and k of Tables 1 to 3 against the measured forces:"
    yield f"  {'id':8}{'table':10}{'measured':>10}{'element':>10}{'':>9}{'missing / v^2':>16}"
    for miss in misses():
        force = f"{miss.measured:>8.0f} N{miss.element:>8.0f} N{100 * miss.share:>+8.1f}%"
        orifice = "" if miss.orifice is None else f"{miss.orifice:>9.0f} N s2/m2"
        yield f"  {miss.id:8}{miss.table:10}{force}{orifice}".rstrip()
    yield "An orifice would have to give the last column, rising as the slot closes: at gap 0.15 mm it falls, when hot"
    yield "it is negative. With Tables 2 and 3 the peak at 0 V rises with heat; the measured one falls."
    tried = attempts()
    verdict = verdict_on(tried)
    for base in BASES:
        yield f"\nGap 0.25 mm, 0 V, five forces; of the element is kept: {_KEPT[base]}"
        yield from (_line(one) for one in tried if one.base == base)
    yield f"\nLeft out, for nothing that they need moves inside a published test: {', '.join(excluded())}"
    yield f"Verdict: {verdict.verdict}: {verdict.reason}."


_KEPT: dict[Base, str] = {
    "tables": "T0, C and k of Tables 2 and 3",
    "stiffness of the tables": "k of Tables 2 and 3",
    "nothing of the tables": "nothing",
}


def _line(one: Attempt) -> str:
    units = {p.name: p.unit for effect in library().values() if effect.name == one.effect for p in effect.parameters}
    units |= {"T0 cold": "N", "T0 hot": "N", "C cold": "N s/m", "C hot": "N s/m", "k": "N/m"}
    values = ", ".join(f"{name} {value:.3g} {units[name]}" for name, value in one.parameters.items())
    closes = "closes" if one.closes else f"{one.worst:.1f} times too far at {one.worst_id}"
    return f"  {one.effect:20}{closes:34}{values if one.closes else ''}".rstrip()


def calibration() -> str:
    """The calibrated valve, the stand's forces beside the published ones, and the dampers of configs/paper.yaml."""
    return "\n".join(_calibration())


def _calibration() -> Iterator[str]:
    valve = calibrate()
    yield "Valve, fitted to the published forces:"
    yield from (f"  {name:18}{value:>12.4g}" for name, value in vars(valve).items())
    for name, stiffness in least_stiffness().items():
        yield f"Softest oil spring that can give {name}: {stiffness:.3g} N/m; the stand has {STIFFNESS:.3g} N/m"
    yield f"\n  {'id':8}{'published':>11}{'stand':>10}{'':>8}  without noise"
    for row in rig_tests():
        loop = loop_in(stand_damper(valve, row.setting or ""), row)
        force = loop.peak if row.quantity == PEAK else loop.at_zero
        low, high = span(row)
        several = f"  the paper prints {low:g} to {high:g} N for this test" if low < high else ""
        yield f"  {row.id:8}{row.number:>9.0f} N{force:>8.0f} N{100 * (force / row.number - 1):>+7.1f}%{several}"
    yield f"\n{written(valve)}"


def claims_text() -> str:
    """What the paper says, and what its own numbers give."""
    return "\n".join(f"{claim.says}\n    {claim.gives}" for claim in claims())


# ----------------------------------------------------------------------------------------------------


TOPICS = {"claims": claims_text, "calibration": calibration, "contradiction": contradiction}


def main(arguments: list[str]) -> int:
    """Print the topics asked for; 2 where one is unknown or none is named."""
    if not arguments or not set(arguments) <= set(TOPICS):
        sys.stderr.write(f"usage: python -m pzd.paper {' | '.join(TOPICS)}\n")
        return 2
    for name in arguments:
        sys.stdout.write(f"{TOPICS[name]()}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
