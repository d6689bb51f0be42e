"""Searches from the same random starts: dgd's, SciPy's TRF and fides, all on dgd's residuals and Jacobians.

Of each model in `models/` several sets of data are simulated with its own values, its noise and stated seeds. So many starts
for each are drawn evenly in the logarithms between the bounds. A search has succeeded where half its sum of squares is within 0.1 of the least that any
search, from any start or from the truth, has found. Counted are points at which residuals were asked for.

    python compare.py [--starts 50] [--sets 6] [--models pinene,stat5] [--write ../../../../docs/measured.md]
"""

from __future__ import annotations

import argparse
import logging
import statistics
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from math import comb
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

import dgd

MODELS = Path(__file__).resolve().parent / "models"

# When what is measured.
TIMES = {
    "pinene": [1230.0, 3060.0, 4920.0, 7800.0, 10680.0, 15030.0, 22620.0, 36420.0],
    "fitzhugh_nagumo": [0.2 * k for k in range(1, 101)],
    "goodwin": [4.0 * k for k in range(1, 61)],
    "predators": [0.5 * k for k in range(1, 11)],
    "stat5": [0.0, 2.5, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 60.0, 80.0, 100.0, 120.0, 160.0, 200.0, 240.0],
    "t_cells": [float(k) for k in range(1, 31)],
    "repressilator": [10.0 * k for k in range(1, 59)],
}

# The same in all searches.
RTOL = 1e-8

# Chance alone makes a difference as large less often.
SIGNIFICANT = 0.05

# Beyond that of the best, and still a success.
CLOSE = 0.1


@dataclass
class Search:
    """What one optimiser made of all starts of a problem."""

    successes: list[bool] = field(default_factory=list)
    evaluations: list[int] = field(default_factory=list)

    def median_of_successes(self) -> float:
        """Median evaluations of the searches that succeeded."""
        counts = [n for n, ok in zip(self.evaluations, self.successes) if ok]
        return statistics.median(counts) if counts else float("nan")


class Problem:
    """Half a sum of squares in logarithms."""

    def __init__(self, name: str, seed: int) -> None:
        self.name = name
        self.model = dgd.load(str(MODELS / f"{name}.dgd"))
        times = TIMES[name]
        begin = times if times[0] == 0.0 else [0.0, *times]
        run = self.model.simulate({"time [s]": begin}, noise_seed=seed, rtol=1e-10)
        table = run.to_dict()
        outputs = [o for o in self.model.outputs]
        self.data = {"time [s]": begin}
        for output in outputs:
            values = np.array(column(table, output), float)
            if times[0] != 0.0:
                values[0] = np.nan
            self.data[f"{output} [{self.model.outputs[output].unit}]"] = values.tolist()
        self.objective = self.model.objective([self.data], rtol=RTOL)
        lower, upper = self.objective.bounds
        self.bounds = (np.log(lower), np.log(upper))
        self.points: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def count(self) -> None:
        self.evaluated = 0

    def residuals(self, z: np.ndarray) -> np.ndarray:
        """Not a number where the model cannot be simulated: SciPy then takes a quarter of the step."""
        self.evaluated += 1
        try:
            return self.objective.residuals(np.exp(z))
        except dgd.DgdError:
            return np.full(len(self.size), np.nan)

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        x = np.exp(z)
        return self.objective.jacobian(x) * x

    def cost(self, z: np.ndarray) -> float:
        try:
            return self.objective(np.exp(z))
        except dgd.DgdError:
            return np.inf

    @property
    def size(self) -> np.ndarray:
        return self.objective.residuals(self.objective.x0)


def column(table: dict, output: str) -> object:
    for name, values in table.items():
        if name == output or name.startswith(f"{output} ["):
            return values
    raise KeyError(output)


Optimiser = Callable[[Problem, np.ndarray], tuple[float, int]]


def by_dgd(problem: Problem, z: np.ndarray) -> tuple[float, int]:
    names = problem.objective.names
    params = dict(zip(names, np.exp(z).tolist()))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = problem.model.fit([problem.data], params=params, noise="declared", rtol=RTOL, progress=False)
    except dgd.DgdError:
        return np.inf, 1
    end = np.log([found.params[name] for name in names])
    return problem.cost(end), found.result["evaluations"]


def by_trf(problem: Problem, z: np.ndarray) -> tuple[float, int]:
    problem.count()
    try:
        found = least_squares(problem.residuals, z, problem.jacobian, problem.bounds, "trf")
    except (ValueError, dgd.DgdError):
        return np.inf, problem.evaluated
    return problem.cost(found.x), problem.evaluated


