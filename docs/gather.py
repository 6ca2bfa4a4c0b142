"""Gathers the pages of the repository, the notebook and the reference under build/docs, from which MkDocs makes a site.

The pages stand where they stand in the repository, so that their links hold; files that they link to come along.
"""

from __future__ import annotations

import base64
import json
import re
import shutil
import sys
from pathlib import Path
from typing import Any

import pzd

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOK = Path("docs/first_hour.ipynb")
REFERENCE = Path("docs/reference.md")
_LINK = re.compile(r"\]\(([^)#\s]+)(#[^)]*)?\)")


def pages() -> list[Path]:
    """Return every page of the repository, from its root."""
    folders = [ROOT, ROOT / "configs", ROOT / "runs", ROOT / "docs"]
    found = [path for folder in folders for path in folder.glob("*.md")] + [*(ROOT / "pzd").rglob("*.md")]
    return sorted(path.relative_to(ROOT) for path in found)


def gather(target: Path) -> None:
    """Write the sources of the site.

    Parameters
    ----------
    target : folder that is written anew
    """
    shutil.rmtree(target, ignore_errors=True)
    for page in pages():
        text = (ROOT / page).read_text(encoding="utf-8").replace(f"]({NOTEBOOK})", f"]({NOTEBOOK.with_suffix('.md')})")
        _write(target / page, text)
        for link, _ in _LINK.findall(text):
            _copy(page.parent / link, target)
    _write(target / NOTEBOOK.with_suffix(".md"), _notebook(target / NOTEBOOK.parent))
    _write(target / REFERENCE, _reference())


def _copy(linked: Path, target: Path) -> None:
    """Copy a file that a page links to, unless it is a page itself, or somewhere else."""
    source = (ROOT / linked).resolve()
    if source.is_file() and source.is_relative_to(ROOT) and source.suffix != ".md":
        place = target / source.relative_to(ROOT)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, place)


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def _notebook(folder: Path) -> str:
    """Return the notebook as a page, and write its pictures beside it."""
    parts: list[str] = []
    for cell in json.loads((ROOT / NOTEBOOK).read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        parts += [_output(output, f"{cell['id']}-{n}.png", folder) for n, output in enumerate(cell["outputs"])]
    return "\n\n".join(parts) + "\n"


def _output(output: dict[str, Any], name: str, folder: Path) -> str:
    data = output.get("data", {})
    if "image/png" in data:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(base64.b64decode(data["image/png"]))
        return f"![what the cell draws]({name})"
    text = "".join(output.get("text") or data["text/plain"])
    return f"```text\n{text.rstrip()}\n```"


def _reference() -> str:
    """Return the page of the reference: all that the front door offers, by its docstrings."""
    names = "\n\n".join(f"::: pzd.{name}" for name in pzd.__all__)
    results = {
        "identify": "stages.Identification",
        "diagnose": "stages.Finding",
        "changes": "comparison.ComparedStates",
        "table": "dampers.ForceTable",
        "ride": "rides.CarRide",
        "rate": "vibration.RatedVibration",
        "run and load": "runs.FinishedRun",
    }
    returned = "\n\n".join(f"## What {name} returns\n\n::: pzd.front.{path}" for name, path in results.items())
    return f"# Reference\n\n{pzd.__doc__}\n\n{names}\n\n{returned}\n"


if __name__ == "__main__":
    gather(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build" / "docs")
