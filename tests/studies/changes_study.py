"""How often `pzd changes` is right, on pairs of states of dampers of the second generator.

    PYTHONPATH=. python tests/studies/changes_study.py [--pairs N] [--first I] [--seed S] [--kind changed|same|stand]
        [--only equal|unlike] [--plain] [--log FILE]

Each pair is a damper drawn from the whole space of `pzd/blind/independent`, with one or two laws outside the library in
both states, on sines (and triangles) at one or more values of the control signal. `changed`: one or two quantities of
the damper change by 0.5 to 5 % of peak each, `same`: nothing, `stand`: the load cell's zero or gain, or a delay. In a
third of the changed pairs the second state runs other motions; `--only` leaves out those of the other kind. The first
state is diagnosed, as the command does; `--plain` takes it as it was identified, which is four times as fast and more
often wrong. A line a pair, then how many are right, ambiguous with the truth among the rivals, incomplete (names of the
truth, not all of it), silent, or wrong, and how many intervals of `to` hold the true change, with Wilson's 95 %
intervals, for equal and unlike motions apart. The line tells how far `to` lies from the true change, in half intervals.
With `--log` what comes of each pair is added to a file, and the summary counts all that the file holds, so that a long
study may run in pieces.

A second count holds to what shows: of what changed, that which leaves 0.5 % of peak beside the other change and beside
what any two tests of one damper on this stand differ by, an offset, a gain and a delay of each. What leaves less may be
named or not. Dampers whose force is not settled, so that C larger by a billionth makes another one, are not drawn: the
steps of the generator's solver chatter where a valve is all but flat.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.random import Generator, SeedSequence, default_rng

from pzd.artefacts import Rig
from pzd.artefacts.changes import Changes
from pzd.blind.independent import case, stand
from pzd.blind.independent.kernel import BinghamTable
from pzd.blind.independent.laws import LAWS, Scale
from pzd.blind.independent.outside import OUTSIDE
from pzd.blind.rates import Rate
from pzd.damper.effects import library
from pzd.diagnosis.changes.comparison import changes_between
from pzd.diagnosis.changes.state import State, diagnosed_state
from pzd.diagnosis.config import DiagnoseConfig
from pzd.fit.intervals import LEVEL
from pzd.identification.config import IdentifyConfig
from pzd.identification.stage import identify
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.rig.config import FilesEntry, RigConfig

CAMPAIGNS = ("two_by_two", "constant_stroke", "sines_and_triangles")
ELEMENT = ("T0", "C", "k")
NEW = ("asymmetry", "fluid_inertia", "gas_spring", "lash", "orifice_quadratic", "preload_offset", "relief_valve",
       "rounded_yield", "shear_thinning", "stribeck_friction")  # fmt: skip
ADDITIVE = ("fluid_inertia", "gas_spring", "orifice_quadratic", "preload_offset")
"""Laws of one size in proportion to which the force is."""
SIZES = (0.005, 0.05)
"""Least and largest change of the force (r.m.s.), as a share of peak."""
MULTIPLIES = {"C": ("aeration", "frequency_dependent", "position_grooves"), "T0": ("thixotropy",)}
"""Laws outside the library that multiply C or T0: of a change of it the force shows a share."""
SMALL = 0.01
"""Relative change over which that share is differenced."""
VANISHING = 1e-9
"""Relative change of C that must make no force."""
UNSETTLED = 1e-3
"""Force that it makes [share of peak, r.m.s.] from which the force is that of chance: a fifth of the least change."""
OWN = (0.003, 0.01, 2e-4)
"""Standard deviations of offset [peak], gain and delay [s] of a test on this stand (`stand.ErrorsOfTest`)."""
SAMPLES = 2000
"""Samples of a test on which what shows is counted."""
STAND = ("load_cell_zero", "load_cell_gain", "recorder_delay")


@dataclass(frozen=True, eq=False)
class Pair:
    """Two states with the truth."""

    before: tuple[Record, ...]
    after: tuple[Record, ...]
    changed: Mapping[str, Mapping[str, float]]
    """Factors of T0, C or k, parameters of a law that is newly there, or the stand's doing."""
    base: BinghamTable
    """T0, C and k of the first state."""
    shown: Mapping[str, tuple[float, ...]]
    """Share of each that the force shows where a law outside the library multiplies it, at every value of `base`."""
    outside: tuple[str, ...]
    equal: bool
    hidden: tuple[str, ...] = ()
    """Of what changed, that which leaves less than the least change beside the other one and what tests differ by."""


