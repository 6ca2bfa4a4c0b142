"""Force that a damper predicts for a record, and its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pzd.damper.compose import jump_at_reversal, respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion, parts_of_steps, steps_of_voltage
from pzd.diagnosis.cleaned_records import CleanedRecord, temperature_moves
from pzd.identification.prepared_record import in_motion
from pzd.record import Array, Mask, Record, Rows
from pzd.signals.jumps import beside_unresolved_reversals, jump_timing_error, jumps
from pzd.signals.measures import reversals
from pzd.signals.noise import harmonics_of

FEWEST_IN_HALF_CYCLE = 25
"""Fewest samples of the fastest half cycle from which a parabola between them is exact enough: 1e-4 of the force."""
PREDICTION_TOLERANCE = 1e-7
"""Tolerance of the path of the element, as a share of the force.

Reason: far below `likelihood.RESOLUTION`; see `likelihood.SIMULATION_TOLERANCE`."""

FIXED_TEMPERATURE = 0.05
"""Change of temperature over a test [K] up to which it is simulated at its median.

Reason: of 5 % a kelvin, which is much for an oil, the force changes by 0.25 % of itself, which counts as nothing."""
NEAR_STEP = 0.001
"""Time before and after a step of the voltage that is not compared [s].

Reason: two standard deviations of a test's own delay (`NuisanceConfig.delay_s`); a sample at least, over which a filter
against aliasing spreads the step of the force."""
END_SHARE = 0.02
"""Share of a record at either end that is not compared: the smoothed displacement rests on one side alone there."""


def predicted_force(damper: Damper, cleaned: CleanedRecord) -> Array:
    """Predict the (n,) force of a damper under the record's cleaned motion [N]."""
    record = cleaned.lead or cleaned.record
    return simulated_record(damper, record)[cleaned.lead_samples :]


def simulated_record(damper: Damper, record: Record) -> Array:
    """Simulate the (n,) force of a damper in the motion of a record, from its first recorded force on [N]."""
    motion, places = simulation_motion(record)
    return respond(damper, motion, float(record.force[0]), PREDICTION_TOLERANCE)[places]


def simulation_motion(record: Record) -> tuple[Motion, Rows]:
    """Return the record's motion, on a finer grid where its samples are too far apart.

    That is where no parabola goes from one to the next, and where the voltage steps between two.

    Parameters
    ----------
    record : cleaned; a temperature that hardly moves is replaced by its median

    Returns
    -------
    the motion, and (n,) which of its samples are those of the record
    """
    size = record.time.size
    half_cycle = min(np.diff(reversals(record.displacement)), default=size)
    fewest = int(np.ceil(FEWEST_IN_HALF_CYCLE / max(half_cycle, 1)))
    motion, places = Motion.of(record).finer(np.maximum(parts_of_steps(record.voltage, size), fewest))
    if motion.temperature is not None and not temperature_moves(motion.temperature, FIXED_TEMPERATURE):
        held = np.full(motion.temperature.size, np.median(motion.temperature))
        motion = replace(motion, temperature=held)
    return motion, places


def comparable_samples(cleaned: CleanedRecord) -> NDArray[np.bool_]:
    """Return (n,) whether a prediction can be compared with a sample.

    It depends neither on how the record began nor on when exactly a voltage stepped; and something moves, or has just
    come to rest.
    """
    size = cleaned.record.time.size
    if cleaned.lead is not None:
        return np.ones(size, dtype=np.bool_)
    ends = int(END_SHARE * size)
    order = np.arange(size)
    inside = (order >= ends) & (order < size - ends)
    return inside & in_motion(cleaned.record) & ~_stepping(cleaned.record)


def _stepping(record: Record) -> NDArray[np.bool_]:
    """Return (n,) whether the voltage steps shortly before or after a sample."""
    size = record.time.size
    steps = np.append(steps_of_voltage(record.voltage, size), False)
    if not steps.any():
        return steps
    width = int(np.ceil(NEAR_STEP * record.rate))
    near = np.convolve(steps, np.ones(2 * width + 2))[width : width + size]
    return np.asarray(near > 0.5)


# --- Predicted force with its uncertainty
#
# Errors in variables: what noise and resolution leave in the cleaned displacement of an average cycle repeats in every
# cycle of the prediction, and the oil stiffness turns it into force; the scatter of the force between cycles does not
# show it. So a few displacements that are as likely are simulated (Monte Carlo). A voltage that moves is known at its
# samples alone: a step falls anywhere between two of them.


BETWEEN_SAMPLES = 0.5
"""Standard deviation of the instant of the voltage [samples]."""
NEIGHBOURS = 2
"""Harmonics on either side over which the scatter of so few draws is averaged."""


