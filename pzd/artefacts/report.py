"""Artefact of report: comfort numbers, expected numbers and the page; and the manifest of every stage."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Self

from pzd.quantities import Control
from pzd.schema.csvfile import read_rows, write_rows
from pzd.schema.model import Frozen


class ComfortRow(Frozen):
    """One comfort measure of one ride."""

    case: str
    point: str
    edition: str
    """The standard and its year, e.g. `ISO 2631-1:1997`."""
    measure: str
    value: float | None
    unit: str
    status: str
    """How far the number can be trusted, e.g. `verified` or `unverified transcription`."""


class ReferenceRow(Frozen):
    """One expected number beside that of the run."""

    id: str
    kind: str
    expected: float | str
    """As the reference file has it; a range is text."""
    computed: float | None
    """In `unit`; None where the run does not give it, and `note` says why."""
    unit: str
    ratio: float | None
    """Computed over expected; None where there is no such ratio."""
    note: str


ANSWER = "answer.txt"


@dataclass(frozen=True, eq=False)
class Report:
    """The comfort numbers and the page."""

    folder: ClassVar[str] = "6-report"

    comfort: tuple[ComfortRow, ...]
    page: str
    """report.html, whole."""
    reference: tuple[ReferenceRow, ...] | None = None
    """None where the config names no expected numbers."""
    answer: tuple[str, ...] = ()
    """What came out, in a few sentences: those with which the page begins."""

    def write(self, folder: Path, control: Control) -> None:
        """Write comfort.csv, report.html, answer.txt and, where the config names expected numbers, reference.csv."""
        write_rows(folder / "comfort.csv", ComfortRow, self.comfort, control)
        (folder / "report.html").write_text(self.page, encoding="utf-8")
        if self.answer:
            (folder / ANSWER).write_text("\n".join(self.answer) + "\n", encoding="utf-8", newline="\n")
        if self.reference is not None:
            write_rows(folder / "reference.csv", ReferenceRow, self.reference, control)

    @classmethod
    def read(cls, folder: Path, control: Control) -> Self:
        """Read and check them again."""
        reference = folder / "reference.csv"
        return cls(
            read_rows(folder / "comfort.csv", ComfortRow, control),
            (folder / "report.html").read_text(encoding="utf-8"),
            read_rows(reference, ReferenceRow, control) if reference.exists() else None,
            cls.read_answer(folder),
        )

    @staticmethod
    def read_answer(folder: Path) -> tuple[str, ...]:
        """Read what came out; nothing where an earlier version wrote the folder."""
        answer = folder / ANSWER
        return tuple(answer.read_text(encoding="utf-8").splitlines()) if answer.is_file() else ()


class Manifest(Frozen):
    """What a stage was made from and what it made; the only file with timestamps."""

    stage: str
    key: str
    """Hash of all that the stage depends on."""
    config: str
    """Path of the config."""
    inputs: dict[str, str]
    """Hash of every input file."""
    outputs: dict[str, str]
    """Hash of every output file."""
    versions: dict[str, str]
    """Version of pzd, Python and the numerical libraries."""
    finished: str
    """When, in UTC."""
    seconds: float
    """How long it took."""
    marks: tuple[str, ...] = ()
    """Why the result is not to be trusted (exit 4); carried on by the stages behind."""
