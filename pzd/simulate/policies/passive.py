"""The dampers as they are at one voltage, without control."""

from pzd.simulate.policies import Policy

POLICY = Policy("passive", "the voltage stays where it is", "voltage")
