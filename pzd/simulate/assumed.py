"""What a ride assumes where the config does not say it: car, lag of the valve, bounds, sensors and supply."""

from __future__ import annotations

from collections.abc import Collection

from pzd.simulate.car_block import CarBlock
from pzd.simulate.config import SimulateConfig
from pzd.simulate.policies import policies


def assumed(config: SimulateConfig, effects: Collection[str], with_voltage: bool) -> tuple[str, ...]:
    """One line an assumption, each with the key that would say it; nothing where the config says all.

    Parameters
    ----------
    config : the block, as the user wrote it
    effects : of the damper
    with_voltage : whether the rig has a control signal
    """
    lines = [*_car(config.car)]
    said = config.model_fields_set
    if (
        with_voltage
        and "dynamic" in config.fidelities
        and "valve_lag" not in effects
        and "valve_response_s" not in said
    ):
        lines.append(
            f"the valve follows with a time constant of {1000.0 * config.valve_response_s:g} ms, that of the damper of "
            "Makowski and Knap 2021 (simulate.valve_response_s)"
        )
    controls = config.policies is None or any(policies()[name].controlled for name in config.policies)
    if with_voltage and controls and "ideal" in config.fidelities and not said & {"bounds", "c_min_Ns_per_m"}:
        lines.append("ideal forces are bounded by the damper's own table (simulate.bounds)")
    if with_voltage and controls and set(config.fidelities) != {"ideal"}:
        perfect = {
            "sensors": "controllers see the ride exactly and at once (simulate.sensors)",
            "supply": "the voltage that they ask for is set exactly and at once (simulate.supply)",
        }
        lines += [line for key, line in perfect.items() if key not in said]
    return tuple(lines)


_NOT_ASSUMED = ("model", "name", "unsprung_mass_kg", "tyre_stiffness_N_per_m", "tyre_damping_Ns_per_m")
"""Keys of a car that take nothing from the assumed one where they are not given: its wheels have no mass."""


def _car(block: CarBlock) -> list[str]:
    if "model" in block.model_fields_set:
        return []
    unsaid = [key for key in CarBlock.model_fields if key not in _NOT_ASSUMED and getattr(block, key) is None]
    car = block.car()
    if block.model_fields_set.isdisjoint(set(CarBlock.model_fields) - {"name"}):
        springs = " and ".join(f"{k / 1000.0:g}" for k in car.stiffnesses)
        return [f"the car is {block.model}: {car.mass:g} kg on springs of {springs} kN/m (simulate.car)"]
    return [f"of the car {', '.join(unsaid)} are those of {block.model} (simulate.car)"] if unsaid else []
