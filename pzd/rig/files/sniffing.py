"""Guesses about a file of unknown layout: its dialect, the quantity in each column, the values in its name.

Only for the guess of a config, and for the few rows of a measured curve: a run reads records by its config.
"""

from __future__ import annotations

import codecs
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from pzd.artefacts.table import PRESSURES
from pzd.quantities import (
    ACCELERATION,
    CHANNELS,
    DISPLACEMENT,
    FORCE,
    PRESSURE,
    TEMPERATURE,
    TIME,
    VELOCITY,
    VOLTAGE,
    Control,
    Quantity,
)
from pzd.rig.config import FilesEntry, FileSplit
from pzd.rig.files.dialect import (
    BLANKS,
    ROW_NAMES,
    SEPARATORS,
    are_numbered,
    fields_of,
    plain_numbers,
    text_bytes,
    unquoted_fields,
    without_mark,
)
from pzd.rig.files.formats import TEXT, format_of, formats, read_sheet, rows_in, tables_in
from pzd.rig.files.layout import ALSO_READ, minus_before, own_quantity
from pzd.rig.files.one_clock import headers_together
from pzd.rig.files.sheet import Wanted, spelled
from pzd.rig.files.units import SPELLINGS, UnitError, factor_in, in_header, is_unit, to_canonical
from pzd.schema.errors import DataError, at

# --- Quantity of a column, by its header in ten languages: de en es fr it ja pl pt ru zh ---

_LOOKS_LIKE = {
    TIME: r"^t$|^tout$|^x_value$|^x-axis$|^x_axis$|^epoch|^millis|^micros"
    r"|time|clock|zeit|\btemps\b|tiempo|\btempo\b|^czas|^second|^sek"
    r"|\u65f6\u95f4|\u6642\u9593|^\u0432\u0440\u0435\u043c",
    DISPLACEMENT: r"^[xs]$|disp|^dist|pos|stroke|travel|lvdt|exten|weg|hub|federung|course|placement|desplaz|carrera"
    r"|(?:(?<![a-z])|lin|linear|string)pot(?![a-z])(?!.*(?:temp|volt))|potentiom|recorrido|spostament|corsa|desloca|^curso|przemieszcz|^skok"
    r"|\u043f\u0435\u0440\u0435\u043c\u0435\u0449|\u0441\u043c\u0435\u0449|^\u0445\u043e\u0434"
    r"|\u4f4d\u79fb|\u884c\u7a0b|\u5909\u4f4d|\u30b9\u30c8\u30ed\u30fc\u30af",
    VELOCITY: r"^v$|vel|speed|geschw|vitesse|pr[eę]dko|(?<!\u52a0)\u901f\u5ea6"
    r"|\u0441\u043a\u043e\u0440\u043e\u0441\u0442",
    ACCELERATION: r"^a$|acc|beschl|acel|przyspiesz|\u52a0\u901f\u5ea6",
    FORCE: r"^f$|^for[cç]|force|load|kraft|effort|fuerza|carga|forza|carico|^si[lł]a|(?<![\u538b\u5727])\u529b"
    r"|\u8f7d\u8377|\u8377\u91cd|\u8d1f\u8377|^\u0441\u0438\u043b|\u0443\u0441\u0438\u043b\u0438|\u043d\u0430\u0433\u0440\u0443\u0437\u043a",
    TEMPERATURE: r"temp(?!s\b|o\b)|t[eé]mp[eé]r|\u6e29\u5ea6|\u6eab\u5ea6"
    r"|\u0442\u0435\u043c\u043f\u0435\u0440\u0430\u0442\u0443\u0440",
    PRESSURE: r"^p$|(?<!com)press|druck|presi|ci[sś]nieni|\u538b\u529b|\u5727\u529b"
    r"|\u0434\u0430\u0432\u043b\u0435\u043d\u0438",
}
"""Headers of each quantity, without a unit in brackets."""
CONTROLS = {
    Control("pwm", "%"): r"\bpwm|\bduty|tastverh|tastgrad",
    Control(): r"^u$|volt|spannung|tension|tensi[oó]n|napi[eę]ci|tens[aã]o|\u7535\u538b|\u96fb\u5727"
    r"|\u043d\u0430\u043f\u0440\u044f\u0436\u0435\u043d\u0438",
    Control(
        "current", "A"
    ): r"^i$|current|strom|courant|corriente|corrente|^pr[aą]d|\u7535\u6d41|\u96fb\u6d41|^\u0442\u043e\u043a",
}
"""Headers of the control signal; a share of time goes before the voltage that it chops."""
REBOUND, COMPRESSION = "rebound", "compression"
"""Columns of force by direction, as the keys of a curve's `columns`."""
DIRECTIONS = {
    REBOUND: re.compile(r"(?i)rebound|extension|\breb\b|zugstufe|d[ée]tente|estensione|rebote|\u4f38|\u590d\u539f"),
    COMPRESSION: re.compile(r"(?i)compr|jounce|\bbump\b|\bcomp\b|druckstufe|\bbound\b|\u7e2e|\u538b\u7f29"),
}
"""Headers of the force in one direction."""
_WITH_UNIT = {
    TIME: "^t$",
    DISPLACEMENT: "^[xs]$",
    VELOCITY: "^v$",
    ACCELERATION: "^a$",
    FORCE: "^f$",
    TEMPERATURE: "^t$",
    PRESSURE: "^p$",
}
"""Symbols of a quantity where a unit of it follows: `x_m`, `F_kN`, `T [degC]`."""
_CONTROLS_WITH_UNIT = {
    Control("pwm", "%"): "ctrl|control|valve|coil",
    Control(): "^u$|ctrl|control|valve|piezo|coil",
    Control("current", "A"): "^i$|ctrl|control|valve|coil",
}
"""Symbols of the control signal where a unit of it follows: `U_V`, `ctrl [V]`, `Coil/A`."""
_CLOCKS = {"millis": "ms", "micros": "us"}
"""Units of the clocks of small boards, after whose functions columns are named."""
_LAST_WORD = re.compile(r"[ _/,]\s*([A-Za-zµ°%\u0400-\u04ff][A-Za-zµ°/²^0-9\u0400-\u04ff]*)$")
_DEGREES = dict.fromkeys(("C", "°C", "deg C", "grad C", "Grad C"), "degC") | dict.fromkeys(("F", "°F", "deg F"), "degF")
"""Spellings of degrees that pint does not know, or takes for coulombs and farads."""


