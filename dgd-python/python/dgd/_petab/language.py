"""What the language of this build can say of noise, priors and starts: newer ones can say more."""

from __future__ import annotations

import warnings
from functools import cache

from .._errors import DgdError
from .._model.model import parse


@cache
def has_noise_formulas() -> bool:
    """Whether noise may be a formula of parameters and outputs, and log-normal."""
    return _is_said("parameter s = 1  in 0 .. 2\nlet x = s\noutput y [1] = x  noise lognormal(s + 0.1*abs(y))")


@cache
def has_prior(law: str) -> bool:
    """Whether a prior may have this law, by the language's name for it."""
    return _is_said(f"parameter s = 1  prior {law}(1, 2)\nlet x = s\noutput y [1] = x")


@cache
def has_steady_starts() -> bool:
    """Whether a model may start where it is at rest."""
    return _is_said("state x = 1\nequation e: 1 [s]*der(x) = 1 - x\nstart steady\noutput x")


def _is_said(items: str) -> bool:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            parse(f"model probe\n{items}\n")
        except DgdError:
            return False
    return True
