"""What a prior of PEtab says, as far as the language can say it."""

from __future__ import annotations

from collections.abc import Sequence

from ..refusal import Refusals

Normal = tuple[float, float]
Bounds = tuple["float | None", "float | None"]


def prior(
    parameter: str, kind: str, numbers: Sequence[float], scale: str, bounds: Bounds, refusals: Refusals
) -> tuple[Normal | None, Bounds]:
    """Mean and standard deviation of a normal prior, and the bounds.

    ``scale`` is that of the parameter: a prior called ``parameterScale…`` is one of its logarithm where it is not
    ``"lin"``. A uniform prior is constant within its bounds, which are taken over.
    """
    is_scaled = kind.startswith("parameterScale")
    bare = kind.removeprefix("parameterScale")
    bare = bare[:1].lower() + bare[1:]
    if bare == "normal" and len(numbers) == 2 and not (is_scaled and scale != "lin"):
        return (numbers[0], numbers[1]), bounds
    if bare in ("uniform", "log-uniform"):
        base = {"log": 2.718281828459045, "log10": 10.0}.get(scale) if is_scaled else None
        within = [base**one for one in numbers] if base else list(numbers)
        return None, _narrower(bounds, within)
    where = f" on the scale `{scale}`" if is_scaled and scale != "lin" else ""
    refusals.add(f"prior `{kind}`{where} of parameter `{parameter}`")
    return None, bounds


def _narrower(bounds: Bounds, within: Sequence[float]) -> Bounds:
    """The narrower of two pairs of bounds."""
    if len(within) != 2:
        return bounds
    lower, upper = bounds
    return (
        within[0] if lower is None else max(lower, within[0]),
        within[1] if upper is None else min(upper, within[1]),
    )