def control_of(headers: Sequence[str], units: Sequence[str] | None) -> Control:
    """Guess the control signal from the headers and the row of units; a voltage where they show none."""
    below: Sequence[str | None] = units or [None] * len(headers)
    shown = [
        control
        for control, pattern in CONTROLS.items()
        for header, unit in zip(headers, below, strict=True)
        if (re.search(pattern, _bare(header)) and quantity_of(header, None, Control()) not in (FORCE, DISPLACEMENT))
        or _by_unit(header, unit, control) is VOLTAGE
    ]
    return next(iter(shown), Control())


def assigned(headers: Sequence[str], units: Sequence[str] | None, control: Control) -> dict[Quantity, str]:
    """Assign headers to quantities, each header to one quantity alone; of several that say as much, the first.

    A column in a unit of the quantity is taken before one in volts or without a unit, and what was measured along the
    stroke before what was demanded or acts across it.
    """
    return {quantity: heads[0] for quantity, heads in claims(headers, units, control).items()}


_NOT_THE_ONE = re.compile(
    r"command|\bcmd|_cmd|soll|set[ _-]?p(oin)?t\b|demand|target|desired|setting|\bref\b|_ref\b|referen|consigne"
    r"|consigna|zadan|\bside|lateral|transvers|radial|horizontal|\bquer|seitlich|seiten|friction|reibung|\berror\b"
    r"|abweichung"
    r"|\u6307\u4ee4|\u8bbe\u5b9a|\u76ee\u6a19|\u76ee\u6807"
)
"""Words in the header of what was demanded and not measured, acts across the stroke, or is a part of the force."""


def claims(headers: Sequence[str], units: Sequence[str] | None, control: Control) -> dict[Quantity, list[str]]:
    """Return by quantity the headers that name it best, in their order; several where nothing tells which is meant.

    A word says more than a symbol, which may be that of a frequency or a sample.
    """
    found: dict[Quantity, tuple[tuple[bool, int, bool], list[str]]] = {}
    for index, header in enumerate(headers):
        below = units[index] if units else None
        quantity = quantity_of(header, below, control)
        if quantity is None:
            continue
        canonical = is_canonical(header, quantity, control)
        unit = unit_of(header, below, own_quantity(quantity, control))
        rank = 3 if canonical else 2 if unit is not None else 0 if _in_brackets(header, units, index) else 1
        best = canonical or not _NOT_THE_ONE.search(_bare(header)), rank, len(_bare(header)) > 1
        if quantity not in found or best > found[quantity][0]:
            found[quantity] = (best, [header])
        elif best == found[quantity][0] and _bare(header) not in map(_bare, found[quantity][1]):
            found[quantity][1].append(header)
    named = {quantity: found[quantity][1] for quantity in CHANNELS if quantity in found}
    warm = [] if TEMPERATURE in named else _warm_without_a_name(headers, units, control)
    return {**named, TEMPERATURE: warm} if len(warm) == 1 else named


def _warm_without_a_name(headers: Sequence[str], units: Sequence[str] | None, control: Control) -> list[str]:
    """Return the headers of no quantity that a unit of temperature follows: `oil [degC]`."""
    below: Sequence[str | None] = units or [None] * len(headers)
    return [
        header
        for header, unit in zip(headers, below, strict=True)
        if quantity_of(header, unit, control) is None
        and is_in_unit(header, unit, TEMPERATURE)
        and not _NOT_THE_ONE.search(_bare(header))
    ]


def is_in_unit(header: str, below: str | None, quantity: Quantity) -> bool:
    """Whether a unit of a quantity stands in a header or below it; a last letter may be the name of a channel."""
    last = _LAST_WORD.search(header)
    named = bool(below and below.strip("[]() ")) or in_header(header, quantity) or (last and len(last[1]) > 1)
    return bool(named) and unit_of(header, below, quantity) is not None


