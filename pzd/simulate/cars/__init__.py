"""The cars, one file each; every module here is found by itself."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

from pzd.simulate.vehicle.car import HalfCar


@cache
def cars() -> dict[str, HalfCar]:
    """Find every car, by name."""
    found = [importlib.import_module(f"{__name__}.{info.name}").CAR for info in pkgutil.iter_modules(__path__)]
    return {car.name: car for car in found}
