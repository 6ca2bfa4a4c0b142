"""Columns of numbers in a Parquet file, where a CSV of them would be large; pyarrow writes it, an extra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pzd.quantities import Control
from pzd.schema.errors import ConfigError, DataError, at


def check_installed(key: str) -> None:
    """Refuse a config whose `key` asks for Parquet where nothing can write it.

    Raises
    ------
    ConfigError : when pyarrow is not installed
    """
    if find_spec("pyarrow") is None:
        raise ConfigError(f"{key}: parquet is written with pyarrow, which is not installed; pip install 'pzd[formats]'")


def write_columns(path: Path, columns: Mapping[str, NDArray[np.float64]], control: Control) -> None:
    """Write arrays of one length as columns.

    Raises
    ------
    ValueError : when a number is not finite, which the reader would not take
    """
    import pyarrow as pa
    from pyarrow import parquet

    wrong = [name for name, values in columns.items() if not np.isfinite(values).all()]
    if wrong:
        raise ValueError(f"{path.name}: {', '.join(wrong)} must hold finite numbers")
    parquet.write_table(pa.table({control.renamed(name): values for name, values in columns.items()}), path)


def read_columns(
    path: Path, header: Sequence[str], control: Control, optional: Sequence[str] = ()
) -> dict[str, NDArray[np.float64]]:
    """Read columns of finite numbers; those in `optional` may be missing, and are then left out.

    Raises
    ------
    ConfigError : when pyarrow is not installed
    DataError : when the file is missing or is none, or a column is missing or holds anything but finite numbers
    """
    check_installed(at(path))
    import pyarrow as pa
    from pyarrow import parquet

    try:
        table = parquet.read_table(path)
    except FileNotFoundError:
        raise DataError(f"{at(path)}: the file is missing; run the stage again") from None
    except (pa.ArrowInvalid, OSError) as error:
        raise DataError(f"{at(path)}: is no Parquet file ({error}); run the stage again") from None
    found, faults = {}, []
    for name in header:
        column = control.renamed(name)
        if column not in table.column_names:
            faults += [] if name in optional else [f"{at(path)}: column {column} is missing"]
            continue
        values = table.column(column)
        if values.null_count or not pa.types.is_float64(values.type) or not np.isfinite(values.to_numpy()).all():
            faults.append(f"{at(path)}: column {column} must hold finite numbers")
            continue
        found[name] = np.array(values.to_numpy())
    if faults:
        raise DataError(faults)
    return found