def is_canonical(header: str, quantity: Quantity, control: Control) -> bool:
    """Whether a header is read without being named in the config."""
    return header in (own_quantity(quantity, control).column, ALSO_READ.get(quantity))


def unit_of(header: str, below: str | None, quantity: Quantity) -> str | None:
    """Return the unit in the row of units or the header, as pint spells it; None where it is of another quantity."""
    if factor_in(header) is not None:
        return None  # only a person knows which way it counts
    last = _LAST_WORD.search(header)
    text = below.strip("[]() ") if below and below.strip("[]() ") else in_header(header, quantity) or (last and last[1])
    if not text and quantity is TIME:
        text = next((unit for begin, unit in _CLOCKS.items() if header.lower().startswith(begin)), None)
    if not text:
        return None
    unit = _DEGREES.get(text, text) if quantity is TEMPERATURE else text
    try:
        to_canonical(np.zeros(1), unit, quantity)
    except UnitError:
        return None
    return unit


def quantity_of(header: str, below: str | None, control: Control) -> Quantity | None:
    """Return the quantity in a header; of two (Druckkraft, load cell voltage) the mechanical one.

    Parameters
    ----------
    header : of the column
    below : of the row of units, where there is one
    control : the control signal
    """
    for quantity in CHANNELS:
        if is_canonical(header, quantity, control):
            return quantity
    if (meant := _by_unit(header, below, control)) is not None:
        return meant
    bare = _bare(header)
    for quantity in (FORCE, DISPLACEMENT, VELOCITY, ACCELERATION, TIME, TEMPERATURE, PRESSURE):
        if re.search(_LOOKS_LIKE[quantity], bare) and not (quantity is VELOCITY and "rpm" in header.lower()):
            return quantity
    return VOLTAGE if re.search(CONTROLS[control], bare) else None


def _by_unit(header: str, below: str | None, control: Control) -> Quantity | None:
    """Return the quantity of a header by the unit in it; None without one."""
    word = _LAST_WORD.sub("", _bare(header))
    for quantity, pattern in {**_WITH_UNIT, VOLTAGE: _CONTROLS_WITH_UNIT[control]}.items():
        if re.search(pattern, word) and unit_of(header, below, own_quantity(quantity, control)) is not None:
            return quantity
    return None


def _in_brackets(header: str, units: Sequence[str] | None, index: int) -> bool:
    """Whether a header has any unit in brackets."""
    return bool(units and units[index]) or bool(re.search(r"[\[(].*[\])]", header))


def _bare(header: str) -> str:
    return re.sub(r"[\[(\uff08\u3010].*", "", header).strip().lower()


# --- Values in the name of a file: control signal, temperature, position of the clickers ---

_SYMBOLS = {"voltage": "[UV]", "current": "I"}
"""Symbols that may stand before a number: I1p25A, U=100. A is an amplitude as often as amperes, T a period."""
_ALONE = r"(?:(?<![A-Za-z0-9])|(?<=^[UVIT])|(?<=[^A-Za-z0-9][UVIT]))(?<![0-9][.,])"
_NUMBER = rf"{_ALONE}([0-9]+(?:[.xp,][0-9]+)?)"
_BEFORE_SYMBOL = re.compile(r"[0-9] ?[A-Za-z%]+ ?=")
"""A number before a symbol with its own value: of `Test 1 V=0` the 1 is no voltage."""
_UNITS_IN_NAMES = {
    "voltage": "mV|kV|V|Volts?",
    "current": "mA|A|Amps?",
    "pwm": "%|pct|percent",
    "temperature": "degC|C|degF|(?<=[0-9][0-9])F",  # F2 and 2F are front more often than degrees
}
_VALUES = {
    name: re.compile(rf"{_NUMBER}{'' if name == 'temperature' else ' ?'}({units})(?![A-Za-z]| ?=)")
    for name, units in _UNITS_IN_NAMES.items()
}
"""150V, 0x5A, 0p5A, 0.5 Amp, 40pct, 22degC, 104F."""
_WORDS_IN_NAMES = {
    "voltage": "volt(?:age)?|spannung|tension",
    "current": "current|strom|courant|corriente",
    "pwm": "pwm|duty",
    "temperature": "temp(?:eratur)?e?",
}
"""Words before a number whose unit may be missing: current=0.5, pwm40."""
_CLICKERS = (
    "C[0-9]+_?R[0-9]+",
    "R[0-9]+_?C[0-9]+",
    "(?i:[ck]lick(?:er|s)?[ _-]?[0-9]+)",
    "(?i:[0-9]+[ _-]?[ck]lick(?:er|s)?)",
    "(?i:(?:reb(?:ound)?|comp(?:ression)?|bump)[0-9]+)(?![.,][0-9])",
    rf"[0-9]+(?:\.[0-9]+)?[ _-]?(?:{'|'.join(sorted(PRESSURES))})",
)
"""C08_R12, R12C8 (clicks from closed in compression and rebound), click5, 5 clicks, Klick-5, reb2, 150psi."""
STATES = re.compile(
    "(?i:(?<![a-z])(?:before|after|old|new|aged|worn|fresh|rebuilt|vorher|nachher|alt|neu|avant|apres|antes|despues)"
    "(?![a-z]))"
)
"""Words for a state of a damper."""
_DAMPERS = (
    "LF|LR|RF|RR|FL|FR|RL|lf|lr|rf|rr|fl|fr|rl",
    "(?i:(?:front|rear)[ _-]?(?:left|right)|(?:left|right)[ _-]?(?:front|rear)|front|rear|left|right)",
    "(?i:S/?N[ _-]?[0-9]+)",
    "(?i:(?:damper|shock)[ _-]?[0-9]+)",
)
"""Corner, axle or side of a car, serial number or number of a damper: LF, front_left, SN1041, damper 1."""


