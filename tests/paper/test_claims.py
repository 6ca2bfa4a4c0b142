"""The paper's words against its own numbers, and what `python -m pzd.paper` prints."""

from __future__ import annotations

import subprocess
import sys

import pytest

from pzd.paper.__main__ import printed_claims
from pzd.paper.contradiction import claims

GIVEN = {
    "227 N": "2270",
    "43 %": "76 % up; 1530 -> 870 N is 43 % down",
    "one test": "1514, 1530, 1610 N",
    "fivefold": "= 2.6",
    "200-250 %": "236 and 194 %",
    "of second degree": "4.2, 10.9, 13.4 N/V",
    "twofold temperature": "1.72 times",
    "approximately 10 %": "11 %; at 0 V 300 N are 19 %",
    "every temperature": "0.010/K; the peak at 150 V falls by 0.006/K; the force at zero velocity falls by 0.041/K",
    "drops most": "-44 %",
    "(Table 3)": "1363 N at 100 V, 1078 at 150",
    "slot closes": "16400 -> 13700 and 3040 -> 2560",
    "warm oil": "2720 -> 3300",
    "9 ms": "14 to 49 ms",
    "750 to 45,000": "a range of 60",
    "9 h": "1.4 times",
    "4 min": "2.9 times",
}


@pytest.mark.parametrize(("words", "number"), GIVEN.items())
def test_a_claim_of_the_paper_is_set_beside_its_own_numbers(words: str, number: str) -> None:
    found = [claim for claim in claims() if words in claim.says and number in claim.gives]
    assert len(found) == 1


def test_every_claim_is_printed() -> None:
    text = "\n".join(printed_claims())
    assert all(claim.says in text and claim.gives in text for claim in claims())
    assert len(claims()) == len(GIVEN)


@pytest.mark.ci
def test_the_command_prints_a_topic_and_refuses_what_is_none() -> None:
    def run(*topics: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-m", "pzd.paper", *topics], capture_output=True, text=True, check=False)

    assert "236 and 194 %" in run("claims").stdout
    refused = run("nonsense")
    assert refused.returncode == 2
    assert "claims | calibration | contradiction" in refused.stderr