def pair(seed: int, index: int, kind: str, only: str | None = None) -> Pair | None:
    """Draw a pair; None where its motions are not those that are asked for."""
    rng = default_rng(SeedSequence(seed, spawn_key=(index, 43)))
    run = stand.campaign(str(rng.choice(CAMPAIGNS)), rng)
    actuator = stand.Actuator.drawn(rng)
    equal = kind != "changed" or rng.random() < 2.0 / 3.0
    if only is not None and equal != (only == "equal"):
        return None
    other = run if equal else replace(
        run, tests=tuple(replace(t, frequency=1.25 * t.frequency, amplitude=0.85 * t.amplitude) for t in run.tests)
    )  # fmt: skip
    phases = int(rng.integers(1 << 31))
    base, run = case.drawn_base(run, actuator, phases, rng)
    other = replace(other, step=run.step)
    motions, others = (case.driven_tests(each, actuator, phases) for each in (run, other))
    coarse = case.driven_tests(run, actuator, phases, coarse=True)
    plain = case.HiddenDamper(base, {}, 22.0)
    scale = case._scale(run, base, coarse, [plain.force(m, None) for m in coarse])
    outside = tuple(str(n) for n in rng.choice(list(OUTSIDE), int(rng.integers(1, 3)), replace=False))
    laws = case._sized_laws(outside, plain, coarse, scale, 1.0, rng)
    first = case.HiddenDamper(base, laws, 22.0)
    if _differ(first, _moved_little(first), motions) > UNSETTLED:
        return None
    names = {"changed": int(rng.integers(1, 3)), "same": 0, "stand": 0}[kind]
    truth: dict[str, Mapping[str, float]] = {}
    second = first
    drawn = [str(name) for name in rng.choice([*ELEMENT, *NEW], names, replace=False)]
    while drawn:
        name, size = drawn.pop(0), float(np.exp(rng.uniform(*np.log(SIZES))))
        changed = _changed(second, name, size, motions, scale, rng)
        if changed is None:  # a valve that never opens, or stands beside another one
            drawn.append(str(rng.choice([n for n in (*ELEMENT, *NEW) if n != name and n not in {*truth, *drawn}])))
            continue
        second, truth[name] = changed
    forces = [first.force(m, None) for m in motions]
    peak = max(float(np.max(np.abs(f))) for f in forces)
    chain = stand.Chain.drawn(rng, peak, scale.stroke, run.rate)
    before = _records(motions, forces, chain, peak, base.values, rng)
    after = _records(others, [second.force(m, None) for m in others], chain, peak, base.values, rng)
    if kind == "stand":
        name = str(rng.choice(STAND))
        side = float(rng.choice([-1.0, 1.0]))
        by = {"load_cell_zero": 0.05 * peak, "load_cell_gain": 0.05, "recorder_delay": 0.005}[name]
        by *= side * float(rng.uniform(0.3, 0.95))
        truth[name] = {name: by}
        after = tuple(_seen(r, name, by) for r in after)
    shown = {name: _shown(first, name, motions) for name in ELEMENT}
    hidden = _hidden(first, {n: v for n, v in truth.items() if n not in STAND}, motions)
    return Pair(before, after, truth, base, shown, outside, equal, hidden)


def _moved_little(damper: case.HiddenDamper) -> case.HiddenDamper:
    return _with(damper, "C", {"factor": 1.0 + VANISHING})


def _with(damper: case.HiddenDamper, name: str, values: Mapping[str, float]) -> case.HiddenDamper:
    """Return the damper in which one quantity changed."""
    if name in ELEMENT:
        row = tuple(values["factor"] * v for v in getattr(damper.base, name))
        return replace(damper, base=replace(damper.base, **{name: row}))
    return replace(damper, laws={**damper.laws, name: values})


def _differ(one: case.HiddenDamper, other: case.HiddenDamper, motions: list[stand.Driven]) -> float:
    """Return the r.m.s. difference of force of two dampers, each test in units of its peak."""
    pairs = [(m, one.force(m, None), other.force(m, None)) for m in motions]
    steady = [(a[m.time[::2] >= 0.0], b[m.time[::2] >= 0.0]) for m, a, b in pairs]
    return float(np.sqrt(np.mean([np.mean((b - a) ** 2) / np.max(np.abs(a)) ** 2 for a, b in steady])))