def value_in_names(stems: Sequence[str], name: str) -> tuple[str, str | None] | None:
    """Return the pattern that finds a quantity in every name, and its unit; None where a name lacks it.

    Where the units differ (500mA, 1A) they are in the group of the pattern, and the unit returned is empty; where a
    word stands for it (current=0.5) there is None.

    Parameters
    ----------
    stems : names of files, without their ending
    name : `voltage`, `current`, `pwm` or `temperature`
    """
    matches = [_VALUES[name].search(stem) if name in _VALUES else None for stem in stems]
    found = [(stem, match) for stem, match in zip(stems, matches, strict=True) if match]
    units = sorted({match[2] for _, match in found})
    if len(found) < len(stems):
        return _value_behind_word(stems, name) if name in _VALUES else None
    if name == "temperature" and len(units) > 1:
        return None
    if name != "temperature" and any(_two_numbers(stem, match) for stem, match in found):
        return None
    minus = {minus_before(stem, match.start(1)) for stem, match in found if stem[: match.start(1)].endswith("-")}
    if len(minus) > 1:
        return None  # a dash in one name and a minus in another
    comma = "," if any("," in match[1] for _, match in found) else ""
    blank = " ?" * any(match.end(1) < match.start(2) for _, match in found)
    number = f"{'-?' * (True in minus)}[0-9.{comma}xp]+"
    end = "(?![A-Za-z]| ?=)" if any(map(_BEFORE_SYMBOL.search, stems)) else "(?![A-Za-z])"
    if len(units) > 1:
        return f"(?P<{name}>{number}{blank}(?:{'|'.join(units)})){end}", ""
    unit = units[0]
    return f"(?P<{name}>{number}){blank}{unit}{end}", _spelled_unit(unit)


def _spelled_unit(unit: str) -> str:
    """Return the unit of a value in a name as pint spells it."""
    return _DEGREES.get(unit, SPELLINGS.get(unit, unit))


def _value_behind_word(stems: Sequence[str], name: str) -> tuple[str, str | None] | None:
    """Return the pattern that finds a number behind the word for a quantity in every name, and its unit if any."""
    word = f"(?i:{_WORDS_IN_NAMES[name]})[ _=]?"
    if name in _SYMBOLS and not any(re.search(word, stem) for stem in stems):
        word = f"{_SYMBOLS[name]}="
    number = "[0-9]+(?:[.xp,][0-9]+)?"
    whole = re.compile(rf"(?<![A-Za-z]){word}{number}({_UNITS_IN_NAMES[name]})?(?![A-Za-z0-9])")
    matches = [whole.search(stem) for stem in stems]
    units = {match[1] for match in matches if match}
    if not all(matches) or len(units) != 1:
        return None
    unit = units.pop()
    told = None if unit is None else _spelled_unit(unit)
    return f"(?<![A-Za-z]){word}(?P<{name}>{number}){unit or ''}(?![A-Za-z0-9])", told


_SAID = re.compile(
    r"""[^\w\n]*(?P<label>[^\d\W][^:\uff1a=;,\t\n]*?)[\s."']*[:\uff1a=;,\t][^\w\n+-]*
    (?P<number>[-+]?\d+(?:[.,]\d+)?)[^\w\n%\u00b0]*(?P<unit>[A-Za-z%\u00b0\u00b5]{1,5})?\W*""",
    re.VERBOSE,
)
"""A line above a header: `Current [A]: 0.5`, `# Strom; 0,5; A`."""


def said_above(texts: Sequence[str], quantities: Sequence[Quantity], control: Control) -> tuple[str, dict[str, str]]:
    r"""Return the pattern that finds labels of the tests in the lines above each table, and the unit of each label.

    What is the same above all of them may be the supply of the valve or a limit of the stand.

    Parameters
    ----------
    texts : lines above each table
    quantities : labels to look for: `VOLTAGE` for the control signal, the temperature
    control : the control signal

    Returns
    -------
    an empty pattern where no label is said above every table

    Examples
    --------
    >>> above = ["Valve\nCurrent [A]: 0.5", "Valve\nCurrent [A]: 1.0"]
    >>> said_above(above, [VOLTAGE], Control("current", "A"))[1]
    {'current': 'A'}
    """
    lines = [[match for line in text.split("\n") if (match := _SAID.fullmatch(line))] for text in texts]
    found: dict[str, tuple[int, str, str]] = {}
    for place, first in enumerate(lines[0] if lines else []):
        label = first["label"].strip()
        same = [match for of_text in lines for match in of_text if match["label"].strip() == label]
        for quantity in quantities:
            name = own_quantity(quantity, control).name
            units = {unit_of(label, match["unit"], own_quantity(quantity, control)) for match in same}
            meant = quantity_of(label, first["unit"], control) is quantity and name not in found
            differ = len(same) == len(texts) and len({match["number"] for match in same}) > 1
            if meant and differ and len(units) == 1 and (unit := units.pop()) is not None:
                number = rf"^\W*{_as_pattern(label)}[^\w\n-]*(?P<{name}>-?[0-9]+(?:[.,][0-9]+)?)"
                found[name] = place, number, unit
    patterns = [pattern for _, pattern, _ in sorted(found.values())]
    return r"[\s\S]*?".join(patterns), {name: unit for name, (_, _, unit) in found.items()}