@dataclass(frozen=True, eq=False)
class PredictedForce:
    """Force that a damper predicts for a record, and its uncertainty."""

    damper: Damper
    force: Array
    """(n,) [N]."""
    shared_variance: Array | float
    """(H + 1,) variance |.|^2 of the harmonics of its average cycle by what all cycles share, the errors of the
    displacement and mains in step with them [N^2]; 0 where none repeats."""
    timing: Array
    """(n, 1) change of the force by one standard deviation of the voltage's instant [N]; (n, 0) where it stands."""
    drawn: tuple[tuple[Record, Array], ...]
    """Other motions of a record that does not repeat, as likely as its own, each with its force (n,) [N]."""


def predict(damper: Damper, cleaned: CleanedRecord, delay: float) -> PredictedForce:
    """Predict the force of a damper in a record, with its uncertainty.

    Parameters
    ----------
    damper : that predicts
    cleaned : the record
    delay : standard deviation of a test's own delay [s]
    """
    force = predicted_force(damper, cleaned)
    timing = _timing(damper, cleaned, force, delay)
    if cleaned.lead is None:
        drawn = tuple((draw, simulated_record(damper, draw)) for draw in cleaned.draws[1:])
        return PredictedForce(damper, force, 0.0, timing, drawn)
    shared = displacement_variance(damper, cleaned) + cleaned.hum_variance
    return PredictedForce(damper, force, shared, timing, ())


def unresolved_turns(damper: Damper, displacement: Array, *, closed: bool = False) -> Array:
    """Return (n,) by how much the friction of a damper may be off beside a reversal that no sample resolves [N].

    A seal beside the element turns at once, however finely the motion is sampled.

    Equation: 2 T0 where the rod goes more than 2 T0/k within an interval, else 0; and the jump of the parallel forces

    Parameters
    ----------
    damper : with T0 and k at each voltage, of which the largest counts
    displacement : (n,) cleaned [m]
    closed : whether the last sample is followed by the first
    """
    travel = max(2.0 * row.T0_N / row.k_N_per_m for row in damper.base)
    turns = (2.0 * max(row.T0_N for row in damper.base), travel), (jump_at_reversal(damper), 0.0)
    off = np.zeros(displacement.size)
    for force, until_turned in turns:
        if force > 0.0:
            off += force * beside_unresolved_reversals(displacement, until_turned, closed=closed)
    return off


def drawn_calm(given: PredictedForce, calm: Mask, counted: Mask) -> list[tuple[Record, Array]]:
    """Return the forces (m,) under the other motions that a noisy displacement leaves possible [N].

    Parameters
    ----------
    given : predicted force
    calm : (n,) the samples beside no jump
    counted : (n,) which samples of the record count
    """
    return [(record, np.where(calm, force, given.force)[counted]) for record, force in given.drawn]


def _timing(damper: Damper, cleaned: CleanedRecord, force: Array, delay: float) -> Array:
    record = cleaned.record
    if cleaned.constant or record.voltage is None:
        return np.zeros((force.size, 0))
    late = replace(record, voltage=np.concatenate([record.voltage[:1], record.voltage[:-1]]))
    change = predicted_force(damper, replace(cleaned, record=late)) - force
    return np.asarray(np.hypot(BETWEEN_SAMPLES, delay * record.rate) * change[:, None])


def displacement_variance(damper: Damper, cleaned: CleanedRecord) -> Array | float:
    """Compute the variance of the harmonics of a predicted average cycle, by the uncertainty of its displacement.

    What they change beside a jump is its instant, which is left to chance, as far as it goes: what a sample earlier or
    later does not explain remains. In the mean nothing else counts, for a stuck damper keeps the offset it began with.

    Steps that err alike in n tests give n of them the same error: each counts n times, so that all of them together
    know no more than one.

    Equation: s_h^2 = n mean_j |c_h(x + e_j) - c_h(x)|^2              Source: Monte Carlo, JCGM 101:2008

    Parameters
    ----------
    damper : that predicts
    cleaned : the record

    Returns
    -------
    (H + 1,) variance |.|^2 [N^2]; 0 where nothing repeats
    """
    if not cleaned.draws:
        return 0.0
    points = cleaned.draws[0].time.size // 2
    known, *others = (simulated_record(damper, draw)[points:] for draw in cleaned.draws)
    turns = unresolved_turns(damper, cleaned.draws[0].displacement[points:], closed=True)
    calm = np.maximum(jumps(known, closed=True), turns) == 0.0
    by_timing = np.stack([jump_timing_error(other, known, closed=True) for other in others])
    left = np.stack(others) - known - np.where(calm, 0.0, by_timing)
    changes = np.fft.rfft(left, points, axis=1) / points
    # Of an uneven clock, parts of a record have not quite the same number of points a cycle.
    size = harmonics_of(cleaned.folded.shape[1]) + 1
    power = cleaned.read_alike * np.mean(np.abs(changes) ** 2, axis=0)[:size]
    beside_jumps = cleaned.read_alike * np.mean(np.mean(left * ~calm, axis=1) ** 2)
    power[0] = 0.0
    width = np.ones(2 * NEIGHBOURS + 1)
    smooth: Array = np.convolve(power, width, "same") / np.convolve(np.ones(power.size), width, "same")
    smooth[0] = beside_jumps
    return smooth
