"""Comparison of the adopted damper with the baseline and other models, on held-out tests and voltages."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Literal

import numpy as np

from pzd.artefacts import Diagnosed, HeldOutTest, Identified, Rig, base_of
from pzd.artefacts.diagnosis import ADOPTED, BASELINE, PeerComparison, PeerParameterRow, PeerRow, PeerSummaryRow
from pzd.damper.effect import NODE_VOLTAGES
from pzd.damper.model import Damper
from pzd.diagnosis import narx
from pzd.diagnosis.cleaned_records import CleanedRecord, clean, unsaturated_records
from pzd.diagnosis.cross_validation import Folds, assign_folds
from pzd.diagnosis.fit.prediction import comparable_samples
from pzd.diagnosis.narx import Order
from pzd.diagnosis.peers import Coefficient, Peer, PeerForm, ShapeParameter, StrokeMotion, peers
from pzd.fit.cross_validation import PredictionError, squared_sums
from pzd.fit.least_squares import minimise, minimise_from
from pzd.record import Array, Mask
from pzd.schema.errors import ConfigError, DataError

# --- Fit of a peer to tests at one voltage


DESCENTS = 3
"""Best points of the grid from which a local search starts.

Reason: time; the residual has few minima over the shape."""
RESOLUTION = 1e-6
"""Residual that says nothing of a shape, as a share of the force (r.m.s.): far below what any sensor shows."""
SHARE_AT_LIMIT = 1e-3
"""Share of the search range within which a shape parameter counts as at its limit; not tuned."""


@dataclass(frozen=True, eq=False)
class PeerData:
    """A test, and the samples of it that may be fitted."""

    motion: StrokeMotion
    force: Array
    """(n,) measured [N]."""
    fitted: Mask
    """(n,) samples to be fitted."""


@dataclass(frozen=True, eq=False)
class PeerFit:
    """A form of a peer fitted at one voltage."""

    parameters: Array
    """(p,) in the order of `Peer.parameters`."""
    error: float
    """Sum of the squared residual over the samples fitted [N^2]."""
    status: str
    """`converged`, `not converged` or `at its limit: ...`."""


def fit_peer(peer: Peer, form: PeerForm, tests: Sequence[PeerData]) -> PeerFit:
    """Fit a peer to some tests at one voltage by least squares of criterion (4).

    The coefficients are solved for at every shape; the shape is searched from the best points of a grid.

    Equation: min_s |F - Phi(s) a(s)|^2, a(s) = Phi(s)^+ F          Source: variable projection, Golub and Pereyra 1973

    Parameters
    ----------
    peer, form : model to fit
    tests : at one voltage, one or more
    """
    force = np.concatenate([test.force[test.fitted] for test in tests])
    scale = float(np.linalg.norm(force))

    def solved(shape: Array) -> tuple[Array, Array]:
        columns = np.concatenate([form.columns(test.motion, shape)[test.fitted] for test in tests])
        coefficients = np.linalg.lstsq(columns, force, rcond=None)[0]
        return coefficients, (force - columns @ coefficients) / scale

    def residual_of(searched: Array) -> Array:
        return solved(_shape(peer, searched))[1]

    starts = [_searched(peer, shape) for shape in peer.grid([test.motion for test in tests])]
    starts.sort(key=lambda start: float(np.sum(residual_of(start) ** 2)))
    low = _searched(peer, np.array([p.low for p in peer.shape]))
    high = _searched(peer, np.array([p.high for p in peer.shape]))
    resolution = RESOLUTION / np.sqrt(force.size)
    best = minimise_from(
        starts[:DESCENTS], lambda start: minimise(residual_of, start, bounds=(low, high), resolution=resolution)
    )
    shape = _shape(peer, best.x)
    coefficients, residual = solved(shape)
    inside = np.minimum(best.x - low, high - best.x) > SHARE_AT_LIMIT * (high - low)
    limited = [p.name for p, free in zip(peer.shape, inside, strict=True) if not free]
    status = f"at its limit: {', '.join(limited)}" if limited else "converged" if best.converged else "not converged"
    return PeerFit(np.concatenate([coefficients, shape]), float(residual @ residual) * scale**2, status)


def between_voltages(fits: Mapping[float, PeerFit], voltage: float) -> Array:
    """Interpolate the (p,) parameters at a voltage [V] linearly, constant beyond the fitted voltages.

    Parameters
    ----------
    fits : one or more, by voltage [V]
    voltage : of the predicted test [V]
    """
    nodes = sorted(fits)
    values = np.array([fits[node].parameters for node in nodes])
    return np.array([np.interp(voltage, nodes, column) for column in values.T])


def _searched(peer: Peer, shape: Array) -> Array:
    """Transform (s,) shape parameters to search variables."""
    return np.array([np.log(v) if p.logarithmic else v for p, v in zip(peer.shape, shape, strict=True)])


def _shape(peer: Peer, searched: Array) -> Array:
    """Transform search variables to (s,) shape parameters, clipped to their limits."""
    return np.array([_value(p, v) for p, v in zip(peer.shape, searched, strict=True)])


def _value(parameter: ShapeParameter, searched: float) -> float:
    value = float(np.exp(searched)) if parameter.logarithmic else searched
    return min(max(value, parameter.low), parameter.high)


# --- Prediction errors of peers on the tests and voltages that diagnose holds out
#
# Peers get what diagnose gets: the same cleaned motion, the same samples, the same folds; nothing is fitted to a
# held-out test.


Predictor = Callable[[int, int], Array]
"""Gives the force (n,) of a fitted model [N] on a record of a group, both by number."""
Fitter = Callable[[int | None, Sequence[int]], Predictor]
"""Fits a model to the tests of some groups, less a fold or none of them."""


@dataclass(frozen=True, eq=False)
class HeldOutTests:
    """The tests of one setting at constant voltage, in the folds of the cross-validation."""

    cleaned: tuple[CleanedRecord, ...]
    folds: Folds
    _fits: dict[tuple[str, str, int, tuple[bytes, ...]], PeerFit] = field(default_factory=dict, repr=False)

    @property
    def groups(self) -> list[tuple[float, tuple[int, ...]]]:
        """Voltage [V] and records of each group at a constant voltage, lowest first."""
        found = zip(self.folds.voltages, self.folds.groups, strict=True)
        return sorted((voltage, group) for voltage, group in found if voltage is not None)

    @property
    def moving(self) -> list[str]:
        """Names of the records whose voltage moves."""
        found = zip(self.folds.voltages, self.folds.groups, strict=True)
        return [self.cleaned[i].record.name for voltage, group in found if voltage is None for i in group]

    @property
    def all_samples(self) -> tuple[Mask, ...]:
        """Masks (n,), one per record, of every sample."""
        return tuple(~mask for mask in self.folds.no_samples)

    def fitted(self, peer: Peer, form: PeerForm, group: int, held_out: Sequence[Mask]) -> PeerFit:
        """Fit a form of a peer at one voltage to all but the held-out samples; the result is cached."""
        _, members = self.groups[group]
        key = peer.name, form.label, group, tuple(held_out[i].tobytes() for i in members)
        if key not in self._fits:
            tests = [self._data(i, ~held_out[i]) for i in members]
            self._fits[key] = fit_peer(peer, form, [test for test in tests if test.fitted.any()])
        return self._fits[key]

    def _data(self, i: int, fitted: Mask) -> PeerData:
        p = self.cleaned[i]
        return PeerData(StrokeMotion.of(p), p.record.force, fitted & comparable_samples(p))

    def best_form(
        self, peer: Peer, held_out: Sequence[Mask], groups: Iterable[int]
    ) -> tuple[PeerForm, dict[float, PeerFit]]:
        """Return the form of a peer with the least error over some voltages, and its fits by voltage [V]."""
        wanted = list(groups)
        fits = {f: {self.groups[g][0]: self.fitted(peer, f, g, held_out) for g in wanted} for f in peer.forms}
        form = min(fits, key=lambda form: sum(fit.error for fit in fits[form].values()))
        return form, fits[form]

    def law(self, peer: Peer) -> Fitter:
        """Return how a peer is fitted: at each voltage by itself, its parameters interpolated in between."""

        def fitter(fold: int | None, groups: Sequence[int]) -> Predictor:
            form, fits = self.best_form(peer, self.folds.no_samples if fold is None else self.folds.folds[fold], groups)

            def predictor(group: int, i: int) -> Array:
                parameters = between_voltages(fits, self.groups[group][0])
                return peer.force(form, StrokeMotion.of(self.cleaned[i]), parameters)

            return predictor

        return fitter

    def held_out_error(self, fitter: Fitter) -> PredictionError:
        """Compute the held-out prediction error of a model, refitted without each fold."""
        every = range(len(self.groups))
        found = []
        for number, fold in enumerate(self.folds.folds):
            predictor = fitter(number, every)
            found += [self._predicted_error(predictor, group, fold) for group in every]
        return PredictionError.concatenated(found)

    def interpolation_error(self, fitter: Fitter, group: int) -> PredictionError:
        """Compute the prediction error at a voltage of a model that was fitted to the others."""
        predictor = fitter(None, [g for g in range(len(self.groups)) if g != group])
        return self._predicted_error(predictor, group, self.all_samples)

    def known_error(self, figures: Mapping[int, float]) -> PredictionError:
        """Return the held-out error of a model whose W_s of each record is known."""
        return PredictionError.concatenated([self._known_error(fold, figures) for fold in self.folds.folds])

    def known_interpolation_error(self, group: int, figure: float) -> PredictionError:
        """Return the error at a left-out voltage of a model whose W_s there is known."""
        return self._known_error(self.all_samples, dict.fromkeys(self.groups[group][1], figure))

    def _known_error(self, held_out: Sequence[Mask], figures: Mapping[int, float]) -> PredictionError:
        bare = self.error(held_out, figures, lambda i: np.zeros(held_out[i].size))
        return replace(bare, error=np.array([figures[i] for i in bare.records]) * bare.energy)

    def _predicted_error(self, predictor: Predictor, group: int, held_out: Sequence[Mask]) -> PredictionError:
        return self.error(held_out, self.groups[group][1], lambda i: predictor(group, i))

    def error(
        self, held_out: Sequence[Mask], members: Iterable[int], predicted: Callable[[int], Array]
    ) -> PredictionError:
        """Compute the error of predicted forces (n,) on the held-out samples of some records."""
        records, entries = list[int](), list[tuple[float, ...]]()
        for i in members:
            kept = held_out[i] & comparable_samples(self.cleaned[i])
            force = self.cleaned[i].record.force[kept]
            if force.any():
                records.append(i)
                entries.append((*squared_sums(force, force - predicted(i)[kept]), 0.0))
        return PredictionError.of_entries(records, entries)


# --- The black box: its order is chosen by tests that were fitted


UNSTABLE = "unstable in free run"
"""Status of a fit of which the free run grows without end."""


@dataclass(frozen=True, eq=False)
class BlackBox:
    """The NARX models of some tests: fitted at each voltage by itself, of one order, chosen by cross-validation."""

    tests: HeldOutTests
    unstable: set[str] = field(default_factory=set)
    """Names of the held-out tests that an unstable model predicted."""
    _factors: dict[tuple[Order, int, int], Array] = field(default_factory=dict, repr=False)
    """Triangular factors by order, group and fold."""
    _fits: dict[tuple[Order, int, tuple[int, ...]], PeerFit] = field(default_factory=dict, repr=False)
    """Fits by order, group and folds: of all folds but two, either is predicted."""

    def __call__(self, fold: int | None, groups: Sequence[int]) -> Predictor:
        """Fit the model of the best order to the tests of some groups, less a fold; see `Fitter`."""
        order, fits = self.best_order(fold, groups)
        nodes = sorted(fits)

        def predictor(group: int, i: int) -> Array:
            weights = (np.interp(self.tests.groups[group][0], nodes, one) for one in np.eye(len(nodes)))
            force = np.zeros(self.tests.cleaned[i].record.time.size)
            for node, weight in zip(nodes, weights, strict=True):
                if weight > 0.0:
                    force += weight * self._free_run(order, fits[node].parameters, i)
                    if fits[node].status == UNSTABLE:
                        self.unstable.add(self.tests.cleaned[i].record.name)
            return force

        return predictor

    def best_order(self, fold: int | None, groups: Sequence[int]) -> tuple[Order, dict[float, PeerFit]]:
        """Return the order that predicts the tests of some groups best, less a fold, and its fits by voltage [V].

        Each of the other folds is predicted in free run by a fit without it: the fold itself has no part in the choice.
        """
        folds = tuple(k for k in range(len(self.tests.folds.folds)) if k != fold)
        order = min(self._orders, key=lambda order: self._error_within(order, folds, groups))
        return order, {self.tests.groups[group][0]: self._fit(order, group, folds) for group in groups}

    @cached_property
    def _orders(self) -> list[Order]:
        members = [i for _, group in self.tests.groups for i in group]
        return narx.orders([StrokeMotion.of(self.tests.cleaned[i]) for i in members])

    @cached_property
    def _bound(self) -> float:
        forces = (self.tests.cleaned[i].record.force for _, group in self.tests.groups for i in group)
        return narx.BOUND * max(float(np.max(np.abs(force))) for force in forces)

    def _error_within(self, order: Order, folds: tuple[int, ...], groups: Sequence[int]) -> float:
        """Compute W_s on each fold by fits to the others; where there is one alone, by a fit to itself."""
        found = []
        for fold in folds:
            others = tuple(k for k in folds if k != fold) or folds
            for group in groups:
                coefficients = self._fit(order, group, others).parameters
                found.append(
                    self.tests.error(
                        self.tests.folds.folds[fold],
                        self.tests.groups[group][1],
                        partial(self._free_run, order, coefficients),
                    )
                )
        return PredictionError.concatenated(found).criterion or 0.0

    def _free_run(self, order: Order, coefficients: Array, i: int) -> Array:
        p = self.tests.cleaned[i]
        return narx.free_run(order, coefficients, StrokeMotion.of(p), float(p.record.force[0]), self._bound)

    def _fit(self, order: Order, group: int, folds: tuple[int, ...]) -> PeerFit:
        key = order, group, folds
        if key not in self._fits:
            coefficients, error = narx.fit(narx.joined(self._factor(order, group, fold) for fold in folds))
            status = "stable" if narx.is_stable(order, coefficients) else UNSTABLE
            self._fits[key] = PeerFit(coefficients, error, status)
        return self._fits[key]

    def _factor(self, order: Order, group: int, fold: int) -> Array:
        key = order, group, fold
        if key not in self._factors:
            factors = []
            for i in self.tests.groups[group][1]:
                p = self.tests.cleaned[i]
                fitted = self.tests.folds.folds[fold][i] & comparable_samples(p)
                factors.append(narx.triangle(order, StrokeMotion.of(p), p.record.force, fitted))
            self._factors[key] = narx.joined(factors)
        return self._factors[key]


# --- The comparison as tables


def compare_with_peers(rig: Rig, identified: Identified, diagnosed: Diagnosed, setting: str | None) -> PeerComparison:
    """Compare the adopted damper with the baseline and every peer, on held-out tests and voltages.

    Parameters
    ----------
    rig, identified, diagnosed : results of the stages
    setting : of the rig's settings, the one in use

    Raises
    ------
    ConfigError : when the element follows the knee law, beside which no peer is fitted
    DataError : when there is too little to hold a test out at a constant voltage
    """
    if identified.knees.law_of(setting) == "knee":
        raise ConfigError(
            "identify.law: peers are compared with Bingham's law and what diagnose finds beside it, and not with the "
            "knee law; 2-identify/kept_back.csv has what both laws predict; say bingham"
        )
    prediction = diagnosed.diagnosis.prediction
    controlled = any(row.voltage_V is not None for row in identified.rows if row.setting == setting)
    if prediction is None or (controlled and all(each.voltage is None for each in prediction.by)):
        raise DataError(
            "pzd peers: too little to keep a test back at a constant control signal; record two or more at each"
        )
    cleaned = clean(unsaturated_records(rig, setting)[0])
    tests = HeldOutTests(cleaned, assign_folds(cleaned, base_of(identified.rows, setting)))
    black_box = BlackBox(tests)
    fitters: dict[str, Fitter] = {**{name: tests.law(peer) for name, peer in peers().items()}, narx.NAME: black_box}
    by_record = _by_record(tests, prediction.by)
    held_out = {
        BASELINE: tests.known_error({i: each.W_s_plain for i, each in by_record.items()}),
        ADOPTED: tests.known_error({i: each.W_s for i, each in by_record.items()}),
        **{name: tests.held_out_error(fitter).of_records(tuple(by_record)) for name, fitter in fitters.items()},
    }
    left_out = {}
    known = {each.voltage: each for each in prediction.left_out_voltages}
    for group, (voltage, _) in enumerate(tests.groups):
        if voltage in known:
            left_out[voltage] = {
                BASELINE: tests.known_interpolation_error(group, known[voltage].W_s_plain),
                ADOPTED: tests.known_interpolation_error(group, known[voltage].W_s),
                **{name: tests.interpolation_error(fitter, group) for name, fitter in fitters.items()},
            }
    parameters = tuple(_parameter_rows(tests, black_box, setting, controlled=controlled))
    counts = {
        BASELINE: _count(diagnosed.baseline),
        ADOPTED: _count(diagnosed.damper),
        **{name: sum(row.model == name for row in parameters) for name in fitters},
    }
    return PeerComparison(
        tuple(held_out),
        tuple(_rows(tests, held_out, left_out, setting, controlled=controlled)),
        tuple(_summary_row(model, setting, counts[model], held_out, left_out) for model in held_out),
        parameters,
        tuple(tests.moving),
        tuple(sorted(black_box.unstable)),
    )


def _rows(
    tests: HeldOutTests,
    held_out: Mapping[str, PredictionError],
    left_out: Mapping[float, Mapping[str, PredictionError]],
    setting: str | None,
    *,
    controlled: bool,
) -> Iterator[PeerRow]:
    """Yield the errors test by test, by voltage, in total, and at left-out voltages."""

    def rows(
        kept_back: Literal["test", "voltage"],
        voltage: float | None,
        record: str | None,
        errors: Mapping[str, PredictionError],
    ) -> Iterator[PeerRow]:
        """Yield one row per model that predicts anything."""
        for model, each in errors.items():
            if each.criterion is not None:
                yield PeerRow(
                    setting=setting,
                    voltage_V=voltage if controlled else None,
                    kept_back=kept_back,
                    record=record,
                    model=model,
                    W_s=each.criterion,
                    R2=each.determination,
                )

    for voltage, group in tests.groups:
        for i in group:
            errors = {model: each.of_records([i]) for model, each in held_out.items()}
            yield from rows("test", voltage, tests.cleaned[i].record.name, errors)
    for voltage, group in tests.groups if controlled else ():
        yield from rows("test", voltage, None, {model: each.of_records(group) for model, each in held_out.items()})
    yield from rows("test", None, None, held_out)
    for voltage, errors_there in left_out.items():
        yield from rows("voltage", voltage, None, errors_there)


def _summary_row(
    model: str,
    setting: str | None,
    count: int,
    held_out: Mapping[str, PredictionError],
    left_out: Mapping[float, Mapping[str, PredictionError]],
) -> PeerSummaryRow:
    error = held_out[model]
    between = PredictionError.concatenated([errors[model] for errors in left_out.values()])
    return PeerSummaryRow(
        setting=setting,
        model=model,
        parameters=count,
        tests=len(set(error.records)),
        W_s=error.criterion,
        R2=error.determination,
        left_out=len(left_out),
        W_s_left_out=between.criterion,
        R2_left_out=between.determination,
    )


def _parameter_rows(
    tests: HeldOutTests, black_box: BlackBox, setting: str | None, *, controlled: bool
) -> Iterator[PeerParameterRow]:
    """Yield the parameters of every model that was fitted here to all tests."""
    every = range(len(tests.groups))
    for peer in peers().values():
        form, fits = tests.best_form(peer, tests.folds.no_samples, every)
        yield from _of_model(peer.name, form.label, peer.parameters, fits, setting, controlled=controlled)
    order, fits = black_box.best_order(None, every)
    yield from _of_model(narx.NAME, order.label, order.coefficients, fits, setting, controlled=controlled)


def _of_model(
    model: str,
    form: str,
    parameters: Sequence[Coefficient | ShapeParameter],
    fits: Mapping[float, PeerFit],
    setting: str | None,
    *,
    controlled: bool,
) -> Iterator[PeerParameterRow]:
    for voltage, fit in fits.items():
        for parameter, value in zip(parameters, fit.parameters, strict=True):
            yield PeerParameterRow(
                setting=setting,
                voltage_V=voltage if controlled else None,
                model=model,
                form=form,
                parameter=parameter.name,
                value=float(value),
                unit=parameter.unit,
                status=fit.status,
            )


def _count(damper: Damper) -> int:
    """Return how many numbers a damper has: T0, C and k of each condition, and the parameters of its effects."""
    effects = (v for values in damper.effects.values() for name, v in values.items() if name != NODE_VOLTAGES)
    return 3 * len(damper.base) + sum(len(value) if isinstance(value, tuple) else 1 for value in effects)


def _by_record(tests: HeldOutTests, by: Sequence[HeldOutTest]) -> dict[int, HeldOutTest]:
    """Assign the figures of diagnosis.json to records of constant voltage; tests of one name come in its order."""
    waiting: dict[str, list[HeldOutTest]] = {}
    for each in by:
        waiting.setdefault(each.record, []).append(each)
    found = {}
    for voltage, group in zip(tests.folds.voltages, tests.folds.groups, strict=True):
        for i in group:
            mine = waiting.get(tests.cleaned[i].record.name, [])
            if mine:
                each = mine.pop(0)
                if voltage is not None:
                    found[i] = each
    return found