def by_fides(problem: Problem, z: np.ndarray) -> tuple[float, int]:
    import fides

    problem.count()

    def at(z: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        problem.evaluated += 1
        x = np.exp(z)
        try:
            r, j = problem.objective.residuals(x), problem.objective.jacobian(x) * x
        except dgd.DgdError:
            return np.nan, np.full(len(z), np.nan), np.full((len(z), len(z)), np.nan)
        return 0.5 * float(r @ r), j.T @ r, j.T @ j

    lower, upper = problem.bounds
    search = fides.Optimizer(at, upper, lower, verbose=logging.ERROR, options={fides.Options.MAXITER: 1000})
    try:
        cost, end, _, _ = search.minimize(z)
    except (ValueError, RuntimeError, np.linalg.LinAlgError):
        return np.inf, problem.evaluated
    return problem.cost(np.asarray(end)), problem.evaluated


def mcnemar(ours: list[bool], theirs: list[bool]) -> tuple[int, int, float]:
    """Starts from which only we, and only they, succeed, and the exact two-sided probability of that."""
    only_ours = sum(a and not b for a, b in zip(ours, theirs))
    only_theirs = sum(b and not a for a, b in zip(ours, theirs))
    n, least = only_ours + only_theirs, min(only_ours, only_theirs)
    if n == 0:
        return 0, 0, 1.0
    tail = sum(comb(n, k) for k in range(least + 1)) / 2**n
    return only_ours, only_theirs, min(1.0, 2 * tail)


def search_from_starts(name: str, seed: int, count: int, optimisers: dict[str, Optimiser], searches: dict[str, Search]) -> None:
    """Adds what all optimisers make of the same starts of one set of data."""
    problem = Problem(name, seed)
    lower, upper = problem.bounds
    random = np.random.default_rng([seed, len(name), sum(map(ord, name))])
    starts = lower + (upper - lower) * random.random((count, len(lower)))
    truth = np.log(problem.objective.x0)
    best = problem.cost(truth)
    costs: dict[str, list[float]] = {}
    for who, optimiser in optimisers.items():
        best = min(best, optimiser(problem, truth)[0])
        ends = [optimiser(problem, start) for start in starts]
        searches[who].evaluations += [evaluations for _, evaluations in ends]
        costs[who] = [cost for cost, _ in ends]
        best = min(best, *costs[who])
    for who, found in searches.items():
        found.successes += [cost <= best + CLOSE for cost in costs[who]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--starts", type=int, default=50)
    parser.add_argument("--sets", type=int, default=6)
    parser.add_argument("--models", default=",".join(TIMES))
    parser.add_argument("--write", type=Path)
    parser.add_argument("--check", action="store_true", help="fail where dgd is worse")
    arguments = parser.parse_args()
    optimisers: dict[str, Optimiser] = {"dgd": by_dgd, "TRF": by_trf}
    try:
        import fides  # noqa: F401

        optimisers["fides"] = by_fides
    except ImportError:
        print("fides is not installed, and is left out", file=sys.stderr)
    rows, pooled, worse = [], {name: 0 for name in optimisers}, []
    counts: dict[str, list[int]] = {name: [] for name in optimisers}
    for name in arguments.models.split(","):
        searches = {who: Search() for who in optimisers}
        for seed in range(1, arguments.sets + 1):
            search_from_starts(name, seed, arguments.starts, optimisers, searches)
        row = [name]
        for who, found in searches.items():
            pooled[who] += sum(found.successes)
            counts[who] += found.evaluations
            row += [str(sum(found.successes)), f"{found.median_of_successes():.0f}", f"{statistics.median(found.evaluations):.0f}"]
            if who != "dgd":
                only_ours, only_theirs, p = mcnemar(searches["dgd"].successes, found.successes)
                row.append(f"{only_ours} : {only_theirs} ({p:.2g})")
                if p < SIGNIFICANT and only_theirs > only_ours:
                    worse.append(f"{name}: significantly fewer successes than {who}")
        rows.append(row)
        print(" | ".join(row), flush=True)
    head = ["problem"]
    for who in optimisers:
        head += [f"{who}: successes", "evaluations of these", "of all"]
        if who != "dgd":
            head.append(f"only dgd : only {who} (McNemar's p)")
    lines = ["| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows]]
    n = arguments.starts * arguments.sets * len(rows)
    totals = ", ".join(f"{who} {hits}" for who, hits in pooled.items())
    medians = ", ".join(f"{who} {statistics.median(of_all):.0f}" for who, of_all in counts.items())
    text = "\n".join([*lines, "", f"Of {n} starts succeeded: {totals}. Median evaluations of all: {medians}.", ""])
    print(text)
    worse += [f"fewer successes than {who} over all" for who, hits in pooled.items() if hits > pooled["dgd"]]
    if arguments.write:
        page = arguments.write.read_text()
        begin, end = "<!-- starts -->\n", "<!-- end of starts -->"
        before, rest = page.split(begin)
        arguments.write.write_text(before + begin + text + end + rest.split(end)[1])


    if arguments.check and worse:
        sys.exit("; ".join(worse))


if __name__ == "__main__":
    main()
