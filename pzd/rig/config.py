"""The `rig` block of the config: measured files or a virtual stand, and the limits of the stand."""

from __future__ import annotations

import glob
import re
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from pzd.quantities import BINGHAM, CHANNELS, TIME, VOLTAGE, Control
from pzd.rig.stand.config import VirtualEntry
from pzd.schema.model import Frozen, all_keys


def _text(value: object) -> object:
    if isinstance(value, int | float):
        raise ValueError(  # noqa: TRY004  # pydantic turns a ValueError alone into a fault of the config
            f"a value needs its unit: write {value} V, {value} degC, ..."
        )
    return value


def _filled_in(what: str) -> BeforeValidator:
    """Refuse the empty value that `pzd init` leaves where only a person knows the answer."""

    def checked(value: object) -> object:
        if value is None:
            raise ValueError(f"is empty; fill in {what}")
        return value

    return BeforeValidator(checked)


def _not_empty(value: object) -> object:
    if value == "":
        raise ValueError("is empty; fill in one of the answers beside it, or take the line out")
    return value


Header = Annotated[str, _filled_in("the header of its column in the files")]
Unit = Annotated[str, _filled_in("its unit in the files, e.g. s, mm, kN, V, degC")]
Searched = Annotated[str, BeforeValidator(_not_empty)]
"""A regular expression."""
WithUnit = Annotated[str, BeforeValidator(_text)]
"""A number with its unit, like `100 V`."""


@lru_cache(maxsize=1)
def own_words() -> frozenset[str]:
    """Return the names that no control signal may have: in a file they could not be told from pzd's own."""
    from pzd.damper.effects import library

    effects = library().values()
    parameters = [parameter.name for effect in effects for parameter in effect.parameters]
    base = [quantity.name for quantity in BINGHAM]
    words = [*base, *parameters, *(effect.name for effect in effects), *all_keys()]
    # A parameter F_0 is read as that of a control called F, and a key `units` as several of a control called unit.
    return frozenset(stem for word in words for stem in (word, re.sub(r"s?(?:_\d+)?$", "", word)))


class ControlConfig(Frozen):
    """The control signal of the valve."""

    name: str = Field(default=VOLTAGE.name, pattern=r"^[A-Za-z][A-Za-z0-9_]*$")
    """What it is called: `voltage_V` reads `current_A` with `{name: current, unit: A}`."""
    unit: str = Field(default=VOLTAGE.unit, pattern=r'^[^\s,;"]+$')
    """Its unit."""

    @model_validator(mode="after")
    def _says_its_unit(self) -> ControlConfig:
        """Volts are the unit of a voltage, and a guess for anything else."""
        if self.name != VOLTAGE.name and "unit" not in self.model_fields_set:
            raise ValueError(f"the unit of a {self.name} is missing; say it, e.g. {{name: {self.name}, unit: A}}")
        return self

    @field_validator("name")
    @classmethod
    def _not_another_channel(cls, name: str) -> str:
        if name in {channel.name for channel in CHANNELS} - {VOLTAGE.name}:
            raise ValueError(f"{name} is another channel of the rig; the control needs a name of its own")
        if name != VOLTAGE.name and name in own_words():
            raise ValueError(
                f"{name} is a key or a parameter of pzd; the control needs a name of its own, e.g. {name}_in"
            )
        return name

    def signal(self) -> Control:
        """Return the control signal under its name in the files."""
        return Control(self.name, self.unit)


class Fixture(Frozen):
    """What stands between the damper and the sensors, where it is known; taken out of the records."""

    mass_kg: float = Field(default=0.0, ge=0.0)
    """Moving mass between the load cell and the damper: its inertia m a is taken out of the force."""
    stiffness_N_per_m: float | None = Field(default=None, gt=0.0)
    """Stiffness of frame and joints: F/k is taken out of the displacement."""
    tare_N: float = 0.0
    """Force that the cell shows without a damper, in its own direction: taken out before `sign` turns the force."""


