"""Arrays on disk are those that were given, whoever else writes, and leave memory where they are let go of."""

from __future__ import annotations

import gc
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from pzd.parallel import on_disk
from pzd.parallel.on_disk import OnDisk, beside, is_on_disk, let_go, one_at_a_time
from pzd.parallel.processes import parallel_map
from pzd.record import Array

pytestmark = pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="asks Linux what is in memory")
SIZE = 500_000


@dataclass(frozen=True)
class Held:
    values: Array
    others: dict[str, Array] = field(default_factory=dict)
    none: Array | None = None


def resident() -> int:
    """Bytes of memory of this process."""
    told = Path("/proc/self/status").read_text(encoding="utf-8")
    return 1024 * int(told.split("VmRSS:")[1].split()[0])


def numbered(count: int, store: OnDisk) -> list[Held]:
    return [store.kept(Held(np.full(SIZE, float(number)))) for number in range(count)]


def test_only_what_is_beyond_the_limit_goes_to_disk_and_nothing_changes_by_it(rng: np.random.Generator) -> None:
    given = [Held(rng.random(100), {"a": rng.random((50, 3)), "b": np.arange(7.0)}) for _ in range(3)]
    store = OnDisk(in_memory=given[0].values.nbytes + sum(each.nbytes for each in given[0].others.values()))
    kept = [store.kept(held) for held in given]
    assert kept[0].values is given[0].values
    for before, after in zip(given[1:], kept[1:], strict=True):
        assert is_on_disk(after.values)
        pairs = [(before.values, after.values), *((before.others[name], after.others[name]) for name in before.others)]
        for old, new in pairs:
            np.testing.assert_array_equal(new, old)
            assert new.dtype == old.dtype
            assert is_on_disk(new[1:])
        assert after.none is None


def test_what_is_made_of_a_record_lies_where_the_record_does() -> None:
    (record,) = numbered(1, OnDisk(0))
    made = np.arange(5.0)
    assert beside(made, made) is made
    on_its_disk = beside(made, record.values)
    assert is_on_disk(on_its_disk)
    assert beside(on_its_disk, record.values) is on_its_disk


def test_many_arrays_that_are_read_one_at_a_time_do_not_stay_in_memory() -> None:
    held = numbered(40, OnDisk(0))  # 160 MB
    let_go()
    before = resident()
    assert [float(one.values.sum()) for one in one_at_a_time(held)] == [SIZE * float(n) for n in range(40)]
    assert resident() - before < 5 * held[0].values.nbytes
    assert sum(float(one.values.sum()) for one in held) > 0.0  # all of them at a time do
    assert resident() - before > 30 * held[0].values.nbytes
    let_go()


def test_a_forked_process_does_not_write_over_what_its_parent_goes_on_writing() -> None:
    first = numbered(2, OnDisk(0))
    made = parallel_map(lambda n: float(OnDisk(0).kept(Held(np.full(SIZE, 100.0 + n))).values.sum()), range(3), 2)
    more = numbered(4, OnDisk(0))
    assert made == [SIZE * (100.0 + n) for n in range(3)]
    assert [one.values[0] for one in (*first, *more)] == [0.0, 1.0, 0.0, 1.0, 2.0, 3.0]


def test_the_files_are_given_back_with_the_last_array_in_them() -> None:
    held = numbered(40, OnDisk(0))
    some = len(on_disk._files)
    assert some >= 2
    del held
    gc.collect()
    assert len(on_disk._files) <= 1 + some - 2


def test_an_array_stays_in_memory_where_the_disk_is_full(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "pwrite", full)
    held = Held(np.arange(10.0))
    assert OnDisk(0).kept(held).values is held.values
