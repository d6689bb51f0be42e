"""Passes calls to the native module: recordings, and the line that reproduces a result."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from inspect import signature
from typing import Any

import numpy as np

from .. import _dgd
from .._data.columns import Prepared
from .._data.incoming import apart, recording, recordings
from .._errors import UsageError
from .._options import RunOptions, Start, Values, native
from .declared import Declared

#: What a run found, the time stamp of its first sample, what its recording is called, and the line that makes it again.
Ran = tuple[_dgd.Run, "np.datetime64 | None", str, str]


class Asked(Declared):
    """A model with helpers for calls."""

    def _units(self) -> dict[str, str]:
        """Units of all columns that a recording may have."""
        kinds = ("inputs", "outputs", "states")
        declared = {entry["name"]: entry["unit"] for kind in kinds for entry in self._facts[kind]}
        # An output named like a state is read in its own unit.
        declared.update({entry["name"]: entry["unit"] for entry in self._facts["outputs"]})
        return declared

    def _known(self, run: RunOptions) -> dict[str, str]:
        """Units by column name, including renamed columns."""
        known = self._units()
        for column, name in (run.get("rename") or {}).items():
            known.setdefault(column, known.get(name, ""))
        return known

    def _recording(self, data: Any, run: RunOptions) -> Prepared | None:
        return None if data is None else recording(data, run.get("units"), self._known(run), "data")

    def _recordings(self, data: Any, valid: Any, run: RunOptions) -> tuple[list[Prepared], list[Prepared]]:
        known, units = self._known(run), run.get("units")
        train, held_out = recordings(data, units, known, "data"), recordings(valid, units, known, "valid")
        if not train:
            raise UsageError("there is no recording")
        apart([train, held_out])
        return train, held_out

    def _ran(
        self,
        method: Callable[[Any, dict[str, Any]], _dgd.Run],
        data: Any,
        run: RunOptions,
        params: Values,
        start: Start,
        **calls: Any,
    ) -> Ran:
        """The result of a method of the native model for one recording."""
        options = native(run, params, start, **calls)
        given = self._recording(data, run)
        found = method(given.argument if given else None, options)
        origin, name = (given.origin, given.name) if given else (None, self.name)
        return found, origin, name, self._line(method.__name__, given, params=params, start=start, **calls, **run)

    def _line(self, what: str, given: Prepared | list[Prepared] | None, **options: Any) -> str:
        """The line of Python that reproduces a result, for its page."""
        variant, set_before, applied = self._native.choices
        shown = [repr(self.path)]
        if variant:
            shown.append(f"variant={dict(one.split('=', 1) for one in variant)!r}")
        if set_before:
            shown.append(f"params={dict(one.split('=', 1) for one in set_before)!r}")
        if applied:
            shown.append(f"apply={applied!r}")
        arguments = [] if given is None else [_said(given)]
        declared = signature(getattr(type(self), what)).parameters
        for name, value in options.items():
            standard = declared[name].default if name in declared else None
            if value not in (None, [], {}, standard):
                arguments.append(f"{name}={_said(value)}")
        return f"dgd.load({', '.join(shown)}).{what}({', '.join(arguments)})"


def arguments(prepared: Iterable[Prepared]) -> list[Any]:
    """Recordings in the format of the native module."""
    return [one.argument for one in prepared]


def _said(value: Any) -> str:
    if isinstance(value, Prepared):
        return repr(value.argument if isinstance(value.argument, str) else value.name)
    if isinstance(value, list) and value and isinstance(value[0], Prepared):
        return "[" + ", ".join(_said(one) for one in value) + "]"
    return repr(value)
