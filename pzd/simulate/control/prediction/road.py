"""The road that is still ahead: known, or forecast from what passed under the front axle."""

from __future__ import annotations

from pzd.compiled import compiled, inlined
from pzd.record import Array
from pzd.simulate.control.prediction.plant import OBSERVATIONS, ORDER, Predictor
from pzd.simulate.control.sensing import HEIGHT_OFF, RISE_OFF, Electronics
from pzd.simulate.ride.model import RideModel, RoadCoefficients, Vehicle
from pzd.simulate.vehicle.suspension import road_at

# ----------------------------------------------------------------------------------------------------


_FORGOTTEN = 0.99
"""Share of its weight that the past keeps from one choice to the next: of 10 ms each, a second counts."""
_RIDGE = 1e-4
"""Of the mean square of the speeds, added to it: a pure sine leaves most directions of the fit undetermined."""
_STILL = 1e-12
"""Mean square of the speeds below which the road is level [m2/s2]."""
_FAINT = 0.01**2 / (1.0 - _FORGOTTEN)
"""Added to it as well [m2/s2]: a road that rises by 10 mm/s or less, or the noise of its sensors, teaches nothing."""
HEIGHT, EXPECTED, MISSED, PASSED, FASTEST = range(ORDER, ORDER + 5)
"""Places in `Predictor.speeds`."""


@compiled
def fill_known(time: float, car: Vehicle, road: RoadCoefficients, h: float, heights: Array) -> None:
    """Fill the (2, n + 1) heights under both axles [m] from a time [s] on, a step h [s] apart."""
    for i in range(2):
        for n in range(heights.shape[1]):
            heights[i, n], _, _ = road_at(road, car.speed * (time + n * h) - road.behind[i])


@compiled
def learn(plan: Predictor, height: float) -> None:
    """Learn from the height under axle 1 [m], once a choice, how the road goes on, and forecast it.

    Equation: v_(n+1) = sum_j theta_j v_(n-j), theta = (R + mu I)^-1 r, R = sum lambda^m v v^T, of mean speeds v
    Source: linear prediction, autocorrelation with exponential forgetting; Makhoul 1975, Proc. IEEE 63(4), sec. II

    Parameters
    ----------
    plan : its moments, speeds and `ahead` are changed; a forecast is never faster than the road was of late
    height : [m]
    """
    period, speeds, moments = plan.observation_s * plan.every, plan.speeds, plan.moments
    speed = (height - speeds[HEIGHT]) / period
    for i in range(ORDER):
        for j in range(ORDER):
            moments[i, j] = _FORGOTTEN * moments[i, j] + speeds[i] * speeds[j]
        moments[i, ORDER] = _FORGOTTEN * moments[i, ORDER] + speeds[i] * speed
    for i in range(ORDER - 1, 0, -1):
        speeds[i] = speeds[i - 1]
    speeds[0], speeds[HEIGHT] = speed, height
    speeds[MISSED] = _FORGOTTEN * speeds[MISSED] + (speed - speeds[EXPECTED]) ** 2
    speeds[PASSED] = _FORGOTTEN * speeds[PASSED] + speed * speed
    speeds[FASTEST] = max(_FORGOTTEN * speeds[FASTEST], abs(speed))
    _score_forecasts(plan, speed)
    _forecast(plan, height)


@inlined
def _score_forecasts(plan: Predictor, speed: float) -> None:
    """Hold what was forecast for now, by each choice before, against the speed that came [m/s]."""
    number, count = int(plan.felt[OBSERVATIONS]) // plan.every, plan.skill.shape[1]
    for n in range(count):
        then = plan.forecasts[(number - n - 1) % count, n]
        plan.skill[0, n] = _FORGOTTEN * plan.skill[0, n] + then * speed
        plan.skill[1, n] = _FORGOTTEN * plan.skill[1, n] + then * then


@inlined
def _forecast(plan: Predictor, height: float) -> None:
    """Forecast speeds and heights under axle 1 [m] for the periods to come, and what they may miss."""
    period, theta, window = plan.observation_s * plan.every, plan.rooms[ORDER], plan.rooms[ORDER + 1]
    number, count = int(plan.felt[OBSERVATIONS]) // plan.every, plan.skill.shape[1]
    fastest = plan.speeds[FASTEST]
    _solve(plan.moments, plan.rooms, theta)
    for i in range(ORDER):
        window[i] = plan.speeds[i]
    for n in range(count):
        following = 0.0
        for i in range(ORDER):
            following += theta[i] * window[i]
        following = min(max(following, -fastest), fastest)
        for i in range(ORDER - 1, 0, -1):
            window[i] = window[i - 1]
        window[0] = plan.forecasts[number % count, n] = following
    plan.speeds[EXPECTED] = _trusted(plan, number, 0)
    for n in range(count):
        height += period * _trusted(plan, number, n)
        plan.ahead[n] = height
    newest, span = int(plan.felt[OBSERVATIONS]), plan.surprises.size
    for n in range(span):  # backwards, so that the road goes on from where it is: a random road has no direction
        plan.noise[n + 1] = plan.noise[n] + plan.surprises[(newest - n) % span]


