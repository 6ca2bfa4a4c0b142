"""Every ride in one artefact: the window of each road, and the numbers that are taken in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pzd.artefacts import AXLE_COLUMNS, Ending, FoundRow, Response, RideRow, Rides, SpectrumRow, WheelRow
from pzd.simulate.config import SimulateConfig
from pzd.simulate.outcome import POINT, Outcome, ride_of, summary_row, wheel_rows
from pzd.simulate.plan import Case
from pzd.simulate.riding import Held
from pzd.simulate.roads.sine import Sine
from pzd.simulate.vibration import vibration
from pzd.simulate.window import Window, event_of, of_event, settled

_DEMANDED, _VOLTAGE = AXLE_COLUMNS[-2:]


def gathered(
    config: SimulateConfig,
    planned: Sequence[Case],
    outcomes: Sequence[tuple[Held, Outcome]],
    with_voltage: bool,
    responses: tuple[Response, ...],
) -> Rides:
    """The artefact of the stage.

    Parameters
    ----------
    config : the block
    planned : the cases
    outcomes : of each case, what it held constant and how it went
    with_voltage : whether the rig has a control signal
    responses : to a step of the voltage

    Returns
    -------
    histories, and a row or more of each table a case
    """
    windows: dict[str, tuple[Window, Ending]] = {}
    for road in config.roads:
        windows |= _windows(config, road.name, planned, outcomes)
    static = config.car.car().static_loads()
    rides, summary, ridden, weighted = [], [], [], []
    wheels: list[WheelRow] = []
    spectrum: list[SpectrumRow] = []
    found: list[FoundRow] = []
    for case, (held, outcome) in zip(planned, outcomes, strict=True):
        name, (window, ending) = case.name, windows[case.name]
        rides.append(ride_of(name, outcome, _left_out(case, with_voltage)))
        summary.append(summary_row(name, case.road.name, case.policy.name, case.fidelity, outcome, window))
        ridden.append(_ride_row(case, held, outcome.step, window, ending, with_voltage))
        found += _found_rows(name, held)
        wheels += wheel_rows(name, outcome, window, static)
        fundamental = case.road.frequency_Hz if isinstance(case.road, Sine) else None
        felt = vibration(name, POINT, outcome.comfort, outcome.step, window, fundamental)
        weighted.append(felt.weighted)
        spectrum += felt.spectrum
    return Rides(
        tuple(rides),
        tuple(summary),
        tuple(ridden),
        tuple(wheels),
        tuple(weighted),
        tuple(spectrum),
        responses,
        tuple(found),
    )


def _found_rows(case: str, held: Held) -> Iterator[FoundRow]:
    """The best found schedule, an interval a row, or the policy that none beats."""
    if held.found is None:
        return
    found = held.found
    intervals: list[tuple[float | None, ...]] = [(None, None, None)]
    if found.voltages:
        count = len(found.voltages[0])
        intervals = [(n / count, one, two) for n, (one, two) in enumerate(zip(*found.voltages, strict=True))]
    for share, one, two in intervals:
        yield FoundRow(
            case=case,
            found_by=found.by,
            evaluations=found.evaluations,
            most_load_N=found.most_load,
            from_share_of_period=share,
            voltage_1_V=one,
            voltage_2_V=two,
        )


def _windows(
    config: SimulateConfig, road: str, planned: Sequence[Case], outcomes: Sequence[tuple[Held, Outcome]]
) -> dict[str, tuple[Window, Ending]]:
    """The window of all rides over one road, and how the motion of each ends, by case."""
    pairs = zip(planned, outcomes, strict=True)
    mine = [(case, outcome) for case, (_, outcome) in pairs if case.road.name == road]
    if not mine:
        return {}
    case, first = mine[0]
    event = event_of(case.road, config)
    if event is None:
        window = settled(config.settle_s, first.step, len(first.comfort) - 1)
        return {case.name: (window, "end of the ride") for case, _ in mine}
    window, endings = of_event(event, first.step, [outcome.comfort for _, outcome in mine])
    return {case.name: (window, ending) for (case, _), ending in zip(mine, endings, strict=True)}


def _left_out(case: Case, with_voltage: bool) -> tuple[str, ...]:
    """Columns of the history that mean nothing in this case."""
    without = (_VOLTAGE,) if case.fidelity == "ideal" or not with_voltage else ()
    return without + ((_DEMANDED,) if case.policy.aim in ("voltage", "schedule") else ())


def _ride_row(case: Case, held: Held, step: float, window: Window, ending: Ending, with_voltage: bool) -> RideRow:
    aim = case.policy.aim
    return RideRow(
        case=case.name,
        from_s=window.first * step,
        to_s=window.last * step,
        ending=ending,
        voltage_V=held.voltage if aim == "voltage" and with_voltage else None,
        damping_Ns_per_m=held.damping if aim == "damping" else None,
    )
