"""Online estimation of states and parameters, row by row."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from types import TracebackType
from typing import Any

import numpy as np

from . import _dgd
from ._data.columns import split
from ._data.incoming import Units, _raw
from ._errors import UsageError, warn


@dataclass(frozen=True)
class Tracked:
    """An estimate in its declared unit, and its standard deviation."""

    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class Estimates:
    """Estimates after a row: ``states`` and ``params`` by name, ``innovations`` (measured less predicted) of outputs.

    ``nis`` is the normalised square of the innovations: on average the number of samples, if the model is right.
    ``alarm`` is ``"diverged"`` from the row on in which the filter diverged, until ``"recovered"``; ``failure`` is
    the reason why the model could not be evaluated in this row.
    """

    time: float
    states: dict[str, Tracked]
    params: dict[str, Tracked]
    innovations: dict[str, Tracked]
    nis: float | None
    failure: str | None
    alarm: str | None

    def __getitem__(self, name: str) -> float:
        """The value of a state or parameter."""
        found = self.states.get(name) or self.params.get(name)
        if found is None:
            raise KeyError(name)
        return found.value


class Tracker:
    """Online estimation: ``update(row)`` takes a row as it arrives and returns the estimates after it.

    A row is a dictionary, or a row of a frame: ``time`` in s or a timestamp, the inputs and measurements. The first row
    defines the columns; values missing from a later row count as not measured. ``close()`` ends it.
    """

    def __init__(self, native: _dgd.Tracker, units: Units, declared: Mapping[str, str]) -> None:
        self._native = native
        self._units = units
        self._declared = declared
        self._columns: list[str] | None = None
        self._remarked = 0
        #: What was taken as how uncertain, and why; there after the first row.
        self.settings: dict[str, Any] = {}

    def update(self, row: Any) -> Estimates:
        """Takes a row.

        Raises :class:`DataError` if the row cannot be read, which ends the tracker, and :class:`SimulationError` if the
        model could not be evaluated in many consecutive rows.
        """
        cells, units = _cells(row)
        text, lines = "", 1
        if self._columns is None:
            text, lines = self._begin(cells, units) + "\n", 2
        assert self._columns is not None
        unknown = [name for name in cells if name not in self._columns]
        if unknown:
            raise UsageError(f"the first row had no `{unknown[0]}`; it had `" + "`, `".join(self._columns) + "`")
        text += ",".join(_cell(cells.get(name)) for name in self._columns) + "\n"
        answers = [json.loads(line) for line in self._native.exchange(text.encode(), lines)]
        if lines == 2:
            self.settings = answers[0]["settings"]
        remarks = self._native.remarks
        # What is said of the first row is in `settings`.
        new = [] if lines == 2 else remarks[self._remarked :]
        self._remarked = len(remarks)
        warn(new, stacklevel=2)
        return _estimates(answers[-1])

    def _begin(self, cells: Mapping[str, Any], units: Mapping[str, str]) -> str:
        """The header of all rows."""
        if "time" not in cells:
            raise UsageError("a row has its `time`, in s or as a stamp")
        asked = self._units if isinstance(self._units, Mapping) else {}
        headers = []
        self._columns = ["time", *(name for name in cells if name != "time")]
        for name in self._columns:
            unit = asked.get(name) or units.get(name)
            if name == "time":
                unit = None if _is_stamp(cells["time"]) else unit or "s"
            elif unit is None and self._units == "declared":
                unit = self._declared.get(name)
            header = name if unit is None else f"{name} [{unit}]"
            headers.append('"' + header.replace('"', '""') + '"' if "," in header or '"' in header else header)
        return ",".join(headers)

    def run(self, data: Any) -> list[Estimates]:
        """Processes all rows of a recording, and ends."""
        raw = _raw(data)

        def header(name: str) -> str:
            bare, unit = split(name)
            unit = unit or raw.units.get(bare)
            return bare if unit is None else f"{bare} [{unit}]"

        named = [*([] if raw.time is None else [raw.time]), *raw.columns]
        columns = [(header(name), np.asarray(values)) for name, values in named]
        found = [self.update({name: values[k] for name, values in columns}) for k in range(len(columns[0][1]))]
        self.close()
        return found

    def close(self) -> list[str]:
        """Ends it, and returns the summary of all rows."""
        return self._native.close()

    def __enter__(self) -> Tracker:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()


def _cells(row: Any) -> tuple[dict[str, Any], dict[str, str]]:
    """Values of a row by names without units, and units of those that have one in their name."""
    if hasattr(row, "_asdict"):
        row = row._asdict()
    elif hasattr(row, "to_dict"):
        values = row.to_dict()
        if "time" not in values and hasattr(row, "name"):
            values = {"time": row.name, **values}
        row = values
    if not isinstance(row, Mapping):
        raise UsageError(f"a row is a dictionary or a row of a frame, not {type(row).__name__}")
    cells, units = {}, {}
    for header, value in row.items():
        name, unit = split(str(header))
        cells[name] = value
        if unit is not None:
            units[name] = unit
    return cells, units


def _is_stamp(value: Any) -> bool:
    return isinstance(value, (str, datetime, np.datetime64)) or hasattr(value, "isoformat")


def _cell(value: Any) -> str:
    if value is None or type(value).__name__ in ("NAType", "NaTType"):
        return ""
    if isinstance(value, str):
        return value
    if hasattr(value, "isoformat"):
        return str(value.isoformat())
    if isinstance(value, np.datetime64):
        return str(np.datetime_as_string(value))
    # The fewest digits that are read back to the same number.
    number = float(value)
    return "" if number != number else repr(number)


def _estimates(answer: dict[str, Any]) -> Estimates:
    def tracked(entries: dict[str, Any]) -> dict[str, Tracked]:
        return {name: Tracked(one["value"], one["std"], one["unit"]) for name, one in entries.items()}

    return Estimates(
        answer["time"],
        tracked(answer["states"]),
        tracked(answer["parameters"]),
        tracked(answer["innovations"]),
        answer["nis"],
        answer["failure"],
        answer["alarm"],
    )