def _as_pattern(text: str) -> str:
    return re.escape(text).replace("\\ ", " ")


_DECIMALS_OF_IT = re.compile(r"(?<!\d)\d{1,2}[_-]$")


def doubt_in_names(stems: Sequence[str]) -> tuple[str, str, str] | None:
    """Return a control signal that stands in every name, its unit, and a number of it that may be two; None without.

    Examples
    --------
    >>> doubt_in_names(["mr_0_5A", "mr_1_5A"])
    ('current', 'A', '0_5A')
    """
    for name, unit in (("voltage", "V"), ("current", "A")):
        found = [(stem, match) for stem in stems if (match := _VALUES[name].search(stem))]
        doubtful = [told for stem, match in found if (told := _two_numbers(stem, match))]
        if doubtful and len(found) == len(stems):
            return name, unit, max(doubtful, key=lambda number: number.rstrip("VAmk")[-1])  # 0_5 asks better than 0_0
    return None


def _two_numbers(stem: str, match: re.Match[str]) -> str | None:
    """Return a number in a name with one before it, of which it may be the decimals: 0_5A, 1-5A; None without."""
    before = _DECIMALS_OF_IT.search(stem[: match.start(1)])
    return stem[before.start() : match.end()] if before and match[1].isdigit() and len(match[1]) < 3 else None


def setting_in_names(stems: Sequence[str], among: Sequence[str]) -> str | None:
    """Return the pattern that finds which damper, and the position of its clickers, in every name; None without either.

    Parameters
    ----------
    stems : names of the files that one pattern is for, without their ending
    among : names of all files; which damper it is counts where there are several
    """
    damper, clickers = _damper_in_names(stems, among), next((one for one in _CLICKERS if _in_each(one, stems)), None)
    if damper is None or clickers is None:
        only = damper or clickers
        return _as_setting(only) if only else None
    ways = (f"(?:{damper})[ _-]*(?:{clickers})", f"(?:{clickers})[ _-]*(?:{damper})")
    return next((_as_setting(way) for way in ways if _in_each(way, stems)), None)


def settings_apart(stems: Sequence[str], among: Sequence[str]) -> list[str] | None:
    """Return the setting of each name where damper and clickers stand too far apart in the names for one pattern.

    Examples
    --------
    >>> names = ["LF_2in_s_click5", "RF_2in_s_click5"]
    >>> settings_apart(names, among=names)
    ['LF_click5', 'RF_click5']
    """
    damper, clickers = _damper_in_names(stems, among), next((one for one in _CLICKERS if _in_each(one, stems)), None)
    if damper is None or clickers is None or setting_in_names(stems, among) is not None:
        return None
    both = [[re.search(_as_setting(one), stem) for one in (damper, clickers)] for stem in stems]
    return ["_".join(match["setting"] for match in matches if match) for matches in both]


def _damper_in_names(stems: Sequence[str], among: Sequence[str]) -> str | None:
    """Return the pattern of which damper it is: one in every name, and not the same in all files."""
    for one in _DAMPERS:
        found = {stem: {match["setting"] for match in re.finditer(_as_setting(one), stem)} for stem in among}
        if all(len(found[stem]) == 1 for stem in stems) and len(set[str]().union(*found.values())) > 1:
            return one
    return None


def _in_each(pattern: str, stems: Sequence[str]) -> bool:
    return all(re.search(_as_setting(pattern), stem) for stem in stems)


def _as_setting(pattern: str) -> str:
    return f"(?<![A-Za-z0-9])(?P<setting>{pattern})(?![A-Za-z0-9])"


def one_pattern(patterns: Sequence[str], stems: Sequence[str]) -> str | None:
    """Join patterns in the order of the names; None where names have no common order."""
    matches = [(match.start() if (match := re.search(one, stems[0])) else 0, one) for one in patterns]
    found = [one for _, one in sorted(matches, key=itemgetter(0))]
    whole = ".*?".join(found)  # as little as can be between them: else a first digit is lost
    return whole if found and all(re.search(whole, stem) for stem in stems) else None


def setting_of(pattern: str | None, path: Path) -> str | None:
    """Return the setting that a pattern finds in the name of a file; None where it finds none."""
    found = (re.search(pattern, path.stem) or re.search(pattern, path.name)) if pattern else None
    return found.groupdict().get("setting") if found else None


# --- Dialect ---

