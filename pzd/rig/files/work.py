"""The work that a test does on the damper: over a whole test it is positive, or a sign is wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pzd.quantities import DISPLACEMENT, FORCE
from pzd.rig.files.channels import COMPRESSION
from pzd.rig.files.fixture import Freed
from pzd.rig.files.layout import Layout
from pzd.rig.files.splitting import Test
from pzd.signals.work import work, work_of_chance

CLEAR_OFFSET = 0.1
"""Mean force, as a share of half the force's range, from which its sign says which way the force is counted."""


def works_on_the_rig(freed: Freed) -> bool:
    """Whether the damper does work on the rig over a test.

    Not where a steady force over a net displacement does it, nor where it is so little that a damper which hardly slips
    may do it by its noise.
    """
    x, force = freed.displacement, freed.force
    chance = work_of_chance(x, force)
    return work(x, force) < -chance and work(x, force - force.mean()) < -chance


def sign_fault(test: Test, freed: Freed, layout: Layout, others: Sequence[tuple[Test, Freed]]) -> str:
    """What to do about a test over which the damper does work on the rig, and which channel is turned over.

    Parameters
    ----------
    test : the test, for its place
    freed : displacement and force of the damper, a known fixture taken out
    layout : what the config says about each quantity
    others : the tests of the rig whose work is positive
    """
    done = work(freed.displacement, freed.force)
    what = f"{test.place(0)}: the damper does work on the rig over the whole test, {done:.4g} J"
    channel, why = _by_header(test, layout) or _by_others(test, freed, others) or _by_gas(freed) or (None, "")
    sign = -next(spec.sign for spec in layout.channels if spec.quantity.name == (channel or FORCE.name))
    if channel is None:
        return f"{what}: force or displacement has the wrong sign; say sign: {{force: {sign}}}"
    return f"{what}: {channel} has the wrong sign, since {why}; say sign: {{{channel}: {sign}}}"


def _by_header(test: Test, layout: Layout) -> tuple[str, str] | None:
    for spec in layout.channels:
        if spec.quantity in (DISPLACEMENT, FORCE) and spec.sign == 1:
            heads = [head for head in test.sheet.header if head in spec.headers and COMPRESSION.search(head)]
            if heads:
                return spec.quantity.name, f"its header {heads[0]!r} counts compression positive"
    return None


def _by_others(test: Test, freed: Freed, others: Sequence[tuple[Test, Freed]]) -> tuple[str, str] | None:
    offsets = [_offset(other) for mate, other in others if mate.setting == test.setting]
    clear = [offset for offset in offsets if offset is not None]
    mine = _offset(freed)
    if mine is None or not clear or abs(np.mean(np.sign(clear))) < 1.0:
        return None
    theirs = float(np.median(clear))
    channel = FORCE.name if mine * theirs < 0.0 else DISPLACEMENT.name
    return channel, f"the mean force is {mine:+.4g} N here and {theirs:+.4g} N in the files whose work is right"


def _by_gas(freed: Freed) -> tuple[str, str] | None:
    """A gas force pushes the rod out, so it is negative at every position and less so the further the rod is out."""
    offset = _offset(freed)
    if offset is None:
        return None
    channel = FORCE.name if offset > 0.0 else DISPLACEMENT.name
    return channel, f"the mean force of {offset:+.4g} N, if it is the gas force and no tare, is negative in extension"


def _offset(freed: Freed) -> float | None:
    """The mean force where it is clearly off zero."""
    low, high = np.percentile(freed.force, (1.0, 99.0))
    middle = 0.5 * float(low + high)
    return middle if abs(middle) > CLEAR_OFFSET * 0.5 * float(high - low) else None