@inlined
def _trusted(plan: Predictor, number: int, ahead: int) -> float:
    """Speed [m/s] that a choice forecast for so many further periods, as far as such forecasts came true."""
    held, squares = plan.skill[0, ahead], plan.skill[1, ahead]
    if squares < _STILL:
        return 0.0
    share = min(max(held / squares, 0.0), 1.0)
    return float(share * plan.forecasts[number % plan.skill.shape[1], ahead])


@inlined
def _solve(moments: Array, room: Array, theta: Array) -> None:
    """Fill theta (ORDER,) by elimination: the matrix is positive definite, so no pivot is needed."""
    power = 0.0
    for i in range(ORDER):
        power += moments[i, i] / ORDER
        theta[i] = 0.0
        for j in range(ORDER + 1):
            room[i, j] = moments[i, j]
    if power < _STILL:
        return
    for i in range(ORDER):
        room[i, i] += _RIDGE * power + _FAINT
    _triangular(room)
    for i in range(ORDER - 1, -1, -1):
        theta[i] = room[i, ORDER]
        for j in range(i + 1, ORDER):
            theta[i] -= room[i, j] * theta[j]
        theta[i] /= room[i, i]


@inlined
def _triangular(room: Array) -> None:
    for i in range(ORDER):
        for j in range(i + 1, ORDER):
            share = room[j, i] / room[i, i]
            for n in range(i, ORDER + 1):
                room[j, n] -= share * room[i, n]


@inlined
def unforeseen(plan: Predictor) -> float:
    """Share of the mean square of the road's speed that the forecasts of one period missed of late."""
    missed, passed = plan.speeds[MISSED], plan.speeds[PASSED]
    return 0.0 if passed < _STILL else float(min(missed / passed, 1.0))


@compiled
def fill_forecast(plan: Predictor, course: int, start: float, delay: float, h: float, heights: Array) -> None:
    """Fill the (2, n + 1) heights under both axles [m] from `start` [s] after now on, a step h [s] apart.

    Equation: xi_2(t) = xi_1(t - (a1 + a2) / V)      Source: the rear axle meets what the front axle has met

    Parameters
    ----------
    plan : with what was observed and forecast
    course : 0 with what was missed of late added, 1 with it subtracted
    start : [s]
    delay : of axle 2 behind axle 1 [s]
    h : [s]
    heights : filled
    """
    for n in range(heights.shape[1]):
        heights[0, n] = _under_the_front(plan, course, start + n * h)
        heights[1, n] = _under_the_front(plan, course, start + n * h - delay)


@inlined
def _under_the_front(plan: Predictor, course: int, since: float) -> float:
    """Height under axle 1 [m] at a time [s] since now, observed or forecast, linear between."""
    newest = int(plan.felt[OBSERVATIONS])
    count = plan.past.size
    if since <= 0.0:
        place = -since / plan.observation_s
        back = min(int(place), count - 2)
        share = min(place - back, 1.0)
        near, far = plan.past[(newest - back) % count], plan.past[(newest - back - 1) % count]
        return float(near + share * (far - near))
    place = since / (plan.observation_s * plan.every)
    cell = min(int(place), plan.ahead.size - 1)
    start = plan.past[newest % count] if cell == 0 else plan.ahead[cell - 1]
    mean = start + min(place - cell, 1.0) * (plan.ahead[cell] - start)
    place = since / plan.observation_s
    cell = min(int(place), plan.surprises.size - 1)
    noise = plan.noise[cell] + min(place - cell, 1.0) * (plan.noise[cell + 1] - plan.noise[cell])
    return float(mean + (1.0 - 2.0 * course) * noise)


# ----------------------------------------------------------------------------------------------------
# Height of the road under the axles, as the sensors give it: each sample by a Kalman filter with the rise measured.


MEASURED_HEIGHT, RISE, SAMPLED, HELD = range(4)
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

    Equation: x = x_0 + h (v_0 + v) / 2, then x + K (z - x)      Source: see `pzd.simulate.control.sensing.road_gain`
    """
    elapsed = sampled - tracked[SAMPLED]
    if first:
        tracked[MEASURED_HEIGHT] = height
    elif elapsed < 0.5 * period:
        tracked[HELD] += period
        return float(tracked[MEASURED_HEIGHT] + tracked[HELD] * tracked[RISE])
    else:
        tracked[MEASURED_HEIGHT] += 0.5 * elapsed * (tracked[RISE] + rise)
        tracked[MEASURED_HEIGHT] += gain * (height - tracked[MEASURED_HEIGHT])
    tracked[RISE], tracked[SAMPLED], tracked[HELD] = rise, sampled, 0.0
    return float(tracked[MEASURED_HEIGHT])
