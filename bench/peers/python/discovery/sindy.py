"""PySINDy on what the fitted base model leaves: weak form, ensembles, and validation.

PySINDy knows no model. It is given the discrepancy instead: of each equation whose state is measured
d = d/dt(measured) - rate(measured, inputs), of each other output d = measured - output(measured, inputs).
Rates and outputs are those of the base model, fitted to the training recording; dgd evaluates them.
"""

import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pysindy as ps

from bank import Model, Said, run, seconds_per_unit, table
from forms import EXPECTED

# Windows of the weak form, and samples on either side of a window's middle.
WINDOWS, HALF = 300, 15
# Least share of the ensemble in which a term has to be (Fasel et al., 2022).
INCLUDED = 0.6
MODELS = 20
THRESHOLDS = (0.05, 0.1, 0.2, 0.4)
MOST_TERMS = 3
# Least share of the discrepancy on the validation recording that terms have to explain to be named,
# and what each further term has to add.
WORTH, EACH = 0.1, 0.02


@dataclass
class Row:
    """An equation or a reading with its discrepancy, in the weak form."""

    name: str
    #: What may be hidden here: names that it depends on.
    places: set
    target: np.ndarray
    #: Derivatives of the rate with respect to the model's own parameters.
    own: np.ndarray
    terms: np.ndarray


def said(case):
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        recorded = Discrepancy.of(case, Path(folder))
        if recorded is None:
            return Said(text="the base model's fit failed", is_right_name=False)
        return scored(case, recorded, chosen(recorded))


def scored(case, recorded, found):
    if not found:
        return Said(text="nothing", is_right_name=case.kind == "nothing")
    names = [(recorded.train[row].name, recorded.names[term]) for row, term in found]
    says = Said(text=" + ".join(f"{term} in {row}" for row, term in names))
    # Terms are in the order of what they explain.
    first = recorded.train[found[0][0]]
    is_placed = bool(case.places() & first.places)
    expected = EXPECTED.get(f"{case.truth['domain']}.{case.hidden}", ())
    is_named = is_placed and any(
        term in expected and case.places() & recorded.train[row].places
        for (row, _), (_, term) in zip(found, names))
    says.is_right_name = is_named
    says.is_right_place = is_placed and not is_named
    says.is_wrong = not is_placed
    return says


class Discrepancy:
    """Both recordings in the weak form."""

    def __init__(self, names, train, valid):
        self.names, self.train, self.valid = names, train, valid

    @classmethod
    def of(cls, case, folder):
        model, data = case.model, {part: case.path(f"{part}.csv") for part in ("train", "valid")}
        fitted = folder / "train" / "model.dgd"
        case.run("fit", case.path("model.dgd"), "--data", data["train"], "-o", folder / "train")
        if not fitted.exists():
            return None
        # Start values of the validation recording; only states that are not measured need them.
        run(case.dgd, "fit", fitted, "--data", data["valid"], "--fix", ",".join(model.parameters),
            "-o", folder / "valid")
        fits = {"train": fitted, "valid": folder / "valid" / "model.dgd"}
        if not fits["valid"].exists():
            return None
        both, names = {}, None
        for part, fit in fits.items():
            both[part], names = rows(case, model, fitted, fit, data[part], folder, names)
        return cls(names, both["train"], both["valid"])


def rows(case, model, fitted, fit, data, folder, names):
    frame, header = table(data)
    frame = frame.interpolate(limit_direction="both")
    time, second = frame["time"].to_numpy(), seconds_per_unit(header)
    simulated = folder / "simulated.csv"
    run(case.dgd, "simulate", fit, "--data", data, "-o", simulated)
    shown, shown_header = table(simulated)
    known = {}
    for state in model.states:
        if state in model.measured():
            known[state] = frame[state].to_numpy()
            continue
        slope = next((e for e in model.equations if e.is_exact and e.rate == f"({state})"), None)
        known[state], header[state] = shown[state].to_numpy(), shown_header[state]
        if slope and slope.state in model.measured():
            # The measured state's slope is closer to the truth than a simulation.
            smoothed = ps.SmoothedFiniteDifference(smoother_kws={"window_length": 9})
            seen = frame[slope.state].to_numpy()
            rate = smoothed(seen[:, None], time)[:, 0]
            # In the unit of the simulation: its own slope tells the factor.
            other = np.gradient(shown[slope.state].to_numpy(), time)
            known[state] = rate * (other @ known[state]) / (other @ other)
    raw = {name: frame[name].to_numpy() for name in model.inputs}
    # The trapezoidal rule integrates a held input rightly if its jumps are halfway.
    halfway = lambda values: (values + np.append(values[:1], values[:-1])) / 2
    held = {name: halfway(values) if model.inputs[name] == "hold" else values
            for name, values in raw.items()}
    replay = Replay(case, model, fitted, header, time, folder)
    rates, readings = replay.of({**known, **held}), replay.of({**known, **raw})
    libraries, names = terms(known, held, time, names)
    weak = Weak(time)
    found = []
    for equation in model.equations:
        if equation.state not in model.measured():
            continue
        rate, own = rates[equation.name]
        target = weak.slope(known[equation.state]) - second * weak.mean(rate)
        places = model.reads(equation.rate) | {equation.name, f"sensor {equation.state}"}
        if equation.is_exact:
            places |= {f"sensor {name}" for name in model.reads(equation.rate)}
        found.append(Row(equation.name, places, target, weak.means(own), weak.means(libraries)))
    for output, expression in model.readings().items():
        reading, own = readings[output]
        target = weak.mean(frame[output].to_numpy() - reading)
        places = model.reads(expression) | {f"sensor {output}"}
        found.append(Row(f"reading {output}", places, target, weak.means(own), weak.means(libraries)))
    return found, names


