"""Reads rig files: listing, layout, channels, tests, refusals and records, each step once and in this order.

listing -> layout -> format reader -> channels -> tests -> refusals -> fixture -> work -> record
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from pzd.quantities import Control
from pzd.rig.config import FilesEntry, Limits
from pzd.rig.files.channels import channels
from pzd.rig.files.clock import on_regular_clock
from pzd.rig.files.fixture import Freed, damper_alone
from pzd.rig.files.formats import read_sheet
from pzd.rig.files.layout import Layout, layouts
from pzd.rig.files.listing import listed
from pzd.rig.files.records import measured, names
from pzd.rig.files.refusals import refuse
from pzd.rig.files.splitting import Test, split_into_tests
from pzd.rig.files.work import sign_fault, works_on_the_rig
from pzd.rig.preflight import Measured
from pzd.schema.errors import ConfigError, DataError


def read(
    entries: Sequence[FilesEntry], limits: Limits, control: Control, folder: Path
) -> tuple[Callable[[], Measured], ...]:
    """Every test of every file, refused or accepted; what is returned makes the record of each, in any order.

    Parameters
    ----------
    entries : `rig.files` of the config
    limits : what the stand can do
    control : the control signal
    folder : the config's folder, which relative paths start from

    Raises
    ------
    ConfigError : when the config does not describe the files; every fault is listed
    DataError : when a file cannot be used; every such file is listed
    FilesError : when a file cannot be read
    """
    files = listed(entries, folder)
    described = layouts(entries, control, folder)
    tests: list[tuple[Test, Freed]] = []
    layout_of: dict[Path, Layout] = {}
    config_faults: list[str] = []
    data_faults: list[str] = []
    for file in files:
        try:
            layout_of[file.path] = described[file.number]
            tests += _read_file(file.path, described[file.number])
        except ConfigError as error:
            config_faults += error.messages
        except DataError as error:
            data_faults += error.messages
    if config_faults:
        raise ConfigError(dict.fromkeys(config_faults))
    wrong = [test for test in tests if works_on_the_rig(test[1])]
    right = [test for test in tests if not works_on_the_rig(test[1])]
    data_faults += [sign_fault(test, freed, layout_of[test.sheet.path], right) for test, freed in wrong]
    if data_faults:
        raise DataError(data_faults)
    called = names([(test.sheet.path, test.number) for test, _ in tests])
    return tuple(
        partial(measured, name, test, freed, limits, control) for name, (test, freed) in zip(called, tests, strict=True)
    )


def _read_file(path: Path, layout: Layout) -> list[tuple[Test, Freed]]:
    """The tests of one file, and displacement and force of the damper alone in each."""
    entry = layout.entry
    values, setting = layout.values(path)
    sheet = read_sheet(path, entry, layout.wanted(), layout.place)
    tests = split_into_tests(channels(sheet, layout), sheet, layout, values, setting)
    refuse(tests, layout)
    return [(test, damper_alone(test, entry.fixture)) for test in map(on_regular_clock, tests)]
