"""Simulation of the known rates with formulas added, for tools that do not simulate."""

import numpy as np
from scipy.integrate import solve_ivp

FUNCTIONS = {name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "sign", "tanh")}
FUNCTIONS |= {"abs": np.abs, "Abs": np.abs, "cot": lambda x: 1 / np.tan(x), "max": np.maximum}
MOST_EVALUATIONS, SUBSTEPS = 20_000, 2


def compiled(expression):
    return compile(expression, "<formula>", "eval")


def numbers(expression, values, length):
    """An expression of columns, as a column."""
    code = expression if not isinstance(expression, str) else compiled(expression)
    return np.broadcast_to(np.asarray(eval(code, FUNCTIONS | {"__builtins__": {}}, values), float), (length,))


def simulated(case, added, frame, start):
    """Columns of the states at the frame's times from this start; None where it leaves the range of numbers."""
    names = list(case.states)
    codes = [compiled(f"({case.states[name]['rate']}) + ({added.get(name) or 0})") for name in names]
    scope = FUNCTIONS | {"__builtins__": {}}
    rate = lambda x, given: np.array([eval(code, scope, {**dict(zip(names, x)), **given}) for code in codes], float)
    first, time = np.array([start[name] for name in names], float), frame["time"].to_numpy()
    with np.errstate(all="ignore"):
        try:
            values = of_inputs(case, rate, frame, first) if case.given else alone(rate, time, first)
        except (ArithmeticError, ValueError):
            return None
    return None if values is None else dict(zip(names, values))


def alone(rate, time, first):
    evaluations = 0

    def counted(_, x):
        nonlocal evaluations
        evaluations += 1
        if evaluations > MOST_EVALUATIONS:
            raise OverflowError
        return rate(x, {})

    far = lambda _, x: np.abs(x).max() - 1e8
    far.terminal = True
    solved = solve_ivp(counted, (time[0], time[-1]), first, "LSODA", time, rtol=1e-7, atol=1e-9, events=far)
    return solved.y if solved.y.shape[1] == len(time) else None


def of_inputs(case, rate, frame, x):
    """By Runge–Kutta steps between the readings, which are close together; inputs are held or linear."""
    time = frame["time"].to_numpy()
    columns = {name: (frame[name].to_numpy(), how) for name, how in case.given.items()}
    shown = [x]
    for k in range(len(time) - 1):
        step = (time[k + 1] - time[k]) / SUBSTEPS
        for part in range(SUBSTEPS):
            at = lambda share: {name: values[k] if how == "hold"
                                else values[k] + share * (values[k + 1] - values[k])
                                for name, (values, how) in columns.items()}
            begin, middle, end = (at((part + c) / SUBSTEPS) for c in (0, 0.5, 1))
            k1 = rate(x, begin)
            k2 = rate(x + step / 2 * k1, middle)
            k3 = rate(x + step / 2 * k2, middle)
            k4 = rate(x + step * k3, end)
            x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        if not np.isfinite(x).all():
            return None
        shown.append(x)
    return np.array(shown).T
