"""One voltage at both axles for the whole ride, the best: what a switch on the dashboard could do without control."""

from pzd.simulate.policies import Policy

POLICY = Policy("best_fixed_voltage", "the voltage with the least a_w on this road, held", "voltage", tuned="voltage")