def _hidden(
    first: case.HiddenDamper, truth: Mapping[str, Mapping[str, float]], motions: list[stand.Driven]
) -> tuple[str, ...]:
    """Return what of the changes leaves less than the least one, the other refitted, beside what tests differ by.

    Each of two tests has an offset, a gain and a delay of its own, up to where chance leaves 95 % of them; the mean of
    all tests is known by their number.
    """
    second = first
    for name, values in truth.items():
        second = _with(second, name, values)
    tests = []
    for m in motions:
        at = np.flatnonzero(m.time[::2] >= 0.0)
        at = at[:: max(1, at.size // SAMPLES)]
        force = second.force(m, None)
        peak = float(np.max(np.abs(force[at])))
        own = np.column_stack([np.full(at.size, peak), force[at], -np.gradient(force, m.time[::2])[at]])
        made = []
        for name in truth:
            less = first
            for other, values in truth.items():
                less = less if other == name else _with(less, other, values)
            made.append((force - less.force(m, None))[at])
        tests.append((np.array(made) / peak, own * np.sqrt(2.0) * np.array(OWN) / peak))
    found = []
    for i, name in enumerate(truth):
        left = np.sqrt(np.mean([np.mean(r**2) for r in _left_of(i, tests)]))
        found.extend([name] if left < SIZES[0] else [])
    return tuple(found)


def _left_of(change: int, tests: list[tuple[Array, Array]]) -> list[Array]:
    """Return what is left in each test of a change beside the others and what the tests have of their own."""
    others = [np.delete(made, change, axis=0) for made, _ in tests]
    within = [np.linalg.lstsq(own, made[change], rcond=None)[0] for made, own in tests]
    size = np.zeros(others[0].shape[0])
    for _ in range(20):  # one after the other: own, then the other change, until they stand still
        rest = [made[change] - size @ o for (made, _), o in zip(tests, others, strict=True)]
        within = [np.linalg.lstsq(own, r, rcond=None)[0] for (_, own), r in zip(tests, rest, strict=True)]
        chance = LEVEL / np.sqrt(len(tests))
        mean = np.mean(within, axis=0)
        within = [np.clip(b - mean + np.clip(mean, -chance, chance), -LEVEL, LEVEL) for b in within]
        rest = [made[change] - own @ b for (made, own), b in zip(tests, within, strict=True)]
        if not size.size:
            return rest
        size = np.linalg.lstsq(np.concatenate(others, axis=1).T, np.concatenate(rest), rcond=None)[0]
    return [r - size @ o for r, o in zip(rest, others, strict=True)]


def _shown(damper: case.HiddenDamper, name: str, motions: list[stand.Driven]) -> tuple[float, ...]:
    """Return the share of a change of T0, C or k that the true force shows, at every value of the control signal.

    Equation: s = sum dF dF_1 / sum dF_1^2, dF with the laws that multiply the quantity, dF_1 without
    """
    within = [law for law in damper.laws if law in MULTIPLIES.get(name, ())]
    values = damper.base.values
    if not within:
        return (1.0,) * len(values)
    row = tuple((1.0 + SMALL) * v for v in getattr(damper.base, name))
    moved = replace(damper.base, **{name: row})
    sums = np.zeros((2, len(values)))
    for m in motions:
        steady = m.time[::2] >= 0.0
        with_laws, without = (
            (replace(d, base=moved).force(m, None) - d.force(m, None))[steady]
            for d in (damper, replace(damper, laws={k: v for k, v in damper.laws.items() if k not in within}))
        )
        at = int(np.argmin(np.abs(np.array(values) - np.median(m.signal))))
        sums[:, at] += float(with_laws @ without), float(without @ without)
    return tuple(float(v) for v in np.where(sums[1] > 0.0, sums[0] / np.where(sums[1] > 0.0, sums[1], 1.0), 1.0))


def _changed(
    damper: case.HiddenDamper, name: str, size: float, motions: list[stand.Driven], scale: Scale, rng: Generator
) -> tuple[case.HiddenDamper, Mapping[str, float]] | None:
    """Return the damper in which one quantity changed by so much of the peak, and how; None where it cannot.

    On the motions that are recorded: coarser and shorter ones show what a law of memory hides otherwise.
    """
    chance, strength, side = int(rng.integers(1 << 31)), 0.1, float(rng.choice([-1.0, 1.0]))
    before = [damper.force(m, None)[m.time[::2] >= 0.0] for m in motions]
    for _ in range(8):
        if name in ELEMENT:
            values = {"factor": float(np.exp(side * min(strength, 1.0)))}
        else:
            values = dict(LAWS[name].draw(default_rng(chance), scale, strength))
        changed = _with(damper, name, values)
        after = [changed.force(m, None)[m.time[::2] >= 0.0] for m in motions]
        made = np.sqrt(np.mean([np.mean((a - b) ** 2) / np.max(np.abs(b)) ** 2
                                for a, b in zip(after, before, strict=True)]))  # fmt: skip
        if max(SIZES[0], 0.8 * size) <= made <= 1.25 * size:
            break
        strength = min(2.0, strength * min(4.0, max(0.2, size / max(float(made), 1e-9))))
    return (changed, values) if made >= SIZES[0] else None


def _records(
    motions: list[stand.Driven], forces: list[Array], chain: stand.Chain, peak: float, values: tuple[float, ...],
    rng: Generator,
) -> tuple[Record, ...]:  # fmt: skip
    found = []
    for i, (m, f) in enumerate(zip(motions, forces, strict=True)):
        t = case._logged(m, f, None, chain, peak, values, rng)
        v = np.gradient(t.displacement, t.time)
        signal = None if t.signal is None else t.signal
        found.append(Record(f"r{i:02d}", None, t.time, t.displacement, v, np.gradient(v, t.time), t.force, signal))
    return tuple(found)


def _seen(record: Record, name: str, by: float) -> Record:
    if name == "load_cell_zero":
        return replace(record, force=record.force + by)
    if name == "load_cell_gain":
        return replace(record, force=(1.0 + by) * record.force)
    return replace(record, force=np.interp(record.time - by, record.time, record.force))


def judged(found: Changes, truth: Mapping[str, Mapping[str, float]], hidden: Collection[str] = ()) -> str:
    """Return how a result stands to the truth, of which some need not be named."""
    named = {c.name for c in found.changes if c.of == "damper"} - set(hidden)
    truth = {name: values for name, values in truth.items() if name not in hidden}
    of_damper = {name for name in truth if name not in STAND}
    told = {c.name for c in found.changes} | set(found.rivals)
    if found.verdict == "ambiguous" and set(truth) <= told:
        return "ambiguous"
    if named - of_damper:
        return "wrong, unexplained" if found.verdict == "unexplained" else "wrong"
    if found.verdict == "unexplained":
        return "unexplained"
    if named == of_damper and found.verdict != "ambiguous":
        return "right"
    return "incomplete" if found.verdict != "unchanged" else "silent"


def away(found: Changes, drawn: Pair) -> Iterator[tuple[str, float]]:
    """Yield of each named truth how far `to` lies from the true change, `from` held, in half 95 % intervals.

    A law that stands beside one that the first state was found to have is counted where their sizes add up.
    """
    for c in found.changes:
        given = drawn.changed.get(c.name, {})
        if c.low95 is None or c.high95 is None:
            continue
        start, to, low, high = (np.atleast_1d(np.array(v, dtype=float)) for v in (c.from_, c.to, c.low95, c.high95))
        if "factor" in given:
            shown = np.array(getattr(drawn.base, c.name)) * drawn.shown[c.name]
            own = np.interp(c.at_voltage_V or (drawn.base.values[0],), drawn.base.values, shown)
            true = _moved(c.name, start, own, given["factor"])
        elif c.parameter in given:
            before = np.nan_to_num(start)
            neutral = 0.0 if c.of == "stand" else library()[c.name].parameter(c.parameter).neutral
            absent = np.all((before == 0.0) | (before == neutral))
            if not absent and c.name not in ADDITIVE:
                continue
            true = given[c.parameter] + (np.zeros_like(before) if absent else before)
        else:
            continue
        half = np.where(to > true, to - low, high - to)
        for value in (to - true) / np.maximum(half, np.finfo(float).tiny):
            yield f"{c.name}.{c.parameter}", float(value)


def _moved(name: str, start: Array, own: Array, factor: float) -> Array:
    """Return the value after a true change from the value that was identified before.

    Equation: T0 + dT0, C + dC, 1 / (1/k + d(1/k)): what the force shows is the change of T0, C and the compliance
    """
    if name == "k":
        return np.asarray(1.0 / (1.0 / start + (1.0 / factor - 1.0) / own))
    return np.asarray(start + (factor - 1.0) * own)


def compared(given: Pair, *, diagnosed: bool) -> Changes:
    """Return what is found, from the first state as it was diagnosed, or else as it was identified."""
    rigs = Rig(given.before, ()), Rig(given.after, ())
    config, control = (DiagnoseConfig(), IdentifyConfig()), Control()
    identified = [identify(config[1], rig, 1) for rig in rigs]
    before, after = (
        State.of(name, rig, found, None, control)
        for name, rig, found in zip(("before", "after"), rigs, identified, strict=True)
    )
    if diagnosed:
        own_files = RigConfig(files=(FilesEntry(path="*"),))
        before = diagnosed_state(before, rigs[0], identified[0], None, *config, own_files, control, 1)
    return changes_between(before, after, *config, control).changes


def _short(value: object) -> str:
    return "/".join(f"{v:.4g}" for v in np.atleast_1d(np.array(value, dtype=float)))


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


@dataclass(frozen=True)
class Outcome:
    """What came of one pair."""

    seed: int
    index: int
    kind: str
    motions: str
    judged: str
    damper_named: bool
    """Whether something of the damper is listed as changed."""
    held: tuple[bool, ...]
    """Of each named truth, whether the interval of `to` holds it."""
    of_shown: str = ""
    """How the result stands to what of the truth shows; nothing where none of it does."""


def outcome(given: argparse.Namespace, index: int, drawn: Pair) -> Outcome:
    """Compare a pair, and print its line."""
    begun = time.process_time()
    found = compared(drawn, diagnosed=not given.plain)
    verdict, far = judged(found, drawn.changed), list(away(found, drawn))
    names = [f"{c.name}.{c.parameter}={_short(c.to)}" for c in found.changes]
    told = ", ".join(f"{name} {value:.2f}" for name, value in far)
    truth = {n: {k: round(v, 4) for k, v in each.items()} for n, each in drawn.changed.items()}
    motions, seconds = "equal" if drawn.equal else "unlike", time.process_time() - begun
    say(
        f"{index:4d} {motions} {verdict:18s} {found.verdict:11s} {truth} -> {names} rivals {list(found.rivals)} "
        f"{100 * found.difference.share_of_peak:.2f} % away [{told}] outside {'+'.join(drawn.outside)} "
        f"hidden {list(drawn.hidden)} "
        f"tests {len(drawn.before)} {seconds:.0f} s"
    )
    of_damper = any(c.of == "damper" for c in found.changes)
    shown = judged(found, drawn.changed, drawn.hidden) if set(drawn.changed) - set(drawn.hidden) else ""
    held = tuple(abs(a) <= 1.0 for _, a in far)
    return Outcome(given.seed, index, given.kind, motions, verdict, of_damper, held, shown)


def summary(outcomes: Iterable[Outcome]) -> Iterator[str]:
    """Yield the lines of the summary, by kind and motions."""
    groups: dict[tuple[str, str], list[Outcome]] = {}
    for each in outcomes:
        groups.setdefault((each.kind, each.motions), []).append(each)
    for (kind, motions), own in groups.items():
        counts = Counter(each.judged for each in own)
        yield f"{kind}, {motions} motions, {len(own)} pairs: " + ", ".join(f"{n} {c}" for n, c in counts.most_common())
        if kind == "changed":
            yield f"  right or ambiguous with the truth: {_rate(counts['right'] + counts['ambiguous'], len(own))}"
            shown = [each.of_shown for each in own if each.of_shown]
            hits = sum(each in ("right", "ambiguous") for each in shown)
            yield f"  of what shows, in the pairs in which something does: {_rate(hits, len(shown))}"
        yield f"  wrong name: {_rate(sum(c for n, c in counts.items() if n.startswith('wrong')), len(own))}"
        if kind != "changed":
            yield f"  something of the damper named: {_rate(sum(each.damper_named for each in own), len(own))}"
        intervals = [hit for each in own for hit in each.held]
        yield f"  intervals of `to` that hold: {_rate(sum(intervals), len(intervals))}"


def _rate(hits: int, count: int) -> str:
    low, high = Rate(hits, count).interval
    share = f"{100.0 * hits / count:.1f} %" if count else "-"
    return f"{hits} of {count}, {share} ({100.0 * low:.1f} to {100.0 * high:.1f} %)"


def main() -> int:
    """Draw, compare and count."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=20, help="drawn; those that --only leaves out count")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=("changed", "same", "stand"), default="changed")
    parser.add_argument("--only", choices=("equal", "unlike"))
    parser.add_argument("--plain", action="store_true", help="the first state is not diagnosed")
    parser.add_argument("--log", type=Path)
    given = parser.parse_args()
    outcomes = []
    if given.log is not None and given.log.exists():
        outcomes = [Outcome(**json.loads(line)) for line in given.log.read_text(encoding="utf-8").splitlines()]
    for index in range(given.first, given.first + given.pairs):
        drawn = pair(given.seed, index, given.kind, given.only)
        if drawn is None:
            continue
        outcomes.append(outcome(given, index, drawn))
        if given.log is not None:
            with given.log.open("a", encoding="utf-8") as log:
                log.write(json.dumps(asdict(outcomes[-1])) + "\n")
    for line in summary(outcomes):
        say(line)
    return 0


if __name__ == "__main__":
    sys.exit(main())