MOST_LINES = 400
"""Lines from the top that are looked at: a preamble is shorter, and a table shows itself in fewer."""
_CELL_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
_CLOCK = re.compile(r"\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}([T ].*)?|\d{1,2}:\d{2}(:\d{2}.*)?|\d{4}-\d{2}-\d{2}T.*")
_UNIT = re.compile(r"[\[(]?\s*[A-Za-zµ°%/²³^*.0-9-]{1,8}\s*[\])]?|-")


@dataclass(frozen=True)
class Dialect:
    """Encoding, separators and header of a file; where they are the defaults, the config need not give them."""

    header: tuple[str, ...]
    units: tuple[str, ...] | None
    """Unit of every column where the file gives it apart from the header."""
    first: tuple[str, ...]
    """First row of data."""
    encoding: str = "utf-8"
    separator: str = ","
    decimal: str = "."
    skip: int = 0
    """Lines above the header."""
    units_row: bool = False
    """Whether the units are in a row below the header."""
    apart: bool = False
    """Whether the config names the headers, since no line holds them as they are: blanks separate the rows and stand
    within the headers too, or further lines stand below them."""
    without_fields: tuple[str, ...] = ()
    """Last names of the header, of which no row has a field; they are none of `header`."""
    headless: bool = False
    """Whether the file has no headers; those here are made up."""

    @property
    def header_line(self) -> int:
        """Line of the header in the file."""
        return self.skip + 1

    def entry(self, path: Path, form: str, split: FileSplit | None = None) -> FilesEntry:
        """Return the entry of `rig.files` that reads a file of this dialect.

        Parameters
        ----------
        path : the file
        form : name of its format
        split : how it is cut into tests
        """
        options: dict[str, Any] = {"skip": self.skip, "units_row": self.units_row, "decimal": self.decimal}
        if self.headless or self.apart or self.without_fields:
            options["header"] = self.header
        if form == TEXT:
            options |= {"separator": self.separator, "encoding": self.encoding}
        return FilesEntry(path=str(path), split=split, **options)


def described(path: Path) -> tuple[Dialect, str]:
    """Guess dialect and format of a file; of several tables, by the one with most of a rig's channels.

    Raises
    ------
    UserError : when the file cannot be read, or holds no table
    """
    form = format_of(path, None, "rig.files")
    module, entry = formats()[form], FilesEntry(path=str(path))
    if form == TEXT:
        found = sniffed(path)
        if found is not None:
            return found, form
        sheet = read_sheet(path, entry, Wanted(known=frozenset(q.column for q in CHANNELS)), "rig.files")
        return Dialect(sheet.header, None, ("",) * len(sheet.header), skip=(sheet.header_line or 1) - 1), form
    sheets = rows_in(path, module)
    if sheets is not None:
        sniffs = [dialect for rows in sheets.values() if (dialect := sniffed_rows(rows)) is not None]
    else:
        filled = [table for table in tables_in(path, entry, module) if table.rows]
        together = headers_together(filled)
        filled += [together] if together else []
        sniffs = [Dialect(t.header, t.units, tuple(spelled(cells[0]) for cells in t.cells)) for t in filled]
    if not sniffs:
        raise DataError(f"{at(path)}: {module.KIND} without a table of numbers below headers")
    return max(sniffs, key=lambda d: len(assigned(d.header, d.units, control_of(d.header, d.units)))), form


def sniffed(path: Path) -> Dialect | None:
    """Guess the dialect of a text file; None where no line of numbers below a header is found.

    Raises
    ------
    FilesError : when the file cannot be read
    DataError : when it is a file of another kind
    """
    raw = text_bytes(path)
    found = [dialect for encoding in _encodings(raw) if (dialect := _sniffed_as(raw, encoding)) is not None]
    return max(found, key=lambda d: len(assigned(d.header, d.units, control_of(d.header, d.units)))) if found else None


def _sniffed_as(raw: bytes, encoding: str) -> Dialect | None:
    """Guess the dialect of a text in an encoding."""
    text = raw.decode(encoding, errors="replace").removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")[:MOST_LINES]
    # In quotes a decimal comma may stand between separating ones.
    quoted = any('","' in line for line in lines)
    readings = [(s, d) for s in (*SEPARATORS, BLANKS) for d in ".," if s != d or quoted]
    tables = [_table([_fields(line, reading[0]) for line in lines], encoding, *reading, lines) for reading in readings]
    found = [table for table in tables if table is not None]
    best = max(found, key=lambda rated: rated[0])[1] if found else None
    if best is not None and _of_a_rig(best):
        return best
    apart = _names_apart(lines, encoding)
    return apart if apart is not None and _of_a_rig(apart) else best


def _of_a_rig(dialect: Dialect) -> bool:
    """Whether the headers name displacement and force."""
    return {DISPLACEMENT, FORCE} <= set(
        assigned(dialect.header, dialect.units, control_of(dialect.header, dialect.units))
    )


_WIDE_BLANKS = re.compile(r"\s{2,}|\t")
_NAME_AND_UNIT = re.compile(r"[^\[\]()]+[\[(][^\])]*[\])]")