class Replay:
    """The fitted model with its states as inputs: it shows rates and outputs at measured states."""

    def __init__(self, case, model, fitted, header, time, folder):
        self.case, self.model, self.header, self.time, self.folder = case, model, header, time, folder
        self.path = folder / "replay.dgd"
        self.fitted = fitted.read_text()
        self.path.write_text(self._text())

    def _text(self):
        fitted, lines = Model(self.fitted), []
        for line in self.fitted.splitlines():
            word = line.split(" ")[0]
            bare = line.split("///")[0]
            if word in ("input", "state"):
                name, units = bare.split()[1], bare[bare.index("["):bare.index("]") + 1]
                lines.append(f"input {name} {units} linear")
            elif word not in ("equation", "output"):
                lines.append(line)
        for equation in fitted.equations:
            # In the unit of the recording; differences of temperatures are in K.
            unit = fitted.outputs.get(equation.state, [fitted.states[equation.state]])[0]
            unit = {"°C": "K", "barg": "bar"}.get(unit, unit)
            lines.append(f"output rate_{equation.name} [({unit})/s] = {equation.rate}")
        for output, expression in fitted.readings().items():
            for equation in fitted.equations:
                expression = expression.replace(f"der({equation.state})", f"({equation.rate})")
            lines.append(f"output shown_{output} [{fitted.outputs[output][0]}] = {expression}")
        return "\n".join(lines) + "\n"

    def of(self, columns):
        """Of each equation and reading, its values and their derivatives to the parameters."""
        data = self.folder / "replay.csv"
        rows = np.column_stack([self.time, *columns.values()])
        header = ",".join(self.header[name] for name in ("time", *columns))
        np.savetxt(data, rows, delimiter=",", header=header, comments="", fmt="%.12g", encoding="utf-8")
        base = self._run(data)
        parts = {name: [] for name in base}
        for name, value in self._values().items():
            moved = self._run(data, "--set", f"{name}={value * 1.001:.12g}")
            for output, values in moved.items():
                parts[output].append((values - base[output]) / 0.001)
        return {name: (values, np.column_stack(parts[name])) for name, values in base.items()}

    def _run(self, data, *changed):
        out = self.folder / "replayed.csv"
        run(self.case.dgd, "simulate", self.path, "--data", data, "-o", out, *changed)
        frame, _ = table(out)
        shown = {name: frame[name].to_numpy() for name in frame
                 if name.startswith(("rate_", "shown_"))}
        out.unlink()
        return {name.split("_", 1)[1]: values for name, values in shown.items()}

    def _values(self):
        found = {}
        for line in self.fitted.splitlines():
            if line.startswith("parameter "):
                found[line.split()[1]] = float(line.split("=")[1].split()[0])
        return found


