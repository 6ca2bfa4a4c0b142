"""Draws a case: a damper near that of the config, something hidden in it, and what the stand records of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from pzd.blind.case import Clean, Places, Truth, write_clean
from pzd.blind.config import BlindConfig, TestPlan
from pzd.blind.outside import FORMS, Reached
from pzd.blind.plan import PlannedCase
from pzd.damper.compose import respond
from pzd.damper.effect import Scales, Strength
from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.identification.prepared_record import warm_up
from pzd.quantities import DISPLACEMENT, FORCE, TEMPERATURE, TIME, VOLTAGE, Control
from pzd.record import Array
from pzd.rig.stand.config import DisplacementNoise, ForceNoise, Jitter, Noise, VirtualEntry
from pzd.rig.stand.frame import force_in_frame
from pzd.rig.stand.recording import StandRecord, run_campaign
from pzd.schema.csvfile import write_columns
from pzd.schema.validate import write_json
from pzd.signals.nuisance import NuisanceConfig

# ----------------------------------------------------------------------------------------------------
# How strong a hidden effect is: found from the size that it shall have, between nothing and the most.


Values = dict[str, float]

_HALVINGS = 14  # of the strength: to a ten-thousandth of the most


def of_size(strength: Strength, size_at: Callable[[Values], float], wanted: float) -> Values:
    """The parameters at which an effect has a size, or its most where that is smaller.

    Parameters
    ----------
    strength : the parameters at each strength, see `pzd.damper.effect.Strength`
    size_at : how much an effect with these parameters changes the force; it rises with the strength
    wanted : the size
    """
    low, high = 0.0, 1.0
    if size_at(strength(high)) <= wanted:
        return strength(high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if size_at(strength(middle)) > wanted else (middle, high)
    return strength(high)


# ----------------------------------------------------------------------------------------------------
# How large what is hidden is, and the effects and forms scaled to a size.


def with_effects(
    plain: Damper, wanted: Mapping[str, float], records: Sequence[Clean], draw: np.random.Generator
) -> Damper:
    """The damper with effects, each of its size where it acts alone.

    Parameters
    ----------
    plain : the damper without
    wanted : the size of each effect by its name
    records : motions, and the force of the plain damper
    draw : where what else there is to an effect comes from
    """
    scales = _scales(records, plain)
    start = _start_temperature(records)
    drifts = any(library()[name].place == "material" for name in wanted)
    base = plain.model_copy(update={"reference_temperature_degC": start if drifts else None})
    effects: dict[str, Values] = {}
    for name, size in wanted.items():
        hiding = library()[name].hidden
        if hiding is None:
            raise ValueError(f"{name} says not how it is hidden")
        effects[name] = of_size(hiding(draw, scales), partial(_size, records, base, name), size)
    return Damper(
        base=plain.base, effects=_as_dicts(effects), reference_temperature_degC=base.reference_temperature_degC
    )


def _as_dicts(effects: Mapping[str, Values]) -> dict[str, dict[str, float | tuple[float, ...]]]:
    return {name: dict(values) for name, values in effects.items()}


def _start_temperature(records: Sequence[Clean]) -> float | None:
    temperature = records[0].motion.temperature
    return None if temperature is None else float(temperature[0])


def _size(records: Sequence[Clean], plain: Damper, name: str, values: Values) -> float:
    """How much an effect changes the force of the record that it changes most, as a share of its peak."""
    damper = plain.with_effect(name, values)
    return max(_change(record, plain, damper) for record in records)


def sizes(records: Sequence[Clean], plain: Damper, damper: Damper) -> dict[str, float]:
    """How much each effect of a damper, alone, changes the force of the record that it changes most.

    Parameters
    ----------
    records : motions, and the force of the plain damper
    plain : without the effects
    damper : with them

    Returns
    -------
    by the effect's name: amplitude of a sine of the same r.m.s., as a share of the record's peak
    """
    base = plain.model_copy(update={"reference_temperature_degC": damper.reference_temperature_degC})
    return {
        name: _size(records, base, name, {key: float(value) for key, value in values.items()})  # type: ignore[arg-type]  # one number each, as drawn
        for name, values in damper.effects.items()
    }


def _change(record: Clean, plain: Damper, damper: Damper) -> float:
    start = float(record.force[0])
    with_it, without = (respond(one, record.motion, start, 1e-6) for one in (damper, plain))
    return amplitude(with_it - without) / record.peak


def amplitude(force: Array) -> float:
    """Amplitude of the sine that has the r.m.s. of a force [N]: a short spike does not count as a large effect."""
    return float(np.sqrt(2.0 * np.mean(force**2)))


def _scales(records: Sequence[Clean], damper: Damper) -> Scales:
    motions = [record.motion for record in records]
    voltages = np.concatenate([[0.0] if m.voltage is None else m.voltage[[0, -1]] for m in motions])
    moving = [float(np.ptp(m.voltage)) for m in motions if m.voltage is not None]
    return Scales(
        force=max(record.peak for record in records),
        low_force=min(record.peak for record in records),
        speed=max(float(np.max(np.abs(m.velocity))) for m in motions),
        stroke=max(float(np.max(np.abs(m.displacement))) for m in motions),
        acceleration=max(float(np.max(np.abs(m.acceleration))) for m in motions),
        damping=float(np.median([row.C_Ns_per_m for row in damper.base])),
        voltage=max([float(np.ptp(voltages)), *moving]),
    )


@dataclass(frozen=True, eq=False)
class Outside:
    """A form outside the library at its size."""

    name: str
    values: Mapping[str, float]
    reached: Reached

    @classmethod
    def drawn(cls, name: str, size: float, records: Sequence[Clean], draw: np.random.Generator) -> Outside:
        """The form with parameters drawn, adding `size` of its peak to the record that it changes most."""
        form = FORMS[name]
        scale = Reached(
            stroke=max(float(np.max(np.abs(record.motion.displacement))) for record in records),
            speed=max(float(np.max(np.abs(record.motion.velocity))) for record in records),
        )
        values = {key: float(draw.uniform(*limits)) for key, limits in form.ranges.items()}
        largest = max(amplitude(form.shape(r.motion, scale, values)) / r.peak for r in records)
        return cls(name, {**values, "force_N": size / largest}, scale)

    def law(self, damper: Damper, motion: Motion, frame_stiffness: float | None) -> Array:
        """(n,) force of the damper and of the form beside it [N]."""
        shape = FORMS[self.name].shape(motion, self.reached, self.values)
        return force_in_frame(damper, motion, frame_stiffness) + self.values["force_N"] * shape


# ----------------------------------------------------------------------------------------------------
# The visible gap: what of a hidden effect is left once T0, C and k have taken up what they can.


_STEP = 1e-4
_EVALUATIONS = 30


def gap_after_refit(records: Sequence[Clean], damper: Damper) -> float:
    """What a damper cannot follow of noise-free records, its T0, C and k refitted in every base row.

    Equation: min sqrt(mean ((F - F_sim) / F_peak)^2), F_peak of each record, over all samples of all records

    Parameters
    ----------
    records : without noise
    damper : where the search starts; its base rows are refitted, its effects stay as they are

    Returns
    -------
    share of the peak force
    """
    from scipy.optimize import least_squares

    parts = [_Part(record, damper) for record in records]
    start = np.array([(1.0, 0.0, 0.0) for _ in damper.base]).ravel()
    size = np.sqrt(sum(part.size for part in parts))

    def residuals(x: Array) -> Array:
        rows = _rows(damper, x)
        return np.asarray(np.concatenate([part.residuals(rows) for part in parts]) / size)

    def slopes(x: Array) -> Array:
        return np.asarray(np.concatenate([part.slopes(damper, x) for part in parts]) / size)

    low = np.tile([0.0, -3.0, -3.0], len(damper.base))
    high = np.tile([np.inf, 3.0, 3.0], len(damper.base))
    found = least_squares(residuals, start, jac=slopes, bounds=(low, high), max_nfev=_EVALUATIONS, ftol=1e-6, xtol=1e-6)
    return float(np.sqrt(2.0 * found.cost))


def _rows(damper: Damper, x: Array) -> Damper:
    """The damper at a point of the search: T0 as a ratio, C and k as logarithms of one, row by row."""
    rows = tuple(
        BaseRow(
            voltage_V=row.voltage_V,
            temperature_degC=row.temperature_degC,
            T0_N=row.T0_N * float(friction),
            C_Ns_per_m=row.C_Ns_per_m * float(np.exp(damping)),
            k_N_per_m=row.k_N_per_m * float(np.exp(stiffness)),
        )
        for row, (friction, damping, stiffness) in zip(damper.base, x.reshape(-1, 3), strict=True)
    )
    return damper.model_copy(update={"base": rows})


class _Part:
    """One record in the search, and which of the searched variables it depends on."""

    def __init__(self, record: Clean, damper: Damper) -> None:
        self.record = record
        self.first = warm_up(record.motion.displacement)
        self.size = record.force.size - self.first
        voltages = [row.voltage_V for row in damper.base]
        own, voltage = list(range(len(voltages))), record.motion.voltage
        if voltage is not None and np.ptp(voltage) == 0.0 and voltage[0] in voltages:
            own = [i for i in own if voltages[i] == voltage[0]]
        self.columns = [3 * i + j for i in own for j in range(3)]

    def residuals(self, damper: Damper) -> Array:
        """(m,) what is not followed, as a share of the record's peak."""
        simulated = respond(damper, self.record.motion, float(self.record.force[0]), 1e-7)
        return np.asarray((self.record.force - simulated)[self.first :] / self.record.peak)

    def slopes(self, damper: Damper, x: Array) -> Array:
        """(m, p) derivatives of the residuals by the searched variables."""
        found = np.zeros((self.size, x.size))
        here = self.residuals(_rows(damper, x))
        for column in self.columns:
            moved = x.copy()
            moved[column] += _STEP
            found[:, column] = (self.residuals(_rows(damper, moved)) - here) / _STEP
        return found


# ----------------------------------------------------------------------------------------------------


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


def drawn(setup: BenchmarkSetup, planned: PlannedCase) -> tuple[Truth, list[StandRecord]]:
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
    records = list(run_campaign(recorded, stand_seed, control=setup.control, law=law))
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
    return _known(run_campaign(stand, seed, control=control))


def _known(records: Iterable[StandRecord]) -> list[Clean]:
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


def _channels(record: StandRecord) -> dict[str, Array | None]:
    """The columns of a rig file: what a data logger has."""
    columns = {TIME.column: record.time, DISPLACEMENT.column: record.displacement, FORCE.column: record.force}
    more = {VOLTAGE.column: record.voltage, TEMPERATURE.column: record.temperature}
    return {**columns, **{name: channel for name, channel in more.items() if channel is not None}}
