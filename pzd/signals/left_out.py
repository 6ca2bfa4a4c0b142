"""Where a record parts, of which samples are left out: nothing is differenced across what is missing."""

from __future__ import annotations

import numpy as np

from pzd.record import Array, Mask


def parted(values: Array, counted: Mask) -> list[Array]:
    """Values (m,) or (m, p) at the counted samples of a record, parted where samples between them are left out.

    Parameters
    ----------
    values : at the m samples that count
    counted : (n,) which samples of the record these are
    """
    ends = np.flatnonzero(np.diff(np.flatnonzero(counted)) > 1) + 1
    return np.split(values, ends)


def slope_within(values: Array, counted: Mask) -> Array:
    """(m,) change from sample to sample, by central differences within each stretch; 0 for a sample that stands alone.

    Parameters
    ----------
    values : (m,) at the samples that count
    counted : (n,) which samples of the record these are
    """
    parts = parted(values, counted)
    return np.concatenate([np.gradient(part) if part.size > 1 else np.zeros(part.size) for part in parts])


def unbroken(counted: Mask, memory: int) -> Mask:
    """Which of the counted samples (m,), but for the first few, have as many predecessors in the same stretch.

    Parameters
    ----------
    counted : (n,) which samples of a record count
    memory : how many predecessors; the first so many of the m samples are left out of what is returned

    Returns
    -------
    (m - memory,)
    """
    run = np.convolve(counted, np.ones(memory + 1, dtype=np.int64))[: counted.size]
    whole: Mask = run[counted][memory:] == memory + 1
    return whole
