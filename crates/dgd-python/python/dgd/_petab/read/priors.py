"""Prior knowledge of a parameter: its value, and its prior as far as the language supports it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..refusal import Refusals

#: A law by the language's name for it, and its two numbers.
Law = tuple[str, float, float]
Bounds = tuple["float | None", "float | None"]

_BASES = {"log": math.e, "log10": 10.0}


def nominal(parameter: str, value: float | None, bounds: Bounds, is_log: bool, refusals: Refusals) -> float:
    """The nominal value, or the midpoint of the bounds if there is none, on the parameter's scale."""
    if value is not None:
        return value
    lower, upper = bounds
    if lower is None or upper is None or not math.isfinite(upper - lower) or (is_log and lower <= 0):
        refusals.add(f"parameter `{parameter}` without a nominal value and without bounds")
        return 1.0
    return math.sqrt(lower * upper) if is_log else (lower + upper) / 2


def prior(
    parameter: str, kind: str, numbers: Sequence[float], scale: str, bounds: Bounds, refusals: Refusals
) -> tuple[Law | None, Bounds]:
    """The prior, and the bounds.

    ``scale`` is that of the parameter: a prior called ``parameterScale…`` is one of its logarithm where it is not
    ``"lin"``. A uniform prior is constant within its ends, which are taken over as bounds.
    """
    base = _BASES.get(scale) if kind.startswith("parameterScale") else None
    bare = kind.removeprefix("parameterScale").replace("-", "").lower()
    if bare == "uniform":
        return None, _narrower(bounds, [base**one for one in numbers] if base else numbers)
    law = _law(bare, numbers, base) if len(numbers) == 2 else None
    if law is not None:
        return law, bounds
    where = f" on the scale `{scale}`" if base else ""
    refusals.add(f"prior `{kind}`{where} of parameter `{parameter}`")
    return None, bounds


def _law(bare: str, numbers: Sequence[float], base: float | None) -> Law | None:
    first, second = numbers
    if base is not None:
        # A density of the logarithm. That of the language is one of the parameter: its term 2 ln(a/median) is made up
        # for by a median that is larger by the square of the deviation.
        deviation = second * math.log(base)
        return ("lognormal", base**first * math.exp(deviation**2), deviation) if bare == "normal" else None
    if bare == "lognormal":
        return "lognormal", math.exp(first), second
    return (bare, first, second) if bare in ("normal", "laplace", "gamma") else None


def _narrower(bounds: Bounds, within: Sequence[float]) -> Bounds:
    """The narrower of two pairs of bounds."""
    if len(within) != 2:
        return bounds
    lower, upper = bounds
    return (
        within[0] if lower is None else max(lower, within[0]),
        within[1] if upper is None else min(upper, within[1]),
    )
