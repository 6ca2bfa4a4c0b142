"""Sixty kinds of mistakes in the shipped configs: each ends with exit code 2, its line and column, and what to do.

The place is that of the mistake as it was made, not as the reader of YAML or the model sees it. Which of the keys and
values of a config a mistake falls on is drawn.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest
import yaml

from pzd.cli.app import status

ROOT = Path(__file__).resolve().parent.parent
CONFIGS = ("alike", "paper", "quickstart", "utfsm", "utfpr", "blind", "reference")


@dataclass(frozen=True)
class Site:
    """One key of a config with its value; indices into the text."""

    path: tuple[str, ...]
    key: int
    key_end: int
    value: int
    value_end: int
    kind: str
    """`mapping`, `list`, or what its scalar reads as."""
    flow: bool
    """Whether it stands in braces."""
    shared: bool
    """Whether an alias repeats it elsewhere, so that one mistake is several."""

    @property
    def name(self) -> str:
        return self.path[-1]


@dataclass(frozen=True)
class Broken:
    """A config with one mistake in it."""

    text: str
    at: int
    """Index of the mistake in the text."""

    @property
    def place(self) -> tuple[int, int]:
        """Line and column from 1."""
        return self.text.count("\n", 0, self.at) + 1, self.at - self.text.rfind("\n", 0, self.at)


def is_number(text: str) -> bool:
    return re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", text) is not None


@cache
def shipped(name: str) -> str:
    """Text of a config; the measured files of `utfsm` are not part of the project, so another stands for them."""
    text = (ROOT / "configs" / f"{name}.yaml").read_text(encoding="utf-8")
    return re.sub(r"path: \S+utfsm\S+csv", "path: data.csv", text)


def write_data(folder: Path) -> None:
    """Two cycles of a sine with the headers of `utfsm`."""
    time = np.arange(1000) / 500.0
    rows = [f"{t},{10 * np.sin(6.283 * t)},{300 * np.cos(6.283 * t)},0" for t in time]
    header = "time_s,displacement_mm,force_N,current_A"
    (folder / "data.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")


@cache
def sites(name: str) -> tuple[Site, ...]:
    """Every key of a shipped config, by the parser's own marks."""
    root = yaml.compose(shipped(name))
    seen: set[int] = set()
    aliased = {event.anchor for event in yaml.parse(shipped(name)) if isinstance(event, yaml.AliasEvent)}
    anchors = [event for event in yaml.parse(shipped(name)) if getattr(event, "anchor", None) in aliased]
    spans = [e.start_mark.index for e in anchors if not isinstance(e, yaml.AliasEvent)]

    def walk(node: Any, path: tuple[str, ...], shared: bool) -> Iterator[Site]:
        if id(node) in seen:
            return
        seen.add(id(node))
        if isinstance(node, yaml.SequenceNode):
            for number, item in enumerate(node.value):
                yield from walk(item, (*path, str(number)), shared or item.start_mark.index in spans)
        elif isinstance(node, yaml.MappingNode):
            for key, value in node.value:
                own = shared or value.start_mark.index in spans
                text = getattr(value, "value", "")
                plain = isinstance(value, yaml.ScalarNode) and value.style is None
                kind = {"SequenceNode": "list", "MappingNode": "mapping"}.get(type(value).__name__)
                kind = kind or ("number" if plain and is_number(text) else "null" if text in ("null", "") else "text")
                yield Site(
                    (*path, key.value),
                    key.start_mark.index,
                    key.end_mark.index,
                    value.start_mark.index,
                    value.end_mark.index,
                    kind,
                    bool(node.flow_style),
                    own,
                )
                yield from walk(value, (*path, key.value), own)

    return tuple(walk(root, (), False))


Pick = Callable[..., tuple[str, Site]]
Make = Callable[[Pick], Broken]


@dataclass(frozen=True)
class Mistake:
    """One kind of mistake."""

    name: str
    make: Make
    says: str
    """What the message must say to do, as a regular expression."""


MISTAKES: list[Mistake] = []


def mistake(says: str) -> Callable[[Make], Make]:
    """Enter a kind of mistake under the name of its function."""

    def enter(make: Make) -> Make:
        MISTAKES.append(Mistake(make.__name__, make, says))
        return make

    return enter


def key_becomes(text: str, site: Site, key: str) -> Broken:
    return Broken(text[: site.key] + key + text[site.key_end :], site.key)


