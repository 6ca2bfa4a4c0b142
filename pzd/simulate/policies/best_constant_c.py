"""One damping coefficient at both axles for the whole ride, the best: what a well-chosen viscous damper could do."""

from pzd.simulate.policies import Policy
from pzd.simulate.policies.constant import feedback

POLICY = Policy(
    "best_constant_c",
    "the damping coefficient with the least a_w on this road, held",
    "damping",
    tuned="damping",
    feedback=feedback,
)
