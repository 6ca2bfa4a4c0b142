"""Draws a case by either generator; its rig files go where the diagnosis looks, its truth where it does not.

The virtual rig draws a damper from everywhere, or near that of the config, and hides in it effects of the library, each
of a drawn size, or a form outside the library. Cases of the second generator are drawn by `pzd.blind.independent`, and
handed over here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from pzd.blind.case import CaseFiles, NoiseFreeRecord, Truth, write_noise_free
from pzd.blind.config import BlindConfig, TestPlan
from pzd.blind.independent.case import HiddenLaws, IndependentCase, drawn_case
from pzd.blind.independent.damper_space import elastic_levels
from pzd.blind.independent.outside import OUTSIDE
from pzd.blind.outside import FORMS, Envelope
from pzd.blind.plan import PlannedCase
from pzd.damper.compose import respond
from pzd.damper.effect import Scales, Strength
from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper, Effects
from pzd.damper.motion import Motion
from pzd.identification.prepared_record import warm_up
from pzd.quantities import DISPLACEMENT, FORCE, TEMPERATURE, TIME, VOLTAGE, Control
from pzd.record import Array
from pzd.rig.stand.config import DisplacementNoise, ForceNoise, Jitter, Noise, VirtualEntry, Warming
from pzd.rig.stand.frame import force_in_frame
from pzd.rig.stand.recording import StandRecord, run_campaign
from pzd.schema.csvfile import write_columns
from pzd.schema.validate import write_json
from pzd.signals.nuisance import NuisanceConfig

Values = dict[str, float]
"""Parameters of an effect by name."""


@dataclass(frozen=True)
class BenchmarkSetup:
    """The config that every case starts from."""

    blind: BlindConfig
    stand: VirtualEntry
    nuisance: NuisanceConfig
    """Gain, offset and delay that differ from test to test."""
    control: Control

    def campaign(self, name: str) -> TestPlan:
        """Return the campaign of that name."""
        return next(campaign for campaign in self.blind.campaigns if campaign.name == name)


@dataclass(frozen=True)
class DrawnCase:
    """A case before it is written."""

    truth: Truth
    rig_files: Sequence[Mapping[str, Array]]
    """Columns of each file, as a data logger has them."""
    noise_free: Sequence[NoiseFreeRecord]
    """In the order of the files."""


def hide(setup: BenchmarkSetup, planned: PlannedCase, files: CaseFiles) -> None:
    """Draw a case; write its rig files where the diagnosis looks, and its truth where it does not.

    Parameters
    ----------
    setup : what every case starts from
    planned : the case
    files : where they lie
    """
    draw = draw_independent_case if setup.blind.generator == "independent" else draw_case
    case = draw(setup, planned)
    rig = files.rig(planned.id)
    rig.mkdir(parents=True, exist_ok=True)
    for number, columns in enumerate(case.rig_files, start=1):
        write_columns(rig / f"r{number:02d}.csv", columns, setup.control)
    files.truth(planned.id).parent.mkdir(parents=True, exist_ok=True)
    write_json(files.truth(planned.id), case.truth, setup.control)
    write_noise_free(files.noise_free(planned.id), case.noise_free)


def _columns(
    time: Array, displacement: Array, force: Array, voltage: Array | None, temperature: Array | None
) -> dict[str, Array]:
    """Return the columns of a rig file, without the channels that the rig has not."""
    channels = {TIME: time, DISPLACEMENT: displacement, FORCE: force, VOLTAGE: voltage, TEMPERATURE: temperature}
    return {quantity.column: channel for quantity, channel in channels.items() if channel is not None}


# --- Cases of the virtual rig ---


def draw_case(setup: BenchmarkSetup, planned: PlannedCase) -> DrawnCase:
    """Draw a case of the virtual rig.

    Parameters
    ----------
    setup : what every case starts from
    planned : the case
    """
    blind, campaign = setup.blind, setup.campaign(planned.campaign)
    rng = np.random.default_rng(np.random.SeedSequence(blind.seed, spawn_key=(planned.index,)))
    stand_seed = int(rng.integers(1 << 31))
    force_noise, rho = float(rng.choice(blind.force_noise)), float(rng.choice(blind.noise_rho))
    displacement_noise = float(np.exp(rng.uniform(*np.log(blind.displacement_noise_m))))
    warms = bool(rng.random() < blind.warming_share) or planned.needs("temperature")
    wanted = {name: float(np.exp(rng.uniform(*np.log(blind.sizes)))) for name in planned.hidden}
    stand = _quiet_stand(setup, campaign, warms=warms)
    if blind.base_spread is None:
        stand = _with_any_damper(stand, stand_seed, setup.control, rng)
    else:
        stand = stand.model_copy(update={"damper": _scattered(stand.damper, blind.base_spread, rng)})
    at_rate = stand.model_copy(update={"oversampling": 1})  # sizes need no finer steps
    baseline = _noise_free(run_campaign(at_rate, stand_seed, control=setup.control))
    form: HiddenForm | None = None
    if planned.kind == "outside":
        form = HiddenForm.drawn(planned.hidden[0], wanted[planned.hidden[0]], baseline, rng)
        damper, law = stand.damper, form.law
    else:
        damper, law = with_effects(stand.damper, wanted, baseline, rng), force_in_frame
    noisy = stand.model_copy(update={"damper": damper, **_sensors(setup, force_noise, rho, displacement_noise)})
    records = list(run_campaign(noisy, stand_seed, control=setup.control, law=law))
    noise_free = _noise_free(records)
    truth = Truth(
        id=planned.id,
        seed=blind.seed,
        kind=planned.kind,
        campaign=campaign.name,
        effects=tuple(damper.effects),
        form=form.name if form else None,
        form_values=dict(form.values) if form else {},
        damper=damper,
        sizes=wanted if form else sizes(baseline, stand.damper, damper),
        force_noise=force_noise,
        noise_rho=rho,
        displacement_noise_m=displacement_noise,
        warming=warms,
        one_frequency=campaign.one_frequency,
        lowest_peak_N=min(record.peak for record in noise_free),
        visible_gap=gap_after_refit(noise_free, stand.damper),
        gap_given_other=_gaps_given_other(noise_free, damper),
    )
    rig_files = [_columns(r.time, r.displacement, r.force, r.voltage, r.temperature) for r in records]
    return DrawnCase(truth, rig_files, noise_free)


def _with_any_damper(stand: VirtualEntry, seed: int, control: Control, rng: np.random.Generator) -> VirtualEntry:
    """Return the stand with a damper from everywhere, and a load cell and a heat capacity that suit its force."""
    records = _noise_free(run_campaign(stand.model_copy(update={"oversampling": 1}), seed, control=control))
    envelope = _envelope(records)
    stroke = min(float(np.ptp(record.motion.displacement)) for record in records)
    voltages = sorted({row.voltage_V or 0.0 for row in stand.damper.base})
    drawn = elastic_levels(rng, len(voltages), envelope.speed, stroke)
    rows = [drawn[voltages.index(row.voltage_V or 0.0)] for row in stand.damper.base]
    strongest = float(np.max(drawn[:, 0] + drawn[:, 1] * envelope.speed))
    stronger = strongest / max(record.peak for record in records)
    resolution = stand.resolution.model_copy(update={"force_N": stronger * stand.resolution.force_N})
    changes: dict[str, Any] = {"damper": Damper(base=_with_values(stand.damper.base, rows)), "resolution": resolution}
    if stand.temperatures_degC:
        changes["temperatures_degC"] = tuple(
            t.model_copy(update={"heat_capacity_J_per_K": stronger * t.heat_capacity_J_per_K})
            if isinstance(t, Warming)
            else t
            for t in stand.temperatures_degC
        )
    return stand.model_copy(update=changes)


def _scattered(damper: Damper, spread: float, rng: np.random.Generator) -> Damper:
    """Scale T0, C and k of every row, half by factors of the case and half by the row's own."""
    common = rng.uniform(-0.5, 0.5, 3)
    factors = [1.0 + spread * (common + rng.uniform(-0.5, 0.5, 3)) for _ in damper.base]
    return Damper(base=_scaled_rows(damper.base, factors))


