"""Recordings from Python, as passed to dgd: columns, units, and start time."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _dgd
from .._errors import DataError, UsageError
from .bytes import Array, packed

# As in a data file: a space stands before the unit, so that `p[1]` is an element.
_HEADER = re.compile(r"^(.*\S)\s+\[([^\[\]]*)\]\s*$")


def split(header: str) -> tuple[str, str | None]:
    """A header as name and unit: ``"p_r [bar]"`` is ``("p_r", "bar")``."""
    found = _HEADER.match(header)
    return (found[1], found[2].strip()) if found else (header.strip(), None)


@dataclass
class Raw:
    """Columns of a frame, with the time separate.

    ``time`` is numbers, stamps or durations; its header says the unit of numbers.
    """

    columns: list[tuple[str, Any]]
    time: tuple[str, Any] | None = None
    units: dict[str, str] = field(default_factory=dict)
    name: str | None = None


@dataclass
class Prepared:
    """A recording in the format of the native module, with the information that results keep."""

    argument: Any
    #: The stamp of the first sample, where times are stamps.
    origin: np.datetime64 | None
    name: str


def prepare(
    raw: Raw, units: Mapping[str, str] | str | None, declared: Mapping[str, str], name: str
) -> Prepared:
    """Columns with headers. ``declared`` has the units of the names in the model."""
    given = _units(raw, units, declared)
    columns: list[tuple[str, Array]] = []
    origin = None
    if raw.time is not None:
        header, values = raw.time
        header, seconds, origin = _time(header, values, given)
        columns.append((header, seconds))
    for header, values in raw.columns:
        bare, own = split(header)
        numbers = _numbers(values)
        if numbers is None:
            if bare in declared:
                kind = getattr(values, "dtype", type(values).__name__)
                raise DataError(f"`{name}`: the column `{bare}` does not hold numbers, but {kind}")
            continue
        unit = given(bare, own)
        columns.append((bare if unit is None else f"{bare} [{unit}]", numbers))
    if not columns:
        raise DataError(f"`{name}` has no column of numbers")
    lengths = {header: len(values) for header, values in columns}
    if len(set(lengths.values())) > 1:
        said = ", ".join(f"`{header}` {length}" for header, length in lengths.items())
        raise DataError(f"the columns of `{name}` differ in length: {said}")
    table = _dgd.Table([(header, packed(numbers)) for header, numbers in columns])
    return Prepared((raw.name or name, table), origin, raw.name or name)


def _units(
    raw: Raw, units: Mapping[str, str] | str | None, declared: Mapping[str, str]
) -> Callable[[str, str | None], str | None]:
    """The unit of a column, from its name and its header."""
    if isinstance(units, str):
        if units != "declared":
            raise UsageError(f'`units` is a dictionary, or "declared" for the model\'s own: {units!r}')
        return lambda name, own: own or raw.units.get(name) or declared.get(name, "s" if name == "time" else None)
    asked = dict(units or {})
    names = [split(header)[0] for header, _ in raw.columns]
    if raw.time is not None:
        names.append(split(raw.time[0])[0])
    for name in asked:
        if name not in names:
            near = get_close_matches(name, names, 1)
            hint = f"did you mean `{near[0]}`?" if near else "there is `" + "`, `".join(names) + "`"
            raise UsageError(f"`units` names `{name}`, which is no column; {hint}")
    return lambda name, own: asked.get(name) or own or raw.units.get(name)


def _numbers(values: Any) -> Array | None:
    """Numbers, with NaN for missing values; None if there are other values."""
    try:
        array = np.asarray(values)
        if array.ndim != 1 or array.dtype.kind in "mM":
            return None
        if array.dtype.kind == "O":
            array = np.array([np.nan if _is_missing(value) else value for value in array], dtype=float)
        if array.dtype.kind in "US":
            return None
        return np.ascontiguousarray(array, dtype=np.float64)
    except (TypeError, ValueError):
        return None


def _is_missing(value: Any) -> bool:
    # Missing values of pandas are not equal to themselves, or say nothing about it.
    return value is None or type(value).__name__ in ("NAType", "NaTType")


def _time(
    header: str, values: Any, unit_of: Callable[[str, str | None], str | None]
) -> tuple[str, Array, np.datetime64 | None]:
    """Header and values of the time, and the first timestamp, if there are any."""
    array = np.asarray(values)
    if array.dtype.kind in "OU":
        array = _stamps(array)
    if array.dtype.kind == "M":
        stamps = array.astype("datetime64[ns]")
        first = stamps[~np.isnat(stamps)][:1]
        if first.size == 0:
            return "time [s]", np.full(len(stamps), np.nan), None
        return "time [s]", _seconds(stamps - first[0]), first[0]
    if array.dtype.kind == "m":
        return "time [s]", _seconds(array.astype("timedelta64[ns]")), None
    numbers = _numbers(array)
    if numbers is None:
        raise DataError(f"the column `{split(header)[0]}` holds neither times nor numbers, but {array.dtype}")
    unit = unit_of("time", split(header)[1])
    return ("time" if unit is None else f"time [{unit}]"), numbers, None


def _seconds(spans: NDArray[np.timedelta64]) -> Array:
    """Integer nanoseconds to seconds, rounded once, like timestamps in a data file."""
    seconds = spans.astype(np.int64) / 1e9
    seconds[np.isnat(spans)] = np.nan
    return seconds


def _stamps(array: NDArray[Any]) -> NDArray[Any]:
    """`datetime` objects or texts as timestamps; those with a zone in UTC."""
    from datetime import datetime, timedelta, timezone

    def parsed(value: Any) -> Any:
        if isinstance(value, str):
            value = datetime.fromisoformat(value.replace("Z", "+00:00"))
        if isinstance(value, datetime) and value.tzinfo is not None:
            value = value.astimezone(timezone.utc).replace(tzinfo=None)
        return value

    try:
        all_values = [parsed(value) for value in array]
        if all(isinstance(value, timedelta) for value in all_values):
            return np.array(all_values, dtype="timedelta64[ns]")
        if all(isinstance(value, datetime) for value in all_values):
            return np.array(all_values, dtype="datetime64[ns]")
    except ValueError:
        pass
    return array
