"""The reason of a verdict on what changed, in sentences; and those that speak against `unchanged`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pzd.artefacts.changes import Change, Difference, Verdict
from pzd.damper.compose import steady_force
from pzd.damper.fitted_laws import fitted_laws, knee
from pzd.diagnosis.changes.candidates import ELEMENT_COLUMNS
from pzd.diagnosis.changes.compared_tests import BEYOND_TESTED
from pzd.diagnosis.changes.findings import Findings, error_share, not_averaged
from pzd.diagnosis.changes.pairs import averaged, stacked
from pzd.diagnosis.changes.quantities import may_be_as_before
from pzd.diagnosis.changes.regression import Fitted
from pzd.identification.knee import TRADE_SPEEDS
from pzd.record import CONSTANT_SHARE
from pzd.schema.errors import counted

GAS_FORCES = ("preload_offset", "gas_spring")
"""Effects that a change of the gas is told as where they explain it: its force and its stiffness."""
LARGE_MODEL_ERROR = 0.05
"""Share of the force (r.m.s.) that the first damper misses in its own tests from which values are its model's.

Reason: a model off by a twentieth has T0 and C off by about as much, more than the intervals of a change; not tuned."""
ONE_CONDITION = 2.0
"""Times what is visible that has to be left at one condition alone: its few tests differ by more than all together."""
NOTHING = ""
"""In the place of a name: what rivals nothing."""
MOST_NAMES = 3
"""Tests of a kind that are named in a sentence."""
SAME_RECORDING = 1e-9
"""Difference of force, as a share of the peak, of a recording from itself: the rounding of the averages."""
EXCHANGED_LEAVES = 0.3
"""Share (r.m.s.) that is left of a difference which comes of rebound and compression being exchanged.