def _scaled_rows(rows: Sequence[BaseRow], factors: Iterable[Array]) -> tuple[BaseRow, ...]:
    """Return rows with T0, C and k multiplied by (3,) factors each."""
    own = (np.array([row.T0_N, row.C_Ns_per_m, row.k_N_per_m]) for row in rows)
    return _with_values(rows, [values * factor for values, factor in zip(own, factors, strict=True)])


def _with_values(rows: Sequence[BaseRow], values: Iterable[Array]) -> tuple[BaseRow, ...]:
    """Return rows with (3,) T0, C and k each."""
    return tuple(
        BaseRow(
            voltage_V=row.voltage_V,
            temperature_degC=row.temperature_degC,
            T0_N=float(T0),
            C_Ns_per_m=float(C),
            k_N_per_m=float(k),
        )
        for row, (T0, C, k) in zip(rows, values, strict=True)
    )


def _quiet_stand(setup: BenchmarkSetup, campaign: TestPlan, *, warms: bool) -> VirtualEntry:
    """Return the stand with this campaign, without noise and jitter."""
    changes = {"tests": campaign.tests, "noise": Noise(), "jitter": Jitter(), "setting": None}
    warming = {"temperatures_degC": (setup.blind.warming,)} if warms else {}
    return setup.stand.model_copy(update={**changes, **warming})


