"""Draws a case: a damper near that of the config, something hidden in it, and what the stand records of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.blind.case import Places, Truth
from pzd.blind.clean import Clean, write_clean
from pzd.blind.config import BlindConfig, TestPlan
from pzd.blind.plan import PlannedCase
from pzd.blind.sizes import Outside, sizes, with_effects
from pzd.blind.visible import gap_after_refit
from pzd.damper.model import BaseRow, Damper
from pzd.quantities import DISPLACEMENT, FORCE, TEMPERATURE, TIME, VOLTAGE, Control
from pzd.record import Array
from pzd.rig.stand.config import DisplacementNoise, ForceNoise, Jitter, Noise, VirtualEntry
from pzd.rig.stand.frame import force_in_frame
from pzd.rig.stand.recording import Taken, take
from pzd.schema.csvfile import write_columns
from pzd.schema.jsonfile import write_json
from pzd.signals.nuisance import NuisanceConfig


@dataclass(frozen=True)
class BenchmarkSetup:
    """What every case starts from."""

    blind: BlindConfig
    stand: VirtualEntry
    nuisance: NuisanceConfig
    """What differs from test to test."""
    control: Control

    def campaign(self, name: str) -> TestPlan:
        """The campaign of that name."""
        return next(campaign for campaign in self.blind.campaigns if campaign.name == name)


def hide(setup: BenchmarkSetup, planned: PlannedCase, places: Places) -> None:
    """Draw a case; write its rig files where the diagnosis looks, and its truth where it does not.

    Parameters
    ----------
    setup : what every case starts from
    planned : the case
    places : where its files go
    """
    truth, records = drawn(setup, planned)
    rig = places.rig(planned.id)
    rig.mkdir(parents=True, exist_ok=True)
    for number, record in enumerate(records, start=1):
        write_columns(rig / f"r{number:02d}.csv", _channels(record), setup.control)
    places.truth(planned.id).parent.mkdir(parents=True, exist_ok=True)
    write_json(places.truth(planned.id), truth, setup.control)
    write_clean(places.clean(planned.id), _known(records))


def drawn(setup: BenchmarkSetup, planned: PlannedCase) -> tuple[Truth, list[Taken]]:
    """The truth of a case, and what the data logger has of it.

    Parameters
    ----------
    setup : what every case starts from
    planned : the case
    """
    blind, campaign = setup.blind, setup.campaign(planned.campaign)
    draw = np.random.default_rng(np.random.SeedSequence(blind.seed, spawn_key=(planned.index,)))
    stand_seed = int(draw.integers(1 << 31))
    share, rho = float(draw.choice(blind.force_noise)), float(draw.choice(blind.noise_rho))
    unsteady = float(np.exp(draw.uniform(*np.log(blind.displacement_noise_m))))
    warms = bool(draw.random() < blind.warming_share) or planned.needs("temperature")
    wanted = {name: float(np.exp(draw.uniform(*np.log(blind.sizes)))) for name in planned.hidden}
    stand = _stand(setup, campaign, _scattered(setup.stand.damper, blind.base_spread, draw), warms=warms)
    plain = _clean(stand.model_copy(update={"oversampling": 1}), stand_seed, setup.control)
    if planned.kind == "outside":
        hidden = Outside.drawn(planned.hidden[0], wanted[planned.hidden[0]], plain, draw)
        damper, law = stand.damper, hidden.law
    else:
        hidden, law = None, force_in_frame
        damper = with_effects(stand.damper, wanted, plain, draw)
    recorded = stand.model_copy(update={"damper": damper, **_noise(setup, share, rho, unsteady)})
    records = list(take(recorded, stand_seed, control=setup.control, law=law))
    clean = _known(records)
    return Truth(
        id=planned.id,
        seed=blind.seed,
        kind=planned.kind,
        campaign=campaign.name,
        effects=tuple(damper.effects),
        form=hidden.name if hidden else None,
        form_values=dict(hidden.values) if hidden else {},
        damper=damper,
        sizes=sizes(plain, stand.damper, damper) if hidden is None else wanted,
        force_noise=share,
        noise_rho=rho,
        displacement_noise_m=unsteady,
        warming=warms,
        one_frequency=campaign.one_frequency,
        lowest_peak_N=min(one.peak for one in clean),
        visible_gap=gap_after_refit(clean, stand.damper),
        gap_given_other=_given_other(clean, damper),
    ), records


def _scattered(damper: Damper, spread: float, draw: np.random.Generator) -> Damper:
    """The damper with T0, C and k of every row scaled, half by factors of the case and half by the row's own."""
    common = draw.uniform(-0.5, 0.5, 3)
    rows = []
    for row in damper.base:
        friction, damping, stiffness = 1.0 + spread * (common + draw.uniform(-0.5, 0.5, 3))
        rows.append(
            BaseRow(
                voltage_V=row.voltage_V,
                temperature_degC=row.temperature_degC,
                T0_N=row.T0_N * float(friction),
                C_Ns_per_m=row.C_Ns_per_m * float(damping),
                k_N_per_m=row.k_N_per_m * float(stiffness),
            )
        )
    return Damper(base=tuple(rows))


def _stand(setup: BenchmarkSetup, campaign: TestPlan, damper: Damper, *, warms: bool) -> VirtualEntry:
    """The stand with this campaign, without noise and jitter."""
    changes = {"damper": damper, "tests": campaign.tests, "noise": Noise(), "jitter": Jitter(), "setting": None}
    warming = {"temperatures_degC": (setup.blind.warming,)} if warms else {}
    return setup.stand.model_copy(update={**changes, **warming})


def _noise(setup: BenchmarkSetup, share: float, rho: float, unsteady: float) -> dict[str, Noise | Jitter]:
    """What the sensors add in this case; voltage and temperature as the config's stand has them."""
    own, nuisance = setup.stand.noise, setup.nuisance
    noise = Noise(
        displacement=DisplacementNoise(sd_m=unsteady),
        force=ForceNoise(share_of_peak=share, rho=rho),
        voltage=own.voltage,
        temperature=own.temperature,
    )
    return {
        "noise": noise,
        "jitter": Jitter(gain=nuisance.gain, offset_of_peak=nuisance.offset, delay_s=nuisance.delay_s),
    }


def _clean(stand: VirtualEntry, seed: int, control: Control) -> list[Clean]:
    return _known(take(stand, seed, control=control))


def _known(records: Iterable[Taken]) -> list[Clean]:
    return [Clean(record.truth, record.true_force, record.force) for record in records]


def _given_other(records: Sequence[Clean], damper: Damper) -> dict[str, float]:
    """Of a pair: what is left without each when the other one stays as it is and T0, C and k are refitted."""
    if len(damper.effects) < 2:
        return {}
    rest = {
        name: {key: dict(values) for key, values in damper.effects.items() if key != name} for name in damper.effects
    }
    return {
        name: gap_after_refit(records, damper.model_copy(update={"effects": effects})) for name, effects in rest.items()
    }


def _channels(record: Taken) -> dict[str, Array | None]:
    """The columns of a rig file: what a data logger has."""
    columns = {TIME.column: record.time, DISPLACEMENT.column: record.displacement, FORCE.column: record.force}
    more = {VOLTAGE.column: record.voltage, TEMPERATURE.column: record.temperature}
    return {**columns, **{name: channel for name, channel in more.items() if channel is not None}}