def value_becomes(text: str, site: Site, value: str, wrong: str = "") -> Broken:
    """Another value; the mistake is where `wrong` stands in it, by default all of it."""
    if "\n" not in text[site.key_end : site.value]:
        return Broken(text[: site.value] + value + text[site.value_end :], site.value + value.index(wrong))
    # A block that begins below its key, and ends where the next key or comment begins.
    end = text.rfind("\n", 0, site.value_end)
    return Broken(text[: site.key_end] + f": {value}" + text[end:], site.key_end + 2 + value.index(wrong))


def value_of(name: str, becomes: str, says: str, *path: str, config: str = "reference", wrong: str = "") -> None:
    """Enter a kind of mistake: another value at a path of a config, in which a part may be what is wrong."""

    def make(pick: Pick) -> Broken:
        return value_becomes(*pick(config, path=path), becomes, wrong)

    MISTAKES.append(Mistake(name, make, says))


# Keys that a model knows; those of effects, columns and the like are the user's own.
OWN = {"effects", "columns", "units", "constants", "sign", "kinds"}


def known(site: Site) -> bool:
    return not OWN & set(site.path)


# ---------------------------------------------------------------- keys


@mistake(r"no such key; did you mean {name}\?")
def two_letters_of_a_key_swapped(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: known(s) and len(s.name) > 6 and s.name[2] != s.name[3])
    return key_becomes(text, site, site.name[:2] + site.name[3] + site.name[2] + site.name[4:])


@mistake(r"no such key; did you mean {name}\?")
def a_letter_of_a_key_missing(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: known(s) and len(s.name) > 6)
    return key_becomes(text, site, site.name[:3] + site.name[4:])


@mistake(r"no such key; did you mean {name}\?")
def a_letter_of_a_key_doubled(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: known(s) and len(s.name) > 4)
    return key_becomes(text, site, site.name[:2] + site.name[1] + site.name[2:])


@mistake(r"no such key; did you mean {name}\?")
def a_key_in_capitals(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: known(s) and s.name.islower() and len(s.name) > 4)
    return key_becomes(text, site, site.name.upper())


@mistake(r"no such key; did you mean {name}\?")
def a_hyphen_in_a_key(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: known(s) and "_" in s.name)
    return key_becomes(text, site, site.name.replace("_", "-"))


@mistake(r"no such key; did you mean amplitude_m\?")
def a_key_in_another_unit(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.name == "amplitude_m" and "blind" not in s.path)
    return key_becomes(text, site, "amplitude_mm")


@mistake(r"no such key; did you mean {name}\?")
def a_key_without_its_unit(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.name in ("frequency_Hz", "amplitude_m", "stroke_m") and "waveform" in s.path)
    return key_becomes(text, site, site.name.rsplit("_", 1)[0])


@mistake(r"no such key; there is|no such key; did you mean")
def a_key_that_nobody_knows(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: known(s) and not s.flow and len(s.path) < 3)
    return Broken(text[: site.key] + "zzz: 1\n" + indent(text, site) + text[site.key :], site.key)


def indent(text: str, site: Site) -> str:
    return " " * (site.key - text.rfind("\n", 0, site.key) - 1)


@mistake(r"the key is given a second time \(first at .*:\d+:\d+\)")
def a_key_twice_in_a_block(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: not s.flow and s.kind in ("number", "text"))
    end = text.index("\n", site.value_end) + 1
    copy = f"{indent(text, site)}{site.name}: 1\n"
    return Broken(text[:end] + copy + text[end:], end + len(indent(text, site)))


@mistake(r"the key is given a second time \(first at .*:\d+:\d+\)")
def a_key_twice_in_braces(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.flow and s.kind == "number")
    return Broken(text[: site.value_end] + f", {site.name}: 3" + text[site.value_end :], site.value_end + 2)


@mistake(r"a key must be text; put it in quotes")
def a_number_as_key(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.flow and not s.shared)
    return key_becomes(text, site, "12")


@mistake(r"say where the damper comes from: rig, or damper")
def the_needed_block_left_out(pick: Pick) -> Broken:
    pick("alike")
    return Broken("seed: 1\n", 0)


@mistake(r"T0_N: is missing")
def a_needed_key_left_out(pick: Pick) -> Broken:
    text, site = pick("alike", where=lambda s: s.name == "T0_N")
    return Broken(text[: site.key] + text[site.value_end + 2 :], text.rfind("{", 0, site.key))


# ---------------------------------------------------------------- YAML


def first_of_block(site: Site) -> bool:
    return not site.flow and len(site.path) == 1


