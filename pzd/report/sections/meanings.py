"""What the names of policies and fidelities stand for, and what the controllers see and set."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pzd.artefacts import SummaryRow
from pzd.report.blocks import Notes
from pzd.report.context import ReportContext
from pzd.report.wording import amount, listed
from pzd.simulate.config import SimulateConfig
from pzd.simulate.electronics import Sensors
from pzd.simulate.policies import policies

_FIDELITIES = {
    "ideal": "the demanded force is there at once",
    "table": "the voltage comes from the table of force, and the force from the voltage",
    "dynamic": "as table, with the lag of the valve and the damper's own dynamics",
}
_UNCONTROLLED_FIDELITIES = {
    "ideal": "the demanded force is there at once",
    "table": "the force is that of the table at the speed of the damper",
    "dynamic": "as table, with the damper's own dynamics",
}
"""The same of a damper without a control signal."""


def meanings(context: ReportContext, rows: Sequence[SummaryRow]) -> tuple[Notes, ...]:
    """What the names of the policies and fidelities of some rides stand for."""
    used = {row.policy for row in rows}
    as_it_is = {} if context.controlled else {"passive": "the damper as it is"}
    names = [f"{name}: {as_it_is.get(name, policy.meaning)}" for name, policy in policies().items() if name in used]
    exact = {row.fidelity for row in rows}
    fidelities = _FIDELITIES if context.controlled else _UNCONTROLLED_FIDELITIES
    names += [f"{name}: {text}" for name, text in fidelities.items() if name in exact]
    if context.controlled and exact - {"ideal"}:
        names += [*_sensors(context.simulate), *_supply(context)]
    return (Notes(tuple(names)),) if names else ()


def _sensors(config: SimulateConfig) -> Iterator[str]:
    """What the controllers see, where that is not all."""
    sensors, noise = config.sensors, config.sensors.noise
    if sensors == Sensors():
        return
    period = sensors.period_s or config.control_period_s
    told = [f"a sample every {amount(1000.0 * period, 'ms')}, {amount(1000.0 * sensors.delay_s, 'ms')} late"]
    deviations = (
        ("deflection", 1000.0 * noise.deflection_m, "mm"),
        ("its rate", noise.deflection_rate_m_per_s, "m/s"),
        ("height", 1000.0 * noise.heave_m, "mm"),
        ("pitch", 1000.0 * noise.pitch_rad, "mrad"),
        ("vertical speed", noise.heave_rate_m_per_s, "m/s"),
        ("pitch rate", 1000.0 * noise.pitch_rate_rad_per_s, "mrad/s"),
        ("acceleration", noise.acceleration_m_per_s2, "m/s2"),
    )
    noisy = [f"{name} {amount(size, unit)}" for name, size, unit in deviations if size > 0.0]
    told += [f"with noise of {listed(noisy)} r.m.s."] if noisy else []
    yield f"sensors, at table and dynamic: {' '.join(told)}"


def _supply(context: ReportContext) -> Iterator[str]:
    """What becomes of the voltage that the controllers ask for, where it is not set at once."""
    supply, unit = context.simulate.supply, context.control.unit
    told = []
    if supply.step is not None:
        told.append(f"sets values {amount(supply.step, unit)} apart")
    if supply.slew_per_s is not None:
        told.append(f"changes by {amount(supply.slew_per_s, f'{unit}/s')} at most")
    if supply.power_W is not None and supply.capacitance_F is not None:
        told.append(f"charges {amount(1e6 * supply.capacitance_F, 'uF')} with {amount(supply.power_W, 'W')}")
    if told:
        yield f"supply of an axle, at table and dynamic: {listed(told)}"