def _names_apart(lines: Sequence[str], encoding: str) -> Dialect | None:
    """Guess the headers above rows that blanks separate, where the headers hold blanks: `Axial Force`, `Pos [mm]`.

    They end at two blanks or more, or behind a unit in brackets.
    """
    for decimal in ".,":
        rows = [line.split() for line in lines]
        whole = [len(row) > 2 and _numbers(row, decimal) == len(row) for row in rows]
        starts = (n for n in range(1, len(rows) - 1) if whole[n] and whole[n + 1] and len(rows[n]) == len(rows[n + 1]))
        first = next(starts, None)
        if first is None or whole[first - 1]:
            continue
        above = [n for n in range(first) if rows[n]][-2:]
        width = len(rows[first])
        below = rows[above[-1]] if len(above) > 1 and all(_UNIT.fullmatch(cell) for cell in rows[above[-1]]) else []
        line = lines[above[0] if len(below) == width else above[-1]].strip()
        ways = (_WIDE_BLANKS.split(line), [name.strip() for name in _NAME_AND_UNIT.findall(line)])
        names = next((way for way in ways if len(way) == width), None)
        if names is None:
            continue
        if len(below) == width:
            names = [f"{name} [{unit.strip('[]()')}]" for name, unit in zip(names, below, strict=True)]
        return Dialect(tuple(names), None, tuple(rows[first]), encoding, BLANKS, decimal, skip=first, apart=True)
    return None


def _fields(line: str, separator: str) -> list[str]:
    """Split a line into its fields, separators in quotes left alone."""
    return unquoted_fields(line, separator) if '"' in line else fields_of(line, separator)


def sniffed_rows(rows: Sequence[Sequence[str]]) -> Dialect | None:
    """Guess the header and first row among rows of cells, as in the sheet of a workbook."""
    width = max((sum(bool(cell) for cell in row) for row in rows), default=0)
    cells = [[cell.strip() for cell in row[:width]] for row in rows[:MOST_LINES]]
    found = [table for decimal in ".," if (table := _table(cells, "utf-8", "\t", decimal)) is not None]
    return max(found, key=lambda rated: rated[0])[1] if found else None


_CODE_PAGES = ("latin-1", "cp1250", "cp1251", "gbk", "shift_jis")
"""Encodings that are tried where a text is neither UTF-8 nor UTF-16; the one in which most headers mean something."""


def _encodings(raw: bytes) -> tuple[str, ...]:
    """Return the encodings that a text may be in."""
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return ("utf-16",)
    if wide := without_mark(raw):
        return (wide,)
    return tuple(page for page in _CODE_PAGES if _reads(raw, page)) if not _reads(raw, "utf-8") else ("utf-8",)


def _reads(raw: bytes, encoding: str) -> bool:
    try:
        raw.decode(encoding)
    except UnicodeDecodeError:
        return False
    return True


def _table(
    cells: list[list[str]], encoding: str, separator: str, decimal: str, lines: Sequence[str] = ()
) -> tuple[tuple[int, int], Dialect] | None:
    """Find the table in rows read this way, from lines of a text, rated by its rows and then the numbers in them."""
    rows = [[_unquoted(cell) for cell in row] for row in cells]
    numbers = [_numbers(row, decimal) for row in rows]
    data = [n for n, row in enumerate(rows) if len(row) > 1 and _mostly_numbers(row, numbers[n])]
    # A line of the preamble, say one of a date, may hold numbers too, but it is narrower than the table.
    usual = Counter(len(rows[n]) for n in data).most_common(1)[0][0] if data else 0
    data = _of_the_table(rows, [n for n in data if len(rows[n]) >= usual], decimal)
    if not data:
        return None
    numbered = bool(lines) and are_numbered([lines[n] for n in data])
    first = start = data[0]
    if first == 0:
        return _headless(rows, data, numbers, encoding, separator, decimal)
    width = len(rows[first])
    above = [n for n in range(first) if any(rows[n])][-2:]  # empty lines may stand between head and rows
    if not above:
        return None
    if above[-1] != first - 1:
        rows = [*rows[: above[-1] + 1], *rows[first:]]
        first = above[-1] + 1
        data = [
            n
            for n in range(first, len(rows))
            if len(rows[n]) >= usual and _mostly_numbers(rows[n], _numbers(rows[n], decimal))
        ]
        numbers = [_numbers(row, decimal) for row in rows]
    if width == len(rows[first - 1]) + 1 and not any(rows[n][-1] for n in data if len(rows[n]) == width):
        width -= 1  # a separator behind the last field
        rows = [row[:width] for row in rows]
    elif numbered and width == len(rows[first - 1]) + 1:
        rows = [[ROW_NAMES, *row] if n < first else row for n, row in enumerate(rows)]
    below = rows[first - 1]
    units = first > 1 and len(rows[first - 2]) == len(below) == width and bool(below[0] or rows[first - 2][0])
    units = (
        units
        and any(below)
        and (
            all(_UNIT.fullmatch(cell) or cell.strip("[]() ") in SPELLINGS for cell in below if cell)
            or _channels_in_units(rows[first - 2], below)
        )
    )
    top = first - 1 - units
    named_more = [] if separator == BLANKS or units else _without_fields(rows[top], width)
    rows[top] = rows[top][: len(rows[top]) - len(named_more)]
    if len(rows[top]) != width:
        return None
    if separator == BLANKS and any(head.endswith((",", ";")) for head in rows[top]):
        return None  # blanks behind the separator
    # A row may leave out the last column where that is one of events.
    shortest = width - (not _numbers(rows[first][-1:], decimal))
    alike = [n for n in data if shortest <= len(rows[n]) <= width]
    named = tuple(rows[first - 1]) if units else None
    found = Dialect(tuple(rows[top]), named, tuple(rows[first]), encoding, separator, decimal, top, units_row=units)
    found = replace(found, skip=start, without_fields=tuple(named_more)) if named_more else found
    if not assigned(found.header, named, control_of(found.header, named)):
        names = _names_further_up(rows, first, width)
        found = replace(found, header=names, units=None, skip=start, units_row=False, apart=True) if names else found
    return (len(alike), sum(numbers[n] for n in alike)), found


