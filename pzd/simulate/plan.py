"""Which rides a config asks for, and which of them the rig allows."""

from __future__ import annotations

from dataclasses import dataclass

from pzd.schema.errors import ConfigError
from pzd.simulate.config import Fidelity, SimulateConfig
from pzd.simulate.policies import policies
from pzd.simulate.policy import Policy
from pzd.simulate.road import Road
from pzd.simulate.roads.sine import Sine

WITH_VOLTAGE = ("constant", "best_constant_c", "passive", "best_fixed_voltage", "comfort")
WITHOUT_VOLTAGE = ("constant", "passive")
"""The policies that are ridden where the config names none."""
PLAIN_SUFFIX = "-plain"
"""Appended to the case that rides on the damper before diagnose."""


@dataclass(frozen=True)
class Case:
    """One ride to be computed."""

    road: Road
    policy: Policy
    fidelity: Fidelity
    plain: bool
    """On the damper before diagnose."""

    @property
    def name(self) -> str:
        """road-policy-fidelity, with `-plain` appended."""
        return f"{self.road.name}-{self.policy.name}-{self.fidelity}" + (PLAIN_SUFFIX if self.plain else "")


def cases(config: SimulateConfig, with_voltage: bool, changed: bool) -> tuple[Case, ...]:
    """The rides, in the order of roads, policies and fidelities.

    Without a control signal nothing can be asked of the dampers: then constant damping is ridden as
    `ideal` and the dampers as they are (`passive`) by table and dynamically.

    Parameters
    ----------
    config : the block
    with_voltage : whether the rig has a control signal
    changed : whether diagnose changed the damper, so that each ride on it has a `-plain` one beside it

    Raises
    ------
    ConfigError : when a policy is named that needs the voltage of a rig without one
    """
    known = policies()
    default = WITH_VOLTAGE if with_voltage else WITHOUT_VOLTAGE
    chosen = [known[name] for name in config.policies or default]
    if not with_voltage:
        _refuse_without_voltage(config, chosen)
    found = []
    for road in config.roads:
        for policy in chosen:
            for fidelity in config.fidelities:
                if not _possible(road, policy, fidelity, with_voltage):
                    continue
                found.append(Case(road, policy, fidelity, plain=False))
                by_table = fidelity != "ideal" or (config.coefficients is None and policy.aim != "damping")
                if changed and by_table and policy.tuned is None:
                    found.append(Case(road, policy, fidelity, plain=True))
    unridden = [policy.name for policy in chosen if not any(case.policy is policy for case in found)]
    if "best_found" in unridden:
        raise ConfigError(
            "simulate.policies: best_found repeats its voltages with the road, at the fidelity dynamic; give a road of "
            "kind sine and that fidelity, or leave it out"
        )
    if not found:
        raise ConfigError("simulate.fidelities: none of them can ride any of the policies; add table or dynamic")
    return tuple(found)


def _possible(road: Road, policy: Policy, fidelity: Fidelity, with_voltage: bool) -> bool:
    if policy.aim == "predict":  # what it predicts is the damper with its dynamics
        return fidelity == "dynamic"
    if policy.aim == "schedule":  # it repeats with the road
        return fidelity == "dynamic" and isinstance(road, Sine)
    if policy.aim == "voltage":
        return fidelity != "ideal" and (with_voltage or policy.tuned is None)
    return with_voltage or fidelity == "ideal"


def _refuse_without_voltage(config: SimulateConfig, chosen: list[Policy]) -> None:
    wrong = [
        f"simulate.policies: {policy.name} sets the voltage of the dampers, and the rig records none; "
        "map a control signal, or ride constant and passive"
        for policy in chosen
        if policy.controlled or policy.tuned in ("voltage", "schedule")
    ]
    if wrong:
        raise ConfigError(wrong)
    if config.bounds == "table":
        raise ConfigError("simulate.bounds: the rig records no voltage, so the table bounds nothing (got table)")
