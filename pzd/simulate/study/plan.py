"""Which rides a config asks for, and which of them the rig allows."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from pzd.artefacts import Table
from pzd.record import CONSTANT_SHARE, SAME_TEMPERATURE
from pzd.schema.errors import ConfigError
from pzd.simulate.config import CarBlock, Fidelity, SimulateConfig
from pzd.simulate.policies import Policy, policies
from pzd.simulate.roads import Road
from pzd.simulate.roads.sine import Sine

# --- What the config may ask of a table: a temperature and a voltage that it covers ---


def checked_temperature(config: SimulateConfig, table: Table) -> float | None:
    """Return the temperature of the dampers [degC]: the config's, by default the lowest of the table.

    Raises
    ------
    ConfigError : when the table does not cover it
    """
    known = sorted({row.temperature_degC for row in table.force if row.temperature_degC is not None})
    asked = config.temperature_degC
    if asked is None:
        return known[0] if known else None
    if not known:
        raise ConfigError(f"simulate.temperature_degC: the table has no temperature; leave it out (got {asked:g})")
    advice = " degC; test the damper at it, or ride at a temperature that was tested"
    _check_within("temperature_degC", asked, known, SAME_TEMPERATURE, advice)
    return asked


def checked_voltage(config: SimulateConfig, table: Table) -> None:
    """Refuse a voltage of the policy `passive` that the table does not cover.

    Raises
    ------
    ConfigError : when it does not
    """
    known = sorted({row.voltage_V for row in table.force if row.voltage_V is not None})
    asked = config.passive_voltage_V
    if asked is None:
        return
    if not known:
        raise ConfigError(f"simulate.passive_voltage_V: the rig records no voltage; leave it out (got {asked:g})")
    _check_within("passive_voltage_V", asked, known, CONSTANT_SHARE * max(abs(known[0]), abs(known[-1])))


def _check_within(key: str, asked: float, known: list[float], margin: float, advice: str = "") -> None:
    """Refuse a value beyond the known ones, rising, by more than the margin within which two are one condition."""
    if not known[0] - margin <= asked <= known[-1] + margin:
        span = f"{known[0]:g}" if known[0] == known[-1] else f"{known[0]:g} to {known[-1]:g}"
        raise ConfigError(f"simulate.{key}: must lie within the table, {span}{advice} (got {asked:g})")


# --- What a ride assumes where the config does not say it: car, lag of the valve, bounds, sensors and supply ---


def assumed(config: SimulateConfig, effects: Collection[str], with_voltage: bool) -> tuple[str, ...]:
    """Return one line an assumption, each with the key that would say it; nothing where the config says all.

    Parameters
    ----------
    config : the block, as the user wrote it
    effects : of the damper
    with_voltage : whether the rig has a control signal
    """
    lines = [*_car(config.car)]
    given = config.model_fields_set
    if (
        with_voltage
        and "dynamic" in config.fidelities
        and "valve_lag" not in effects
        and "valve_response_s" not in given
    ):
        lines.append(
            f"the valve follows with a time constant of {1000.0 * config.valve_response_s:g} ms, that of the damper of "
            "Makowski and Knap 2021 (simulate.valve_response_s)"
        )
    controls = config.policies is None or any(policies()[name].controlled for name in config.policies)
    if with_voltage and controls and "ideal" in config.fidelities and not given & {"bounds", "c_min_Ns_per_m"}:
        lines.append("ideal forces are bounded by the damper's own table (simulate.bounds)")
    if with_voltage and controls and set(config.fidelities) != {"ideal"}:
        perfect = {
            "sensors": "controllers see the ride exactly and at once (simulate.sensors)",
            "supply": "the voltage that they ask for is set exactly and at once (simulate.supply)",
        }
        lines += [line for key, line in perfect.items() if key not in given]
    return tuple(lines)


_NOT_ASSUMED = ("model", "name", "unsprung_mass_kg", "tyre_stiffness_N_per_m", "tyre_damping_Ns_per_m")
"""Keys of a car that take nothing from the assumed one where they are not given: its wheels have no mass."""


def _car(block: CarBlock) -> list[str]:
    if "model" in block.model_fields_set:
        return []
    assumed_keys = [key for key in CarBlock.model_fields if key not in _NOT_ASSUMED and getattr(block, key) is None]
    car = block.car()
    if block.model_fields_set.isdisjoint(set(CarBlock.model_fields) - {"name"}):
        springs = " and ".join(f"{k / 1000.0:g}" for k in car.stiffnesses)
        return [f"the car is {block.model}: {car.mass:g} kg on springs of {springs} kN/m (simulate.car)"]
    return [f"of the car {', '.join(assumed_keys)} are those of {block.model} (simulate.car)"] if assumed_keys else []


# --- The cases ---

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
    """Return the rides, in the order of roads, policies and fidelities.

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


REALISTIC: tuple[Fidelity, ...] = ("dynamic", "table", "ideal")
"""Fidelities, the one nearest to a real car first."""


def drawn(planned: Sequence[Case]) -> frozenset[str]:
    """Return the names of the cases whose histories the report draws.

    Of each road those on the adopted damper, at the fidelity nearest to a car at which a policy controls; where none
    does, nearest of all.
    """
    names: set[str] = set()
    for road in {case.road.name for case in planned}:
        adopted = [case for case in planned if case.road.name == road and not case.plain]
        controlled = [case for case in adopted if case.policy.controlled] or adopted
        nearest = min((REALISTIC.index(case.fidelity) for case in controlled), default=0)
        names |= {case.name for case in adopted if case.fidelity == REALISTIC[nearest]}
    return frozenset(names)


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