def _sensors(setup: BenchmarkSetup, share: float, rho: float, displacement_noise: float) -> dict[str, Noise | Jitter]:
    """Return noise and jitter of the case; voltage and temperature as the config's stand has them."""
    own, nuisance = setup.stand.noise, setup.nuisance
    noise = Noise(
        displacement=DisplacementNoise(sd_m=displacement_noise),
        force=ForceNoise(share_of_peak=share, rho=rho),
        voltage=own.voltage,
        temperature=own.temperature,
    )
    return {
        "noise": noise,
        "jitter": Jitter(gain=nuisance.gain, offset_of_peak=nuisance.offset, delay_s=nuisance.delay_s),
    }


def _noise_free(records: Iterable[StandRecord]) -> list[NoiseFreeRecord]:
    return [NoiseFreeRecord(record.truth, record.true_force, record.force) for record in records]


# --- The size of a hidden effect: how much it changes the force ---


_HALVINGS = 14  # of the strength: to a ten-thousandth of the most


def parameters_of_size(strength: Strength, size_at: Callable[[Values], float], wanted: float) -> Values:
    """Find the parameters at which an effect has a size, or its most where that is smaller.

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


def with_effects(
    baseline: Damper, wanted: Mapping[str, float], records: Sequence[NoiseFreeRecord], rng: np.random.Generator
) -> Damper:
    """Hide effects in a damper, each of its size where it acts alone.

    Parameters
    ----------
    baseline : the damper without
    wanted : the size of each effect by its name
    records : motions, and the force of the baseline damper
    rng : of what else there is to an effect

    Raises
    ------
    ValueError : when an effect does not say how it is hidden
    """
    scales = _scales(records, baseline)
    drifts = any(library()[name].place == "material" for name in wanted)
    temperature = records[0].motion.temperature
    reference = float(temperature[0]) if drifts and temperature is not None else None
    base = baseline.model_copy(update={"reference_temperature_degC": reference})
    effects: Effects = {}
    for name, size in wanted.items():
        hiding = library()[name].hidden
        if hiding is None:
            raise ValueError(f"{name} says not how it is hidden")
        effects[name] = {**parameters_of_size(hiding(rng, scales), partial(_size, records, base, name), size)}
    return Damper(base=baseline.base, effects=effects, reference_temperature_degC=reference)


def sizes(records: Sequence[NoiseFreeRecord], baseline: Damper, damper: Damper) -> dict[str, float]:
    """Compute how much each effect of a damper, alone, changes the force of the record that it changes most.

    Parameters
    ----------
    records : motions, and the force of the baseline damper
    baseline : without the effects
    damper : with them

    Returns
    -------
    by the effect's name: amplitude of a sine of the same r.m.s., as a share of the record's peak
    """
    base = baseline.model_copy(update={"reference_temperature_degC": damper.reference_temperature_degC})
    return {
        name: _size(records, base, name, {key: float(value) for key, value in values.items()})  # type: ignore[arg-type]  # one number each, as drawn
        for name, values in damper.effects.items()
    }


def _size(records: Sequence[NoiseFreeRecord], baseline: Damper, name: str, values: Values) -> float:
    damper = baseline.with_effect(name, values)
    return max(_change(record, baseline, damper) for record in records)


def _change(record: NoiseFreeRecord, baseline: Damper, damper: Damper) -> float:
    start = float(record.force[0])
    with_it, without = (respond(one, record.motion, start, 1e-6) for one in (damper, baseline))
    return _amplitude(with_it - without) / record.peak


def _amplitude(force: Array) -> float:
    """Return the amplitude of the sine that has the r.m.s. of a force [N]: a short spike counts as no large effect."""
    return float(np.sqrt(2.0 * np.mean(force**2)))


def _scales(records: Sequence[NoiseFreeRecord], damper: Damper) -> Scales:
    motions = [record.motion for record in records]
    voltages = np.concatenate([[0.0] if m.voltage is None else m.voltage[[0, -1]] for m in motions])
    moving = [float(np.ptp(m.voltage)) for m in motions if m.voltage is not None]
    envelope = _envelope(records)
    return Scales(
        force=max(record.peak for record in records),
        low_force=min(record.peak for record in records),
        speed=envelope.speed,
        stroke=envelope.stroke,
        acceleration=max(float(np.max(np.abs(m.acceleration))) for m in motions),
        damping=float(np.median([row.C_Ns_per_m for row in damper.base])),
        voltage=max([float(np.ptp(voltages)), *moving]),
        flow=tuple((row.T0_N, row.T0_N + row.C_Ns_per_m * envelope.speed) for row in damper.base),
    )


def _envelope(records: Sequence[NoiseFreeRecord]) -> Envelope:
    return Envelope(
        stroke=max(float(np.max(np.abs(record.motion.displacement))) for record in records),
        speed=max(float(np.max(np.abs(record.motion.velocity))) for record in records),
    )


@dataclass(frozen=True, eq=False)
class HiddenForm:
    """A form outside the library at its size."""

    name: str
    values: Mapping[str, float]
    envelope: Envelope

    @classmethod
    def drawn(cls, name: str, size: float, records: Sequence[NoiseFreeRecord], rng: np.random.Generator) -> HiddenForm:
        """Draw the parameters of a form that adds `size` of its peak to the record that it changes most."""
        form, envelope = FORMS[name], _envelope(records)
        values = {key: float(rng.uniform(*limits)) for key, limits in form.ranges.items()}
        largest = max(_amplitude(form.shape(r.motion, envelope, values)) / r.peak for r in records)
        return cls(name, {**values, "force_N": size / largest}, envelope)

    def law(self, damper: Damper, motion: Motion, frame_stiffness: float | None) -> Array:
        """Return the (n,) force of the damper and of the form in parallel [N]."""
        shape = FORMS[self.name].shape(motion, self.envelope, self.values)
        return force_in_frame(damper, motion, frame_stiffness) + self.values["force_N"] * shape


# --- The visible gap: residual of the records after T0, C and k are refitted ---


_STEP = 1e-4
_EVALUATIONS = 30


def gap_after_refit(records: Sequence[NoiseFreeRecord], damper: Damper) -> float:
    """Compute the residual of noise-free records after T0, C and k are refitted in every base row.

    Equation: min sqrt(mean ((F - F_sim) / F_peak)^2), F_peak of each record, over all samples of all records; when
    within a sample a friction turns does not count, see `NoiseFreeRecord.missed_by`

    Parameters
    ----------
    records : without noise
    damper : where the search starts; its base rows are refitted, its effects stay as they are

    Returns
    -------
    share of the peak force
    """
    from scipy.optimize import least_squares

    refits = [_Refit(record, damper) for record in records]
    start = np.array([(1.0, 0.0, 0.0) for _ in damper.base]).ravel()
    size = np.sqrt(sum(refit.size for refit in refits))

    def residuals(x: Array) -> Array:
        moved = _refitted(damper, x)
        return np.asarray(np.concatenate([refit.residuals(moved) for refit in refits]) / size)

    def slopes(x: Array) -> Array:
        return np.asarray(np.concatenate([refit.slopes(damper, x) for refit in refits]) / size)

    low = np.tile([0.0, -6.0, -3.0], len(damper.base))
    high = np.tile([np.inf, 6.0, 3.0], len(damper.base))
    found = least_squares(residuals, start, jac=slopes, bounds=(low, high), max_nfev=_EVALUATIONS, ftol=1e-6, xtol=1e-6)
    return float(np.sqrt(2.0 * found.cost))


def _refitted(damper: Damper, x: Array) -> Damper:
    """Return the damper at a point of the search: T0 as a ratio, C and k as logarithms of one, row by row."""
    factors = [np.array([friction, np.exp(C), np.exp(k)]) for friction, C, k in x.reshape(-1, 3)]
    return damper.model_copy(update={"base": _scaled_rows(damper.base, factors)})


class _Refit:
    """One record in the search, and which of the searched variables it depends on."""

    def __init__(self, record: NoiseFreeRecord, damper: Damper) -> None:
        self.record = record
        self.first = warm_up(record.motion.displacement)
        self.size = record.force.size - self.first
        voltages = [row.voltage_V for row in damper.base]
        rows, voltage = list(range(len(voltages))), record.motion.voltage
        if voltage is not None and np.ptp(voltage) == 0.0 and voltage[0] in voltages:
            rows = [i for i in rows if voltages[i] == voltage[0]]
        self.columns = [3 * i + j for i in rows for j in range(3)]

    def residuals(self, damper: Damper) -> Array:
        """Return the (m,) residual as a share of the record's peak."""
        simulated = respond(damper, self.record.motion, float(self.record.force[0]), 1e-7)
        return self.record.missed_by(simulated)[self.first :] / self.record.peak

    def slopes(self, damper: Damper, x: Array) -> Array:
        """Return (m, p) derivatives of the residual by the searched variables."""
        slopes = np.zeros((self.size, x.size))
        here = self.residuals(_refitted(damper, x))
        for column in self.columns:
            moved = x.copy()
            moved[column] += _STEP
            slopes[:, column] = (self.residuals(_refitted(damper, moved)) - here) / _STEP
        return slopes


