"""Which columns, times and units a frame, an array, a dictionary or a file has."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .._errors import UsageError
from .columns import Prepared, Raw, prepare, split

Units = Mapping[str, str] | str | None

_KINDS = (
    "a frame of pandas, polars or pyarrow, a dataset of xarray, a structured array, a dictionary of columns, a "
    "simulation, or the path of a file"
)


def recording(data: Any, units: Units, declared: Mapping[str, str], name: str) -> Prepared:
    """A recording as the native module takes it; files are read there."""
    if isinstance(data, (str, os.PathLike)):
        if units is not None:
            raise UsageError("a file has its units in its header: rename columns with their units by `rename`")
        path = os.fspath(data)
        return Prepared(path, None, os.path.basename(path))
    return prepare(_raw(data), units, declared, name)


def recordings(data: Any, units: Units, declared: Mapping[str, str], name: str) -> list[Prepared]:
    """Several recordings: a list, a dictionary of them by name, or one by itself."""
    if data is None:
        return []
    if isinstance(data, Mapping) and data and all(_is_recording(one) for one in data.values()):
        named = [(str(key), one) for key, one in data.items()]
    elif isinstance(data, (list, tuple)):
        named = [(f"{name} {k}" if len(data) > 1 else name, one) for k, one in enumerate(data, 1)]
    else:
        named = [(name, data)]
    return [recording(one, units, declared, own) for own, one in named]


def apart(lists: Sequence[list[Prepared]]) -> None:
    """Gives tables of one name names of their own."""
    known: set[str] = set()
    for one in (one for all_of_them in lists for one in all_of_them):
        if not isinstance(one.argument, tuple):
            continue
        name, k = one.name, 1
        while name in known:
            k += 1
            name = f"{one.name} ({k})"
        known.add(name)
        one.argument, one.name = (name, one.argument[1]), name


def _is_recording(value: Any) -> bool:
    """Whether a value of a dictionary is a recording by itself, not a column."""
    is_path = isinstance(value, (str, os.PathLike))
    return is_path or isinstance(value, Mapping) or hasattr(value, "columns") or hasattr(value, "data_vars") or (
        hasattr(value, "_as_raw")
    )


def _package(data: Any) -> str:
    return type(data).__module__.partition(".")[0]


def _raw(data: Any) -> Raw:
    if hasattr(data, "_as_raw"):
        raw: Raw = data._as_raw()
        return raw
    package, kind = _package(data), type(data).__name__
    if package == "pandas" and kind == "DataFrame":
        return _of_pandas(data)
    if package == "polars" and kind == "DataFrame":
        return _of_polars(data)
    if package == "pyarrow" and kind in ("Table", "RecordBatch"):
        return _of_arrow(data)
    if package == "xarray" and kind == "Dataset":
        return _of_xarray(data)
    if isinstance(data, np.ndarray) and data.dtype.names:
        return _with_time([(name, data[name]) for name in data.dtype.names])
    if isinstance(data, Mapping):
        return _with_time([(str(name), values) for name, values in data.items()])
    what = f"{package}.{kind}" if package not in ("builtins", "") else kind
    if isinstance(data, np.ndarray):
        what = "an array without names"
    raise UsageError(f"a recording is {_KINDS}, not {what}")


def _with_time(columns: Iterable[tuple[str, Any]]) -> Raw:
    """The column called `time` apart."""
    raw = Raw([])
    for header, values in columns:
        if raw.time is None and split(header)[0] == "time":
            raw.time = (header, values)
        else:
            raw.columns.append((header, values))
    return raw


def _attributes(attributes: Mapping[Any, Any]) -> str | None:
    """The unit among a column's attributes."""
    for key in ("unit", "units"):
        value = attributes.get(key)
        if isinstance(value, str):
            return value
    return None


def _of_pandas(frame: Any) -> Raw:
    raw = _with_time((str(label), _of_series(frame[label])) for label in frame.columns)
    units = frame.attrs.get("units")
    raw.units.update(units if isinstance(units, Mapping) else {})
    for label in frame.columns:
        unit = _attributes(frame[label].attrs)
        if unit is not None:
            raw.units.setdefault(split(str(label))[0], unit)
    raw.name = frame.attrs.get("name")
    if raw.time is None:
        header = "time" if frame.index.name is None else str(frame.index.name)
        is_time = type(frame.index).__name__ in ("DatetimeIndex", "TimedeltaIndex")
        if is_time or (frame.index.name is not None and split(header)[0] == "time"):
            raw.time = (header, _of_series(frame.index))
    return raw


def _of_series(series: Any) -> Any:
    """A column of pandas without its zone, which is UTC then, and without its own kind of missing values."""
    zone = getattr(series.dtype, "tz", None)
    if zone is not None:
        series = series.dt.tz_convert("UTC").dt.tz_localize(None) if hasattr(series, "dt") else (
            series.tz_convert("UTC").tz_localize(None)
        )
    if getattr(series.dtype, "na_value", None) is not None and series.dtype.kind in "iufb":
        return series.to_numpy(dtype=np.float64, na_value=np.nan)
    return series.to_numpy()


def _of_polars(frame: Any) -> Raw:
    def column(name: str) -> Any:
        series = frame[name]
        if getattr(series.dtype, "time_zone", None) is not None:
            series = series.dt.convert_time_zone("UTC").dt.replace_time_zone(None)
        return series.to_numpy()

    return _with_time((name, column(name)) for name in frame.columns)


def _of_arrow(table: Any) -> Raw:
    def column(k: int) -> Any:
        values = table.column(k)
        if hasattr(values, "combine_chunks"):
            values = values.combine_chunks()
        return values.to_numpy(zero_copy_only=False)

    raw = _with_time((name, column(k)) for k, name in enumerate(table.schema.names))
    for one in table.schema:
        told = {key.decode(): value.decode() for key, value in (one.metadata or {}).items()}
        unit = _attributes(told)
        if unit is not None:
            raw.units[split(one.name)[0]] = unit
    return raw


def _of_xarray(dataset: Any) -> Raw:
    raw = Raw([], name=dataset.attrs.get("name"))
    if "time" in dataset.variables:
        raw.time = ("time", dataset["time"].values)
        unit = _attributes(dataset["time"].attrs)
        if unit is not None:
            raw.units["time"] = unit
    for name in dataset.data_vars:
        values = dataset[name]
        if values.ndim != 1:
            continue
        raw.columns.append((str(name), values.values))
        unit = _attributes(values.attrs)
        if unit is not None:
            raw.units[str(name)] = unit
    return raw
