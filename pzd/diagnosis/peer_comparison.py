"""Comparison of the adopted damper with the baseline and with published models, on held-out tests and voltages."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from pzd.artefacts import Diagnosed, HeldOutTest, Identified, Prediction, Rig, base_of
from pzd.artefacts.diagnosis import ADOPTED, BASELINE, PeerComparison, PeerParameterRow, PeerRow
from pzd.diagnosis.cross_validation import Folds, PredictionError, assign_folds, squared_sums
from pzd.diagnosis.data import PreparedRecord, prepare, unsaturated_records
from pzd.diagnosis.fit.prediction import comparable_samples
from pzd.diagnosis.peers import Peer, PeerForm, ShapeParameter, StrokeMotion, peers
from pzd.fit.least_squares import minimise, minimise_from
from pzd.record import Array, Mask
from pzd.schema.errors import ConfigError, DataError

# --- Fit of a peer to tests at one voltage


DESCENTS = 3
"""Best points of the grid from which a local search starts.

Reason: time; the residual has few minima over the shape."""
RESOLUTION = 1e-6
"""Residual that says nothing of a shape, as a share of the force (r.m.s.): far below what any sensor shows."""
AT_LIMIT = 1e-3
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
    inside = np.minimum(best.x - low, high - best.x) > AT_LIMIT * (high - low)
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


@dataclass(frozen=True, eq=False)
class HeldOutTests:
    """The tests of one setting at constant voltage, in the folds of the cross-validation."""

    prepared: tuple[PreparedRecord, ...]
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
        return [self.prepared[i].record.name for voltage, group in found if voltage is None for i in group]

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
        p = self.prepared[i]
        return PeerData(StrokeMotion.of(p), p.record.force, fitted & comparable_samples(p))

    def best_form(
        self, peer: Peer, held_out: Sequence[Mask], groups: Iterable[int]
    ) -> tuple[PeerForm, dict[float, PeerFit]]:
        """Return the form of a peer with the least error over some voltages, and its fits by voltage [V]."""
        wanted = list(groups)
        fits = {f: {self.groups[g][0]: self.fitted(peer, f, g, held_out) for g in wanted} for f in peer.forms}
        form = min(fits, key=lambda form: sum(fit.error for fit in fits[form].values()))
        return form, fits[form]

    def held_out_error(self, peer: Peer) -> PredictionError:
        """Compute the held-out prediction error of a peer, refitted without each fold."""
        found = []
        for fold in self.folds.folds:
            form, fits = self.best_form(peer, fold, range(len(self.groups)))
            found += [self._predicted_error(peer, form, fits, group, fold) for group in range(len(self.groups))]
        return PredictionError.concatenated(found)

    def interpolation_error(self, peer: Peer, group: int) -> PredictionError:
        """Compute the prediction error at a voltage, with parameters interpolated between the other voltages."""
        form, fits = self.best_form(peer, self.folds.no_samples, (g for g in range(len(self.groups)) if g != group))
        return self._predicted_error(peer, form, fits, group, self.all_samples)

    def known_error(self, figures: Mapping[int, float]) -> PredictionError:
        """Return the held-out error of a model whose W_s of each record is known."""
        return PredictionError.concatenated([self._known_error(fold, figures) for fold in self.folds.folds])

    def known_interpolation_error(self, group: int, figure: float) -> PredictionError:
        """Return the error at a left-out voltage of a model whose W_s there is known."""
        return self._known_error(self.all_samples, dict.fromkeys(self.groups[group][1], figure))

    def _known_error(self, held_out: Sequence[Mask], figures: Mapping[int, float]) -> PredictionError:
        bare = self._error(held_out, figures, lambda i: np.zeros(held_out[i].size))
        return replace(bare, error=np.array([figures[i] for i in bare.records]) * bare.energy)

    def _predicted_error(
        self, peer: Peer, form: PeerForm, fits: Mapping[float, PeerFit], group: int, held_out: Sequence[Mask]
    ) -> PredictionError:
        voltage, members = self.groups[group]
        parameters = between_voltages(fits, voltage)
        return self._error(held_out, members, lambda i: peer.force(form, StrokeMotion.of(self.prepared[i]), parameters))

    def _error(
        self, held_out: Sequence[Mask], members: Iterable[int], predicted: Callable[[int], Array]
    ) -> PredictionError:
        """Compute the error of predicted forces (n,) on the held-out samples of some records."""
        records, entries = list[int](), list[tuple[float, ...]]()
        for i in members:
            kept = held_out[i] & comparable_samples(self.prepared[i])
            force = self.prepared[i].record.force[kept]
            if force.any():
                records.append(i)
                entries.append((*squared_sums(force, force - predicted(i)[kept]), 0.0))
        return PredictionError.of_entries(records, entries)


# --- The comparison as tables


def compare_with_peers(rig: Rig, identified: Identified, diagnosed: Diagnosed, setting: str | None) -> PeerComparison:
    """Compare the adopted damper with the baseline and every peer, on held-out tests and voltages.

    Parameters
    ----------
    rig, identified, diagnosed : results of the stages
    setting : of the rig's settings, the one in use

    Raises
    ------
    ConfigError : when the element follows the knee law, for which diagnose holds no test out
    DataError : when there is too little to hold a test out at a constant voltage
    """
    if identified.knees.law_of(setting) == "knee":
        raise ConfigError(
            "identify.law: under the knee law diagnose keeps no test back that peers could be compared on; "
            "2-identify/kept_back.csv has what both laws predict; say bingham"
        )
    prediction = diagnosed.diagnosis.prediction
    controlled = any(row.voltage_V is not None for row in identified.rows if row.setting == setting)
    if prediction is None or (controlled and all(each.voltage is None for each in prediction.by)):
        raise DataError(
            "pzd peers: too little to keep a test back at a constant control signal; record two or more at each"
        )
    prepared = prepare(unsaturated_records(rig, setting)[0])
    tests = HeldOutTests(prepared, assign_folds(prepared, base_of(identified.rows, setting)))
    return _comparison(tests, prediction, setting, controlled=controlled)


def _comparison(
    tests: HeldOutTests, prediction: Prediction, setting: str | None, *, controlled: bool
) -> PeerComparison:
    """Compare test by test, by voltage, in total, and at left-out voltages."""
    rows: list[PeerRow] = []

    def add(
        kept_back: Literal["test", "voltage"],
        voltage: float | None,
        record: str | None,
        errors: Mapping[str, PredictionError],
    ) -> None:
        """Add one row per model that predicts anything."""
        for model, each in errors.items():
            if each.criterion is not None:
                rows.append(
                    PeerRow(
                        setting=setting,
                        voltage_V=voltage if controlled else None,
                        kept_back=kept_back,
                        record=record,
                        model=model,
                        W_s=each.criterion,
                        R2=each.determination,
                    )
                )

    by_record = _by_record(tests, prediction.by)
    errors = {
        BASELINE: tests.known_error({i: each.W_s_plain for i, each in by_record.items()}),
        ADOPTED: tests.known_error({i: each.W_s for i, each in by_record.items()}),
        **{name: tests.held_out_error(peer).of_records(tuple(by_record)) for name, peer in peers().items()},
    }
    for voltage, group in tests.groups:
        for i in group:
            name = tests.prepared[i].record.name
            add("test", voltage, name, {model: each.of_records([i]) for model, each in errors.items()})
    for voltage, group in tests.groups if controlled else ():
        add("test", voltage, None, {model: each.of_records(group) for model, each in errors.items()})
    add("test", None, None, errors)
    left_out = {left.voltage: left for left in prediction.left_out_voltages}
    for number, (voltage, _) in enumerate(tests.groups):
        if voltage in left_out:
            between = {
                BASELINE: tests.known_interpolation_error(number, left_out[voltage].W_s_plain),
                ADOPTED: tests.known_interpolation_error(number, left_out[voltage].W_s),
                **{name: tests.interpolation_error(peer, number) for name, peer in peers().items()},
            }
            add("voltage", voltage, None, between)
    parameters = [
        PeerParameterRow(
            setting=setting,
            voltage_V=voltage if controlled else None,
            model=peer.name,
            form=form.label,
            parameter=parameter.name,
            value=float(value),
            unit=parameter.unit,
            status=fit.status,
        )
        for peer in peers().values()
        for form, fits in [tests.best_form(peer, tests.folds.no_samples, range(len(tests.groups)))]
        for voltage, fit in fits.items()
        for parameter, value in zip(peer.parameters, fit.parameters, strict=True)
    ]
    return PeerComparison(tuple(errors), tuple(rows), tuple(parameters), tuple(tests.moving))


def _by_record(tests: HeldOutTests, by: Sequence[HeldOutTest]) -> dict[int, HeldOutTest]:
    """Assign the figures of diagnosis.json to records of constant voltage; tests of one name come in its order."""
    waiting: dict[str, list[HeldOutTest]] = {}
    for each in by:
        waiting.setdefault(each.record, []).append(each)
    found = {}
    for voltage, group in zip(tests.folds.voltages, tests.folds.groups, strict=True):
        for i in group:
            mine = waiting.get(tests.prepared[i].record.name, [])
            if mine:
                each = mine.pop(0)
                if voltage is not None:
                    found[i] = each
    return found
