"""The predictor of one ride: settings of the policy, the damper by levels of voltage, and empty memory."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pzd.comfort.weighting import WK, modes
from pzd.damper.compiled.columns import DRIVE, NEUTRAL, STROKE_AND_FLOW, acting
from pzd.damper.effect import ELEMENT
from pzd.record import Array, Complex
from pzd.simulate.control.prediction.plant import (
    MEAN_LOAD_1,
    MEAN_LOAD_2,
    MEMORY,
    ORDER,
    PLANT,
    Predictor,
    fill_curves,
    tabulate_flow,
)
from pzd.simulate.policies.comfort_predictive import ComfortPredictive
from pzd.simulate.ride.model import DynamicDamper
from pzd.simulate.vehicle.car import HalfCar

LEVELS = 129
"""Levels of the effective voltage: what is read at the nearest one is off by a 256th of its range at most."""
_FLOWS = 128
"""Cells of the table of flows."""
_CURVE = 400
"""Cells of the flow curve that it is read from."""
HOLD_STEP = 1e-3
"""Longest step of the plant while a voltage is held [s]: a valve of some milliseconds moves in it."""
TAIL_STEP = 2e-3
"""Longest step behind it [s]: a road of 80 Hz has six of them a wave."""
_FIXED = 5
"""Fixed voltages that ride along, evenly spaced."""
_MEMORY = 3.0
"""Time over which mean squares are taken [s]."""
_FAINT = 1e-4
"""Mean square of an acceleration from which a ride begins [(m/s2)2]."""
_SETTLED = 10.0
"""Time constants after which a valve has followed."""


def predictor_of(
    settings: ComfortPredictive,
    control_period: float,
    damper: DynamicDamper,
    car: HalfCar,
    vehicle_speed: float,
    voltages: Array,
) -> Predictor:
    """The predictor before its first observation.

    Parameters
    ----------
    settings : of the policy
    control_period : time between two observations [s]
    damper : the identified damper at the temperature of the ride
    car : the half-car
    vehicle_speed : [m/s]
    voltages : (m,) of the table, rising [V]
    """
    lowest, highest = float(voltages[0]), float(voltages[-1])
    spacing = (highest - lowest) / (LEVELS - 1) or 1.0
    hold_steps = math.ceil(settings.hold_s / HOLD_STEP * (1.0 - 1e-9))
    tail = settings.horizon_s - settings.hold_s
    tail_steps = math.ceil(tail / TAIL_STEP * (1.0 - 1e-9))
    poles, residues = modes(WK)
    steps = (control_period, settings.hold_s / hold_steps, tail / tail_steps)
    return Predictor(
        observation_s=control_period,
        every=round(settings.hold_s / control_period),
        hold_steps=hold_steps,
        tail_steps=tail_steps,
        load_weight=settings.load_weight,
        margin=settings.margin,
        courses=_courses(settings),
        forgotten=math.exp(-control_period / _MEMORY),
        known=settings.road == "known",
        settled=_SETTLED * float(damper.drive[DRIVE.index(("valve_lag", "tau"))]),
        lowest=lowest,
        spacing=spacing,
        candidates=np.linspace(lowest, highest, settings.voltages),
        tails=np.linspace(lowest, highest, settings.tails),
        steps=np.array(steps),
        residues=np.stack([residues.real, residues.imag], axis=1),
        modes=np.stack([_modes(poles, h) for h in steps]),
        chosen=np.zeros(4, dtype=np.intp),
        fixed_levels=np.repeat(np.linspace(0, LEVELS - 1, _FIXED).astype(np.intp)[:, np.newaxis], 3, axis=1),
        hold_levels=np.zeros((2, settings.voltages, 2 * hold_steps + 1), dtype=np.intp),
        tail_levels=np.zeros((2, settings.voltages * settings.tails, 2 * tail_steps + 1), dtype=np.intp),
        hold_heights=np.zeros((_courses(settings), 2, hold_steps + 1)),
        tail_heights=np.zeros((_courses(settings), 2, tail_steps + 1)),
        kept=np.zeros((2, 2, damper.drive.size)),
        **_damper_over(damper, lowest + spacing * np.arange(LEVELS, dtype=np.float64), steps),
        **_memory(settings, control_period, car, vehicle_speed),
    )


def _courses(settings: ComfortPredictive) -> int:
    return 1 if settings.road == "known" else 2


def _damper_over(damper: DynamicDamper, effective: Array, steps: tuple[float, ...]) -> dict[str, Any]:
    """What the plant reads of the damper at (l,) levels of the effective voltage [V], for every step [s]."""
    levels, rows = effective.size, _over(damper.voltages, damper.rows, effective)
    theta, edges = np.zeros((len(steps), levels)), np.zeros((levels, 2))
    reach, flows = np.zeros((len(steps), levels, 2)), np.zeros((len(steps), levels, 2, _FLOWS + 1))
    curves = np.zeros((levels, 2, _CURVE + 1))
    fill_curves(rows, curves)
    for n, h in enumerate(steps):
        tabulate_flow(rows, h, curves, theta[n], edges, reach[n], flows[n])
    stroke = {effect.name for effect in acting("stroke")}
    bent = [len(ELEMENT) + n for n, column in enumerate(STROKE_AND_FLOW) if column[0] in stroke]
    neutral = [NEUTRAL[STROKE_AND_FLOW[n - len(ELEMENT)]] for n in bent]
    return {
        "straight": bool(np.all(rows[:, bent] == neutral)),
        "theta": theta,
        "edges": edges,
        "reach": reach,
        "flows": flows,
        "rows": rows,
        "parallel": np.zeros((levels, 0)) if damper.alone else _over(damper.voltages, damper.parallel, effective),
    }


def _memory(settings: ComfortPredictive, control_period: float, car: HalfCar, vehicle_speed: float) -> dict[str, Any]:
    """What is remembered of the ride and of the road, before its first observation, and room to work in."""
    cells = math.ceil(settings.horizon_s / settings.hold_s) + 1
    observed = math.ceil(settings.horizon_s / control_period)
    faint = _FAINT * np.array([1.0, (0.5 * car.mass) ** 2, (0.5 * car.mass) ** 2])
    felt = np.zeros(MEMORY)
    felt[[MEAN_LOAD_1, MEAN_LOAD_2]] = faint[1:]
    return {
        "felt": felt,
        "past": np.zeros(math.ceil(car.wheelbase / vehicle_speed / control_period) + 3),
        "moments": np.zeros((ORDER, ORDER + 1)),
        "fixed": np.zeros((_FIXED, PLANT)),
        "fixed_means": np.tile(faint, (_FIXED, 1)),
        "met": np.zeros((2, 2)),
        "tracked": np.zeros((2, 4)),
        "speeds": np.zeros(ORDER + 5),
        "forecasts": np.zeros((cells, cells)),
        "skill": np.zeros((2, cells)),
        "surprises": np.zeros(observed),
        "noise": np.zeros(observed + 1),
        "load_weights": np.zeros(2),
        "rooms": np.zeros((ORDER + 2, ORDER + 1)),
        "ahead": np.zeros(cells),
        "states": np.zeros((2 + _courses(settings), PLANT)),
    }


def _over(nodes: Array, rows: Array, effective: Array) -> Array:
    """(l, r) rows at (l,) effective voltages [V], linear between the (m,) nodes, held beyond; infinities stand."""
    place = np.interp(effective, nodes, np.arange(nodes.size))
    below = place.astype(np.intp)
    above, share = np.minimum(below + 1, nodes.size - 1), (place - below)[:, np.newaxis]
    same = rows[below] == rows[above]
    with np.errstate(invalid="ignore"):
        return np.where(same, rows[below], rows[below] + share * (rows[above] - rows[below]))


def _modes(poles: Complex, h: float) -> Array:
    """(MODES, 6) decay of every mode over a step [s], and what the acceleration at its start and end adds.

    Equation: x(h) = e^z x(0) + h (phi_1 - phi_2) a(0) + h phi_2 a(h), z = p h, phi_k as in `pzd.damper.element`
    """
    z = poles * h
    first = np.expm1(z) / z
    second = (first - 1.0) / z
    parts = (np.exp(z), h * (first - second), h * second)
    return np.stack([part for value in parts for part in (value.real, value.imag)], axis=1)
