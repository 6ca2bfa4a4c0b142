"""How often the 95 % intervals of identify hold the truth: `make coverage-study`.

    PYTHONPATH=.:tests/identification python tests/studies/coverage_study.py [repeats, default 9] [--fresh]

Every draw is a campaign on a damper whose T0, C and k are known (tests/identification/campaigns.py): one
or several tests that repeat or do not, force noise of 1 % of peak with a correlation of 0, 0.5 or 0.9 from
sample to sample, gain (2 %), offset (0.5 % of peak) and delay (0.5 ms) that differ from test to test, and
an effect of 0 to 20 % of peak hidden in the damper. Printed is which share of the rows is `ok`, how
often their intervals hold the truth of T0, C and k, and how often those of all other rows do: where the
status speaks of what the model misses, an interval is about the model's parameters and is not meant to
hold the damper's. Last, the same without any difference between the tests' sensors: the intervals allow
for one all the same. Seeds are fixed; `--fresh` draws anew.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from campaigns import KINDS, SENSORS, campaign

from pzd.artefacts import ParameterRow
from pzd.identification.bingham_fit import Bingham
from pzd.identification.condition import identify_condition
from pzd.identification.config import IdentifyConfig
from pzd.record import Condition
from pzd.signals.nuisance import NuisanceConfig

SEED = 20261122
CORRELATIONS = (0.0, 0.5, 0.9)
SIZES = (0.0, 0.0025, 0.005, 0.01, 0.02, 0.05, 0.2)
ALIKE = NuisanceConfig(offset=0.0, delay_s=0.0, gain=0.0)
COLUMNS = ("T0_N", "C_Ns_per_m", "k_N_per_m")


@dataclass(frozen=True)
class Draw:
    """One campaign and what identify made of it."""

    kind: str
    correlation: float
    size: float
    ok: bool
    missed: bool
    """Whether the status says that the model misses something."""
    held: tuple[bool | None, ...]
    """Whether the interval of T0, C and k holds the truth; None without one."""


def drawn(seed: np.random.SeedSequence, kind: str, correlation: float, size: float, sensors: NuisanceConfig) -> Draw:
    """One campaign."""
    rng = np.random.default_rng(seed)
    truth, records = campaign(rng, kind, correlation=correlation, hidden=size, sensors=sensors)
    row = identify_condition(Condition(None, 0.0, None, records), IdentifyConfig(), seed=1)[0]
    return Draw(kind, correlation, size, row.status == "ok", "misses" in row.status, holds(row, truth))


def holds(row: ParameterRow, truth: Bingham) -> tuple[bool | None, ...]:
    """Whether each interval of a row holds the truth; None where there is none."""
    ends = [(getattr(row, f"{column}_low95"), getattr(row, f"{column}_high95")) for column in COLUMNS]
    return tuple(None if low is None else low <= true <= high for (low, high), true in zip(ends, truth, strict=True))


def coverage(draws: Sequence[Draw]) -> str:
    """Share of the intervals of T0, C and k that hold the truth, and of all, with its standard error."""
    shares, counts = [], []
    for i in range(3):
        held = [bool(d.held[i]) for d in draws if d.held[i] is not None]
        shares.append(f"{np.mean(held):6.3f}" if held else "     -")
        counts.append(len(held))
    everything = [bool(h) for d in draws for h in d.held if h is not None]
    if not everything:
        return f"{'':>27}"
    share = float(np.mean(everything))
    error = float(np.sqrt(share * (1.0 - share) / max(len(draws), 1)))  # T0, C and k of a row count as one draw
    return f"{' '.join(shares)}  {share:.3f} +- {error:.3f} of {min(counts):4d}"


def line(name: str, draws: Sequence[Draw]) -> str:
    """One line of the table."""
    ok = [d for d in draws if d.ok]
    others = [d for d in draws if not d.ok]
    missed = float(np.mean([d.missed for d in draws]))
    return f"{name:<22} {len(draws):5d} {len(ok) / len(draws):6.2f} {missed:6.2f}  {coverage(ok)}   {coverage(others)}"


def table(draws: Sequence[Draw]) -> Iterator[str]:
    """The coverage by kind of campaign, by correlation and by size of what is hidden."""
    yield f"{'':<22} draws     ok misses      T0      C      k     all, where `ok`            the same elsewhere"
    groups: list[tuple[str, Callable[[Draw], bool]]] = [(k, lambda d, k=k: d.kind == k) for k in KINDS]  # type: ignore[misc]  # a default binds k
    groups += [(f"correlation {r:g}", lambda d, r=r: d.correlation == r) for r in CORRELATIONS]  # type: ignore[misc]  # a default binds r
    groups += [(f"hidden {100 * s:g} %", lambda d, s=s: d.size == s) for s in SIZES]  # type: ignore[misc]  # a default binds s
    groups += [("all", lambda _: True)]
    for name, wanted in groups:
        yield line(name, [d for d in draws if wanted(d)])


def main(repeats: int, *, fresh: bool) -> None:
    """Print the table."""
    seeds = np.random.SeedSequence() if fresh else np.random.SeedSequence(SEED)
    plan = list(product(KINDS, CORRELATIONS, SIZES)) * repeats
    draws = [drawn(seed, *each, SENSORS) for seed, each in zip(seeds.spawn(len(plan)), plan, strict=True)]
    sys.stdout.write("\n".join(table(draws)) + "\n")
    plan = list(product(KINDS, CORRELATIONS, (0.0,))) * max(repeats // 2, 1)
    alike = [drawn(seed, *each, ALIKE) for seed, each in zip(seeds.spawn(len(plan)), plan, strict=True)]
    sys.stdout.write(line("sensors all alike", alike) + "\n")


if __name__ == "__main__":
    numbers = [int(argument) for argument in sys.argv[1:] if argument != "--fresh"]
    main(numbers[0] if numbers else 9, fresh="--fresh" in sys.argv[1:])
