"""Execute docs/first_hour.ipynb anew, and keep its outputs and pictures in it: `make notebook`."""

from __future__ import annotations

import json
from pathlib import Path

from notebooks import executed

NOTEBOOK = Path(__file__).resolve().parents[2] / "docs" / "first_hour.ipynb"

if __name__ == "__main__":
    text = json.dumps(executed(NOTEBOOK), indent=1, ensure_ascii=False) + "\n"
    NOTEBOOK.write_text(text, encoding="utf-8", newline="\n")
