"""Runs the notebooks from top to bottom, as `jupyter execute` does; what they claim, they assert.

python tests/notebooks.py [FOLDER]

With a folder, they are written there with what they show.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient

NOTEBOOKS = Path(__file__).resolve().parents[1] / "notebooks"


def main(folder: Path | None) -> int:
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        begin = time.perf_counter()
        # Raises where a cell does.
        NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(path.parent)}}).execute()
        print(f"{path.name}: {len(notebook.cells)} cells, {time.perf_counter() - begin:.1f} s", flush=True)
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            nbformat.write(notebook, folder / path.name)
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else None))
