"""Results as columns over time, convertible to frames of other packages, which are imported on demand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bytes import Array


@dataclass(frozen=True)
class Column:
    """A column of a result: its name, the unit of its values, and its kind."""

    name: str
    unit: str
    kind: str
    values: Array


class Series:
    """Columns over time. ``result["p_r"]`` is the array of a column, ``result.units["p_r"]`` its unit.

    ``time`` is in s since the first sample; ``stamps`` has the same as time stamps, where the recording had some.
    """

    def __init__(self, time: Array, columns: list[Column], origin: np.datetime64 | None, name: str) -> None:
        self.name = name
        self.time = time
        self.columns = tuple(columns)
        self.origin = origin
        self._by_name = {column.name: column for column in columns}

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column."""
        return {column.name: column.unit for column in self.columns}

    @property
    def stamps(self) -> NDArray[np.datetime64] | None:
        """Times as UTC timestamps, or None if the recording has none."""
        if self.origin is None:
            return None
        spans = np.rint(self.time * 1e9).astype("timedelta64[ns]")
        return self.origin + spans

    def __getitem__(self, name: str) -> Array:
        column = self._by_name.get(name)
        if column is None:
            raise KeyError(f"`{name}`; there is `" + "`, `".join(self._by_name) + "`")
        return column.values

    def __contains__(self, name: object) -> bool:
        return name in self._by_name

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_name)

    def __len__(self) -> int:
        return len(self._by_name)

    def keys(self) -> list[str]:
        """Names of the columns, without the time."""
        return list(self._by_name)

    def to_dict(self) -> dict[str, Any]:
        """The time and all columns, by name."""
        return {"time": self._clock(), **{column.name: column.values for column in self.columns}}

    def to_numpy(self) -> NDArray[Any]:
        """A structured array, with a field for the time and for each column."""
        columns = self.to_dict()
        array = np.empty(len(self.time), dtype=[(name, values.dtype) for name, values in columns.items()])
        for name, values in columns.items():
            array[name] = values
        return array

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` with the time as its index and units in ``attrs["units"]``."""
        import pandas

        index = pandas.Index(self._clock(), name="time" if self.origin is not None else "time [s]")
        frame = pandas.DataFrame({column.name: column.values for column in self.columns}, index=index)
        frame.attrs["units"] = self.units
        return frame

    def to_polars(self) -> Any:
        """A `polars.DataFrame`, whose columns are called ``name [unit]``, because it has no metadata for units."""
        import polars

        return polars.DataFrame(self._with_headers())

    def to_arrow(self) -> Any:
        """A `pyarrow.Table`, whose fields have their unit as metadata."""
        import pyarrow

        fields, arrays = [], []
        for name, unit, values in self._all():
            array = pyarrow.array(values)
            arrays.append(array)
            metadata = {} if unit is None else {"unit": unit}
            fields.append(pyarrow.field(name, array.type, metadata=metadata))
        return pyarrow.table(arrays, schema=pyarrow.schema(fields))

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` over ``time``, whose variables have their unit in ``attrs["units"]``."""
        import xarray

        variables = {
            column.name: ("time", column.values, {"units": column.unit, "kind": column.kind})
            for column in self.columns
        }
        dataset = xarray.Dataset(variables, coords={"time": self._coordinate()})
        dataset.attrs["name"] = self.name
        return dataset

    def _coordinate(self) -> Any:
        attributes = {"units": "s"} if self.origin is None else {}
        return ("time", self._clock(), attributes)

    def _clock(self) -> NDArray[Any]:
        stamps = self.stamps
        return self.time if stamps is None else stamps

    def _all(self) -> Iterator[tuple[str, str | None, NDArray[Any]]]:
        yield "time", "s" if self.origin is None else None, self._clock()
        for column in self.columns:
            yield column.name, column.unit, column.values

    def _with_headers(self) -> dict[str, NDArray[Any]]:
        named = ((name if unit is None else f"{name} [{unit}]", values) for name, unit, values in self._all())
        return dict(named)
