"""How often the 95 % intervals of identification hold the truth: many fresh draws, several kinds of noise.

    PYTHONPATH=.:tests/identify python tests/studies/coverage_study.py [draws a noise, default 200]

Each draw takes parameters within 20 % of a row of the paper's tables and gives the row's own test
and ten cycles at 0.5 Hz a force noise of 2 % of r.m.s. Beside the intervals that pzd writes stand
the textbook's (white residuals) and Newey and West's with prewhitening, for comparison; then the
acceptance itself, 50 draws of white noise, is repeated as often as the draws allow.
"""

from __future__ import annotations

import sys

import numpy as np
from fresh_truths import acceptance_test, with_noise

from pzd.identify.config import IdentifyConfig
from pzd.identify.fit import fit_records
from pzd.identify.intervals import uncertainty
from pzd.record import Array

CORRELATIONS = (0.0, 0.5, 0.9, 0.98)
ACCEPTANCE_DRAWS = 50


def newey_west(slopes: Array, residuals: Array) -> Array:
    """(3,) standard errors: scores prewhitened by an AR(1), Bartlett window of 4 (n/100)^(2/9) lags."""
    scores = slopes * residuals[:, None]
    first = np.clip(np.sum(scores[1:] * scores[:-1], axis=0) / np.sum(scores[:-1] ** 2, axis=0), -0.97, 0.97)
    white = scores[1:] - first * scores[:-1]
    lags = int(4.0 * (len(scores) / 100.0) ** (2.0 / 9.0))
    meat = white.T @ white
    for lag in range(1, lags + 1):
        product = white[lag:].T @ white[:-lag]
        meat += (1.0 - lag / (lags + 1.0)) * (product + product.T)
    recoloured = meat / np.outer(1.0 - first, 1.0 - first)
    bread = np.linalg.inv(slopes.T @ slopes)
    return np.sqrt(np.diag(bread @ recoloured @ bread))


def draw(seed: np.random.SeedSequence, correlation: float) -> tuple[Array, Array]:
    """(3,) relative errors, and (3, 3) whether each interval (rows: pzd, textbook, Newey-West) holds each truth."""
    rng = np.random.default_rng(seed)
    truth, records = acceptance_test(rng)
    objective, fit = fit_records([with_noise(r, rng, 0.02, correlation) for r in records], IdentifyConfig(), seed=1)
    miss = np.abs(np.array(fit.parameters) - np.array(truth))
    textbook = np.std(fit.residuals) * np.sqrt(np.diag(np.linalg.inv(fit.slopes.T @ fit.slopes)))
    widths = (
        uncertainty(fit.slopes, fit.residuals, objective.lengths).half_widths(),
        1.96 * textbook,
        1.96 * newey_west(fit.slopes, fit.residuals),
    )
    return miss / np.array(truth), np.stack([miss <= width for width in widths])


def main(draws: int) -> None:
    """Print the coverage for each noise and the outcome of the acceptance."""
    sys.stdout.write("correlation   pzd  textbook  Newey-West   largest error" + "\n")
    white = np.empty((0, 3), dtype=bool)
    for correlation in CORRELATIONS:
        drawn = [draw(seed, correlation) for seed in np.random.SeedSequence().spawn(draws)]
        held = np.stack([h for _, h in drawn])
        shares = held.mean(axis=(0, 2))
        largest = max(float(np.max(e)) for e, _ in drawn)
        sys.stdout.write(
            f"{correlation:11.2f} {shares[0]:5.3f} {shares[1]:9.3f} {shares[2]:11.3f} {largest:15.2%}" + "\n"
        )
        white = held[:, 0] if correlation == 0.0 else white
    batches = len(white) // ACCEPTANCE_DRAWS
    counts = [int(white[i * ACCEPTANCE_DRAWS : (i + 1) * ACCEPTANCE_DRAWS].sum()) for i in range(batches)]
    sys.stdout.write(f"acceptance, intervals of 150 that hold the truth, 136 wanted: {counts}" + "\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
