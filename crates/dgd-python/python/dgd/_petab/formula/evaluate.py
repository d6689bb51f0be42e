"""The value of a formula."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from ..names import PI
from .expression import Expression

_OPERATIONS: dict[str, Callable[..., float]] = {
    "+": lambda *terms: sum(terms),
    "*": lambda *factors: math.prod(factors),
    "/": lambda a, b: a / b,
    "^": lambda a, b: a**b,
    "minus": lambda a: -a,
    "<": lambda a, b: float(a < b),
    "<=": lambda a, b: float(a <= b),
    ">": lambda a, b: float(a > b),
    ">=": lambda a, b: float(a >= b),
    "and": lambda a, b: float(bool(a) and bool(b)),
    "or": lambda a, b: float(bool(a) or bool(b)),
    "not": lambda a: float(not a),
}
_FUNCTIONS: dict[str, Callable[..., float]] = {
    "abs": abs,
    "ceil": math.ceil,
    "floor": math.floor,
    "max": max,
    "min": min,
    "mod": lambda a, b: a % b,
    "sign": lambda a: float((a > 0) - (a < 0)),
}


def evaluated(formula: Expression, values: Mapping[str, float]) -> float:
    """The value of a formula where its names have values; an undefined one is NaN."""
    kind, parts = formula.kind, formula.parts
    if kind == "number":
        return formula.value
    if kind == "name":
        return math.pi if formula.name == PI else values[formula.name]
    if kind == "if":
        return evaluated(parts[1] if evaluated(parts[0], values) else parts[2], values)
    function = _OPERATIONS.get(kind) or _FUNCTIONS.get(formula.name) or getattr(math, formula.name)
    try:
        return float(function(*(evaluated(part, values) for part in parts)))
    except (ArithmeticError, TypeError, ValueError):
        return math.nan


def constant(formula: Expression) -> float | None:
    """The value of a formula without names; None of one that has names, or no finite value."""
    if formula.names - {PI}:
        return None
    value = evaluated(formula, {})
    return value if math.isfinite(value) else None
