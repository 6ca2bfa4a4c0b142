"""The damper handed on beside the plain one and published models, on tests and voltages that no fit has seen."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from pzd.artefacts import Diagnosed, HeldOutTest, Identified, Prediction, Rig, base_of
from pzd.artefacts.diagnosis import ADOPTED, BASELINE, PeerComparison, PeerParameterRow, PeerRow
from pzd.diagnosis.cross_validation import Folds, Missed, deal
from pzd.diagnosis.data import Prepared, prepare, whole_records
from pzd.diagnosis.fit.prediction import counted
from pzd.diagnosis.peers import Peer, PeerForm, ShapeParameter, StrokeMotion, peers
from pzd.record import Array, Mask
from pzd.schema.errors import ConfigError, DataError

# ----------------------------------------------------------------------------------------------------
# The fit of a peer to tests at one voltage, and the line between its parameters from voltage to voltage.


DESCENTS = 3
"""How many of the best points of the grid are followed down."""
AT_LIMIT = 1e-3
"""A shape parameter this close to a limit, as a share of the way searched, stands at it."""


@dataclass(frozen=True, eq=False)
class FittedTest:
    """A test, and the samples of it that may be fitted."""

    motion: StrokeMotion
    force: Array
    """(n,) measured [N]."""
    fitted: Mask
    """(n,) which samples."""


@dataclass(frozen=True, eq=False)
class PeerFit:
    """A form of a peer at one voltage."""

    parameters: Array
    """(p,) in the order of `Peer.parameters`."""
    error: float
    """Sum of the squared residual over the samples fitted [N^2]."""
    status: str
    """`converged`, or what else the search came to."""


def fit_peer(peer: Peer, form: PeerForm, tests: Sequence[FittedTest]) -> PeerFit:
    """The peer with the least criterion (4) over some tests at one voltage.

    The coefficients are solved for at every shape; the shape goes down by least squares from the best points of a grid.

    Equation: min_s |F - Phi(s) a(s)|^2, a(s) = Phi(s)^+ F          Source: variable projection, Golub and Pereyra 1973

    Parameters
    ----------
    peer, form : what is fitted
    tests : at one voltage, one or more
    """
    from scipy.optimize import least_squares

    force = np.concatenate([test.force[test.fitted] for test in tests])
    scale = float(np.linalg.norm(force))

    def solved(shape: Array) -> tuple[Array, Array]:
        columns = np.concatenate([form.columns(test.motion, shape)[test.fitted] for test in tests])
        coefficients = np.linalg.lstsq(columns, force, rcond=None)[0]
        return coefficients, (force - columns @ coefficients) / scale

    def missed(searched: Array) -> Array:
        return solved(_shape(peer, searched))[1]

    starts = [_searched(peer, shape) for shape in peer.grid([test.motion for test in tests])]
    starts.sort(key=lambda start: float(np.sum(missed(start) ** 2)))
    low = _searched(peer, np.array([p.low for p in peer.shape]))
    high = _searched(peer, np.array([p.high for p in peer.shape]))
    found = [least_squares(missed, start, bounds=(low, high), x_scale="jac") for start in starts[:DESCENTS]]
    best = min(found, key=lambda one: float(one.cost))
    shape = _shape(peer, best.x)
    coefficients, residual = solved(shape)
    inside = np.minimum(best.x - low, high - best.x) > AT_LIMIT * (high - low)
    held = [p.name for p, free in zip(peer.shape, inside, strict=True) if not free]
    status = f"at its limit: {', '.join(held)}" if held else "converged" if best.status > 0 else "not converged"
    return PeerFit(np.concatenate([coefficients, shape]), float(residual @ residual) * scale**2, status)


def between_voltages(fits: Mapping[float, PeerFit], voltage: float) -> Array:
    """(p,) parameters at a voltage [V], linear between those fitted and held beyond them.

    Parameters
    ----------
    fits : one or more, by voltage [V]
    voltage : of the test that is predicted [V]
    """
    nodes = sorted(fits)
    values = np.array([fits[node].parameters for node in nodes])
    return np.array([np.interp(voltage, nodes, column) for column in values.T])


def best_form(fits: Mapping[PeerForm, Mapping[float, PeerFit]]) -> PeerForm:
    """The form that misses least of the tests fitted, all voltages together."""
    return min(fits, key=lambda form: sum(fit.error for fit in fits[form].values()))


def _searched(peer: Peer, shape: Array) -> Array:
    """(s,) shape parameters as they are searched."""
    return np.array([np.log(v) if p.logarithmic else v for p, v in zip(peer.shape, shape, strict=True)])


def _shape(peer: Peer, searched: Array) -> Array:
    """(s,) shape parameters, within their limits to rounding."""
    return np.array([_value(p, v) for p, v in zip(peer.shape, searched, strict=True)])


def _value(parameter: ShapeParameter, searched: float) -> float:
    value = float(np.exp(searched)) if parameter.logarithmic else searched
    return min(max(value, parameter.low), parameter.high)


# ----------------------------------------------------------------------------------------------------
# What peers miss of the very tests and voltages that diagnose keeps back.
#
# They see what diagnose sees: the same cleaned motion, the same samples, the same folds; nothing is fitted to a test that
# is kept back.


class _Entry(NamedTuple):
    """Of a test, or of a half of one."""

    record: int
    error: float
    energy: float
    spread: float


@dataclass(frozen=True, eq=False)
class KeptBackTests:
    """The tests of one setting at constant voltage, as diagnose deals them."""

    prepared: tuple[Prepared, ...]
    dealt: Folds
    _fits: dict[tuple[str, str, int, tuple[bytes, ...]], PeerFit] = field(default_factory=dict, repr=False)

    @property
    def groups(self) -> list[tuple[float, tuple[int, ...]]]:
        """Voltage [V] and records of each group at a constant voltage, lowest first."""
        found = zip(self.dealt.voltages, self.dealt.groups, strict=True)
        return sorted((voltage, group) for voltage, group in found if voltage is not None)

    @property
    def moving(self) -> list[str]:
        """The records whose voltage moves."""
        found = zip(self.dealt.voltages, self.dealt.groups, strict=True)
        return [self.prepared[i].record.name for voltage, group in found if voltage is None for i in group]

    def fitted(self, peer: Peer, form: PeerForm, group: int, kept_back: Sequence[Mask]) -> PeerFit:
        """A form of a peer at one voltage, fitted to all but what is kept back; asked twice it is fitted once."""
        _, members = self.groups[group]
        key = peer.name, form.label, group, tuple(kept_back[i].tobytes() for i in members)
        if key not in self._fits:
            tests = [self._test(i, ~kept_back[i]) for i in members]
            self._fits[key] = fit_peer(peer, form, [test for test in tests if test.fitted.any()])
        return self._fits[key]

    def _test(self, i: int, fitted: Mask) -> FittedTest:
        p = self.prepared[i]
        return FittedTest(StrokeMotion.of(p), p.record.force, fitted & counted(p))

    def by_form(
        self, peer: Peer, kept_back: Sequence[Mask], groups: Iterable[int]
    ) -> tuple[PeerForm, dict[float, PeerFit]]:
        """The form of a peer that fits some voltages best without what is kept back, and its fits by voltage [V]."""
        asked = list(groups)
        fits = {form: {self.groups[g][0]: self.fitted(peer, form, g, kept_back) for g in asked} for form in peer.forms}
        form = best_form(fits)
        return form, fits[form]

    def missed(self, peer: Peer) -> Missed:
        """What a peer misses of the tests that are kept back, fold by fold."""
        entries = []
        for fold in self.dealt.folds:
            form, fits = self.by_form(peer, fold, range(len(self.groups)))
            for voltage, group in self.groups:
                entries += [self._entry(i, fold[i], self._predicted(peer, form, fits, voltage, i)) for i in group]
        return _joined(entries)

    def missed_between(self, peer: Peer, group: int) -> Missed:
        """What a peer misses of a voltage, by the line between the voltages around it."""
        form, fits = self.by_form(peer, self.nothing, (g for g in range(len(self.groups)) if g != group))
        voltage, members = self.groups[group]
        return _joined(
            self._entry(i, self.everything[i], self._predicted(peer, form, fits, voltage, i)) for i in members
        )

    def known(self, figure: Mapping[int, float]) -> Missed:
        """What a model misses of the tests that are kept back, of which the W_s of each is known, by record."""
        return _joined(self._of_known(i, fold[i], W_s) for fold in self.dealt.folds for i, W_s in figure.items())

    def known_between(self, group: int, figure: float) -> Missed:
        """What a model misses of a voltage, of which the W_s is known."""
        return _joined(self._of_known(i, self.everything[i], figure) for i in self.groups[group][1])

    @property
    def nothing(self) -> tuple[Mask, ...]:
        """(n,) a record: no sample."""
        return tuple(np.zeros(p.record.time.size, dtype=np.bool_) for p in self.prepared)

    @property
    def everything(self) -> tuple[Mask, ...]:
        """(n,) a record: every sample."""
        return tuple(~mask for mask in self.nothing)

    def _predicted(
        self, peer: Peer, form: PeerForm, fits: Mapping[float, PeerFit], voltage: float, i: int
    ) -> Callable[[], Array]:
        return lambda: peer.force(form, StrokeMotion.of(self.prepared[i]), between_voltages(fits, voltage))

    def _entry(self, i: int, kept_back: Mask, predicted: Callable[[], Array]) -> _Entry:
        """What a predicted force (n,) misses of the kept-back samples (n,) of a record."""
        if not kept_back.any():
            return _Entry(i, 0.0, 0.0, 0.0)
        kept = kept_back & counted(self.prepared[i])
        force = self.prepared[i].record.force[kept]
        residual, about_mean = force - predicted()[kept], force - force.mean()
        squares = (float(each @ each) for each in (residual, force, about_mean))
        return _Entry(i, *squares)

    def _of_known(self, i: int, kept_back: Mask, figure: float) -> _Entry:
        bare = self._entry(i, kept_back, lambda: np.zeros(kept_back.size))
        return bare._replace(error=figure * bare.energy)


def _joined(entries: Iterable[_Entry]) -> Missed:
    """Entries as one, without those of which nothing was kept back."""
    known = [entry for entry in entries if entry.energy > 0.0]
    error, energy, spread = np.array([entry[1:] for entry in known], dtype=np.float64).reshape(-1, 3).T
    return Missed(tuple(entry[0] for entry in known), error, energy, spread, np.zeros(error.size))


# ----------------------------------------------------------------------------------------------------


def compare_with_peers(rig: Rig, identified: Identified, diagnosed: Diagnosed, setting: str | None) -> PeerComparison:
    """The damper handed on beside the plain one and every peer, on tests and voltages that no fit has seen.

    Parameters
    ----------
    rig, identified, diagnosed : the results of the stages
    setting : of the rig's settings, the one in use

    Raises
    ------
    ConfigError : when the element follows the knee law, of which diagnose keeps no test back
    DataError : when there is too little to keep a test back at a constant voltage
    """
    if identified.knees.law_of(setting) == "knee":
        raise ConfigError(
            "identify.law: under the knee law diagnose keeps no test back that peers could be compared on; "
            "2-identify/kept_back.csv has what both laws predict; say bingham"
        )
    prediction = diagnosed.diagnosis.prediction
    if prediction is None or (all(each.voltage is None for each in prediction.by) and _controlled(identified, setting)):
        raise DataError(
            "pzd peers: too little to keep a test back at a constant control signal; record two or more at each"
        )
    prepared = prepare(whole_records(rig, setting)[0])
    tests = KeptBackTests(prepared, deal(prepared, base_of(identified.rows, setting)))
    return _filled(_Tables(setting, _controlled(identified, setting)), tests, prediction)


def _controlled(identified: Identified, setting: str | None) -> bool:
    """Whether the damper of a setting has a control signal."""
    return any(row.voltage_V is not None for row in identified.rows if row.setting == setting)


@dataclass(frozen=True)
class _Tables:
    """The rows of a comparison, and how they are labelled."""

    setting: str | None
    controlled: bool
    """Whether there is a control signal."""
    rows: list[PeerRow] = field(default_factory=list)
    parameters: list[PeerParameterRow] = field(default_factory=list)

    def voltage(self, voltage: float | None) -> float | None:
        """A voltage of a group as a row names it [V]."""
        return voltage if self.controlled else None

    def add(
        self,
        kept_back: Literal["test", "voltage"],
        voltage: float | None,
        record: str | None,
        missed: Mapping[str, Missed],
    ) -> None:
        """A row a model, where anything was predicted."""
        for model, each in missed.items():
            if each.criterion is not None:
                self.rows.append(
                    PeerRow(
                        setting=self.setting,
                        voltage_V=self.voltage(voltage),
                        kept_back=kept_back,
                        record=record,
                        model=model,
                        W_s=each.criterion,
                        R2=each.determination,
                    )
                )

    def add_parameters(self, tests: KeptBackTests, peer: Peer) -> None:
        """The parameters of a peer at every voltage, fitted to all tests."""
        form, fits = tests.by_form(peer, tests.nothing, range(len(tests.groups)))
        for voltage, fit in fits.items():
            for parameter, value in zip(peer.parameters, fit.parameters, strict=True):
                self.parameters.append(
                    PeerParameterRow(
                        setting=self.setting,
                        voltage_V=self.voltage(voltage),
                        model=peer.name,
                        form=form.label,
                        parameter=parameter.name,
                        value=float(value),
                        unit=parameter.unit,
                        status=fit.status,
                    )
                )


def _filled(tables: _Tables, tests: KeptBackTests, prediction: Prediction) -> PeerComparison:
    """The comparison, test by test, then by voltage, in all, and of voltages left out."""
    by_record = _by_record(tests, prediction.by)
    missed = {
        BASELINE: tests.known({i: each.W_s_plain for i, each in by_record.items()}),
        ADOPTED: tests.known({i: each.W_s for i, each in by_record.items()}),
        **{name: tests.missed(peer).of(tuple(by_record)) for name, peer in peers().items()},
    }
    for voltage, group in tests.groups:
        for i in group:
            name = tests.prepared[i].record.name
            tables.add("test", voltage, name, {model: each.of([i]) for model, each in missed.items()})
    for voltage, group in tests.groups if tables.controlled else ():
        tables.add("test", voltage, None, {model: each.of(group) for model, each in missed.items()})
    tables.add("test", None, None, missed)
    left_out = {left.voltage: left for left in prediction.left_out_voltages}
    for number, (voltage, _) in enumerate(tests.groups):
        if voltage in left_out:
            between = {
                BASELINE: tests.known_between(number, left_out[voltage].W_s_plain),
                ADOPTED: tests.known_between(number, left_out[voltage].W_s),
                **{name: tests.missed_between(peer, number) for name, peer in peers().items()},
            }
            tables.add("voltage", voltage, None, between)
    for peer in peers().values():
        tables.add_parameters(tests, peer)
    return PeerComparison(tuple(missed), tuple(tables.rows), tuple(tables.parameters), tuple(tests.moving))


def _by_record(tests: KeptBackTests, by: Sequence[HeldOutTest]) -> dict[int, HeldOutTest]:
    """The figures of diagnosis.json by record, where its voltage stands still; tests of one name come in its order."""
    waiting: dict[str, list[HeldOutTest]] = {}
    for each in by:
        waiting.setdefault(each.record, []).append(each)
    found = {}
    for voltage, group in zip(tests.dealt.voltages, tests.dealt.groups, strict=True):
        for i in group:
            mine = waiting.get(tests.prepared[i].record.name, [])
            if mine:
                each = mine.pop(0)
                if voltage is not None:
                    found[i] = each
    return found