class FileSplit(Frozen):
    """Where one test ends and the next begins in a file that holds several; exactly one way."""

    column: str | None = None
    """Header of a column of labels: a test is a stretch of rows with one label."""
    event: str | None = None
    """Header of a column of events, mostly empty; the last column may be left out of rows without an event."""
    begins: str | None = None
    """Text in the event that begins a new test, e.g. `DAQ Resume`."""
    gap_s: float | None = Field(default=None, gt=0.0)
    """A pause of the clock longer than this [s] begins a new test."""
    tables: bool = False
    """Each table of the file (sheet, group, block) is a test, as it is without `split`: for `constants` of each."""
    constants: dict[str, tuple[WithUnit, ...]] = Field(default={})
    """Quantity -> one value with unit for each test in the file, in their order."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if sum((self.column is not None, self.event is not None, self.gap_s is not None, self.tables)) != 1:
            raise ValueError("say exactly one of column, event (with begins), gap_s, tables")
        if (self.event is None) != (self.begins is None):
            raise ValueError("event and begins belong together")
        return self


class Beside(Frozen):
    """A second logger that recorded some of the quantities of the same tests, by a clock of its own."""

    path: str = Field(min_length=1)
    """Its file, relative to the folder of this config; `*` stands for what `*` matched in the path beside it. How it
    is written is seen from the file."""
    columns: dict[str, Header] = Field(default={})
    """Quantity -> header in its file: `time`, and what is read of it."""
    units: dict[str, Unit] = Field(default={})
    """Quantity -> unit in its file, as beside it."""
    same_clock: bool = False
    """Whether both clocks count from one instant, or both are of dates."""
    event: tuple[str, str] | None = None
    """Headers of an event that both recorded, here and in the second file: its rising edges are the same instants."""
    column: tuple[str, str] | None = None
    """Headers of a signal that both recorded, here and in the second file: the clocks are set where they agree best."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if sum((self.same_clock, self.event is not None, self.column is not None)) != 1:
            raise ValueError("say how the clocks go together, exactly one of same_clock, event, column")
        if TIME.name not in self.columns or len(self.columns) < 2:
            raise ValueError("columns: name time and what is read of this file, e.g. {time: t, force: Load}")
        return self


class FilesEntry(Frozen):
    """Measured files of one layout, and how to read them."""

    path: str = Field(min_length=1)
    """Path or glob pattern (`*`, `?`, `**`), relative to the folder of this config."""
    layout: str | None = Field(default=None, pattern=r"^[A-Za-z0-9_-]+$")
    """Name of a layout, which says everything below for files of one kind: one that comes with pzd, or NAME.yaml
    beside this config. The keys of the entry take precedence."""
    columns: dict[str, Header] = Field(default={})
    """Quantity -> header in the file, e.g. `{time: t, force: Load}`; what is not named has its canonical header.
    An empty header (`{voltage: ''}`) leaves a column out."""
    rate_Hz: float | None = Field(default=None, gt=0.0)
    """Samples a second of files in which no column holds the time; each recording begins at 0."""
    units: dict[str, Unit] = Field(default={})
    """Quantity -> unit in the file (`mm`, `kN`, `degF`), or what one recorded unit stands for (`980.665 N`), also about
    the reading that means zero (`-200 N/V about 2.5 V`, `-200 N/V about the mean of the first 10`).
    For time also a format of date and time (`%m/%d/%Y %H:%M:%S.%f`)."""
    constants: dict[str, WithUnit] = Field(default={})
    """Quantity -> value with unit (`100 V`) that no column holds."""
    sign: dict[str, Literal[1, -1]] = Field(default={})
    """Quantity -> 1 or -1; -1 turns a channel that counts compression positive."""
    pattern: Searched | None = None
    """Regular expression searched in the file's name, its groups named after quantities or `setting`,
    e.g. `(?P<voltage>[0-9.]+)V`; `x`, `p` or `_` between its digits is a decimal point; units as under `units`."""
    preamble: Searched | None = None
    """Regular expression searched in the lines above the header, its groups as those of `pattern`, e.g.
    `Current: (?P<current>-?[0-9.,]+)`; `^` begins a line."""
    setting: str | None = None
    """Which setting of the damper these files measured."""
    fixture: Fixture | None = None
    """A known fixture, taken out and said in records.json."""
    split: FileSplit | None = None
    """How a file with several tests is cut; not cut by default."""
    format: str | None = None
    """Format of the files, e.g. `text`; by their content, then the ending of the name where nothing is said."""
    table: str | None = None
    """Name or pattern (`*`, `?`) of the sheets, groups or structures to read; by default every one with a recording."""
    separator: str | None = Field(default=None, min_length=1, max_length=1)
    """Between fields: `,`, `;`, a tab, or a blank for any run of blanks; seen from the header by default."""
    decimal: str = Field(default=".", pattern=r"^[.,]$")
    """Decimal point or comma."""
    skip: int = Field(default=0, ge=0)
    """Lines before the header (a preamble)."""
    header: tuple[str, ...] | None = None
    """Headers of files that have no header line."""
    units_row: bool = False
    """Whether the line below the header holds the units."""
    comment: str | None = Field(default=None, min_length=1, max_length=1)
    """Lines that begin with this character are left out."""
    leave_out: Searched | None = None
    """Regular expression; data lines in which it is found are left out, as messages that a logger wrote among them."""
    encoding: str = "utf-8"
    """Encoding of the text."""
    beside: Beside | None = None
    """A second logger of the same tests, whose file holds some of the quantities."""
    source: str | None = None
    """Where the files can be had: shown when they are absent."""

    @field_validator("pattern", "preamble", "leave_out")
    @classmethod
    def _compiles(cls, pattern: str | None, info: ValidationInfo) -> str | None:
        if pattern is not None:
            try:
                groups = re.compile(pattern).groupindex
            except re.error as error:
                raise ValueError(f"not a regular expression: {error}") from None
            if not groups and info.field_name != "leave_out":
                raise ValueError("needs a named group, e.g. (?P<voltage>[0-9.]+)V")
        return pattern

    @field_validator("encoding")
    @classmethod
    def _known_encoding(cls, encoding: str) -> str:
        try:
            "".encode(encoding)
        except LookupError:
            raise ValueError("an encoding that Python knows is needed, e.g. utf-8, latin-1, utf-16") from None
        return encoding


