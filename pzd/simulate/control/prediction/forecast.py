"""The road ahead: known, or forecast from what has passed under the front axle; and the road that the sensors give.

Forecasts are a linear prediction of the mean speeds of the road from choice to choice, trusted as far as those before
came true. Their recent errors, the innovations, may recur: one course of the road has them added, the other subtracted.
"""

from __future__ import annotations

from pzd.compiled import compiled, inlined
from pzd.record import Array
from pzd.simulate.control.prediction.predictor import ORDER, Memory, Predictor, RoadForecast, Speed, Track
from pzd.simulate.control.sensing import HEIGHT_ERROR, RISE_ERROR, Electronics
from pzd.simulate.ride.model import RideModel, RoadCoefficients, Vehicle
from pzd.simulate.vehicle.suspension import road_at

_REMEMBERED = 0.99
"""Share of its weight that the past keeps from one choice to the next: of 10 ms each, a second counts."""
_RIDGE = 1e-4
"""Of the mean square of the speeds, added to it: a pure sine leaves most directions of the fit undetermined."""
_STILL = 1e-12
"""Mean square of the speeds below which the road is level [m2/s2]."""
_FAINT = 0.01**2 / (1.0 - _REMEMBERED)
"""Added to it as well [m2/s2]: a road that rises by 10 mm/s or less, or the noise of its sensors, teaches nothing."""


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
    plan : its moments, speeds and heights are changed; a forecast is never faster than the road was of late
    height : [m]
    """
    period = plan.settings.observation_s * plan.settings.every
    speeds, moments = plan.forecast.speeds, plan.forecast.moments
    speed = (height - speeds[Speed.LAST_HEIGHT]) / period
    for i in range(ORDER):
        for j in range(ORDER):
            moments[i, j] = _REMEMBERED * moments[i, j] + speeds[i] * speeds[j]
        moments[i, ORDER] = _REMEMBERED * moments[i, ORDER] + speeds[i] * speed
    for i in range(ORDER - 1, 0, -1):
        speeds[i] = speeds[i - 1]
    speeds[0], speeds[Speed.LAST_HEIGHT] = speed, height
    speeds[Speed.MISSED_SQUARES] = _REMEMBERED * speeds[Speed.MISSED_SQUARES] + (speed - speeds[Speed.EXPECTED]) ** 2
    speeds[Speed.SPEED_SQUARES] = _REMEMBERED * speeds[Speed.SPEED_SQUARES] + speed * speed
    speeds[Speed.TOP_SPEED] = max(_REMEMBERED * speeds[Speed.TOP_SPEED], abs(speed))
    _score_forecasts(plan, speed)
    _forecast(plan, height)


@inlined
def _score_forecasts(plan: Predictor, speed: float) -> None:
    """Compare what each choice before forecast for now with the speed that came [m/s]."""
    forecasts, skill = plan.forecast.forecasts, plan.forecast.skill
    number, count = int(plan.observed.measured[Memory.OBSERVATIONS]) // plan.settings.every, skill.shape[1]
    for n in range(count):
        then = forecasts[(number - n - 1) % count, n]
        skill[0, n] = _REMEMBERED * skill[0, n] + then * speed
        skill[1, n] = _REMEMBERED * skill[1, n] + then * then


@inlined
def _forecast(plan: Predictor, height: float) -> None:
    """Forecast speeds and heights under axle 1 [m] for the periods to come, and what they may miss."""
    forecast, elimination = plan.forecast, plan.workspace.elimination
    theta, window = elimination[ORDER], elimination[ORDER + 1]
    period, newest = plan.settings.observation_s * plan.settings.every, int(plan.observed.measured[Memory.OBSERVATIONS])
    number, count, top = newest // plan.settings.every, forecast.skill.shape[1], forecast.speeds[Speed.TOP_SPEED]
    _solve(forecast.moments, elimination, theta)
    for i in range(ORDER):
        window[i] = forecast.speeds[i]
    for n in range(count):
        following = 0.0
        for i in range(ORDER):
            following += theta[i] * window[i]
        following = min(max(following, -top), top)
        for i in range(ORDER - 1, 0, -1):
            window[i] = window[i - 1]
        window[0] = forecast.forecasts[number % count, n] = following
    forecast.speeds[Speed.EXPECTED] = _trusted(forecast, number, 0)
    for n in range(count):
        height += period * _trusted(forecast, number, n)
        forecast.heights[n] = height
    span = forecast.innovations.size
    for n in range(span):  # backwards, so that the road goes on from where it is: a random road has no direction
        forecast.deviation[n + 1] = forecast.deviation[n] + forecast.innovations[(newest - n) % span]


@inlined
def _trusted(forecast: RoadForecast, number: int, ahead: int) -> float:
    """Return the speed [m/s] that a choice forecast so many periods ahead, as far as such forecasts came true."""
    product, square = forecast.skill[0, ahead], forecast.skill[1, ahead]
    if square < _STILL:
        return 0.0
    share = min(max(product / square, 0.0), 1.0)
    return float(share * forecast.forecasts[number % forecast.skill.shape[1], ahead])


@inlined
def _solve(moments: Array, rows: Array, theta: Array) -> None:
    """Fill theta (ORDER,) by elimination in rows to work in: the matrix is positive definite, so no pivot is needed."""
    power = 0.0
    for i in range(ORDER):
        power += moments[i, i] / ORDER
        theta[i] = 0.0
        for j in range(ORDER + 1):
            rows[i, j] = moments[i, j]
    if power < _STILL:
        return
    for i in range(ORDER):
        rows[i, i] += _RIDGE * power + _FAINT
    for i in range(ORDER):
        for j in range(i + 1, ORDER):
            share = rows[j, i] / rows[i, i]
            for n in range(i, ORDER + 1):
                rows[j, n] -= share * rows[i, n]
    for i in range(ORDER - 1, -1, -1):
        theta[i] = rows[i, ORDER]
        for j in range(i + 1, ORDER):
            theta[i] -= rows[i, j] * theta[j]
        theta[i] /= rows[i, i]


@inlined
def unforeseen(plan: Predictor) -> float:
    """Return the recent mean square error of forecasts of one period, as a share of that of the road's speed."""
    missed, passed = plan.forecast.speeds[Speed.MISSED_SQUARES], plan.forecast.speeds[Speed.SPEED_SQUARES]
    return 0.0 if passed < _STILL else float(min(missed / passed, 1.0))


