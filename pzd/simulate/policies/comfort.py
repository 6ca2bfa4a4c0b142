"""The paper's control: the admissible forces that make |a_K| smallest, equations (10) to (12).

Where many forces do, `tie_break` of the config says which; the variants fix it, whatever the config says.
"""

from pzd.simulate.policies import Policy

POLICIES = (
    Policy("comfort", "smallest acceleration at K among the forces within reach", "minimise", controlled=True),
    Policy(
        "comfort_smallest",
        "as comfort; of many such forces those of the smallest Euclidean norm",
        "minimise",
        controlled=True,
        tie_break="smallest",
    ),
    Policy(
        "comfort_largest",
        "as comfort; of many such forces those of the largest Euclidean norm",
        "minimise",
        controlled=True,
        tie_break="largest",
    ),
    Policy(
        "comfort_least_load",
        "as comfort; of many such forces those with the least wheel loads",
        "minimise",
        controlled=True,
        tie_break="least_load",
    ),
)
