"""The paper's control with the smallest forces of those that make |a_K| smallest, whatever `tie_break` says."""

from pzd.simulate.policies import Policy

POLICY = Policy(
    "comfort_smallest",
    "as comfort; of many such forces those of the smallest Euclidean norm",
    "minimise",
    controlled=True,
    tie_break="smallest",
)