class NamedLayout(FilesEntry):
    """A layout file: everything that an entry of `rig.files` may say of files of one kind, but their path."""

    path: Literal[""] = ""
    """Stands in the entry, not in the layout."""
    about: str
    """Whose files these are, in a line."""
    control: ControlConfig = ControlConfig()
    """The control signal that the files record; the config must name the same one."""
    name: str | None = None
    """Regular expression that a file's name must match for `pzd init` to propose the layout by itself."""

    @model_validator(mode="after")
    def _stands_alone(self) -> Self:
        if self.layout is not None:
            raise ValueError("a layout names no other layout")
        return self


class Limits(Frozen):
    """Limits of the test stand; by default the largest values in the records of a setting.

    The next test that a diagnosis proposes lies within these limits, be they wider or narrower than the records.
    """

    stroke_m: float | None = Field(default=None, gt=0.0, le=1.0)
    """Largest stroke, end to end, half of it to either side of the middle of the recorded displacements [m]."""
    speed_m_per_s: float | None = Field(default=None, gt=0.0, le=10.0)
    """Largest speed [m/s]."""
    force_N: float | None = Field(default=None, gt=0.0)
    """Largest force, also the range of the load cell [N]."""
    frequency_Hz: float | None = Field(default=None, gt=0.0)
    """Largest frequency [Hz]."""
    voltage_V: tuple[float, float] | None = None
    """Smallest and largest control signal."""

    @field_validator("voltage_V")
    @classmethod
    def _rising(cls, voltage: tuple[float, float] | None) -> tuple[float, float] | None:
        if voltage is not None and not voltage[0] < voltage[1]:
            raise ValueError("the smallest comes first")
        return voltage


class RigConfig(Frozen):
    """Where the rig records come from: exactly one of `files` and `virtual`."""

    files: tuple[FilesEntry, ...] | None = Field(default=None, min_length=1)
    """Measured files."""
    virtual: tuple[VirtualEntry, ...] | None = Field(default=None, min_length=1)
    """Virtual test stands, one a setting."""
    limits: Limits = Limits()
    """Limits of the stand."""

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.files is None) == (self.virtual is None):
            raise ValueError("say exactly one of files and virtual")
        return self

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        names = [planned.name for entry in self.virtual or () for planned in entry.plan()]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"virtual: two records would be called {', '.join(twice)}; give each entry a setting")
        return self


def matching(folder: Path, pattern: str) -> list[Path]:
    """Return the files that a path or glob pattern of the config names, seen from the config's folder."""
    literal = folder / pattern
    if literal.is_file():
        return [literal]
    whole = str(Path(glob.escape(str(folder))) / pattern)
    found = [Path(path) for path in glob.glob(whole, recursive=True)]  # noqa: PTH207  # Path.glob takes no absolute patterns
    return [path for path in found if path.is_file()]
