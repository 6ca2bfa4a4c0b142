"""The damper handed on beside the plain one and published models, on tests and voltages that no fit has seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from pzd.artefacts import Diagnosed, Identified, KeptBack, Prediction, Rig, base_of
from pzd.artefacts.peers import HANDED_ON, PLAIN, PeerComparison, PeerParameterRow, PeerRow
from pzd.diagnose.data.cleaning import prepare
from pzd.diagnose.data.exclusions import whole_records
from pzd.diagnose.folds import deal
from pzd.diagnose.missed import Missed
from pzd.diagnose.peer import Peer
from pzd.diagnose.peer_prediction import KeptBackTests
from pzd.diagnose.peers import peers
from pzd.schema.errors import ConfigError, DataError


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
        PLAIN: tests.known({i: each.W_s_plain for i, each in by_record.items()}),
        HANDED_ON: tests.known({i: each.W_s for i, each in by_record.items()}),
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
                PLAIN: tests.known_between(number, left_out[voltage].W_s_plain),
                HANDED_ON: tests.known_between(number, left_out[voltage].W_s),
                **{name: tests.missed_between(peer, number) for name, peer in peers().items()},
            }
            tables.add("voltage", voltage, None, between)
    for peer in peers().values():
        tables.add_parameters(tests, peer)
    return PeerComparison(tuple(missed), tuple(tables.rows), tuple(tables.parameters), tuple(tests.moving))


def _by_record(tests: KeptBackTests, by: Sequence[KeptBack]) -> dict[int, KeptBack]:
    """The figures of diagnosis.json by record, where its voltage stands still; tests of one name come in its order."""
    waiting: dict[str, list[KeptBack]] = {}
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
