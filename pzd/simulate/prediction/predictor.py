"""What `comfort_predictive` knows and remembers during a ride, as numbers that the compiled loop reads."""

from __future__ import annotations

from typing import NamedTuple

from pzd.record import Array, Rows

BODY_AND_OIL = 8
"""z, phi, dz, dphi, and of one damper at each axle the elastic deflection of the oil, then the speed of its flow."""
MODES = 4
"""Pairs of poles of the weighting Wk."""
WEIGHTED, LOAD_1, LOAD_2 = range(BODY_AND_OIL + 2 * MODES, BODY_AND_OIL + 2 * MODES + 3)
WHEELS = LOAD_2 + 1
PLANT = WHEELS + 4
"""State of the plant: the above, real and imaginary part of every mode of the weighting, and what they come to:
weighted acceleration [m/s2] and dynamic load of each wheel [N]; height [m] of the wheels of both axles, then its rate
[m/s], which stay 0 where they have no mass."""
OBSERVED, HELD, TAIL = range(3)
"""Steps for which `Predictor.modes` is laid out: between two observations, while a voltage is held, behind it."""
ACCELERATION, OBSERVATIONS, MEAN_LOAD_1, MEAN_LOAD_2 = range(2 * MODES, 2 * MODES + 4)
MEMORY = 2 * MODES + 4
"""What is remembered: the modes of the weighting, the acceleration that was felt last, how often it was, and recent
mean squares of the load of each wheel."""
ORDER = 8
"""Past speeds of the road from which the next is forecast: four sines, or what a random road remembers."""


class Predictor(NamedTuple):
    """Settings, memory and room to work in of one ride; all arrays are empty for other policies."""

    observation_s: float
    """Time between two observations: the control period [s]."""
    every: int
    """Observations between two choices."""
    hold_steps: int
    tail_steps: int
    load_weight: float
    """Weight of the wheel loads."""
    forgotten: float
    """Share of a mean square that stays from one observation to the next."""
    margin: float
    """Share of its cost by which a choice must beat that of a voltage held on, on a road that cannot be forecast."""
    courses: int
    """Courses that the road may take: one that is known, or the forecast with its misses added and subtracted."""
    known: bool
    """Whether the road ahead is known."""
    settled: float
    """Time after which the valve has followed a voltage [s]."""
    lowest: float
    """Effective voltage of the first level [V]."""
    spacing: float
    """Between two levels [V]."""
    candidates: Array
    """(c,) voltages that may be held [V]."""
    tails: Array
    """(t,) voltages that may follow [V]."""
    straight: bool
    """Whether no effect of the stroke acts, so that F = k e."""
    steps: Array
    """(3,) steps of the plant [s], by what they are for, as in all that follows."""
    theta: Array
    """(3, l) share of the flow at the end in a step, at each level."""
    edges: Array
    """(l, 2) force [N] at which the flow begins, in compression and in rebound."""
    reach: Array
    """(3, l, 2) width of the table of flows above it [N]."""
    flows: Array
    """(3, l, 2, n + 1) speed of the flow [m/s], see `pzd.simulate.prediction.plant.tabulate_flow`."""
    rows: Array
    """(l, r) parameter rows of the element at each level of the effective voltage."""
    parallel: Array
    """(l, b) rows of the parallel effects."""
    residues: Array
    """(MODES, 2) of the weighting, real and imaginary part."""
    modes: Array
    """(3, MODES, 6) decay and the weights of the acceleration at both ends of a step, real and imaginary part."""
    felt: Array
    """(MEMORY,) see above."""
    chosen: Rows
    """(4,) indices of the candidates of both axles, and of their tails."""
    past: Array
    """(m,) height of the road under axle 1 at the last observations, the newest at `OBSERVATIONS` modulo m [m]."""
    moments: Array
    """(ORDER, ORDER + 1) recent mean products of the road's speeds, and of them with the next one [m2/s2]."""
    fixed: Array
    """(f, PLANT) where the ride would be, had each of f voltages been held from its start."""
    fixed_levels: Rows
    """(f, 3) its level, for one step."""
    fixed_means: Array
    """(f, 3) recent mean squares of weighted acceleration and loads in that ride."""
    met: Array
    """(2, 2) height under both axles at the last observation and now [m]."""
    tracked: Array
    """(2, 4) under each axle: height [m] and rise [m/s] of the last sample, when it was, how long it is held [s]."""
    speeds: Array
    """(ORDER + 5,) last mean speeds of the road, the newest first [m/s]; height at the last choice [m], speed
    forecast for the period that goes on [m/s], recent squares of what such forecasts missed, and of the speeds; the
    fastest of late [m/s]."""
    forecasts: Array
    """(n, n) speeds that each of the last n choices forecast for the n periods behind it, in turn [m/s]."""
    skill: Array
    """(2, n) recent mean products of what was forecast so many periods ahead with what came, and with itself."""
    surprises: Array
    """(q,) what the forecasts of one period missed of the rise between two observations, in turn [m]."""
    noise: Array
    """(q + 1,) what they missed, as one course of the road ahead; the other has it with the other sign [m]."""
    load_weights: Array
    """(2,) of the squared load of each wheel in this choice [1/kg2]."""
    rooms: Array
    """(ORDER + 2, ORDER + 1) to work in."""
    hold_levels: Rows
    """(2, c, 2 hold_steps + 1) level of the effective voltage at every half step."""
    tail_levels: Rows
    """(2, c t, 2 tail_steps + 1)"""
    hold_heights: Array
    """(s, 2, hold_steps + 1) heights of the road under both axles in every course that it may take [m]."""
    tail_heights: Array
    """(s, 2, tail_steps + 1)"""
    ahead: Array
    """(n,) forecast heights under axle 1, one a choice [m]."""
    states: Array
    """(s + 2, PLANT) now, at the end, and behind what is held in every course."""
    kept: Array
    """(2, 2, d) voltages behind each drive effect now and behind what is held, an axle each [V]."""