Reason: a tenth of it as a mean square; a damper that changed otherwise differs as much from its mirror image. Not
tuned."""


def reason_of(
    found: Findings, verdict: Verdict, listed: Sequence[Change], rivals: dict[str, list[str]], difference: Difference
) -> list[str]:
    """Return the sentences of the reason: how large the difference is, what made it, how the tests were compared."""
    of_damper = list(dict.fromkeys(c.name for c in listed if c.of == "damper"))
    of_stand = list(dict.fromkeys(c.name for c in listed if c.of == "stand"))
    size = f"the force differs by {_digits(difference.rms_N)} N r.m.s."
    peak = f"{_digits(100.0 * difference.share_of_peak, 2)} % of peak"
    left, noise = _digits(difference.left_N), _digits(difference.noise_N)
    told = [f"{size}, {peak}, of which {left} N are left, {noise} N of them noise"]
    if of_damper:
        told.append(f"of the damper: {', '.join(of_damper)}")
        told += [words for name in of_damper if (words := _kind_told(found, name))]
        told += _gas_before(found, of_damper)
        told += _by_law_told(found, of_damper)
        told += beside_effects(found, of_damper)
    elif verdict == "unchanged":
        told.append("nothing of the damper changed visibly")
        if (hidden := found.search.hidden(found.best)) > found.diagnose.visible:
            told.append(
                f"less than {100.0 * hidden:.2g} % of peak would not be seen, since the damper of "
                f"{found.before.name} misses as much"
            )
        if (noise_share := difference.noise_N / found.first.force) > found.diagnose.visible:
            told.append(f"less than {100.0 * noise_share:.2g} % of peak would not be seen beneath the noise")
    if of_stand:
        told.append(f"of the stand: {', '.join(of_stand)}")
    if open_ := may_be_as_before(listed):
        told.append(f"the interval of {' and '.join(open_)} holds what was before: by how much these tests do not tell")
    told += _rivals_told(found, rivals, named=verdict != "unexplained")
    told += _left_told(found, verdict, listed, difference)
    temperatures = found.temperatures()
    if None not in temperatures and abs(temperatures[1] - temperatures[0]) > 0.5:  # type: ignore[operator]  # not None
        warm = f"the damper was at {temperatures[1]:.3g} degC instead of {temperatures[0]:.3g}"
        told.append(warm + _by_temperature(found, temperatures[1] - temperatures[0]))  # type: ignore[operator]  # not None
    if len({row.temperature_degC for row in found.first.damper.base}) > 1 and temperatures[0] is not None:
        told.append(f"T0, C and k are those at {temperatures[0]:.3g} degC, the mean of the tests")
    return [*told, *_tests_told(found)]


# --- What changed


def _kind_told(found: Findings, name: str) -> str | None:
    """Say of a law that is newly there of which kind it is, where its values tell; None of all others."""
    values = [(c, float(x)) for c, x in zip(found.best.coordinates, found.best.values, strict=True) if c.name == name]
    if side := next((c.side for c, _ in values if c.side), 0):
        return f"{name} acts in {'extension' if side > 0 else 'compression'} alone"
    if not all(c.absent for c, _ in values):
        return None
    if name == "second_branch":
        return "second_branch is friction behind a spring of its own, as a seal's, beside T0 and k"
    fastest = max(float(np.max(np.abs(c.motion.velocity))) for c in found.comparisons)
    speed = next((c.start * float(np.exp(x)) for c, x in values if c.parameter == "v_s"), 0.0)
    if name == "stribeck_friction" and speed > fastest:
        return "stribeck_friction that falls off at no tested speed is dry friction beside the oil spring"
    return None


def beside_effects(found: Findings, of_damper: Sequence[str]) -> list[str]:
    """Say beside which effects of the first state T0 and C stand, where they changed: without these they are others."""
    names = [name for name in found.first.damper.effects if name not in (*GAS_FORCES, *fitted_laws())]
    changed = [name for name in of_damper if name in ELEMENT_COLUMNS]
    if not names or not changed:
        return []
    verb, those = ("are", "those") if len(changed) > 1 else ("is", "that")
    beside = f"{', '.join(names)} of {found.before.name}"
    return [f"{' and '.join(changed)} {verb} {those} beside {beside}, not {those} of identify"]


def _gas_before(found: Findings, of_damper: Sequence[str]) -> list[str]:
    """Say which gas of the first state a newly told constant force or stiffness adds to."""
    own = found.first.damper.effects
    new = [name for name in GAS_FORCES if name in of_damper and name not in own]
    if not new or "accumulator" not in own or "accumulator" in of_damper:
        return []
    force = float(np.mean(own["accumulator"]["F_g"]))
    adds = "adds" if len(new) == 1 else "add"
    return [f"{' and '.join(new)} {adds} to the gas of {found.before.name}, an accumulator with F_g = {force:.3g} N"]


def _by_law_told(found: Findings, of_damper: Sequence[str]) -> list[str]:
    """Say by how much the force of the knee law changes, slow and fast, at the first control signal."""
    if knee.EFFECT.name not in found.first.damper.effects or not {*ELEMENT_COLUMNS, knee.EFFECT.name} & {*of_damper}:
        return []
    fastest = max(float(np.max(np.abs(c.motion.velocity))) for c in found.comparisons)
    reached = [speed for speed in TRADE_SPEEDS if speed <= fastest] or [fastest]
    changed = found.first.changed(found.best.coordinates, found.best.values.tolist(), None)
    at = found.voltages()[0], found.temperatures()[0]
    told = []
    for speed in dict.fromkeys((reached[0], reached[-1])):
        either = np.array([speed, -speed])
        grown = steady_force(changed, *at, either) / steady_force(found.first.damper, *at, either) - 1.0
        rebound, compression = (f"{100.0 * share:+.1f} %" for share in grown.tolist())
        told.append(f"{rebound} in rebound and {compression} in compression at {speed:.3g} m/s")
    where = f" at {at[0]:.4g} {found.control.unit}" if len(found.voltages()) > 1 else ""
    return [f"by the law, without the gas, the force{where} changes by {', by '.join(told)}"]


def _by_temperature(found: Findings, warmer: float) -> str:
    """Say by how much T0 and C follow the temperature, where that is among the changes."""
    fall = {
        c.parameter.removeprefix("beta_"): float(x)
        for c, x in zip(found.best.coordinates, found.best.values, strict=True)
        if c.name == "temperature" and c.parameter.startswith("beta_")
    }
    words = [f"{name} changes by {100.0 * np.expm1(-beta * warmer):+.2g} %" for name, beta in fall.items()]
    return f", by which {' and '.join(words)}" if words else ""


def _rivals_told(found: Findings, rivals: dict[str, list[str]], *, named: bool) -> Iterator[str]:
    """Say what cannot be told apart; where not all is `named`, that something is left is said apart."""
    for name, others in rivals.items():
        if name == NOTHING:
            too = " too" if found.best.candidates else ""
            yield f"{' or '.join(others)} may have changed{too}{', or what is left has no name' * named}"
        else:
            yield f"{name} cannot be told from {' or '.join(others)} by these tests"


def _left_told(found: Findings, verdict: Verdict, listed: Sequence[Change], difference: Difference) -> Iterator[str]:
    """Say what of the difference has no name, and what the damper of the first state misses of its own tests."""
    if verdict == "unexplained":
        where, left = found.most_left(found.best)
        most = f", most of it {where}, {100.0 * left:.2g} % of peak" if left > found.diagnose.visible else ""
        yield f"what is left has no name{most}"
    elif verdict == "changed" and not found.search.leaves_nothing(found.best):
        yield f"{found.left_share(difference):.0%} of the difference (r.m.s. beyond noise) has no name"
    missed = error_share(found.first.damper, found.before.cleaned) or 0.0
    if listed and missed > LARGE_MODEL_ERROR:
        yield (
            f"the damper of {found.before.name} misses {100.0 * missed:.2g} % of the force in its own tests: the "
            "values are those of that model, and the intervals those of what changed in it"
        )


# --- How the tests were compared


def _tests_told(found: Findings) -> list[str]:
    """Say how the tests were compared, and which are left out or go where no test of the first state came."""
    pairs = sum(c.before is not None for c in found.comparisons)
    told = [f"{counted(pairs, 'test')} compared cycle by cycle, {len(found.comparisons) - pairs} through the model"]
    told += _misread(found)
    if farther := _stroke_beyond(found):
        told.append(farther)
    for state in (found.before, found.after):
        aside = not_averaged(state)
        moving = [test.record.name for test in aside if not test.constant]
        unlike = [test.record.name for test in aside if test.constant]
        for names, why in ((moving, "the control signal moves"), (unlike, "no cycle repeats")):
            if names:
                told.append(f"{counted(len(names), 'test')} of {state.name} left out: {why} in {_first(names)}")
    compared = {c.after for c in found.comparisons}
    if out := sum(test.record.name not in compared for test in averaged(found.after.cleaned)):
        told.append(
            f"{counted(out, 'test')} of {found.after.name} left out: {found.before.name} was not tested at such a "
            "control signal or temperature"
        )
    return told


def _misread(found: Findings) -> list[str]:
    """Say where both states are the same recordings, or the second is the first with its two directions exchanged.

    Equation: F_h -> - (-1)^h F_h, what both signs turned make of a motion that is the same to either side
    """
    pairs = [c for c in found.comparisons if c.before is not None]
    apart = sum(float(c.difference @ c.difference) for c in pairs)
    if pairs and apart <= SAME_RECORDING**2 * sum(c.peak**2 for c in pairs):
        return [
            f"the tests of {found.after.name} are those of {found.before.name} once more: nothing else was measured"
        ]
    exchanged = 0.0
    for c in pairs:
        sides = np.where(np.arange(c.measured.size) % 2, 1.0, -1.0)
        left = stacked(sides * c.measured - c.reference)
        exchanged += float(left @ left)
    if not pairs or exchanged > EXCHANGED_LEAVES**2 * apart:
        return []
    size, rest = (_digits(float(np.sqrt(each / len(pairs)))) for each in (apart, exchanged))
    told = f"with rebound and compression of {found.after.name} exchanged {rest} N of the {size} N are left: are the "
    told += "signs of its files those of the others (`sign` in rig.files), or was the valve turned round?"
    return [told]


def _stroke_beyond(found: Findings) -> str | None:
    """Say which compared test goes farthest beyond the stroke of the first state; None where none does."""
    strokes = [float(np.max(np.abs(r.displacement - found.first.middle_m))) for r in found.before.records]
    farthest = {
        r.name: float(np.max(np.abs(r.displacement - found.first.middle_m)))
        for r in found.after.records
        if r.name in {c.after for c in found.comparisons}
    }
    test = max(farthest, key=lambda name: farthest[name])
    if farthest[test] <= (1.0 + CONSTANT_SHARE) * max(strokes):
        return None
    return (
        f"{test} goes {_digits(1e3 * farthest[test])} mm from the middle, the tests of {found.before.name} "
        f"{_digits(1e3 * max(strokes))} mm: what acts there alone may be no change"
    )


# --- What speaks against `unchanged`


def left_out_differ(found: Findings) -> str | None:
    """Say by how much worse the first damper predicts the tests that are not compared; None where it does not.

    What is seen where the control signal moves alone, as a lag of the valve, changes no average cycle.
    """
    tests = [not_averaged(state) for state in (found.before, found.after)]
    own, other = (error_share(found.first.damper, each) for each in tests)
    if own is None or other is None or other <= BEYOND_TESTED * own + found.diagnose.visible:
        return None
    return (
        f"but of the tests left out the damper of {found.before.name} misses {100.0 * other:.2g} % in "
        f"{found.after.name} and {100.0 * own:.2g} % in {found.before.name} (r.m.s., of the force): what changed "
        "shows there alone, and has no name"
    )


def beyond_the_model(found: Findings, best: Fitted) -> str | None:
    """Say which test compared through the model differs by more than the first damper may miss; None if none does.

    Beside tests compared cycle by cycle these decide nothing else, but an end stop may be reached in them alone.
    """
    if all(c.before is None for c in found.comparisons):
        return None
    beyond = {
        c.after: left**0.5 / c.peak
        for c, left, missed in found.left_of_tests(best)
        if c.before is None and left > missed + (found.diagnose.visible * c.peak) ** 2
    }
    if not beyond:
        return None
    test = max(beyond, key=lambda name: beyond[name])
    return (
        f"but {test} differs from what the damper of {found.before.name} would give there by "
        f"{100.0 * beyond[test]:.2g} % of its peak, more than that damper misses in its own tests: what shows "
        "there alone has no name"
    )


def at_one_condition(found: Findings, best: Fitted) -> str | None:
    """Say at which condition the force changed that is the same at all others; None where it did at none.

    T0, C and k change at a control signal or at all, and over all tests what changed at one temperature alone is
    too little to be seen.
    """
    where, left = found.most_left(best)
    if left <= ONE_CONDITION * max(found.diagnose.visible, found.search.hidden(best)):
        return None
    return f"but {where} {100.0 * left:.2g} % of peak is left: what changed there alone has no name"


# --- Numbers and names


def _digits(value: float, count: int = 3) -> str:
    """Return a number to so many digits, without a power of ten."""
    return f"{float(f'{value:.{count}g}'):g}"


def _first(names: Sequence[str]) -> str:
    """Return some names in words, the first few of many."""
    return ", ".join(names[:MOST_NAMES]) + (" and others" if len(names) > MOST_NAMES else "")
