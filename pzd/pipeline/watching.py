"""The files that a config names, looked at again and again: what has changed, once nobody writes it any more."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pzd.config import load
from pzd.pipeline.dependencies import files_named
from pzd.schema.errors import UserError
from pzd.schema.yamlfile import chain

EVERY_S = 1.0
"""Time between two looks: far more than they take, far less than a test on a rig."""

State = Mapping[Path, tuple[int, int]]
"""Size [bytes] and time of the last change [ns] of each file that is there."""


@dataclass(frozen=True)
class Look:
    """What there is to say after a look."""

    lines: tuple[str, ...]
    """One a file: new, changed, gone, or still being written."""
    settled: bool
    """Whether files have changed since the last time that this was so, and all stood still for one look."""


@dataclass
class WatchedFiles:
    """A config, what it extends, and the files that it names, as they are on the disk now."""

    config: Path
    overrides: Sequence[str] = ()
    _read: dict[Path, tuple[int, int]] = field(default_factory=dict)
    """The config and what it extends, as they were when they were last read."""
    _files: Callable[[], Iterable[Path]] = tuple

    def state(self) -> State:
        """Every file; where the config is wrong, those that it named before, for it may be mended the next moment."""
        configs = dict(_states(chain(self.config)))
        if configs != self._read:
            self._read = configs
            try:
                read = load(self.config, self.overrides)
                self._files = lambda: files_named(read, self.config.parent)
            except UserError:
                pass
        return {**dict(_states(self._files())), **configs}


def looks(state: Callable[[], State], wait: Callable[[], None]) -> Iterator[Look]:
    """Return what there is to say after each look, for ever; the first time that all stand still counts as a change.

    Parameters
    ----------
    state : gives the files as they are now
    wait : takes its time between two looks
    """
    handled: State | None = None
    before, moved, reported = state(), set[Path](), set[Path]()
    while True:
        wait()
        now = state()
        moving = {path for path in now if now[path] != before.get(path)}
        going_on = (moving & moved) - reported
        settled = now == before and now != handled
        still = (f"{path}: still being written" for path in sorted(going_on))
        yield Look(tuple(_changes(handled or now, now) if settled else still), settled=settled)
        before, moved, reported = now, moving, (reported | going_on) & moving
        handled = now if settled else handled


def _changes(before: State, now: State) -> Iterator[str]:
    for path in sorted({*before, *now}):
        if path not in before:
            yield f"{path}: new"
        elif path not in now:
            yield f"{path}: gone"
        elif before[path] != now[path]:
            yield f"{path}: changed"


def _states(paths: Iterable[Path]) -> Iterator[tuple[Path, tuple[int, int]]]:
    for path in paths:
        try:
            stat = path.stat()
        except OSError:  # taken away since it was listed
            continue
        yield path, (stat.st_size, stat.st_mtime_ns)
