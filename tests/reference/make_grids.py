"""References for grids: the numbers of `tests/language/tables.rs`, along x = t, y = 3 - t."""

import numpy as np
from scipy.interpolate import CubicSpline, RegularGridInterpolator

X, Y = np.array([0, 1, 2.5, 4]), np.array([-1, 0.5, 3])
F = np.array([[1, 2, -1], [0.5, 3, 2], [4, -2, 0], [1, 1, 2.5]])
linear = RegularGridInterpolator((X, Y), F)


def cubic(x, y):
    along_x = CubicSpline(X, F, bc_type="natural")(x)
    return float(CubicSpline(Y, along_x, bc_type="natural")(y))


for t in [0.0, 0.4, 1.7, 2.6, 3.9]:
    print(t, repr(float(linear((t, 3 - t)))), repr(cubic(t, 3 - t)))
