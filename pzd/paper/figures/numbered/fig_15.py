"""Figure 15: the model at two temperatures without voltage."""

from __future__ import annotations

from pzd.paper.figures.planes import at_two_temperatures

FIGURE = at_two_temperatures(15, 0.0, "without voltage")
