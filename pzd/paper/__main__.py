"""`python -m pzd.paper claims | calibration | contradiction`: print the paper against its own numbers.

`claims` prints its words against its numbers, `calibration` the valve of the virtual stand and the dampers of
configs/paper.yaml, `contradiction` its model against its measurements, and what could close the gap.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence

from pzd.damper.compiled.columns import value_of
from pzd.damper.effects import library
from pzd.damper.model import Damper
from pzd.paper.contradiction import BASES, Attempt, Base, attempts, claims, excluded, fitted_forces, model_errors
from pzd.paper.published import LARGE_GAP, PEAK, SMALL_GAP, loop_in, rig_tests, span
from pzd.paper.valve import STIFFNESS, Valve, calibrate, least_stiffness, stand_damper
from pzd.report.reference import same_test

# --- Claims ---


def printed_claims() -> Iterator[str]:
    """Print the words of the paper, and what its own numbers give."""
    for claim in claims():
        yield f"{claim.says}\n    {claim.gives}"


# --- Calibration ---


def calibration() -> Iterator[str]:
    """Print the calibrated valve, the stand's forces beside the published ones, and the dampers of the config."""
    valve = calibrate()
    yield "Valve, fitted to the published forces:"
    yield from (f"  {name:18}{value:>12.4g}" for name, value in vars(valve).items())
    for name, stiffness in least_stiffness().items():
        yield f"Softest oil spring that can give {name}: {stiffness:.3g} N/m; the stand has {STIFFNESS:.3g} N/m"
    yield f"\n  {'id':8}{'published':>11}{'stand':>10}{'':>8}  without noise"
    for row in rig_tests():
        loop = loop_in(stand_damper(valve, row.setting or ""), row)
        force = loop.peak if row.quantity == PEAK else loop.force_at_rest
        low, high = span(row)
        several = f"  the paper prints {low:g} to {high:g} N for this test" if low < high else ""
        yield f"  {row.id:8}{row.number:>9.0f} N{force:>8.0f} N{100 * (force / row.number - 1):>+7.1f}%{several}"
    yield f"\n{written(valve)}"


def rounded(damper: Damper) -> Damper:
    """Round a damper to the digits of a config: 0.1 N, 1 N s/m, 0.001."""
    rows = tuple(
        row.model_copy(update={"T0_N": round(row.T0_N, 1), "C_Ns_per_m": round(row.C_Ns_per_m)}) for row in damper.base
    )
    return Damper(base=rows).with_effect("shear_thinning", {"n": round(_index(damper), 3)})


def written(valve: Valve) -> str:
    """Write the damper of both settings as the `rig.virtual` entries of configs/paper.yaml, in its digits."""
    lines = []
    for setting in (SMALL_GAP, LARGE_GAP):
        damper = rounded(stand_damper(valve, setting))
        rows = (", ".join(f"{name}: {value:.7g}" for name, value in row.model_dump().items()) for row in damper.base)
        lines += [f"    - setting: {setting}", "      damper:", "        base:"]
        lines += [f"          - {{{row}}}" for row in rows]
        lines += ["        effects:", f"          shear_thinning: {{n: {_index(damper):g}}}"]
    return "\n".join(lines)


def _index(damper: Damper) -> float:
    return value_of(damper, "shear_thinning", "n")


# --- Contradiction ---


def verdict_on(tried: Sequence[Attempt]) -> tuple[str, str]:
    """Return the verdict on the attempts, named only where one explanation is left, and its reason.

    Parameters
    ----------
    tried : every effect over every base
    """
    explanations = [one for one in tried if one.closes]
    if not explanations:
        return "unexplained", "no effect meets the published forces, whatever the parameters"
    if len(explanations) == 1:
        return "named", f"{explanations[0].effect} alone meets the published forces"
    unknowns = min(one.unknowns for one in explanations)
    forces = fitted_forces()
    numbers = sum(not any(same_test(row, earlier) for earlier in forces[:n]) for n, row in enumerate(forces))
    reason = (
        f"{len(explanations)} of {len(tried)} attempts meet the forces, with {unknowns} unknowns or more for {numbers} "
        "numbers: none of them is put to a test, so no probability can be given to any"
    )
    return "ambiguous", reason


def contradiction() -> Iterator[str]:
    """Print the published model against the published measurements, and what could close the gap."""
    yield "The element with T0, C and k of Tables 1 to 3 against the measured forces:"
    yield f"  {'id':8}{'table':10}{'measured':>10}{'element':>10}{'':>9}{'missing / v^2':>16}"
    for error in model_errors():
        force = f"{error.measured:>8.0f} N{error.element:>8.0f} N{100 * error.share:>+8.1f}%"
        orifice = "" if error.orifice is None else f"{error.orifice:>9.0f} N s2/m2"
        yield f"  {error.id:8}{error.table:10}{force}{orifice}".rstrip()
    yield "An orifice would have to give the last column, rising as the slot closes: at gap 0.15 mm it falls, when hot"
    yield "it is negative. With Tables 2 and 3 the peak at 0 V rises with heat; the measured one falls."
    tried = attempts()
    verdict, reason = verdict_on(tried)
    for base in BASES:
        yield f"\nGap 0.25 mm, 0 V, five forces; of the element is kept: {_BASE_IN_WORDS[base]}"
        yield from (_attempt_line(one) for one in tried if one.base == base)
    yield f"\nLeft out, for nothing that they need moves inside a published test: {', '.join(excluded())}"
    yield f"Verdict: {verdict}: {reason}."


_BASE_IN_WORDS: dict[Base, str] = {
    "tables": "T0, C and k of Tables 2 and 3",
    "stiffness of the tables": "k of Tables 2 and 3",
    "nothing of the tables": "nothing",
}


def _attempt_line(one: Attempt) -> str:
    units = {p.name: p.unit for effect in library().values() if effect.name == one.effect for p in effect.parameters}
    units |= {"T0 cold": "N", "T0 hot": "N", "C cold": "N s/m", "C hot": "N s/m", "k": "N/m"}
    values = ", ".join(f"{name} {value:.3g} {units[name]}" for name, value in one.parameters.items())
    closes = "closes" if one.closes else f"{one.worst:.1f} times too far at {one.worst_id}"
    return f"  {one.effect:20}{closes:34}{values if one.closes else ''}".rstrip()


# --- The command ---


TOPICS: dict[str, Callable[[], Iterator[str]]] = {
    "claims": printed_claims,
    "calibration": calibration,
    "contradiction": contradiction,
}


def main(arguments: list[str]) -> int:
    """Print the topics asked for; 2 where one is unknown or none is named."""
    if not arguments or not set(arguments) <= set(TOPICS):
        sys.stderr.write(f"usage: python -m pzd.paper {' | '.join(TOPICS)}\n")
        return 2
    for name in arguments:
        for line in TOPICS[name]():
            sys.stdout.write(f"{line}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
