"""Hands a case of the second generator on to the judging: rig files, truth and noise-free records, as `hide` does."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from pzd.blind.case import Clean, Places, Truth, write_clean
from pzd.blind.config import BlindConfig
from pzd.blind.plan import Kind, PlannedCase, dealt
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.quantities import DISPLACEMENT, FORCE, TEMPERATURE, TIME, VOLTAGE
from pzd.schema.csvfile import write_columns
from pzd.schema.validate import write_json

if TYPE_CHECKING:
    from pzd.blind.hide import BenchmarkSetup
    from pzd.blind.independent.case import IndependentCase, LoggedTest


def plan_independent(config: BlindConfig) -> tuple[PlannedCase, ...]:
    """Every case of the second generator, in the order in which they are done.

    Parameters
    ----------
    config : the shares of what is hidden, and the number
    """
    from pzd.blind.independent.stand import SHARES

    return dealt(config, SHARES, hideable)


def hideable(campaign: str, kind: Kind) -> list[tuple[str, ...]]:
    """What a campaign of the second generator can hide.

    Each campaign begins at another place of the list, so that few cases hold many laws.
    """
    from pzd.blind.independent.case import DRIVE, LAWS, OUTSIDE, SEPARATE
    from pzd.blind.independent.stand import SHARES

    turn = 4 * list(SHARES).index(campaign)
    laws = [name for name in LAWS if name not in DRIVE or campaign == "moving_signal"]
    if kind == "none":
        return [()]
    choices: list[tuple[str, ...]]
    if kind == "outside":
        choices = [(name,) for name in OUTSIDE]
    elif kind == "single":
        choices = [(name,) for name in laws]
    else:
        together = [name for name in laws if name not in SEPARATE]
        choices = [(one, other) for one, other in combinations(together, 2)]
        choices.sort(key=lambda pair: (len(pair[0]) * 5 + len(pair[1]) * 3) % 11)  # mixed, and the same every time
    turn %= len(choices)
    return choices[turn:] + choices[:turn]


def hide_independent(setup: BenchmarkSetup, planned: PlannedCase, places: Places) -> None:
    """Draw a case with the second generator; write its rig files where the diagnosis looks, and its truth elsewhere.

    Parameters
    ----------
    setup : the config, of which the seed counts
    planned : the case
    places : where its files go
    """
    from pzd.blind.independent.case import drawn_case

    case = drawn_case(setup.blind.seed, planned.index, planned.campaign, planned.hidden)
    rig = places.rig(planned.id)
    rig.mkdir(parents=True, exist_ok=True)
    for number, test in enumerate(case.tests, start=1):
        columns = {TIME.column: test.time, DISPLACEMENT.column: test.displacement, FORCE.column: test.force}
        more = {VOLTAGE.column: test.signal, TEMPERATURE.column: test.temperature}
        columns |= {name: channel for name, channel in more.items() if channel is not None}
        write_columns(rig / f"r{number:02d}.csv", columns, setup.control)
    places.truth(planned.id).parent.mkdir(parents=True, exist_ok=True)
    write_json(places.truth(planned.id), truth_of(case, planned, setup.blind.seed), setup.control)
    write_clean(places.clean(planned.id), [_clean(test) for test in case.tests])


def truth_of(case: IndependentCase, planned: PlannedCase, seed: int) -> Truth:
    """The truth of a case in the form in which it is scored."""
    from pzd.blind.independent.case import described_by

    outside = planned.kind == "outside"
    peaks = [float(np.max(np.abs(test.true_force))) for test in case.tests]
    noise = [float(np.std(np.diff(t.force - t.true_force))) / np.sqrt(2.0) for t in case.tests]
    return Truth(
        id=planned.id,
        seed=seed,
        kind=planned.kind,
        campaign=planned.campaign,
        effects=() if outside else tuple(case.laws),
        form=planned.hidden[0] if outside else None,
        form_values=dict(case.laws[planned.hidden[0]]) if outside else {},
        described_by=described_by(planned.hidden[0]) if outside else (),
        damper=_damper(case, outside=outside),
        sizes={},
        force_noise=max(n / p for n, p in zip(noise, peaks, strict=True)),
        noise_rho=0.0,
        displacement_noise_m=case.chain.displacement_noise,
        warming=case.tests[0].temperature is not None,
        one_frequency=case.campaign.one_frequency,
        lowest_peak_N=min(peaks),
        visible_gap=case.visible_gap,
        gap_given_other=dict(case.gap_given_other),
    )


def _damper(case: IndependentCase, *, outside: bool) -> Damper:
    base, controlled = case.base, len(case.base.values) > 1
    rows = tuple(
        BaseRow(voltage_V=value if controlled else None, T0_N=T0, C_Ns_per_m=C, k_N_per_m=k)
        for value, T0, C, k in zip(base.values, base.T0, base.C, base.k, strict=True)
    )
    effects: dict[str, dict[str, float | tuple[float, ...]]] = (
        {} if outside else {name: dict(values) for name, values in case.laws.items()}
    )
    return Damper(base=rows, effects=effects, reference_temperature_degC=case.reference_temperature)


def _clean(test: LoggedTest) -> Clean:
    """A record without noise; its time, displacement and control signal are the true ones."""
    motion = Motion(
        test.time,
        test.true_displacement,
        test.true_velocity,
        test.true_acceleration,
        None if test.signal is None else test.true_signal,
        test.true_temperature,
    )
    return Clean(motion, test.true_force, test.force)