@mistake(r"a colon is missing behind the key; write seed: 1")
def a_colon_missing(pick: Pick) -> Broken:
    text, site = pick(path=("seed",))
    return Broken(text[: site.key_end] + text[site.key_end + 1 :], site.key)


@mistake(r"a colon is missing behind the key; write {name}:")
def a_colon_missing_before_a_block(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: first_of_block(s) and s.kind == "mapping" and text_after(s).startswith("\n"))
    return Broken(text[: site.key_end] + text[site.key_end + 1 :], site.key)


def text_after(site: Site) -> str:
    return "\n" if site.value - site.key_end > 2 else ""


@mistake(r"a blank is missing behind the colon; write seed: 1")
def a_blank_missing_behind_the_colon(pick: Pick) -> Broken:
    text, site = pick(path=("seed",))
    return Broken(text[: site.key_end + 1] + text[site.value :], site.key)


@mistake(r"a tab where YAML wants spaces; indent with spaces")
def a_tab(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: not s.flow and 1 < len(s.path) < 4 and not s.path[-2].isdecimal())
    start = text.rfind("\n", 0, site.key) + 1
    return Broken(text[:start] + "\t" + text[site.key :], start)


@mistake(r"indented otherwise than those around it|it may be indented too far")
def a_key_too_far_in(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.path in (("rig",), ("setting",)) and s.key > 0)
    return Broken(text[: site.key] + "  " + text[site.key :], site.key + 2)


@mistake(r"indented otherwise than those around it")
def a_key_not_far_enough_in(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: not s.flow and len(s.path) > 3 and s.path[-2].isdecimal(), before="      ")
    return Broken(text[: site.key - 1] + text[site.key :], site.key - 1)


@mistake(r"no such key|must be|is missing")
def a_block_that_begins_in_the_first_column(pick: Pick) -> Broken:
    text, site = pick(path=("rig", "limits"), config="alike")
    return Broken(text[: site.key - 2] + text[site.key :], site.key - 2)


@mistake(r"the \{{ that opens here is not closed; put \}} at its end")
def a_brace_not_closed(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.kind == "mapping" and not s.flow, ends="}")
    return Broken(text[: site.value_end - 1] + text[site.value_end :], site.value)


@mistake(r"the \[ that opens here is not closed; put \] at its end")
def a_bracket_not_closed(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.kind == "list" and not s.flow, ends="]")
    return Broken(text[: site.value_end - 1] + text[site.value_end :], site.value)


@mistake(r"this \}} closes nothing; take it away")
def a_brace_too_many(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.kind == "mapping" and not s.flow, ends="}")
    return Broken(text[: site.value_end] + "}" + text[site.value_end :], site.value_end)


@mistake(r"a comma is missing before this")
def a_comma_missing(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.flow and s.kind == "number", before=", ")
    return Broken(text[: site.key - 2] + " " + text[site.key :], site.key - 1)


@mistake(r"the quote that opens here is not closed")
def a_quote_not_closed(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.kind == "text" and not s.flow and len(s.path) < 4)
    return Broken(text[: site.value] + '"' + text[site.value :], site.value)


@mistake(r"a second colon in one line; put the text in quotes")
def a_colon_in_a_text(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.name == "setting" and s.kind == "text" and not s.flow)
    return Broken(text[: site.value] + "gap: 3" + text[site.value_end :], site.value + 3)


@mistake(r"no anchor of this name stands before it")
def an_alias_of_nothing(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.kind in ("number", "text", "mapping"), ends=None)
    return Broken(text[: site.value] + "*nothing" + text[site.value_end :], site.value)


@mistake(r"tags are not allowed; leave it out")
def a_tag(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.kind == "number")
    return Broken(text[: site.value] + "!!int " + text[site.value :], site.value)


@mistake(r"a second document begins here; one is allowed")
def a_second_document(pick: Pick) -> Broken:
    text, _ = pick()
    return Broken(f"{text}---\nseed: 2\n", len(text))


@mistake(r"a character that YAML does not allow")
def a_control_character(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: s.kind == "text")
    return Broken(text[: site.value] + "\x07" + text[site.value :], site.value)


# ---------------------------------------------------------------- values of another kind


def a_number(site: Site) -> bool:
    return site.kind == "number" and known(site) and not site.shared


