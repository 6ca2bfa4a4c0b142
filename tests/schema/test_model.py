"""Docstrings under fields describe the keys of the JSON schema."""

from __future__ import annotations

from typing import ClassVar

from pzd.schema.model import Frozen


class Base(Frozen):
    """A block."""

    first: int = 1
    """Of the base."""
    second: int = 2
    """Of the base,

    in two paragraphs."""
    third: int = 3
    """Of the base."""
    other: ClassVar[int] = 0
    """No key."""


class Derived(Base):
    """A block made of it."""

    third: int = 4
    fourth: int = 5
    """Its own."""


def test_each_key_is_described_by_the_docstring_under_the_field_of_its_own_class() -> None:
    properties = Derived.model_json_schema()["properties"]
    assert {key: body.get("description") for key, body in properties.items()} == {
        "first": "Of the base.",
        "second": "Of the base,\n\nin two paragraphs.",
        "third": None,
        "fourth": "Its own.",
    }
