"""What peers miss of the very tests and voltages that diagnose keeps back.

They see what diagnose sees: the same cleaned motion, the same samples, the same folds; nothing is fitted to a test that
is kept back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from pzd.diagnose.data.cleaning import Prepared
from pzd.diagnose.fit.prediction import counted
from pzd.diagnose.folds import Folds
from pzd.diagnose.missed import Missed
from pzd.diagnose.peer import Peer, PeerForm, StrokeMotion
from pzd.diagnose.peer_fit import FittedTest, PeerFit, best_form, between_voltages, fit_peer
from pzd.record import Array, Mask


class _Entry(NamedTuple):
    """Of a test, or of a half of one."""

    record: int
    error: float
    energy: float
    spread: float


@dataclass(frozen=True, eq=False)
class KeptBackTests:
    """The tests of one setting at constant voltage, as diagnose deals them."""

    prepared: tuple[Prepared, ...]
    dealt: Folds
    _fits: dict[tuple[str, str, int, tuple[bytes, ...]], PeerFit] = field(default_factory=dict, repr=False)

    @property
    def groups(self) -> list[tuple[float, tuple[int, ...]]]:
        """Voltage [V] and records of each group at a constant voltage, lowest first."""
        found = zip(self.dealt.voltages, self.dealt.groups, strict=True)
        return sorted((voltage, group) for voltage, group in found if voltage is not None)

    @property
    def moving(self) -> list[str]:
        """The records whose voltage moves."""
        found = zip(self.dealt.voltages, self.dealt.groups, strict=True)
        return [self.prepared[i].record.name for voltage, group in found if voltage is None for i in group]

    def fitted(self, peer: Peer, form: PeerForm, group: int, kept_back: Sequence[Mask]) -> PeerFit:
        """A form of a peer at one voltage, fitted to all but what is kept back; asked twice it is fitted once."""
        _, members = self.groups[group]
        key = peer.name, form.label, group, tuple(kept_back[i].tobytes() for i in members)
        if key not in self._fits:
            tests = [self._test(i, ~kept_back[i]) for i in members]
            self._fits[key] = fit_peer(peer, form, [test for test in tests if test.fitted.any()])
        return self._fits[key]

    def _test(self, i: int, fitted: Mask) -> FittedTest:
        p = self.prepared[i]
        return FittedTest(StrokeMotion.of(p), p.record.force, fitted & counted(p))

    def by_form(
        self, peer: Peer, kept_back: Sequence[Mask], groups: Iterable[int]
    ) -> tuple[PeerForm, dict[float, PeerFit]]:
        """The form of a peer that fits some voltages best without what is kept back, and its fits by voltage [V]."""
        asked = list(groups)
        fits = {form: {self.groups[g][0]: self.fitted(peer, form, g, kept_back) for g in asked} for form in peer.forms}
        form = best_form(fits)
        return form, fits[form]

    def missed(self, peer: Peer) -> Missed:
        """What a peer misses of the tests that are kept back, fold by fold."""
        entries = []
        for fold in self.dealt.folds:
            form, fits = self.by_form(peer, fold, range(len(self.groups)))
            for voltage, group in self.groups:
                entries += [self._entry(i, fold[i], self._predicted(peer, form, fits, voltage, i)) for i in group]
        return _joined(entries)

    def missed_between(self, peer: Peer, group: int) -> Missed:
        """What a peer misses of a voltage, by the line between the voltages around it."""
        form, fits = self.by_form(peer, self.nothing, (g for g in range(len(self.groups)) if g != group))
        voltage, members = self.groups[group]
        return _joined(
            self._entry(i, self.everything[i], self._predicted(peer, form, fits, voltage, i)) for i in members
        )

    def known(self, figure: Mapping[int, float]) -> Missed:
        """What a model misses of the tests that are kept back, of which the W_s of each is known, by record."""
        return _joined(self._of_known(i, fold[i], W_s) for fold in self.dealt.folds for i, W_s in figure.items())

    def known_between(self, group: int, figure: float) -> Missed:
        """What a model misses of a voltage, of which the W_s is known."""
        return _joined(self._of_known(i, self.everything[i], figure) for i in self.groups[group][1])

    @property
    def nothing(self) -> tuple[Mask, ...]:
        """(n,) a record: no sample."""
        return tuple(np.zeros(p.record.time.size, dtype=np.bool_) for p in self.prepared)

    @property
    def everything(self) -> tuple[Mask, ...]:
        """(n,) a record: every sample."""
        return tuple(~mask for mask in self.nothing)

    def _predicted(
        self, peer: Peer, form: PeerForm, fits: Mapping[float, PeerFit], voltage: float, i: int
    ) -> Callable[[], Array]:
        return lambda: peer.force(form, StrokeMotion.of(self.prepared[i]), between_voltages(fits, voltage))

    def _entry(self, i: int, kept_back: Mask, predicted: Callable[[], Array]) -> _Entry:
        """What a predicted force (n,) misses of the kept-back samples (n,) of a record."""
        if not kept_back.any():
            return _Entry(i, 0.0, 0.0, 0.0)
        kept = kept_back & counted(self.prepared[i])
        force = self.prepared[i].record.force[kept]
        residual, about_mean = force - predicted()[kept], force - force.mean()
        squares = (float(each @ each) for each in (residual, force, about_mean))
        return _Entry(i, *squares)

    def _of_known(self, i: int, kept_back: Mask, figure: float) -> _Entry:
        bare = self._entry(i, kept_back, lambda: np.zeros(kept_back.size))
        return bare._replace(error=figure * bare.energy)


def _joined(entries: Iterable[_Entry]) -> Missed:
    """Entries as one, without those of which nothing was kept back."""
    known = [entry for entry in entries if entry.energy > 0.0]
    error, energy, spread = np.array([entry[1:] for entry in known], dtype=np.float64).reshape(-1, 3).T
    return Missed(tuple(entry[0] for entry in known), error, energy, spread, np.zeros(error.size))
