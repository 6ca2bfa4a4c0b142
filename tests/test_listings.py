"""A listing of the documentation is told from what a command prints, but for the last digits."""

from __future__ import annotations

from listings import listings, missing, same


def test_a_listing_is_read_with_its_command() -> None:
    text = "<!-- printed by: pzd show a.yaml -->\n```text\none\ntwo\n```\n\n```text\nother\n```\n"
    assert listings(text) == [("pzd show a.yaml", "one\ntwo\n")]


def test_last_digits_may_differ_and_nothing_else() -> None:
    assert same("q = 2503 (2474 to 2532) N", "q = 2504 (2474 to 2532) N")
    assert not same("q = 2503 (2474 to 2532) N", "q = 2603 (2474 to 2532) N")
    assert not same("q = 2503 (2474 to 2532) N", "k = 2503 (2474 to 2532) N")
    assert not same("W_s 8.24e-05 after", "W_s 8.24e-04 after")


def test_a_line_that_was_not_printed_is_missing() -> None:
    assert missing("verdict: none\nconfidence: 97%\n", "confidence: 97%\nreason\n") == ["verdict: none"]
