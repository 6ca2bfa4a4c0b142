"""How the one least squares does on the nonlinear regressions of NIST StRD, from both starting points of each.

make nist
"""

from __future__ import annotations

from strd import EQUAL_DIGITS, MODELS, regression


def main() -> None:
    """Print digits, evaluations and verdict of every fit, and how many are right, refused and wrong."""
    right = refused = wrong = 0
    say(f"{'set':10} {'start':>5} {'digits':>7} {'evaluations':>12} {'offset':>8} {'condition':>10}  verdict")
    for name in MODELS:
        data = regression(name)
        for start in (0, 1):
            found = data.fitted(start)
            digits = data.digits(found.x)
            true = digits >= EQUAL_DIGITS
            right, refused = right + (found.converged and true), refused + (not found.converged)
            wrong += found.converged and not true
            verdict = found.reason or "converged"
            figures = f"{digits:7.1f} {found.evaluations:12} {found.offset:8.1e} {found.condition:10.1e}"
            say(f"{name:10} {start + 1:5} {figures}  {verdict}")
    say(f"of {2 * len(MODELS)} fits {right} right to {EQUAL_DIGITS:.0f} digits, {refused} refused, {wrong} wrong")


def say(line: str) -> None:
    """Print at once."""
    print(line, flush=True)  # noqa: T201  # this is what the study is for


if __name__ == "__main__":
    main()
