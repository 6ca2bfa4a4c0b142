"""What the nuisances of a test may explain within their priors, taken out of residuals once and for all.

Equation: r' = (I + V V')^(-1/2) r = r - V M V' r,  M = R diag((1 - 1/sqrt(1 + s^2))/s^2) R',  V' V = R diag(s^2) R'
Source: Gaussian prior, marginal likelihood
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pzd.record import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

HIDDEN = 1e-3
"""A nuisance that moves all residuals together by less [standard deviations of one] is left out.

Reason: it would change the misfit by a millionth."""
SPARSE = 0.2
"""Share of numbers other than zero up to which the columns are kept as these alone.

Reason: a column for a sample beside a jump has as many as the noise remembers; not tuned."""


@dataclass(frozen=True, eq=False)
class IntegratedOut:
    """Nuisances of a test, and how much of what they could explain is taken out."""

    columns: Array | csr_array
    """(w, p) what each does to the residuals at one standard deviation, in units of noise."""
    inner: Array
    """(p, p) M."""
    covariance: Array
    """(p, p) of the nuisances once the residuals are known: R diag(1/(1 + s^2)) R'."""

    @classmethod
    def of(cls, columns: Array) -> IntegratedOut:
        """Of some nuisances (w, p); what lies below `HIDDEN` is left in.

        By the eigenvalues of the (p, p) products, which lose nothing of what shows.
        """
        squares, right = np.linalg.eigh(columns.T @ columns)
        shown = squares > HIDDEN**2
        squares, right = squares[shown], right[:, shown]
        return cls(
            _packed(columns),
            (right * ((1.0 - 1.0 / np.sqrt(1.0 + squares)) / squares)) @ right.T,
            (right / (1.0 + squares)) @ right.T,
        )

    @classmethod
    def nothing(cls, residuals: int) -> IntegratedOut:
        """No nuisances of so many residuals."""
        return cls(np.zeros((residuals, 0)), np.zeros((0, 0)), np.zeros((0, 0)))

    def taken_out(self, values: Array) -> Array:
        """(w,) or (w, k) values in units of noise, without what the nuisances may explain of them."""
        if not self.inner.size:
            return values
        return np.asarray(values - self.columns @ (self.inner @ (self.columns.T @ values)))

    def likeliest(self, values: Array) -> Array:
        """(p,) the likeliest nuisances [standard deviations], given residuals (w,) that they are not taken out of."""
        return np.asarray(self.covariance @ (self.columns.T @ values))


def _packed(columns: Array) -> Array | csr_array:
    if not columns.size or np.count_nonzero(columns) > SPARSE * columns.size:
        return columns
    from scipy.sparse import csr_array

    return csr_array(columns)
