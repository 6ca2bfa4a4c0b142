"""The records of one setting, and how a damper compares with them; each damper is simulated once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from pzd.damper.model import Damper
from pzd.diagnose.data.cleaning import Prepared
from pzd.diagnose.data.split import UNTOUCHED, Split
from pzd.diagnose.fit.input_uncertainty import Predicted, expected
from pzd.diagnose.residual_check import ResidualCheck, check_residual
from pzd.diagnose.work import Work
from pzd.record import Mask
from pzd.signals.nuisance import NuisanceConfig

Item = TypeVar("Item")
Made = TypeVar("Made")


@dataclass(frozen=True, eq=False)
class Campaign:
    """The records of one setting, and which of their samples the search for missing effects may see."""

    prepared: tuple[Prepared, ...]
    parts: Split
    nuisance: NuisanceConfig
    jobs: int = 1
    """Records that are simulated at the same time."""
    work: Work = field(default_factory=Work, repr=False)
    """What has been simulated in fits, and may be."""
    _expected: dict[tuple[str, int], Predicted] = field(default_factory=dict, repr=False)
    _checks: dict[str, tuple[ResidualCheck, ...]] = field(default_factory=dict, repr=False)

    @property
    def seen(self) -> tuple[Mask, ...]:
        """(n,) the samples of each record that the search for missing effects may see."""
        return tuple(roles != UNTOUCHED for roles in self.parts.roles)

    def in_role(self, role: int) -> tuple[Mask, ...]:
        """(n,) the samples of each record in one role of the split."""
        return tuple(roles == role for roles in self.parts.roles)

    def expected(self, damper: Damper, numbers: Sequence[int]) -> tuple[Predicted, ...]:
        """What the damper makes of some of the records."""
        key = damper.model_dump_json()
        new = [i for i in numbers if (key, i) not in self._expected]
        made = self.each(lambda i: expected(damper, self.prepared[i], self.nuisance.delay_s), new)
        self._expected.update(zip(((key, i) for i in new), made, strict=True))
        return tuple(self._expected[key, i] for i in numbers)

    def checks(self, damper: Damper) -> tuple[ResidualCheck, ...]:
        """Every record against a damper, over the samples seen."""
        key = damper.model_dump_json()
        if key not in self._checks:
            self._checks[key] = self._against(damper, self.seen)
        return self._checks[key]

    def untouched(self, damper: Damper) -> tuple[ResidualCheck, ...]:
        """Every record against a damper, over the samples that the search may not see."""
        return self._against(damper, self.in_role(UNTOUCHED))

    def offset(self, damper: Damper) -> float:
        """By how much the median record lies above what the damper makes of it [N]; no effect has to explain it."""
        asked = in_use(self.seen)
        given = zip(asked, self.expected(damper, asked), strict=True)
        return float(np.median([np.mean(self.prepared[i].record.force - each.force) for i, each in given]))

    def _against(self, damper: Damper, masks: Sequence[Mask]) -> tuple[ResidualCheck, ...]:
        asked = in_use(masks)
        given = [(e, self.prepared[i], masks[i]) for i, e in zip(asked, self.expected(damper, asked), strict=True)]
        return self.each(lambda each: check_residual(*each, self.nuisance), given)

    def each(self, function: Callable[[Item], Made], items: Iterable[Item]) -> tuple[Made, ...]:
        """What a function makes of every item, `jobs` of them at the same time."""
        with ThreadPoolExecutor(max(self.jobs, 1)) as pool:
            return tuple(pool.map(function, items))


def in_use(masks: Sequence[Mask]) -> list[int]:
    """The records of which a mask (n,) keeps any sample."""
    return [i for i, mask in enumerate(masks) if mask.any()]
