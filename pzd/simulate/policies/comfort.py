"""The paper's control: the forces within reach that make |a_K| smallest, equations (10) to (12)."""

from pzd.simulate.policies import Policy

POLICY = Policy("comfort", "smallest acceleration at K among the forces within reach", "minimise", controlled=True)
