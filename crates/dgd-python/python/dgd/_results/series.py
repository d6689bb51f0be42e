"""States, outputs and their derivatives over time."""

from __future__ import annotations

import json
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _dgd
from .._data.bytes import array
from .._data.columns import Raw
from .._data.outgoing import Column, Series
from .._show.plot import draw
from .._show.report import Report
from .._show.table import summary_of_series


def _columns(native: list[tuple[str, str, str, bytearray]]) -> list[Column]:
    return [Column(name, unit, kind, array(values)) for name, unit, kind, values in native]


class _OfRun:
    """What every result of a run has."""

    def __init__(self, native: _dgd.Run, call: str) -> None:
        self._native = native
        self._call = call
        self._details: dict[str, Any] = json.loads(native.details)
        #: Name of the integration method.
        self.method: str = self._details["method"]
        #: What happened at events: ``t`` in s, ``modes``, ``from`` and ``to``.
        self.events: list[dict[str, Any]] = self._details["events"]
        #: What the result was made of: version, seed, digests of model and data.
        self.provenance: dict[str, Any] = self._details["provenance"]
        #: What was remarked on the way.
        self.remarks: list[str] = native.remarks

    def to_csv(self) -> str:
        """The text that ``dgd simulate -o`` and ``dgd sensitivity -o`` write."""
        return self._native.csv().decode()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the table to a file whose name gives the format, as for ``dgd simulate -o``: CSV, Parquet or JSON."""
        self._native.save(os.fspath(path))

    def plot(self) -> Any:
        """A `matplotlib` figure in the colours of the reports: inputs, states and outputs, simulated and measured; or
        each trajectory and its derivatives."""
        return draw(self._native.figure())

    def report(self) -> Report:
        """The page that the command writes with ``--plot run.html``."""
        return Report(self._native.page(self._call))


class Simulation(_OfRun, Series):
    """Inputs, states and outputs over time, each in its declared unit.

    An output named like a state takes its column. ``result["p_r"]`` is an array, ``result.units["p_r"]`` its unit;
    ``to_pandas()``, ``to_xarray()``, ``to_polars()``, ``to_arrow()``, ``to_numpy()`` and ``to_dict()`` make frames of
    it. It can be given as a recording again.
    """

    def __init__(self, native: _dgd.Run, origin: np.datetime64 | None, name: str, call: str) -> None:
        _OfRun.__init__(self, native, call)
        Series.__init__(self, array(native.time), _columns(native.columns), origin, name)
        #: Accepted and rejected steps.
        self.steps: tuple[int, int] = (self._details["steps"], self._details["rejected"])

    def _as_raw(self) -> Raw:
        time = self.stamps if self.origin is not None else self.time
        return Raw([(c.name, c.values) for c in self.columns], ("time [s]", time), self.units, self.name)

    def __repr__(self) -> str:
        return f"<dgd.Simulation of {self.name}: {len(self.time)} rows, {', '.join(self)}>"

    def _repr_html_(self) -> str:
        return summary_of_series(repr(self)[1:-1], self)


class Sensitivity(_OfRun):
    """Derivatives of states and outputs to parameters and start values over time.

    ``values[t, i, j]`` is ∂of[i]/∂to[j], in ``units[of[i], to[j]]``; ``result["p_r", "c0"]`` is one of them over time.
    """

    def __init__(
        self, native: _dgd.Run, origin: np.datetime64 | None, name: str, call: str, scaled: bool
    ) -> None:
        super().__init__(native, call)
        columns = _columns(native.columns)
        trajectories = _columns(native.trajectories)
        #: What was differentiated.
        self.of: list[str] = [column.name for column in trajectories]
        each = len(columns) // max(len(self.of), 1)
        #: What it was differentiated to: a parameter by its name, a start value as ``x(0)``.
        self.to: list[str] = [_to(column.name, self.of[0]) for column in columns[:each]]
        #: Whether each derivative was multiplied by its parameter.
        self.scaled = scaled
        self.time = array(native.time)
        self.name = name
        shape = (len(self.time), len(self.of), len(self.to))
        stacked = np.stack([c.values for c in columns], axis=1) if columns else np.zeros(shape)
        self.values: NDArray[np.float64] = stacked.reshape(shape)
        pairs = ((of, to) for of in self.of for to in self.to)
        #: Unit of each derivative.
        self.units: dict[tuple[str, str], str] = {pair: c.unit for pair, c in zip(pairs, columns, strict=True)}
        #: What was differentiated, over time.
        self.trajectories = Series(self.time, trajectories, origin, name)
        self._derivatives = Series(self.time, columns, origin, name)
        #: When derivatives are not defined: ``from`` and ``until`` in s, and the ``equation`` because of which.
        self.undefined: list[dict[str, Any]] = self._details["undefined"]

    def __getitem__(self, pair: tuple[str, str]) -> NDArray[np.float64]:
        of, to = pair
        if of not in self.of or to not in self.to:
            raise KeyError(f"{pair}; there is d({', '.join(self.of)})/d({', '.join(self.to)})")
        one: NDArray[np.float64] = self.values[:, self.of.index(of), self.to.index(to)]
        return one

    @property
    def stamps(self) -> NDArray[np.datetime64] | None:
        """Times as stamps in UTC, or nothing where the recording has none."""
        return self.trajectories.stamps

    def to_numpy(self) -> NDArray[np.float64]:
        """The derivatives as an array over time, of and to."""
        return self.values

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` with ``sensitivity`` over ``time``, ``of`` and ``to``, and ``unit`` over ``of``, ``to``."""
        import xarray

        units = np.array([[self.units[of, to] for to in self.to] for of in self.of], dtype=object)
        variables = {"sensitivity": (("time", "of", "to"), self.values), "unit": (("of", "to"), units)}
        coordinates = {"time": self.trajectories._coordinate(), "of": self.of, "to": self.to}
        dataset = xarray.Dataset(variables, coords=coordinates)
        dataset.attrs.update(name=self.name, scaled=int(self.scaled))
        return dataset

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` with a column for each derivative, as in ``dgd sensitivity -o``."""
        return self._derivatives.to_pandas()

    def to_polars(self) -> Any:
        """A `polars.DataFrame` with a column for each derivative."""
        return self._derivatives.to_polars()

    def to_arrow(self) -> Any:
        """A `pyarrow.Table` with a column for each derivative."""
        return self._derivatives.to_arrow()

    def __repr__(self) -> str:
        of, to = ", ".join(self.of), ", ".join(self.to)
        return f"<dgd.Sensitivity of {self.name}: {len(self.time)} rows, d({of})/d({to})>"


def _to(header: str, of: str) -> str:
    """What a column is the derivative to: of ``d(h)/d(c0)`` and ``c0*d(h)/d(c0)`` it is c0."""
    return header.split(f"d({of})/d(", 1)[1][:-1]
