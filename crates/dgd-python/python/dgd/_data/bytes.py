"""Arrays as the native module takes and gives them: eight bytes a number."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def array(numbers: bytearray) -> Array:
    """Numbers of the native module, which the array owns from now on."""
    return np.frombuffer(numbers, dtype=np.float64)


def packed(values: Any) -> bytes:
    """Numbers for the native module: one, a list or an array."""
    return np.ascontiguousarray(values, dtype=np.float64).tobytes()