@compiled
def fill_forecast(plan: Predictor, course: int, start: float, delay: float, h: float, heights: Array) -> None:
    """Fill the (2, n + 1) heights under both axles [m] from `start` [s] after now on, a step h [s] apart.

    Equation: xi_2(t) = xi_1(t - (a1 + a2) / V)      Source: the rear axle meets what the front axle has met

    Parameters
    ----------
    plan : with what was observed and forecast
    course : 0 with the recent innovations added, 1 with them subtracted
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
    """Return the height under axle 1 [m] at a time [s] since now, observed or forecast, linear between."""
    newest, passed, forecast = int(plan.observed.measured[Memory.OBSERVATIONS]), plan.observed.passed, plan.forecast
    count = passed.size
    if since <= 0.0:
        place = -since / plan.settings.observation_s
        back = min(int(place), count - 2)
        share = min(place - back, 1.0)
        near, far = passed[(newest - back) % count], passed[(newest - back - 1) % count]
        return float(near + share * (far - near))
    place = since / (plan.settings.observation_s * plan.settings.every)
    cell = min(int(place), forecast.heights.size - 1)
    start = passed[newest % count] if cell == 0 else forecast.heights[cell - 1]
    mean = start + min(place - cell, 1.0) * (forecast.heights[cell] - start)
    place = since / plan.settings.observation_s
    cell = min(int(place), forecast.innovations.size - 1)
    deviation = forecast.deviation[cell] + min(place - cell, 1.0) * (
        forecast.deviation[cell + 1] - forecast.deviation[cell]
    )
    return float(mean + (1.0 - 2.0 * course) * deviation)


# --- The road under the axles as the sensors give it: each sample by a Kalman filter with the rise measured ---


@compiled
def observed_height(
    sampled: float, axle: int, model: RideModel, plan: Predictor, electronics: Electronics | None
) -> float:
    """Return the height of the road [m] under an axle, exact where no sensors are given.

    Parameters
    ----------
    sampled : when what the controller sees was [s]
    axle : which one
    model : the ride
    plan : what it tracks is changed
    electronics : with the error of this sample
    """
    road, speed = model.road_coefficients, model.car.speed
    height, slope, _ = road_at(road, speed * sampled - road.behind[axle])
    if electronics is None:
        return height
    height += electronics.road_error[HEIGHT_ERROR, axle]
    return filtered_height(
        sampled,
        height,
        speed * slope + electronics.road_error[RISE_ERROR, axle],
        electronics.road_gains[axle],
        plan.settings.observation_s,
        plan.observed.measured[Memory.OBSERVATIONS] == 0.0,
        plan.observed.tracked[axle],
    )


@compiled
def filtered_height(
    sampled: float, height: float, rise: float, gain: float, period: float, first: bool, tracked: Array
) -> float:
    """Return the height of the road [m] by a sample of height [m] and rise [m/s]; in between it goes on with the rise.

    Equation: x = x_0 + h (v_0 + v) / 2, then x + K (z - x)      Source: see `pzd.simulate.control.sensing.road_gain`
    """
    elapsed = sampled - tracked[Track.SAMPLED]
    if first:
        tracked[Track.HEIGHT] = height
    elif elapsed < 0.5 * period:
        tracked[Track.HELD_FOR] += period
        return float(tracked[Track.HEIGHT] + tracked[Track.HELD_FOR] * tracked[Track.RISE])
    else:
        tracked[Track.HEIGHT] += 0.5 * elapsed * (tracked[Track.RISE] + rise)
        tracked[Track.HEIGHT] += gain * (height - tracked[Track.HEIGHT])
    tracked[Track.RISE], tracked[Track.SAMPLED], tracked[Track.HELD_FOR] = rise, sampled, 0.0
    return float(tracked[Track.HEIGHT])