for _name, _made in {
    "a_number_in_quotes": lambda v: f"'{v}'",
    "a_number_with_its_unit": lambda v: f"{v} mm",
    "a_number_as_a_word": lambda v: "two",
    "a_number_with_a_blank_in_it": lambda v: "1 000",
    "a_truth_value_for_a_number": lambda v: "true",
    "a_list_for_a_number": lambda v: f"[{v}]",
    "a_mapping_for_a_number": lambda v: f"{{value: {v}}}",
    "a_number_in_letters_of_other_scripts": lambda v: "\u0661\u0662",
}.items():

    def _make(pick: Pick, _made: Callable[[str], str] = _made) -> Broken:
        text, site = pick(where=a_number)
        return value_becomes(text, site, _made(text[site.value : site.value_end]))

    MISTAKES.append(Mistake(_name, _make, "must be"))


@mistake(r"must be a number|must be a whole number")
def a_decimal_comma(pick: Pick) -> Broken:
    text, site = pick(where=lambda s: a_number(s) and not s.flow)
    return value_becomes(text, site, "0,5")


@mistake(r"must be a mapping")
def a_list_for_a_mapping(pick: Pick) -> Broken:
    return value_becomes(*pick("alike", path=("rig", "limits")), "[1, 2]")


@mistake(r"must be a mapping")
def a_word_for_a_mapping(pick: Pick) -> Broken:
    return value_becomes(*pick("quickstart", path=("rig", "virtual", "0", "noise", "force")), "little")


@mistake(r"must be a list")
def a_number_for_a_list(pick: Pick) -> Broken:
    return value_becomes(*pick(where=lambda s: s.path[:2] == ("rig", "virtual") and s.name == "voltages_V"), "150")


value_of("nothing_for_a_needed_text", "null", "must be text", "control", "name")
value_of("a_number_for_a_text", "0.25", "must be text; put it in quotes", "setting", config="paper")
value_of("a_fraction_for_a_whole_number", "1.5", "must be a whole number", "seed")
value_of("a_truth_value_of_old_YAML", "no", "must be true or false", "blind", "keep_files")
value_of("infinity", ".inf", "must be a finite number|must be", "table", "speed_max_m_per_s")
value_of("not_a_number", ".nan", "must be a finite number|must be", "table", "tolerance")

# ---------------------------------------------------------------- values out of their limits, and unknown names

_FILE = ("rig", "files", "0")
value_of("a_negative_duration", "-16", "must be greater than 0", "simulate", "duration_s")
value_of("a_negative_seed", "-1", "must be greater than or equal to 0", "seed")
value_of("a_frequency_of_zero", "0", "must be greater than 0", "simulate", "roads", "0", "frequency_Hz")
value_of("too_few_steps_a_sample", "4", "must be greater than or equal to 16", "rig", "virtual", "0", "oversampling")
value_of("a_day_of_30_hours", "30", "must be less than or equal to 24", "report", "daily_exposure_h")
value_of("an_empty_list_of_tests", "[]", "must have at least 1 item", "rig", "virtual", "0", "tests", config="alike")
value_of("limits_the_wrong_way_round", "[150, 0]", "must|rise|smallest", "rig", "limits", "voltage_V", config="alike")
value_of("an_unknown_policy", "[comfort, sky]", "there are .*skyhook", "simulate", "policies", wrong="sky")
value_of("an_unknown_fidelity", "[ideal, tabel]", "did you mean table", "simulate", "fidelities", wrong="tabel")
value_of("an_unknown_road", "sinus", "must be one of .*; did you mean sine", "simulate", "roads", "0", "kind")
value_of("an_unknown_car", "makowski2012", "there are makowski2021", "simulate", "car", "model")
value_of("an_unknown_edition", "['ISO 2631']", "must be one of", "report", "editions", wrong="'ISO 2631'")
value_of("an_unknown_method", "seperable", "did you mean separable", "identify", "method")
value_of("a_car_by_its_name", "makowski2021", "must be true or false", "car")
value_of("a_car_in_yaml_1_1", "no", "must be true or false", "car")
value_of("an_empty_path", "''", "must have at least 1 character|must", "rig", "files", "0", "path", config="utfsm")
value_of("a_path_that_is_not_there", "nowhere/*.csv", "no such file", "rig", "files", "0", "path", config="utfsm")
value_of("an_unknown_unit", "{displacement: furlungs}", "unit", *_FILE, "units", config="utfsm", wrong="furlungs")
value_of(
    "an_unknown_quantity",
    "{displacment: x}",
    "did you mean displacement",
    *_FILE,
    "columns",
    config="utfsm",
    wrong="displacment",
)
value_of("a_current_without_its_unit", "{name: current}", "the unit of a current is missing; say it", "control")
value_of("an_unknown_waveform", "sinus", "did you mean sine", "rig", "virtual", "0", "tests", "0", "waveform", "kind")


