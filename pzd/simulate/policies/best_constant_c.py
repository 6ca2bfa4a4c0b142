"""One damping coefficient at both axles for the whole ride, the best: what a well-chosen viscous damper could do."""

from pzd.simulate.policies.constant import feedback
from pzd.simulate.policy import Policy

POLICY = Policy(
    "best_constant_c",
    "the damping coefficient with the least a_w on this road, held",
    "damping",
    tuned="damping",
    feedback=feedback,
)
