"""The paper's control with the largest forces of those that make |a_K| smallest, whatever `tie_break` says."""

from pzd.simulate.policies import Policy

POLICY = Policy(
    "comfort_largest",
    "as comfort; of many such forces those of the largest Euclidean norm",
    "minimise",
    controlled=True,
    tie_break="largest",
)
