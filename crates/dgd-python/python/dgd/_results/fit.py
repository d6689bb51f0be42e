"""Estimates, how far they can be trusted, and the fitted model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import _dgd
from .._errors import UsageError
from .._show.plot import draw
from .._show.table import number, table
from .found import Findings

if TYPE_CHECKING:
    from .._model.model import Model


@dataclass(frozen=True)
class Interval:
    """The 95 % confidence interval of an estimate by profile likelihood.

    ``lower`` and ``upper`` are in ``unit``, NaN where the likelihood does not fall far enough. ``deviance`` is how much
    the least sum of squares rises where the estimate is held at each of ``values``; it is ``threshold`` at the ends.
    """

    name: str
    unit: str
    lower: float
    upper: float
    values: NDArray[np.float64] = field(repr=False)
    deviance: NDArray[np.float64] = field(repr=False)
    threshold: float = field(repr=False)
    result: dict[str, Any] = field(repr=False)
    figure: dict[str, Any] | None = field(default=None, repr=False)

    def plot(self) -> Any:
        """The likelihood along the estimate, by `matplotlib`."""
        if self.figure is None:
            raise UsageError(f"`{self.name}` has no profile that can be drawn")
        return draw(self.figure)


class Fit(Findings):
    """A fit: ``params["c0"]`` is an estimate in its declared unit, ``std["c0"]`` its standard error, ``cov`` the covariance.

    A fit that ended in no minimum has ``converged == False``; ``left_out`` says why, and a warning was given.
    ``model`` is the fitted model, ``report()`` the page, ``result`` all that ``result.json`` of ``dgd fit`` has.
    """

    def __init__(
        self,
        native: _dgd.Found,
        model: Callable[[str], Model],
        folder: str,
        profiled: Callable[[Model, list[str]], Fit],
    ) -> None:
        super().__init__(native)
        self._profiled = profiled
        entries: dict[str, Any] = self.result["parameters"]
        #: Estimates of parameters, in their declared units.
        self.params: dict[str, float] = {name: _float(entry["value"]) for name, entry in entries.items()}
        #: Their standard errors; NaN at a bound, and where the data does not determine a parameter.
        self.std: dict[str, float] = {name: _float(entry.get("std")) for name, entry in entries.items()}
        #: Their units.
        self.units: dict[str, str] = {name: entry["unit"] for name, entry in entries.items()}
        #: Names of the rows and columns of ``cov`` and ``correlation``.
        self.names: list[str] = list(self.result.get("names", self.params))
        #: The fitted model, with the start values of the first recording.
        self.model: Model = model(native.model_text(folder))
        #: Why the estimates are not what they should be; nothing where the fit came to its end.
        self.left_out: list[str] = self._reservations()
        #: Whether the fit ended in a minimum.
        self.converged: bool = bool(self.result.get("converged", not self.left_out))

    @property
    def cov(self) -> NDArray[np.float64]:
        """Covariance of the estimates ``names``, in products of their units; NaN where something is not determined."""
        return self._matrix("covariance")

    @property
    def correlation(self) -> NDArray[np.float64]:
        """Correlation of the estimates ``names``."""
        return self._matrix("correlation")

    @property
    def starts(self) -> list[dict[str, float]]:
        """Start values of each recording, in their declared units."""
        of_recordings = self.result.get("starts", [])
        return [{name: _float(entry["value"]) for name, entry in one["values"].items()} for one in of_recordings]

    @property
    def outputs(self) -> dict[str, dict[str, Any]]:
        """For each output its ``unit``, ``noise`` and root-mean-square errors ``rms_train`` and ``rms_valid``."""
        outputs: dict[str, dict[str, Any]] = self.result["outputs"]
        return outputs

    @property
    def reduced_chi_square(self) -> float:
        """Mean square of the weighted residuals per degree of freedom; 1 where only noise is left."""
        return _float(self.result.get("reduced_chi_square"))

    def profile(self, *names: str) -> dict[str, Interval]:
        """Confidence intervals by profile likelihood, of all parameters where none is named.

        Those that were asked for with the fit are there at once; others are found by another fit, which begins at
        these estimates.
        """
        wanted = list(names) or list(self.params)
        known = self._profiles()
        missing = [name for name in wanted if name not in known]
        if missing:
            known.update(self._profiled(self.model, missing)._profiles())
        return {name: known[name] for name in wanted if name in known}

    def _profiles(self) -> dict[str, Interval]:
        figures = {name: figure for name, figure in self._native.figures() if name is not None}
        found = {}
        entries: dict[str, dict[str, Any]] = self.result.get("profiles") or {}
        for name, entry in entries.items():
            lower, upper = (_float(end) for end in entry["interval"])
            values, deviance = (np.array([_float(x) for x in entry[key]]) for key in ("values", "deviance"))
            found[name] = Interval(
                name, entry["unit"], lower, upper, values, deviance, entry["threshold"], entry, figures.get(name)
            )
        return found

    def _matrix(self, key: str) -> NDArray[np.float64]:
        rows = self.result.get(key) or [[None] * len(self.names)] * len(self.names)
        return np.array([[_float(value) for value in row] for row in rows], dtype=float)

    def __repr__(self) -> str:
        values = ", ".join(f"{name} = {number(value, 6)} {self.units[name]}" for name, value in self.params.items())
        return f"<dgd.Fit: {values}{'' if self.converged else '; not converged'}>"

    def _repr_html_(self) -> str:
        rows = [
            [name, number(value, 6), number(self.std[name], 2), self.units[name]] for name, value in self.params.items()
        ]
        notes = "".join(f"<p><b>{words}</b></p>" for words in self.left_out)
        return table(["parameter", "estimate", "standard error", "unit"], rows) + notes


def _float(value: Any) -> float:
    return float("nan") if value is None else float(value)
