"""The valve of the paper as `calibrate` finds it."""

from __future__ import annotations

from pzd.paper.valve import Valve

VALVE = Valve(
    laminar=5.63364e-08,
    turbulent=2.27733e-05,
    compliance=6.60238e-09,
    zero_error=-1.03176e-05,
    stroke_50=1.01844e-05,
    stroke_100=3.64595e-05,
    stroke_100_small=4.34934e-05,
    stroke_150=5.96557e-05,
    viscosity_fall=0.00609311,
    friction=121.985,
    friction_fall=0.058171,
)
"""Result of `calibrate`; the dampers of configs/paper.yaml are written from it."""