def _gaps_given_other(records: Sequence[NoiseFreeRecord], damper: Damper) -> dict[str, float]:
    """Return for each of several effects the gap that it leaves where the others are known."""
    if len(damper.effects) < 2:
        return {}
    return {name: gap_after_refit(records, damper.without_effects(name)) for name in damper.effects}


# --- Cases of the second generator ---


def draw_independent_case(setup: BenchmarkSetup, planned: PlannedCase) -> DrawnCase:
    """Draw a case of the second generator; of the config its seed counts."""
    case = drawn_case(setup.blind.seed, planned.index, planned.campaign, planned.hidden)
    rig_files = [_columns(t.time, t.displacement, t.force, t.signal, t.temperature) for t in case.tests]
    noise_free = []
    for t in case.tests:
        # a damper whose records have no control signal has no voltage either, so that its truth has none
        signal = None if t.signal is None else t.true_signal
        kinematics = (t.true_displacement, t.true_velocity, t.true_acceleration)
        noise_free.append(
            NoiseFreeRecord(Motion(t.time, *kinematics, signal, t.true_temperature), t.true_force, t.force)
        )
    return DrawnCase(_independent_truth(case, planned, setup.blind.seed), rig_files, noise_free)


def _independent_truth(case: IndependentCase, planned: PlannedCase, seed: int) -> Truth:
    outside = planned.kind == "outside"
    form = planned.hidden[0] if outside else None
    effects: HiddenLaws = {} if outside else case.laws
    peaks = [float(np.max(np.abs(test.true_force))) for test in case.tests]
    noise = [float(np.std(np.diff(t.force - t.true_force))) / np.sqrt(2.0) for t in case.tests]
    base, controlled = case.base, len(case.base.values) > 1
    rows = tuple(
        BaseRow(voltage_V=value if controlled else None, T0_N=T0, C_Ns_per_m=C, k_N_per_m=k)
        for value, T0, C, k in zip(base.values, base.T0, base.C, base.k, strict=True)
    )
    named: Effects = {name: dict(values) for name, values in effects.items()}
    return Truth(
        id=planned.id,
        seed=seed,
        kind=planned.kind,
        campaign=planned.campaign,
        effects=tuple(effects),
        form=form,
        form_values=dict(case.laws[form]) if form else {},
        described_by=OUTSIDE[form].described_by if form else (),
        damper=Damper(base=rows, effects=named, reference_temperature_degC=case.reference_temperature),
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
