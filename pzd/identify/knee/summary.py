"""The knee law of every condition of every setting, held to Bingham's."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from pzd.artefacts import KneeForceRow, KneeRow, Knees, ParameterRow
from pzd.artefacts.identified import FALLBACK
from pzd.identify.config import IdentifyConfig
from pzd.identify.knee.choice import kept_back, law_row
from pzd.identify.knee.clicks import clicks, per_unit
from pzd.identify.knee.data import Tests
from pzd.identify.knee.fit import fit_bingham, fit_knee
from pzd.identify.knee.rows import knee_forces, knee_row
from pzd.quantities import Control
from pzd.record import Condition
from pzd.schema.errors import ConfigError
from pzd.schema.progress import Listener, Progress
from pzd.signals.stretches import separate_tests

log = logging.getLogger(__name__)


def knees(
    conditions: Sequence[tuple[Condition, ParameterRow]],
    settings: Sequence[str | None],
    config: IdentifyConfig,
    control: Control,
    progress: Listener,
) -> Knees:
    """The knee law of every condition, and the law that each setting hands on.

    Parameters
    ----------
    conditions : in each of which the control signal stands still, with its Bingham parameters
    settings : of the rig
    config : the config's block: which law it asks for, and what the sensors may differ by from test to test
    control : the control signal, which may be a clicker
    progress : hears of every condition that is done

    Raises
    ------
    ConfigError : when the config asks for the knee law and a setting has no test at a constant control signal
    """
    rows: list[KneeRow] = []
    forces: list[KneeForceRow] = []
    found = []
    for number, (condition, bingham) in enumerate(conditions, start=1):
        tests = Tests.of([test for record in condition.records for test in separate_tests(record)])
        labels = (condition.setting, condition.voltage, condition.temperature)
        fit = fit_knee(tests, bingham.k_N_per_m or FALLBACK["k_N_per_m"])
        row = knee_row(labels, tests, fit, config.nuisance)
        rows.append(row)
        forces += knee_forces(row)
        found += kept_back(labels, tests, fit, fit_bingham(tests, fit))
        progress(Progress(number, len(conditions), f"knee law: {_line(row)}"))
    laws = []
    for setting in settings:
        if config.law == "knee" and not any(row.setting == setting for row in rows):
            of = f" of setting {setting}" if setting else ""
            raise ConfigError(
                f"identify.law: needs tests{of} at a constant control signal; in all of them it moves: record some, or "
                "say bingham (got knee)"
            )
        mine = [each for each in found if each[0].setting == setting]
        law = law_row(config.law, setting, mine, sum(row.setting == setting for row in rows))
        log.info("identify: law %s%s, %s", law.law, f" of {setting}" if setting else "", law.reason)
        laws.append(law)
    return Knees(
        tuple(rows),
        tuple(forces),
        clicks(forces, control),
        tuple(row for row, _ in found),
        tuple(laws),
        per_unit(forces, control),
    )


def _line(row: KneeRow) -> str:
    place = ", ".join(str(part) for part in (row.setting, row.voltage_V, row.temperature_degC) if part is not None)
    knee = {
        "rebound": (row.rebound_knee_force_N, row.rebound_knee_velocity_m_per_s),
        "compression": (row.compression_knee_force_N, row.compression_knee_velocity_m_per_s),
    }
    told = [
        f"{way} knee {force:.4g} N at {speed:.3g} m/s" if force is not None else f"no knee in {way}"
        for way, (force, speed) in knee.items()
    ]
    return f"{place or 'all records'}: {', '.join(told)}, W_s = {row.W_s:.3g}"
