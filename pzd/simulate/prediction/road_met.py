"""Height of the road under the axles, as the sensors give it: each sample by a Kalman filter with the rise measured."""

from __future__ import annotations

from pzd.compiled import compiled
from pzd.record import Array
from pzd.simulate.kinematics import road_at
from pzd.simulate.prediction.predictor import OBSERVATIONS, Predictor
from pzd.simulate.ride_model import RideModel
from pzd.simulate.sensing import HEIGHT_OFF, RISE_OFF, Electronics

HEIGHT, RISE, SAMPLED, HELD = range(4)
"""Places in `Predictor.tracked`."""


@compiled
def height_met(sampled: float, axle: int, model: RideModel, plan: Predictor, electronics: Electronics | None) -> float:
    """Height of the road [m] under an axle, exact where no sensors are given.

    Parameters
    ----------
    sampled : when what the controller sees was [s]
    axle : which one
    model : the ride
    plan : its `tracked` is changed
    electronics : with the error of this sample
    """
    road, speed = model.road_coefficients, model.car.speed
    height, slope, _ = road_at(road, speed * sampled - road.behind[axle])
    if electronics is None:
        return height
    height += electronics.road_off[HEIGHT_OFF, axle]
    return filtered_height(
        sampled,
        height,
        speed * slope + electronics.road_off[RISE_OFF, axle],
        electronics.road_gains[axle],
        plan.observation_s,
        plan.felt[OBSERVATIONS] == 0.0,
        plan.tracked[axle],
    )


@compiled
def filtered_height(
    sampled: float, height: float, rise: float, gain: float, period: float, first: bool, tracked: Array
) -> float:
    """Height of the road [m] by a sample of height [m] and rise [m/s]; between two samples it goes on with the rise.

    Equation: x = x_0 + h (v_0 + v) / 2, then x + K (z - x)      Source: see `pzd.simulate.sensing.road_gain`
    """
    elapsed = sampled - tracked[SAMPLED]
    if first:
        tracked[HEIGHT] = height
    elif elapsed < 0.5 * period:
        tracked[HELD] += period
        return float(tracked[HEIGHT] + tracked[HELD] * tracked[RISE])
    else:
        tracked[HEIGHT] += 0.5 * elapsed * (tracked[RISE] + rise)
        tracked[HEIGHT] += gain * (height - tracked[HEIGHT])
    tracked[RISE], tracked[SAMPLED], tracked[HELD] = rise, sampled, 0.0
    return float(tracked[HEIGHT])
