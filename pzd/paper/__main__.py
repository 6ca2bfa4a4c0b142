"""`python -m pzd.paper claims`, `calibration` and `contradiction` print what they find."""

from __future__ import annotations

import sys

from pzd.paper.printing import calibration, claims_text, contradiction

TOPICS = {"claims": claims_text, "calibration": calibration, "contradiction": contradiction}


def main(arguments: list[str]) -> int:
    """Print the topics asked for; 2 where one is unknown or none is named."""
    if not arguments or not set(arguments) <= set(TOPICS):
        sys.stderr.write(f"usage: python -m pzd.paper {' | '.join(TOPICS)}\n")
        return 2
    for name in arguments:
        sys.stdout.write(f"{TOPICS[name]()}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
