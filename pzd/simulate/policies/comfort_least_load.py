"""The paper's control with the least wheel loads of those that make |a_K| smallest."""

from pzd.simulate.policies import Policy

POLICY = Policy(
    "comfort_least_load",
    "as comfort; of many such forces those with the least wheel loads",
    "minimise",
    controlled=True,
    tie_break="least_load",
)