@mistake(r"no layout is called|no such layout|there is")
def an_unknown_layout(pick: Pick) -> Broken:
    text, site = pick("utfsm", path=(*_FILE, "path"))
    return Broken(text[: site.key] + "layout: pres_logger\n      " + text[site.key :], site.key + 8)


@mistake(r"no effect is called orifice_quadratc; did you mean orifice_quadratic\?")
def an_unknown_effect(pick: Pick) -> Broken:
    text, site = pick("quickstart", where=lambda s: s.name == "orifice_quadratic")
    first = "valve_lag: {tau: 0.004}\n" + indent(text, site)
    return Broken(text[: site.key] + first + "orifice_quadratc" + text[site.key_end :], site.key + len(first))


@mistake(r"gas_spring takes k_g")
def an_unknown_parameter_of_an_effect(pick: Pick) -> Broken:
    text, site = pick("alike", where=lambda s: s.name == "k_g")
    return key_becomes(text, site, "k_gas")


@mistake(r"exactly one|one of|virtual|files")
def a_rig_that_is_virtual_and_real(pick: Pick) -> Broken:
    text, site = pick("alike", path=("rig", "virtual"))
    return Broken(text[: site.key] + "files: [{path: a.csv}]\n  " + text[site.key :], text.index("rig:") + 7)


# ---------------------------------------------------------------- the test


def picker(rng: np.random.Generator) -> Pick:
    """Draws a config and one of its keys that fits."""

    def pick(
        config: str | None = None,
        *,
        where: Callable[[Site], bool] = lambda site: True,
        path: tuple[str, ...] | None = None,
        ends: str | None = None,
        before: str = "",
    ) -> tuple[str, Site]:
        found = [
            (shipped(name), site)
            for name in ([config] if config else CONFIGS)
            for site in sites(name)
            if (site.path == path if path else not site.shared and (len(site.path) > 1 or where is not None))
            and where(site)
            and (ends is None or shipped(name)[site.value_end - 1] == ends)
            and shipped(name)[: site.key].endswith(before)
        ]
        assert found, "no key of the shipped configs fits"
        return found[int(rng.integers(len(found)))]

    return pick


def test_there_are_sixty_kinds_and_more() -> None:
    assert len({mistake.name for mistake in MISTAKES}) == len(MISTAKES) >= 60


@pytest.mark.parametrize("made", MISTAKES, ids=lambda made: made.name)
def test_a_mistake_is_told_with_its_place_and_what_to_do(
    tmp_path: Path, rng: np.random.Generator, capsys: pytest.CaptureFixture[str], made: Mistake
) -> None:
    drawn: list[Site] = []
    pick = picker(rng)

    def noted(*args: Any, **kwargs: Any) -> tuple[str, Site]:
        text, site = pick(*args, **kwargs)
        drawn.append(site)
        return text, site

    broken = made.make(noted)
    write_data(tmp_path)
    path = tmp_path / "broken.yaml"
    path.write_text(broken.text, encoding="utf-8")
    assert status(["check", str(path)]) == 2, broken.text
    said = capsys.readouterr()
    assert said.out == ""
    assert "Traceback" not in said.err
    places = [
        (int(line), int(column), rest)
        for line, column, rest in re.findall(rf"{re.escape(str(path))}:(\d+):(\d+): (.*)", said.err)
    ]
    line, column = broken.place
    here = [rest for *place, rest in places if place == [line, column]]
    assert here, f"wanted {line}:{column}, not {said.err}"
    wanted = made.says.format(name=re.escape(drawn[-1].name))
    assert any(re.search(wanted, rest) for rest in here), said.err


@pytest.mark.parametrize(
    "name",
    [
        "an_unknown_effect",
        *(pytest.param(name, marks=pytest.mark.ci) for name in ("a_colon_missing", "a_path_that_is_not_there")),
    ],
)
def test_the_command_line_itself_ends_with_2_and_no_traceback(
    tmp_path: Path, rng: np.random.Generator, pzd: Callable[..., CompletedProcess[str]], name: str
) -> None:
    (made,) = (mistake for mistake in MISTAKES if mistake.name == name)
    write_data(tmp_path)
    path = tmp_path / "broken.yaml"
    broken = made.make(picker(rng))
    path.write_text(broken.text, encoding="utf-8")
    done = pzd("run", path, "--runs", tmp_path / "runs")
    assert done.returncode == 2
    assert "{}:{}:{}: ".format(path, *broken.place) in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "runs" / "broken" / "1-rig").exists()
