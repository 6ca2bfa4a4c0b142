"""What each record has to do with a fit: its residuals and slopes, what its sensors may have done, what repeats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pzd.identify.trial import Trial
from pzd.record import Array, Record
from pzd.signals.cycles import Cycles
from pzd.signals.jumps import jumps, jumps_in_cycles
from pzd.signals.nuisance import NuisanceConfig, columns_of
from pzd.signals.repeating import cycles_of


@dataclass(frozen=True, eq=False)
class Part:
    """One record's part in a fit; (m,) are its counted samples."""

    record: Record
    counted: NDArray[np.bool_]
    """(n,) which samples of the record the fit counts."""
    residuals: Array
    """(m,) measured less simulated force [N]."""
    slopes: Array
    """(m, p) derivatives of the simulated force by the parameters."""
    nuisances: Array
    """(m, 3) force that one standard deviation of the test's offset, gain and delay makes [N]."""
    run: Cycles | None
    """The cycles that repeat, None where the motion does not or the control signal moves."""
    constant: bool = True
    """Whether the control signal stands still."""

    @property
    def force(self) -> Array:
        """(m,) measured force [N]."""
        return self.record.force[self.counted]

    @cached_property
    def number(self) -> NDArray[np.int64]:
        """(m,) the whole repeating cycle of each sample, 0, 1, ..., and -1 for all others; -1 with fewer than two."""
        nothing = np.full(self.residuals.size, -1)
        if self.run is None:
            return nothing
        of_all = self.run.number(self.record.time)
        whole = self.run.whole(self.record.time, self.counted)
        if len(whole) < 2:
            return nothing
        place = np.full(self.run.count + 1, -1)
        place[whole] = np.arange(len(whole))
        found: NDArray[np.int64] = place[of_all][self.counted]
        return found

    @cached_property
    def calm(self) -> NDArray[np.bool_]:
        """(m,) the samples beside no jump of the force, where its instant is chance."""
        record = self.record
        found = jumps_in_cycles(self.run, record.time, record.force) if self.run else jumps(record.force)
        return np.asarray(found[self.counted] == 0.0)

    def folded(self, values: Array) -> Array | None:
        """(cycles, points) of (m,) values over the whole repeating cycles, None with fewer than two."""
        if self.run is None:
            return None
        whole = self.run.whole(self.record.time, self.counted)
        if len(whole) < 2:
            return None
        everywhere = np.zeros(self.record.time.size)
        everywhere[self.counted] = values
        return self.run.fold(self.record.time, everywhere)[whole]


def parts_of(
    records: Sequence[Record],
    trials: Sequence[Trial],
    fitted: tuple[Array, Array],
    nuisance: NuisanceConfig,
    *,
    constant: bool = True,
) -> tuple[Part, ...]:
    """The parts of a fit.

    Parameters
    ----------
    records : that were fitted
    trials : the same, as the fit saw them
    fitted : (N,) residuals and (N, p) slopes of the counted samples, record by record
    nuisance : what may differ from test to test
    constant : whether the control signal stands still, so that the force repeats where the motion does
    """
    residuals, slopes = fitted
    ends = np.cumsum([np.count_nonzero(t.counted) for t in trials])[:-1]
    return tuple(
        Part(
            record,
            trial.counted,
            left,
            slope,
            columns_of(record.force[trial.counted] - left, record.rate, nuisance, trial.counted),
            cycles_of(record) if constant else None,
            constant,
        )
        for record, trial, left, slope in zip(
            records, trials, np.split(residuals, ends), np.split(slopes, ends), strict=True
        )
    )
