"""How to read the files of the rig, as an entry of `rig.files` and as arguments of `pzd.read`."""

from __future__ import annotations

ENTRY = {
    "columns": {"time": "t", "displacement": "pos", "force": "load"},
    "units": {"time": "s", "displacement": "mm", "force": "kN", "current": "A"},
    "pattern": r"-(?P<current>[0-9.]+)A-(?P<setting>\w+)",
}
