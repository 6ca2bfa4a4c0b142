"""Figure 16: the model at two temperatures at 150 V."""

from __future__ import annotations

from pzd.paper.figures.planes import at_two_temperatures

FIGURE = at_two_temperatures(16, 150.0, "at 150 V")
