"""How much a diagnosis may simulate before it ends with what it knows: work, not time, so that a result repeats."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field


@dataclass(eq=False)
class Work:
    """What has been simulated so far, and how much may be.

    It is counted in forces at samples, whoever asks for them, and looked at only where every thread has come to rest:
    so the same input ends at the same place.
    """

    most: float = float("inf")
    """Forces that may be computed."""
    spent: int = 0
    """Forces computed."""
    ended: bool = False
    """Whether the search has been kept from a further step."""
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    def add(self, samples: int) -> None:
        """Count a simulation of so many samples."""
        with self._lock:
            self.spent += samples

    def may_go_on(self) -> bool:
        """Whether anything more is to be looked for; asked between one step of the search and the next."""
        self.ended = self.ended or self.spent >= self.most
        return not self.ended

    @property
    def words(self) -> str:
        """What a verdict says of a search that has been ended; empty for one that came to its own end."""
        if not self.ended:
            return ""
        return (
            f"; the search was ended by diagnose.most_evaluations ({self.most:.3g} forces): a larger one, or shorter "
            "records, may tell more"
        )
