"""Ways in which a rig file or its config could be read wrongly without a word: each tried, and what happened.

    PYTHONPATH=. python tests/studies/misread_files.py

A damper with friction on a sine of 10 mm at 2 Hz and 100 V is written in each way, and read. `right`: the record is
the test. `refused`: nothing was read, the first message says why. `finding`: the record is not the test, or not
known to be, and the preflight says so. `SILENTLY WRONG`: another test was read and nothing said; the study then
ends with status 1.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError
from scipy.signal import butter, lfilter, lfilter_zi

from pzd.quantities import Control
from pzd.record import Array
from pzd.rig.config import RigConfig
from pzd.rig.stage import ingest
from pzd.schema.errors import UserError

TIME = np.arange(4000) * 1e-3
X = 0.01 * np.sin(2.0 * np.pi * 2.0 * TIME)
V = 0.01 * 2.0 * np.pi * 2.0 * np.cos(2.0 * np.pi * 2.0 * TIME)
RNG = np.random.default_rng(1)
FORCE = 900.0 * V + 200.0 * np.tanh(V / 0.005) + 1.0 * RNG.standard_normal(TIME.size)
NOISE = np.random.default_rng(2).standard_normal(TIME.size)
VOLTS = np.full(TIME.size, 100.0)
BASE: dict[str, Any] = {"time_s": TIME, "displacement_m": X, "force_N": FORCE, "voltage_V": VOLTS}


@dataclass(frozen=True)
class Way:
    """One way to write a test down, and the config that reads it."""

    told: str
    columns: dict[str, Any] = field(default_factory=lambda: BASE)
    entry: dict[str, Any] = field(default_factory=dict)
    separator: str = ","
    decimal: str = "."
    above: Sequence[str] = ()
    below: Sequence[str] = ()
    name: str = "a.csv"
    encoding: str = "utf-8"
    newline: str = "\n"
    text: Any = None
    """Changes the lines before they are written."""
    true: dict[str, Any] = field(default_factory=dict)
    """What the record should hold where it is not the base: displacement, force, voltage, temperature."""

    def lines(self) -> list[str]:
        """The lines of the file."""
        cells = [
            c if isinstance(c, list) else [f"{v:.9g}".replace(".", self.decimal) for v in c.tolist()]
            for c in self.columns.values()
        ]
        body = [self.separator.join(row) for row in zip(*cells, strict=True)]
        lines = [*self.above, self.separator.join(self.columns), *body, *self.below]
        return self.text(lines) if self.text else lines


def other(**columns: Any) -> dict[str, Any]:
    """The base columns, some of them changed or added."""
    return {**BASE, **columns}


def renamed(**names: str) -> dict[str, Any]:
    """The base columns under other headers, by quantity."""
    quantity = {"time_s": "time", "displacement_m": "displacement", "force_N": "force", "voltage_V": "voltage"}
    return {names.get(quantity[head], head): values for head, values in BASE.items()}


def with_units(displacement: str, force: str) -> Way:
    """Headers with brackets in front of SI numbers."""
    return Way(
        f"headers x {displacement} and F {force}",
        renamed(displacement=f"x {displacement}", force=f"F {force}"),
        {"columns": {"displacement": f"x {displacement}", "force": f"F {force}"}},
    )


def spiked(values: Array, rows: Any, value: float) -> Array:
    """A channel with some samples replaced."""
    result = values.copy()
    result[rows] = value
    return result


def held(values: Array) -> Array:
    """A channel that stands still for 40 ms while the logger is busy."""
    return spiked(values, slice(1000, 1040), float(values[999]))


def clock(seconds: Array, days: bool = False) -> list[str]:
    """Time of day."""
    day = [f"2024-03-{25 + int(t // 86400):02d} " if days else "" for t in seconds]
    return [
        f"{d}{int(t // 3600) % 24:02d}:{int(t // 60) % 60:02d}:{t % 60:06.3f}"
        for d, t in zip(day, seconds, strict=True)
    ]


def days(form: str) -> list[str]:
    """Dates and times over the midnight from 1 to 2 February."""
    start = datetime(2024, 2, 1, 23, 59, 58)  # noqa: DTZ001  # a logger knows no zone
    return [(start + timedelta(seconds=t)).strftime(f"{form} %H:%M:%S.%f") for t in TIME.tolist()]


def behind(low_pass: float, values: Array, order: int = 1) -> Array:
    """A channel behind a low-pass with this corner [Hz]."""
    b, a = butter(order, low_pass, fs=1000.0)
    return np.asarray(lfilter(b, a, values, zi=lfilter_zi(b, a) * values[0])[0])


def zeroed(count: int, length: int) -> Array:
    """A force that is zero for so many samples, so often."""
    starts = np.linspace(30, TIME.size - 30, count).astype(int)
    return spiked(FORCE, starts[:, None] + np.arange(length), 0.0)


GERMAN = {
    "columns": {"time": "Zeit", "displacement": "Weg", "force": "Kraft"},
    "units": {"time": "s", "displacement": "m", "force": "N"},
}
ZEIT = {"Zeit": TIME, "Weg": X, "Kraft": FORCE, "voltage_V": VOLTS}
TIMELESS = {name: values for name, values in BASE.items() if name != "time_s"}
VOLTLESS = {name: values for name, values in BASE.items() if name != "voltage_V"}
SECONDS: dict[str, Any] = {"units": {"time": "s"}}
LATE = np.concatenate((TIME, TIME + 64.0))
TWICE = {"displacement_m": np.tile(X, 2), "force_N": np.tile(FORCE, 2), "voltage_V": np.tile(VOLTS, 2)}

WAYS: tuple[Way, ...] = (
    Way("semicolons and decimal commas, nothing said", separator=";", decimal=","),
    Way("tabs and decimal commas, nothing said", separator="\t", decimal=","),
    Way("decimal commas in a file separated by commas", decimal=","),
    Way("blanks, nothing said", separator=" "),
    Way(
        "thousands with points (1.234) beside decimal commas",
        ZEIT | {"Kraft": [f"{f:.3f}".replace(".", ",").replace("1,", "1.000,", 1) for f in FORCE]},
        GERMAN | {"decimal": ","},
        ";",
        ",",
    ),
    Way(
        "thousands with a point and no decimals (2.450 is 2450)",
        ZEIT | {"Kraft": [f"{1000 * f / 1000:.0f}" if abs(f) < 1000 else f"{f / 1000:.3f}" for f in 10 * FORCE]},
        GERMAN | {"decimal": ","},
        ";",
        ",",
        true={"force": np.round(10 * FORCE)},
    ),
    Way("Fortran exponents (1.0D-03)", other(force_N=[f"{f:.6E}".replace("E", "D") for f in FORCE])),
    Way("a typographic minus", other(force_N=[f"{f:.6f}".replace("-", "\u2212") for f in FORCE])),
    Way("NaN where a sample was lost", other(force_N=["NaN" if i == 700 else f"{f:.6f}" for i, f in enumerate(FORCE)])),
    Way("-9999 where a sample was lost", other(force_N=spiked(FORCE, 700, -9999.0)), true={"force": None}),
    Way("-9999 for 60 ms", other(force_N=spiked(FORCE, slice(700, 760), -9999.0)), true={"force": None}),
    Way("a row of units that is not announced", text=lambda t: [t[0], "s,m,N,V", *t[1:]]),
    Way("a preamble that is not announced", above=["Rig 3, operator K.", "2024-03-25"]),
    Way("a footer", below=["End of test,,,"]),
    Way("the header again in the middle", text=lambda t: [*t[:2000], t[0], *t[2000:]]),
    Way("a comma at the end of every line", text=lambda t: [line + "," for line in t]),
    Way("a comma at the end of every line of data", text=lambda t: [t[0], *(line + "," for line in t[1:])]),
    Way("lines that end in a carriage return", newline="\r"),
    Way("UTF-16, nothing said", encoding="utf-16"),
    with_units("[mm]", "[N]"),
    with_units("[m]", "[kN]"),
    Way("force in [kg]", renamed(force="Load [kg]"), {"columns": {"force": "Load [kg]"}}),
    Way("stroke in [%]", renamed(displacement="x [%]"), {"columns": {"displacement": "x [%]"}}),
    Way(
        "the header says kN, the config N",
        renamed(force="Load [kN]") | {"Load [kN]": FORCE / 1e3},
        {"columns": {"force": "Load [kN]"}, "units": {"force": "N"}},
    ),
    Way("the header says force_N, the config kN", entry={"units": {"force": "kN"}}),
    Way("milliseconds under time_s", other(time_s=TIME * 1e3)),
    Way(
        "sample numbers called seconds by the config",
        renamed(time="No") | {"No": np.arange(4000.0)},
        {"columns": {"time": "No"}, "units": {"time": "s"}},
    ),
    Way(
        "a clock past midnight without a date",
        renamed(time="when") | {"when": clock(TIME + 86398.0)},
        {"columns": {"time": "when"}, "units": {"time": "%H:%M:%S.%f"}},
    ),
    Way(
        "a clock of whole seconds",
        renamed(time="when") | {"when": [t[:8] for t in clock(TIME)]},
        {"columns": {"time": "when"}, "units": {"time": "%H:%M:%S"}},
    ),
    Way("time rounded to 2 ms at 1 kHz", other(time_s=[f"{round(t / 0.002) * 0.002:.3f}" for t in TIME])),
    Way("two tests with a pause, not split", {"time_s": LATE, **TWICE}),
    Way("two tests, the clock begins anew", {"time_s": np.tile(TIME, 2), **TWICE}),
    Way("a second sampling rate after a pause", {"time_s": np.concatenate((TIME, 9.0 + 10.0 * TIME)), **TWICE}),
    Way(
        "two speeds without a pause",
        other(
            displacement_m=np.where(TIME < 2.0, X, 0.01 * np.sin(2 * np.pi * 4.0 * TIME)),
            force_N=np.where(TIME < 2.0, FORCE, 2.0 * 900.0 * np.cos(2 * np.pi * 4.0 * TIME) * 0.1257),
        ),
        true={"displacement": None},
    ),
    Way(
        "samples left out without a gap in the clock",
        other(
            displacement_m=np.concatenate((X[:1000], X[1100:], X[:100])),
            force_N=np.concatenate((FORCE[:1000], FORCE[1100:], FORCE[:100])),
        ),
        true={"displacement": None},
    ),
    Way("force held for 40 ms while the logger was busy", other(force_N=held(FORCE)), true={"force": None}),
    Way("displacement held for 40 ms", other(displacement_m=held(X)), true={"displacement": None}),
    Way("force cut off at the range of the cell", other(force_N=np.clip(FORCE, -250.0, 250.0)), true={"force": None}),
    Way("force wrapped round at 16 bits", other(force_N=(FORCE + 280.0) % 560.0 - 280.0), true={"force": None}),
    Way("force counts compression positive", other(force_N=-FORCE)),
    Way(
        "displacement and force count compression positive, as the headers say",
        renamed(displacement="Compression [m]", force="Druckkraft [N]")
        | {"Compression [m]": -X, "Druckkraft [N]": -FORCE},
        {"columns": {"displacement": "Compression [m]", "force": "Druckkraft [N]"}},
    ),
    Way("sign: {force: -1} where nothing is turned over", entry={"sign": {"force": -1}}),
    Way(
        "tare of the cell beside a turned sign",
        other(force_N=-FORCE + 50.0),
        {"sign": {"force": -1}, "fixture": {"tare_N": 50}},
    ),
    Way(
        "displacement and force exchanged",
        entry={
            "columns": {"displacement": "force_N", "force": "displacement_m"},
            "units": {"displacement": "mm", "force": "kN"},
        },
    ),
    Way("recorded speed in mm/s called m/s", other(velocity_m_per_s=V * 1e3)),
    Way("recorded speed with the other sign", other(velocity_m_per_s=-V)),
    Way("voltage in a column and as a constant", entry={"constants": {"voltage": "50 V"}}),
    Way("one sample of 10 kV", other(voltage_V=spiked(VOLTS, 1234, 1e4))),
    Way("voltage in millivolts called V", other(voltage_V=VOLTS * 1e3), true={"voltage": 100.0}),
    Way(
        "temperature in kelvin under temperature_degC",
        other(temperature_degC=VOLTS + 195.15),
        true={"temperature": 22.0},
    ),
    Way(
        "temperature in degF under temperature_degC (180)",
        other(temperature_degC=VOLTS + 80.0),
        true={"temperature": 82.2},
    ),
    Way(
        "a thermocouple that falls out",
        other(temperature_degC=spiked(VOLTS - 78.0, [5, 900], 0.0)),
        true={"temperature": 22.0},
    ),
    Way(
        "the pattern also fits the amplitude (25mm_100V)",
        {k: v for k, v in BASE.items() if k != "voltage_V"},
        {"path": "*.csv", "pattern": "(?P<voltage>[0-9.]+)", "units": {"voltage": "V"}},
        name="25mm_100V.csv",
    ),
    Way(
        "the pattern leaves out the minus of -10C",
        entry={"path": "*.csv", "pattern": "(?P<temperature>[0-9.]+)C", "units": {"temperature": "degC"}},
        name="run_-10C.csv",
        true={"temperature": -10.0},
    ),
    Way("an Excel file called .csv", text=lambda t: ["PK\x03\x04" + "xl/workbook"]),
    Way("rate_Hz of 500 beside a clock of 1 kHz", entry={"rate_Hz": 500.0}),
    Way("rate_Hz of 1000 beside a clock in milliseconds", {"t": TIME * 1e3, **TIMELESS}, {"rate_Hz": 1000.0}),
    Way("rate_Hz beside a clock that the config leaves out", entry={"rate_Hz": 500.0, "columns": {"time": ""}}),
    Way("rate_Hz beside numbers of samples", {"Time": np.arange(4000.0), **TIMELESS}, {"rate_Hz": 1000.0}),
    Way("numbers of samples under time_s", other(time_s=np.arange(4000.0))),
    Way("numbers of samples under time_s, seconds by the config", other(time_s=np.arange(4000.0)), SECONDS),
    Way(
        "every tenth sample, numbered under time_s",
        {k: v[::10] for k, v in other(time_s=np.arange(4000.0)).items()},
        true={"displacement": X[::10], "force": FORCE[::10]},
    ),
    Way("the clock jumps by a day", other(time_s=np.where(TIME < 2.0, TIME, TIME + 86400.0))),
    Way(
        "dates whose day comes first, read as months, over midnight",
        {"when": days("%d/%m/%Y"), **TIMELESS},
        {"columns": {"time": "when"}, "units": {"time": "%m/%d/%Y %H:%M:%S.%f"}},
    ),
    Way(
        "dates whose month comes first, read as days, over midnight",
        {"when": days("%m/%d/%Y"), **TIMELESS},
        {"columns": {"time": "when"}, "units": {"time": "%d/%m/%Y %H:%M:%S.%f"}},
    ),
    Way(
        "inches as a quotation mark",
        renamed(displacement='Pos (")') | {'Pos (")': X / 0.0254},
        {"columns": {"displacement": 'Pos (")'}},
    ),
    *(
        Way(f"the header says {head}", renamed(force=head), {"columns": {"force": head}})
        for head in ("Load [']", "Load (F0)", "Load [N/0]", "F [N*9**9**9]", "Load x10 [N]", "Load/100 [N]", "F [N N]")
    ),
    Way(
        "the pattern cuts 1,5V to 5",
        VOLTLESS,
        {"path": "*.csv", "pattern": "(?P<voltage>[0-9.]+)V", "units": {"voltage": "V"}},
        name="b_1,5V.csv",
        true={"voltage": 1.5},
    ),
    Way(
        "the pattern cuts 1.5V to 1",
        VOLTLESS,
        {"path": "*.csv", "pattern": "_(?P<voltage>[0-9]+)", "units": {"voltage": "V"}},
        name="b_1.5V.csv",
        true={"voltage": 1.5},
    ),
    Way(
        "the pattern leaves out the minus of T-20C",
        entry={"path": "*.csv", "pattern": "(?P<temperature>[0-9.]+)C", "units": {"temperature": "degC"}},
        name="run_T-20C.csv",
        true={"temperature": -20.0},
    ),
    Way("one cell of 6e198", other(force_N=spiked(FORCE, 1234, 6e198))),
    Way("no headers", text=lambda t: t[1:]),
    Way("no column of force", {k: v for k, v in BASE.items() if k != "force_N"}),
    Way(
        "one load and unload",
        other(displacement_m=0.01 * np.sin(0.25 * np.pi * TIME), force_N=200.0 * np.cos(0.25 * np.pi * TIME)),
    ),
    Way("displacement in steps of 0.25 mm", other(displacement_m=2.5e-4 * np.rint(X / 2.5e-4))),
    Way("force held at 50 Hz", other(force_N=FORCE[np.arange(TIME.size) // 20 * 20]), true={"force": None}),
    Way("displacement held at 50 Hz", other(displacement_m=X[np.arange(TIME.size) // 20 * 20])),
    Way("force of zero for 3 samples, ten times", other(force_N=zeroed(10, 3)), true={"force": None}),
    Way("80 single zeros of the force", other(force_N=zeroed(80, 1)), true={"force": None}),
    Way(
        "force 40 % lower from half-way on", other(force_N=np.where(TIME > 2.0, 0.6, 1.0) * FORCE), true={"force": None}
    ),
    Way("a gain that steps by 8 %", other(force_N=np.where(TIME > 2.0, 1.08, 1.0) * FORCE), true={"force": None}),
    Way("a zero that drifts by 100 N", other(force_N=FORCE + 25.0 * TIME), true={"force": None}),
    *(
        Way(f"force {1e3 * late:g} ms late", other(force_N=np.interp(TIME - late, TIME, FORCE)), true={"force": None})
        for late in (0.02, 0.05, 0.1)
    ),
    *(
        Way(f"force behind a low-pass of 10 Hz, order {n}", other(force_N=behind(10.0, FORCE, n)), true={"force": None})
        for n in (1, 2)
    ),
    Way(
        "force behind a low-pass of 10 Hz, displacement behind one of 60 Hz",
        other(force_N=behind(10.0, FORCE), displacement_m=behind(60.0, X)),
        true={"force": None},
    ),
    Way(
        "a soft amplifier of a force that is mostly viscous, before the noise",
        other(force_N=400.0 * np.tanh((4000.0 * V + 100.0 * np.sign(V)) / 400.0) + NOISE),
        true={"force": None},
    ),
    Way("force cut off before the noise", other(force_N=np.clip(FORCE, -250.0, 250.0) + NOISE), true={"force": None}),
    Way(
        "a voltage that drops to 0 V in 2 % of the rows",
        other(voltage_V=np.where(RNG.random(TIME.size) < 0.02, 0.0, VOLTS)),
    ),
    Way("an unsteady clock", other(time_s=np.sort(TIME + 3e-4 * RNG.standard_normal(TIME.size)))),
    Way(
        "a recorded speed that is late by 20 ms",
        other(velocity_m_per_s=np.interp(TIME - 0.02, TIME, V)),
        true={"velocity": V},
    ),
    Way(
        "a temperature in every 500th row",
        other(temperature_degC=["22.5" if n % 500 == 0 else "" for n in range(TIME.size)]),
        true={"temperature": 22.5},
    ),
    Way(
        "a temperature that is missing in one row",
        other(temperature_degC=["" if n == 9 else "22.5" for n in range(TIME.size)]),
    ),
    Way(
        "displacement and force exchanged, in millimetres and newtons",
        {"time_s": TIME, "displacement_m": FORCE / 1e4, "force_N": X * 1e3},
    ),
    Way("a hundred thousand brackets", text=lambda t: ["[" * 100_000], name="a.json"),
    Way("a JSON file", text=lambda t: [json.dumps({"time_s": TIME[:5].tolist()})]),
)


def moves_as(record: Any, true: dict[str, Any]) -> bool:
    """Whether the speed is right; None where it cannot be."""
    wanted = true.get("velocity", V if record.time.size == V.size and true["displacement"] is X else record.velocity)
    return wanted is not None and bool(np.abs(record.velocity - wanted).max() < 0.1 * np.abs(wanted).max())


def record_is(way: Way, record: Any) -> bool:
    """Whether the record is the test that was written down."""
    true = {"displacement": X, "force": FORCE, "voltage": 100.0, "temperature": None} | way.true
    for name in ("displacement", "force"):
        values, wanted = getattr(record, name), true[name]
        if wanted is None or values.size != wanted.size or np.abs(values - wanted).max() > 1e-3 * np.abs(wanted).max():
            return False
    if abs(float(np.ptp(record.time)) - float(np.ptp(TIME))) > 1e-6 or not moves_as(record, true):
        return False
    labels = ((record.median_voltage(), true["voltage"]), (record.median_temperature(), true["temperature"]))
    return all(wanted is None or (got is not None and abs(got - wanted) < 0.5) for got, wanted in labels)


def tried(way: Way) -> tuple[str, str]:
    """What happened, and the first thing that was said."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / way.name
        path.write_bytes((way.newline.join(way.lines()) + way.newline).encode(way.encoding))
        entry = {"path": way.name, **way.entry}
        try:
            config = RigConfig.model_validate_json(json.dumps({"files": [entry]}))
            rig = ingest(config, Control(), Path(folder))
        except UserError as error:
            return "refused", error.messages[0].replace(f"{folder}/", "")
        except ValidationError as error:
            return "refused", str(error).splitlines()[2].strip()
    said = [f"{f.check}: {f.where}, {f.size:.4g} {f.unit}; {f.follows}" for e in rig.entries for f in e.findings]
    right = len(rig.records) == 1 and record_is(way, rig.records[0])
    return "right" if right else "finding" if said else "SILENTLY WRONG", said[0] if said else ""


def main() -> int:
    """Print the table; 1 where anything is silently wrong."""
    results = [(way.told, *tried(way)) for way in WAYS]
    for number, (told, happened, said) in enumerate(results, start=1):
        sys.stdout.write(f"{number:2d}  {told:62}  {happened:14}  {said[:150]}\n")
    counts = {
        what: sum(happened == what for _, happened, _ in results) for what in dict.fromkeys(r[1] for r in results)
    }
    sys.stdout.write(f"{len(results)} ways: {', '.join(f'{count} {what}' for what, count in counts.items())}\n")
    return int("SILENTLY WRONG" in counts)


if __name__ == "__main__":
    sys.exit(main())
