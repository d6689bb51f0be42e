"""Refit the model with each candidate term in each equation in turn, and add the one with the least BIC.

Another term is added as long as the criterion falls by what is called very strong evidence, up to two terms. In
place of a library the candidates are PySINDy's: products up to degree three, sines and cosines, and
`x/(b + |x|)`. A free parameter that may be a law is a place, too.
"""

import math
import tempfile
from itertools import combinations_with_replacement
from pathlib import Path

from refit_all import STRONG, of
from terms.score import Answer, error_of_model, scored

MOST_TERMS, DEGREE = 2, 3
# Seconds of a processor for a fit; nearly all need a tenth of one.
MOST_SECONDS = 1
# Points from which the named terms are fitted once more.
STARTS = 5


def said(case):
    with tempfile.TemporaryDirectory() as folder:
        return scored(case, Refits(case, Path(folder)).answer())


class Refits:
    def __init__(self, case, folder):
        self.case, self.folder = case, folder
        self.model = folder / case.model.name
        columns = "".join(f"input {name} [{case.truth['units'][name]}] {how}\n"
                          for name, how in case.truth["columns"].items())
        self.model.write_text(case.model.read_text() + columns)
        self.candidates = [(place, term) for place in case.truth["targets"] for term in terms(case)]

    def answer(self):
        kept, best = [], self.criterion([])
        while len(kept) < MOST_TERMS:
            # Those that are kept stay in the model.
            values = {one: self.criterion([*kept, one]) for one in self.candidates if one not in kept}
            one = min(values, key=values.get)
            if not values[one] < best - STRONG:
                break
            kept, best = [*kept, one], values[one]
        if not kept:
            return Answer()
        fitted = self.folder / "fitted"
        self.fit(kept, "--starts", STARTS, "-o", fitted, limit=20 * MOST_SECONDS)
        text = " and ".join(f"{place}: {term}" for place, term in kept)
        return Answer(text, [place for place, _ in kept], True,
                      error_of_model(self.case, fitted / self.case.model.name))

    def criterion(self, kept):
        fit = self.fit(kept)
        return of(fit) if fit and "outputs" in fit else math.inf

    def fit(self, kept, *more, limit=MOST_SECONDS):
        applied = [part for number, one in enumerate(kept)
                   for part in ("--apply", self.effect(number, *one))]
        return self.case.run("fit", self.model, *self.case.data(), *applied, *more, limit=limit)

    def effect(self, number, place, term):
        unit, name = self.case.truth["targets"][place], self.case.model.read_text().split("model ")[1].split()[0]
        lines = [f"effect term_{number} on {name}", "kind plant", f"parameter c_{number} [{unit}] = 0"]
        if "b_" in term:
            lines.append(f"parameter b_{number} [1] = 1 in 1e-6 ..")
        text = f"c_{number}*{term.replace('b_', f'b_{number}')}"
        is_parameter = place not in {state["equation"] for state in self.case.states.values()}
        lines.append(f"replace {place} by {place} + {text}" if is_parameter else f"add {text} to {place}")
        path = self.folder / f"term_{number}.dgd"
        path.write_text("\n".join(lines) + "\n")
        return path


def terms(case):
    """Candidates in the language; names are numbers in their recorded units."""
    states = [plain(name, state["unit"]) for name, state in case.states.items()]
    given = [plain(name, case.truth["units"][name]) for name in case.given]
    products = ["*".join(factors) for degree in range(1, DEGREE + 1)
                for factors in combinations_with_replacement(states + given, degree)]
    others = [form.format(x=x) for x in states for form in ("sin({x})", "cos({x})", "{x}/(b_ + abs({x}))")]
    return ["1", *products, *others]


def plain(name, unit):
    return f"({name}/1 [K] - 273.15)" if unit == "degC" else f"({name}/1 [{unit}])"
