"""Options of calls: their types, and their conversion for the native module."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Union

from ._errors import UsageError

if TYPE_CHECKING:
    from typing_extensions import TypeAlias

#: A number in the declared unit, a text with a unit of its own as ``"1.8e8 [Pa*s^2/m^6]"``, or a pair of both.
Value: "TypeAlias" = Union[float, str, "tuple[float, str]"]
Values: "TypeAlias" = "Mapping[str, Value] | None"
Names: "TypeAlias" = "str | Iterable[str]"
Start: "TypeAlias" = "Mapping[str, Value] | Literal['model', 'measured'] | None"


class RunOptions(TypedDict, total=False):
    """Options of every call that runs a model.

    ========= ===========================================================================================
    units     units of columns that say none: a dictionary by name, or ``"declared"`` for the model's own
    rename    other names for columns, with a unit or without: ``{"P_RIS": "p_r [barg]"}``
    from_     first time, s since the first sample
    until     last time, s since the first sample
    method    integration method, as ``dgd methods`` lists them; ``"auto"`` chooses one
    steps     ``"auto"``, ``"adaptive"``, ``"per-sample"`` or ``"per-sample=N"``
    rtol      relative tolerance, 1e-6
    atol      absolute tolerance, as a fraction of each unknown's nominal size; rtol
    engine    ``"auto"``, ``"native"`` or ``"interpreter"``; the results do not depend on it
    seed      seed of everything random, 0
    threads   number of threads; all processors. The results do not depend on it
    ========= ===========================================================================================
    """

    units: Mapping[str, str] | str | None
    rename: Mapping[str, str] | None
    from_: float | None
    until: float | None
    method: str
    steps: str
    rtol: float
    atol: float | None
    engine: str
    seed: int
    threads: int | None


def native(run: Mapping[str, Any], params: Values, start: Start, **calls: Any) -> dict[str, Any]:
    """The dictionary for the native module: options of the command that were given, with its names and values."""
    known = list(RunOptions.__annotations__)
    for name in run:
        if name not in known:
            near = get_close_matches(name, known, 1)
            hint = f"did you mean `{near[0]}`?" if near else "there is `" + "`, `".join(known) + "`"
            raise TypeError(f"there is no option `{name}`; {hint}")
    options: dict[str, Any] = {**run, **calls, "set": settings(params)}
    options.pop("units", None)
    options["from"] = options.pop("from_", None)
    options["rename"] = [f"{column}={name}" for column, name in (options.get("rename") or {}).items()]
    if isinstance(start, str):
        options["start"] = start
    else:
        options["set"] += settings(start)
    return {name: value for name, value in options.items() if value is not None}


def settings(values: Values) -> list[str]:
    """Values in the format of the native module, `NAME=VALUE`."""
    return [f"{name}={_value(name, value)}" for name, value in (values or {}).items()]


def _value(name: str, value: Value) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        number, unit = value
        return f"{_number(name, number)} [{unit}]"
    return _number(name, value)


def _number(name: str, value: Any) -> str:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise UsageError(f"`{name}` is a number, or a text with a unit, not {value!r}") from None
    if not math.isfinite(number):
        raise UsageError(f"`{name}` must be a finite number, not {number}")
    # The fewest digits that are read back to the same number.
    return repr(number)


def names(value: Names) -> list[str]:
    """One name or several: ``"c0, F"`` is two."""
    parts = value.split(",") if isinstance(value, str) else list(value)
    return [part.strip() for part in parts if part.strip()]


def choices(variant: Mapping[str, str] | None) -> list[str]:
    """Variants in the format of the native module."""
    return [f"{name}={choice}" for name, choice in (variant or {}).items()]
