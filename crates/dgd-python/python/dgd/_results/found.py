"""Common parts of results of fits and searches."""

from __future__ import annotations

import json
import os
from typing import Any

from .. import _dgd
from .._errors import UsageError
from .._show.plot import draw
from .._show.report import Report


class Findings:
    """Results of a model and recordings: ``result`` is the contents of the command's ``result.json``."""

    def __init__(self, native: _dgd.Found) -> None:
        self._native = native
        self.result: dict[str, Any] = json.loads(native.json)
        #: What the result was made of: version, seed, digests of model and data.
        self.provenance: dict[str, Any] = self.result["provenance"]
        #: What was remarked on the way.
        self.remarks: list[str] = native.remarks

    def _reservations(self) -> list[str]:
        return self._native.reservations

    def plot(self) -> Any:
        """A `matplotlib` figure: of a fit each output of each recording, fitted and measured; of a search measured less
        simulated, before and after."""
        figures = [figure for name, figure in self._native.figures() if name is None]
        if not figures:
            raise UsageError("an estimator that simulates nothing has no curves to draw")
        return draw(figures[0])

    def report(self) -> Report:
        """The page ``report.html`` that ``dgd fit -o`` and ``dgd discover -o`` write."""
        return Report(self._native.page())

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes the folder that the command writes with ``-o``: the model, ``result.json``, ``report.html``."""
        self._native.save(os.fspath(folder))

    def __str__(self) -> str:
        return self._native.text
