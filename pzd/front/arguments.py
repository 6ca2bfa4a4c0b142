"""Arguments of the front door: arrays of any kind as (n,) numbers, and mistakes as errors of Python."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import numpy as np

from pzd.quantities import Control
from pzd.record import Array
from pzd.schema.errors import FilesError, UserError

Given = ParamSpec("Given")
Returned = TypeVar("Returned")

_IN_CONFIG = re.compile(r"\brig\.files\.\d+(?:\.(?=\w)|: ?)|\brig\.(?=limits)")
"""Where an argument would stand in a config, which there is none of here."""
_INTO_ENTRIES = re.compile(r"write `setting: (.+?)` into the entries of `rig` that are it")
"""Advice to name a setting in a config, which `pzd.Test` does here."""


def in_python(function: Callable[Given, Returned]) -> Callable[Given, Returned]:
    """Let a function raise a mistake of the user as ValueError, or OSError where a file cannot be read or written."""

    @wraps(function)
    def called(*args: Given.args, **kwargs: Given.kwargs) -> Returned:
        with as_python_errors():
            return function(*args, **kwargs)

    return called


@contextmanager
def as_python_errors() -> Iterator[None]:
    """Raise what a user can mend as ValueError, or OSError, with the message of the command line."""
    try:
        yield
    except UserError as error:
        kind = OSError if isinstance(error, FilesError) else ValueError
        told = (_INTO_ENTRIES.sub(r"pass setting=\1 to the pzd.Test that are it", one) for one in error.messages)
        raise kind("\n".join(_IN_CONFIG.sub("", message) for message in told)) from None


def numbers(name: str, values: Any, size: int | None = None) -> Array:
    """Return values as (n,) finite numbers: a list, an array, a Series, a column (n, 1).

    Parameters
    ----------
    name : of the argument, for messages
    values : what was given
    size : n that is needed, where the first argument sets it

    Raises
    ------
    TypeError : when they are no numbers
    ValueError : when one is not finite, there are several columns, or the length is another
    """
    if isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(np.float64), np.nan)
    kind = type(values).__name__
    if isinstance(values, str | bytes | dict) or values is None:
        raise TypeError(f"{name}: must be an array of numbers (got {kind})")
    try:
        found = np.asarray(values)
    except ValueError:  # rows of unlike length
        raise TypeError(f"{name}: must be an array of numbers, of one length (got {kind})") from None
    if found.dtype.kind == "O":  # of pandas, say, with missing values
        try:
            found = found.astype(np.float64)
        except (TypeError, ValueError):
            raise TypeError(f"{name}: must be numbers (got {kind} of {_odd_one(found)})") from None
    if found.dtype.kind not in "iuf":
        hint = "; give seconds" if found.dtype.kind in "mM" else ""
        raise TypeError(f"{name}: must be numbers{hint} (got {kind} of {found.dtype})")
    if found.ndim > 1 and max(found.shape, default=0) != found.size:
        raise ValueError(f"{name}: must be one column, (n,) (got an array of shape {found.shape})")
    flat = np.array(found, dtype=np.float64).ravel()
    if size is not None and flat.size != size:
        raise ValueError(f"{name}: must have {size} values, as many as the first array (got {flat.size})")
    bad = np.flatnonzero(~np.isfinite(flat))
    if bad.size:
        more = f", and {bad.size - 1} more such values" if bad.size > 1 else ""
        raise ValueError(
            f"{name}: no finite number at index {bad[0]}{more}; leave out what was not measured (got {flat[bad[0]]:g})"
        )
    return flat


def _odd_one(values: Any) -> str:
    """Return the type of the first value that is no number."""
    for value in values.flat:
        try:
            float(value)
        except (TypeError, ValueError):
            return type(value).__name__
    return "objects"


def label(name: str, value: Any, size: int) -> Array | float | None:
    """Return a control signal, temperature or pressure: one number, (n,) numbers, or None where there is none.

    Raises
    ------
    TypeError, ValueError : as `numbers` does
    """
    if value is None:
        return None
    if isinstance(value, bool):
        raise TypeError(f"{name}: must be a number, or one for each time (got bool)")
    found = numbers(name, value, None if np.size(value) == 1 else size)
    return float(found[0]) if found.size == 1 else found


def jobs_of(given: Any) -> int:
    """Return a number of processes.

    Raises
    ------
    TypeError, ValueError : when it is no whole number from 1 on
    """
    if isinstance(given, bool) or not isinstance(given, int | np.integer):
        raise TypeError(f"jobs: must be a whole number (got {type(given).__name__})")
    if given < 1:
        raise ValueError(f"jobs: must be 1 or more (got {given})")
    return int(given)


def control_of(given: Any) -> Control:
    """Return the control signal by its name and unit, such as ("current", "A").

    Raises
    ------
    TypeError : when it is no pair of texts
    ValueError : when no control signal can have that name or unit
    """
    from pzd.rig.config import ControlConfig
    from pzd.schema.yamlfile import document_of

    if not (isinstance(given, tuple | list) and len(given) == 2 and all(isinstance(each, str) for each in given)):
        raise TypeError(f'control: must be name and unit of the control signal, e.g. ("current", "A") (got {given!r})')
    return document_of({"name": given[0], "unit": given[1]}).validated(ControlConfig, Control()).signal()
