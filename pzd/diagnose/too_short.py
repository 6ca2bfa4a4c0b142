"""What is said where the records are too short to tell a gap from noise, and what to record instead."""

from __future__ import annotations

from collections.abc import Sequence

from pzd.artefacts import Diagnosis
from pzd.diagnose.campaign import Campaign
from pzd.diagnose.data.cleaning import Prepared
from pzd.diagnose.data.split import TRAINING
from pzd.diagnose.fit.weights import FEWEST_SAMPLES, enough
from pzd.diagnose.next_test import MANY_CYCLES, Reach, one_more
from pzd.record import Mask


def too_short(campaign: Campaign) -> bool:
    """Whether nothing of what naming may see, or of what it is to be fitted to, can be weighed."""
    return not all(_any_enough(campaign.prepared, masks) for masks in (campaign.seen, campaign.in_role(TRAINING)))


def _any_enough(prepared: Sequence[Prepared], masks: Sequence[Mask]) -> bool:
    return any(enough(p, mask) for p, mask in zip(prepared, masks, strict=True))


def undecided(recorded: Sequence[Prepared], reach: Reach) -> Diagnosis:
    """The diagnosis of records that are too short: nothing is known, and a longer test is asked for.

    Parameters
    ----------
    recorded : the records of the setting, their displacement as recorded
    reach : what a test may reach
    """
    longest = max(p.record.time.size for p in recorded)
    return Diagnosis.without_effects(
        verdict="ambiguous",
        reason=(
            "the records are too short to tell noise from what is missing: too little of them repeats a cycle, and "
            f"a motion that does not repeat takes {FEWEST_SAMPLES} samples to fit, the same to choose and to hold out "
            f"(the longest record has {longest}); record {MANY_CYCLES} cycles of a test, of at least 40 samples each"
        ),
        gap=None,
        next_test=one_more(recorded, reach),
    )