def _without_fields(names: list[str], width: int) -> list[str]:
    """Return the last names of a header that is longer than the rows; none where one may hold the separator."""
    return [] if any(map(is_unit, names[1:])) else names[max(width, 1) :]


_FEWEST_NAMED = 2  # channels of a rig in a line of names; one may be named by chance
_MOST_HEADS = 6  # lines from the names to the rows: units, comments, sensors, starts and steps of each channel


def _channels_in_units(names: Sequence[str], below: Sequence[str]) -> bool:
    """Whether some cells are units of displacement and force, of channels that the line above names otherwise."""
    found = [
        quantity
        for name, cell in zip(names, below, strict=True)
        for quantity in (DISPLACEMENT, FORCE)
        if name != cell and unit_of("", cell, quantity) is not None
    ]
    return {DISPLACEMENT, FORCE} <= set(found)


def _names_further_up(rows: Sequence[Sequence[str]], first: int, width: int) -> tuple[str, ...] | None:
    """Return the names of the columns, with the units from a line below them, above other lines on each channel."""
    above = [n for n in range(max(first - _MOST_HEADS, 0), first) if len(rows[n]) == width]
    top = next((n for n in above if len(assigned(rows[n], None, control_of(rows[n], None))) >= _FEWEST_NAMED), None)
    if top is None:
        return None
    under = [n for n in above if n > top and all(_UNIT.fullmatch(cell) or not cell for cell in rows[n])]
    units = rows[under[0]] if under else [""] * width
    return tuple(
        f"{name} [{unit.strip('[]()')}]" if unit else name for name, unit in zip(rows[top], units, strict=True)
    )


def _mostly_numbers(row: Sequence[str], numbers: int) -> bool:
    """Whether a row of cells may be one of a table; empty cells say nothing."""
    return numbers > 0 and 2 * numbers >= sum(bool(cell) for cell in row)


def _of_the_table(rows: Sequence[Sequence[str]], data: list[int], decimal: str) -> list[int]:
    """Return those of the lines of numbers that are of the table: not of one of settings or results above it.

    The columns that hold numbers in nearly every line hold them in the first one too, and a small table that more than
    a few lines of other kinds part from the one below it is another.
    """
    count = Counter(i for n in data for i, cell in enumerate(rows[n]) if _numbers([cell], decimal))
    always = [i for i, lines in count.items() if lines > _NEARLY_ALL * len(data)]
    whole = [n for n in data if all(i < len(rows[n]) and _numbers([rows[n][i]], decimal) for i in always)] or data
    parts = np.split(np.array(whole), np.flatnonzero(np.diff(whole) > _MOST_BETWEEN) + 1) if whole else []
    longest = max((part.size for part in parts), default=0)
    first = next((int(part[0]) for part in parts if 4 * part.size >= longest), 0)
    return [n for n in data if n >= first]


_NEARLY_ALL = 0.9  # of the lines; in the others a cell is empty
_MOST_BETWEEN = 3  # lines from one of the table to the next: a message of the logger, or the head of the next test


def _headless(
    rows: list[list[str]], data: list[int], numbers: list[int], encoding: str, separator: str, decimal: str
) -> tuple[tuple[int, int], Dialect] | None:
    """Make the dialect of a table without headers, of which two columns or more hold numbers throughout."""
    width = len(rows[0])
    alike = [n for n in data if len(rows[n]) == width]
    # a scope writes its settings beside the first rows
    always = [i for i in range(width) if all(_numbers([rows[n][i]], decimal) for n in alike)]
    if width < 2 or (numbers[0] < width and len(always) < 2):
        return None
    header = tuple(f"column{n + 1}" for n in range(width))
    found = Dialect(header, None, tuple(rows[0]), encoding, separator, decimal, headless=True)
    return (len(alike), sum(numbers[n] for n in alike)), found


def _unquoted(cell: str) -> str:
    """Return a cell without the quotes around it, as the reader does; a single one may mean inches."""
    around = len(cell) > 1 and cell[0] == cell[-1] == '"'
    return cell[1:-1].replace('""', '"').strip() if around else cell


def _numbers(row: list[str], decimal: str) -> int:
    """Count the cells of a row that are numbers, or a date or time."""
    plain = [plain_numbers(cell, decimal) for cell in row]
    spelled = [cell.replace(",", ".") if decimal == "," and "." not in cell else cell for cell in plain]
    return sum(bool(_CELL_NUMBER.fullmatch(cell) or _CLOCK.fullmatch(cell)) for cell in spelled)
