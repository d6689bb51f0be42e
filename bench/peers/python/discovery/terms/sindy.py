"""PySINDy with the known part given: a sparse regression of what the slopes of the states have beyond it.

d = der(measured) - rate(measured, inputs), of each equation, with `SmoothedFiniteDifference` of several windows
and with plain differences. Windows, libraries, thresholds and numbers of terms are chosen on the validation
recording: terms by what they leave of d, and the rest by the simulation of the corrected model.
"""

import warnings
from dataclasses import dataclass

import numpy as np
import pysindy as ps
from bank import table
from terms.score import Answer, error, scored
from terms.simulate import numbers, simulated

WINDOWS = (None, 5, 9, 15, 25)
THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.4)
MOST_TERMS = 4
# A formula is claimed if its simulation of the validation recording is off by less than this share of the spread.
CLAIMED = 0.1


def said(case):
    # It needs the slope of each state.
    if not case.is_measured:
        return scored(case, Answer("does not apply: not all states are measured"))
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        return scored(case, answered(case))


def answered(case):
    found = [regression for window in WINDOWS for library in libraries()
             if (regression := Regression.of(case, window, library))]
    # The shorter of two that predict alike.
    found.sort(key=lambda one: one.left * (1 + 0.02 * one.number()))
    if not found or not found[0].number():
        return Answer()
    best = found[0]
    added = {state: best.formula(state) for state in best.terms if best.terms[state]}
    equations = [case.states[state]["equation"] for state in sorted(added, key=best.explained.get, reverse=True)]
    text = " and ".join(f"{case.states[state]['equation']}: {formula}" for state, formula in added.items())
    start = {state: case.judged[state][0] for state in case.states}
    judged = error(case, simulated(case, added, case.judged, start))
    return Answer(text, equations, best.left < CLAIMED, judged)


def libraries():
    yield ps.PolynomialLibrary(degree=2)
    yield ps.PolynomialLibrary(degree=3)
    yield ps.PolynomialLibrary(degree=2) + ps.FourierLibrary(n_frequencies=1)


@dataclass
class Regression:
    """Terms of each state's rate with their coefficients."""

    names: list
    terms: dict
    #: Of d on the validation recording, the share that goes with the terms.
    explained: dict
    #: The largest error of the simulated validation recording over a state's spread.
    left: float = np.inf

    @classmethod
    def of(cls, case, window, library):
        train = [Discrepancy.of(case, path, window) for path in case.train]
        valid = Discrepancy.of(case, case.valid, window)
        if None in train or valid is None:
            return None
        library.fit([ps.AxesArray(train[0].columns, {"ax_time": 0, "ax_coord": 1})])
        names = library.get_feature_names(list(train[0].names))
        values = lambda one: np.asarray(library.transform(ps.AxesArray(one.columns, {"ax_time": 0, "ax_coord": 1})))
        fitted, tested = np.vstack([values(one) for one in train]), values(valid)
        # A name that a library has twice, and what did not vary.
        usable = [k for k, name in enumerate(names) if name not in names[:k]
                  and np.isfinite(fitted[:, k]).all() and np.isfinite(tested[:, k]).all()
                  and np.any(fitted[:, k] != 0)]
        found, explained = {}, {}
        for state in case.states:
            d = np.concatenate([one.d[state] for one in train])
            kept, share = chosen(fitted[:, usable], d, tested[:, usable], valid.d[state], window or 2)
            found[state] = [(usable[k], value) for k, value in kept]
            explained[state] = share
        regression = cls([python(name) for name in names], found, explained)
        regression.left = regression._left(case, valid)
        return regression

    def _left(self, case, valid):
        start = {state: valid.states[state][0] for state in case.states}
        shown = simulated(case, {state: self.formula(state) for state in case.states}, valid.frame, start)
        if shown is None or not all(np.isfinite(shown[state]).all() for state in case.states):
            return np.inf
        return max(np.sqrt(np.mean((shown[state] - valid.frame[state]) ** 2)) / (np.std(valid.frame[state]) + 1e-9)
                   for state in case.states)

    def number(self):
        return sum(map(len, self.terms.values()))

    def formula(self, state):
        return " + ".join(f"{value:.6g}*{self.names[k]}" for k, value in self.terms[state]) or "0"


@dataclass
class Discrepancy:
    """A recording with what its slopes have beyond the known rates."""

    frame: object
    names: list
    columns: np.ndarray
    states: dict
    d: dict

    @classmethod
    def of(cls, case, path, window):
        frame, _ = table(path)
        frame = frame.interpolate(limit_direction="both")
        time = frame["time"].to_numpy()
        if window and window > len(time) // 3:
            return None
        slopes = (ps.SmoothedFiniteDifference(smoother_kws={"window_length": window}) if window
                  else ps.FiniteDifference(order=4))
        states, rates = {}, {}
        for state in case.states:
            rates[state] = slopes(frame[state].to_numpy()[:, None], time)[:, 0]
            # What the slope was taken of.
            states[state] = np.asarray(slopes.smoother(frame[state].to_numpy()[:, None], window_length=window,
                                                       polyorder=3, axis=0))[:, 0] if window \
                else frame[state].to_numpy()
        given = {name: frame[name].to_numpy() for name in case.given}
        known = {**states, **given}
        d = {state: rates[state] - numbers(case.states[state]["rate"], known, len(time)) for state in case.states}
        if not all(np.isfinite(values).all() for values in d.values()):
            return None
        return cls(frame, list(known), np.column_stack(list(known.values())), states, d)


def chosen(fitted, d, tested, d_tested, window):
    """Of the answers of STLSQ and FROLS, the one with the least criterion on the validation recording."""
    size = np.sqrt(np.mean(fitted**2, axis=0))
    scale = np.sqrt(np.mean(d**2))
    if not scale > 0:
        return [], 0.0
    unit, b = fitted / size, d / scale
    # Slopes of overlapping windows are not independent.
    count = len(d_tested) / window
    best, least = np.array([], int), count * np.log(np.mean(d_tested**2))
    coefficients = np.array([])
    for kept in supports(unit, b):
        values = np.linalg.lstsq(unit[:, kept], b, rcond=1e-10)[0] * scale / size[kept]
        left = np.mean((d_tested - tested[:, kept] @ values) ** 2)
        criterion = count * np.log(left) + len(kept) * np.log(count)
        if criterion < least:
            best, least, coefficients = kept, criterion, values
    share = 1 - np.mean((d_tested - tested[:, best] @ coefficients) ** 2) / np.mean(d_tested**2)
    return list(zip(best.tolist(), coefficients.tolist())), float(share)


def supports(unit, b):
    seen = set()
    methods = [ps.STLSQ(threshold=threshold, alpha=1e-6) for threshold in THRESHOLDS]
    methods += [ps.FROLS(max_iter=number, alpha=1e-6) for number in range(1, MOST_TERMS + 1)]
    for method in methods:
        try:
            method.fit(unit, b[:, None])
        except (ValueError, np.linalg.LinAlgError):
            continue
        kept = np.flatnonzero(np.abs(method.coef_[0]) > 1e-12)
        if 0 < len(kept) <= 2 * MOST_TERMS and tuple(kept) not in seen:
            seen.add(tuple(kept))
            yield kept


def python(name):
    """`x^2 y` and `sin(1 x)` as an expression."""
    return name.replace("(1 ", "(").replace("^", "**").replace(" ", "*")
