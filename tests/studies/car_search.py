"""The survey of cars that section 5 of the paper may have ridden: computes pzd/paper/cars.csv anew.

    PYTHONPATH=. python tests/studies/car_search.py [folder, default pzd/paper]

Every plausible car of a grid that meets both peaks with constant c of Figure 19 rides under all three
tie-breaks, once as it is and eight times with a parameter moved by 1 %; from the six closest of each
tie-break the search goes on by Nelder and Mead. Half an hour on one free core; the last lines say
which car and tie-break come closest.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from pzd.paper.car_search import (
    CarRow,
    candidates,
    constant_peaks,
    controlled_peaks,
    largest_deviation,
    refined,
    row_of,
)
from pzd.quantities import Control
from pzd.schema.csvfile import write_rows
from pzd.simulate.control.demand import TIE_BREAKS

STARTS = 6


def survey() -> Iterator[CarRow]:
    """Every candidate under every tie-break, and the refined cars."""
    cars = tuple(candidates())
    sys.stdout.write(f"{len(cars)} plausible cars meet both peaks with constant c\n")
    for tie_break in TIE_BREAKS:
        deviations = []
        for car in cars:
            row = row_of(car, tie_break)
            deviations.append((row.deviation, car))
            yield row
        nearest = [car for _, car in sorted(deviations, key=lambda item: item[0])[:STARTS]]
        better = {refined(car, tie_break): None for car in nearest}
        best = sorted(better, key=lambda car: largest_deviation(constant_peaks(car), controlled_peaks(car, tie_break)))
        for car in best[: STARTS // 2]:
            row = row_of(car, tie_break, "refined")
            sys.stdout.write(f"{row.deviation:.2%} {row}\n")
            sys.stdout.flush()
            yield row


def main() -> None:
    """Compute and write."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "pzd/paper")
    write_rows(folder / "cars.csv", CarRow, survey(), Control())


if __name__ == "__main__":
    main()