class Weak:
    """Columns over time in the weak form of PySINDy."""

    def __init__(self, time):
        half = min(HALF, len(time) // 8) * np.median(np.diff(time))
        np.random.seed(0)
        plain = ps.CustomLibrary(library_functions=[lambda x: x])
        self.library = ps.WeakPDELibrary(function_library=plain, spatiotemporal_grid=time,
                                         K=WINDOWS, H_xt=half, p=4)
        self.library.fit([ps.AxesArray(np.zeros((len(time), 1)), {"ax_time": 0, "ax_coord": 1})])
        self.weight = self._integral(np.ones((len(time), 1)))[:, 0]

    def _integral(self, columns):
        """PySINDy's weights of each window, on all columns at once."""
        library = self.library
        return np.array([library.fullweights0[k].ravel() @ columns[np.ravel(library.inds_k[k][0])]
                         for k in range(library.K)])

    def means(self, columns):
        return self._integral(columns) / self.weight[:, None]

    def mean(self, column):
        return self.means(column[:, None])[:, 0]

    def slope(self, column):
        return self.library.convert_u_dot_integral(column[:, None])[:, 0] / self.weight


def terms(states, inputs, time, names):
    """The library: products of degree two of states, inputs and time, and forms that engineers know."""
    variables = {**states, **inputs, "t": time}
    variables = {name: values for name, values in variables.items() if np.ptp(values) > 0}
    polynomials = ps.PolynomialLibrary(degree=2)
    columns = np.column_stack(list(variables.values()))
    values = list(np.asarray(polynomials.fit_transform(columns)).T)
    labels = [f"{label[:-2]}*{label[:-2]}" if label.endswith("^2") else label.replace(" ", "*")
              for label in polynomials.get_feature_names(list(variables))]
    for name, x in states.items():
        values.append(x**3)
        labels.append(f"{name}^3")
        if x.min() < 0 < x.max():
            values += [x * abs(x), abs(x), np.sign(x)]
            labels += [f"{name}*|{name}|", f"|{name}|", f"sign({name})"]
        else:
            values.append(np.sqrt(abs(x)))
            labels.append(f"sqrt({name})")
    for name, u in inputs.items():
        if u.min() <= 0 < u.max():
            values.append(np.sign(u))
            labels.append(f"sign({name})")
    if names is None:
        return np.column_stack(values), labels
    # The validation recording has the terms of the training recording.
    by_name = dict(zip(labels, values))
    return np.column_stack([by_name.get(name, np.zeros(len(time))) for name in names]), names


def chosen(recorded):
    """Pairs of a row and a term, by what they explain; none if nothing is worth a name.

    All rows are one regression, as they share the model's parameters. The influence of these is taken out of
    the target and of each term first: a term competes with other values of the parameters, not with those of
    the fit.
    """
    noise = [np.sqrt(np.mean(residual(row.own, row.target) ** 2)) or 1.0 for row in recorded.train]
    own, target, library = stacked(recorded.train, noise)
    size = np.linalg.norm(library, axis=0)
    left, b = residual(own, library), residual(own, target)
    norm = np.linalg.norm(left, axis=0)
    # What does no more than the parameters do.
    usable = np.flatnonzero(norm > 1e-3 * np.where(size > 0, size, np.inf))
    if not len(usable):
        return []
    unit = left[:, usable] / norm[usable]
    b = b / np.linalg.norm(b)
    best, best_worth = [], WORTH
    for terms in candidates(unit, b):
        kept = usable[terms]
        if not 0 < len(kept) <= MOST_TERMS:
            continue
        worth = explained(recorded, noise, kept) - EACH * (len(kept) - 1)
        if worth > best_worth:
            best, best_worth = kept, worth
    alone = {term: explained(recorded, noise, [term]) for term in best}
    count = recorded.train[0].terms.shape[1]
    return [divmod(term, count) for term in sorted(best, key=alone.get, reverse=True)]


def candidates(unit, b):
    """Terms that are in most models of an ensemble: thresholds of STLSQ, and FROLS of one to three terms."""
    np.random.seed(0)
    methods = [ps.STLSQ(threshold=threshold, alpha=1e-3) for threshold in THRESHOLDS]
    methods += [ps.FROLS(max_iter=number, alpha=1e-3) for number in range(1, MOST_TERMS + 1)]
    for method in methods:
        ensemble = ps.EnsembleOptimizer(method, bagging=True, n_models=MODELS)
        try:
            ensemble.fit(unit, b[:, None])
        except (ValueError, np.linalg.LinAlgError):
            continue
        included = np.mean([np.abs(model[0]) > 1e-12 for model in ensemble.coef_list], axis=0)
        yield np.flatnonzero(included >= INCLUDED)


def stacked(all_rows, noise):
    """One regression: the parameters' columns are shared, and each row has terms of its own."""
    count, number = all_rows[0].terms.shape
    own = np.concatenate([row.own / size for row, size in zip(all_rows, noise)])
    target = np.concatenate([row.target / size for row, size in zip(all_rows, noise)])
    library = np.zeros((count * len(all_rows), number * len(all_rows)))
    for k, (row, size) in enumerate(zip(all_rows, noise)):
        library[k * count:(k + 1) * count, k * number:(k + 1) * number] = row.terms / size
    return own, target, library


def explained(recorded, noise, kept):
    """Share of the discrepancy on the validation recording that goes with these terms."""
    def left(kept):
        own, target, library = stacked(recorded.train, noise)
        columns = np.column_stack([own, library[:, kept]])
        size = np.linalg.norm(columns, axis=0) + 1e-300
        coefficients = np.linalg.lstsq(columns / size, target, rcond=1e-10)[0] / size
        own, target, library = stacked(recorded.valid, noise)
        return np.sum((target - np.column_stack([own, library[:, kept]]) @ coefficients) ** 2)
    return 1 - left(kept) / left([])


def residual(own, target):
    size = np.linalg.norm(own, axis=0)
    basis, singular, _ = np.linalg.svd(own / np.where(size > 0, size, 1.0), full_matrices=False)
    basis = basis[:, singular > 1e-10 * singular[0]]
    return target - basis @ (basis.T @ target)
