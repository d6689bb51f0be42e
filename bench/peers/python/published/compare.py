"""Converged searches per minute on published problems: dgd's, and fides in pyPESTO with AMICI, from the same starts.

Both read the same PEtab problem. Starts are uniform between its bounds, on its scales. Both run on one thread with a relative
tolerance of 1e-8, which is AMICI's default here, and all else as each has it by default; building the models is not counted. All ends
are judged by AMICI's likelihood: a search has converged where it is within 0.1 of the best that either has found.

    python compare.py COLLECTION [--starts 50] [--problems Boehm_JProteomeRes2014,…] [--models FOLDER] [--check RATIO]
"""

from __future__ import annotations

import argparse
import logging
import sys
import time
import warnings
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pypesto.history import HistoryOptions
from pypesto.optimize import FidesOptimizer, OptimizeOptions
from pypesto.petab import PetabImporter

import dgd

# Neither pre-equilibration for part of the experiments only, nor priors that one of the two does not know.
PROBLEMS = "Boehm_JProteomeRes2014,Bruno_JExpBot2016,Elowitz_Nature2000,Sneyd_PNAS2002"

RTOL = 1e-8

# Beyond that of the best, and still converged.
CLOSE = 0.1


@dataclass
class Searches:
    """What one program made of all starts."""

    costs: list[float] = field(default_factory=list)
    seconds: float = 0.0

    def converged(self, best: float) -> int:
        return sum(cost <= best + CLOSE for cost in self.costs)


class Problem:
    """One problem, as both read it."""

    def __init__(self, path: Path, models: Path) -> None:
        importer = PetabImporter.from_yaml(str(path))
        importer.output_folder = str(models / path.stem)
        self.theirs = importer.create_problem()
        # What a fit does not move: a failed simulation costs as much as fides then makes of it.
        self.scales = dict(zip(self.theirs.x_names, self.theirs.x_scales))
        self.names = [self.theirs.x_names[k] for k in self.theirs.x_free_indices]
        self.ours = dgd.from_petab(str(path))
        unknown = set(self.names) - set(self.ours.model.parameters)
        if unknown:
            raise SystemExit(f"{path.stem}: dgd calls {sorted(unknown)} otherwise")

    def linear(self, x: np.ndarray) -> dict[str, float]:
        """Values by name."""
        back = {"log10": lambda v: 10.0**v, "log": np.exp, "lin": lambda v: v}
        return {name: float(back[self.scales[name]](v)) for name, v in zip(self.names, x)}

    def scaled(self, values: dict[str, float]) -> np.ndarray:
        there = {"log10": np.log10, "log": np.log, "lin": lambda v: v}
        return np.array([there[self.scales[name]](values[name]) for name in self.names])

    def by_dgd(self, x: np.ndarray) -> np.ndarray | None:
        """Where it ends."""
        try:
            found = self.ours.fit(params=self.linear(x), rtol=RTOL, threads=1, progress=False)
        except dgd.DgdError:
            return None
        return self.scaled(dict(found.params))

    def by_amici(self, x: np.ndarray) -> np.ndarray | None:
        search = FidesOptimizer(verbose=logging.ERROR)
        options = {"history_options": HistoryOptions(), "optimize_options": OptimizeOptions()}
        found = search.minimize(problem=self.theirs, x0=x, id="0", **options)
        return None if found.x is None else np.asarray(found.x)[self.theirs.x_free_indices]

    def cost(self, x: np.ndarray | None) -> float:
        """−log L, by AMICI."""
        if x is None:
            return np.inf
        value = float(self.theirs.objective(np.clip(x, self.theirs.lb, self.theirs.ub)))
        return value if np.isfinite(value) else np.inf


def searched(problem: Problem, starts: np.ndarray) -> dict[str, Searches]:
    """Turn by turn, so that whatever else the machine does meets both."""
    both = {"dgd": problem.by_dgd, "AMICI": problem.by_amici}
    found = {who: Searches() for who in both}
    for start in starts:
        for who, search in both.items():
            begin = time.perf_counter()
            end = search(start)
            found[who].seconds += time.perf_counter() - begin
            found[who].costs.append(problem.cost(end))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("collection", type=Path)
    parser.add_argument("--starts", type=int, default=50)
    parser.add_argument("--problems", default=PROBLEMS)
    parser.add_argument("--models", type=Path, default=Path("amici-models"), help="where AMICI's compiled models are kept")
    parser.add_argument("--check", type=float, help="fail where dgd has less than so many times AMICI's rate")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    print("| problem | parameters | least −log L | dgd: converged | seconds | per minute | AMICI: converged | seconds | per minute | ratio |")
    print("|---" * 10 + "|", flush=True)
    below = []
    for name in arguments.problems.split(","):
        problem = Problem(arguments.collection / name / f"{name}.yaml", arguments.models)
        lower, upper = problem.theirs.lb, problem.theirs.ub
        random = np.random.default_rng([arguments.starts, sum(map(ord, name))])
        starts = lower + (upper - lower) * random.random((arguments.starts, len(lower)))
        found = searched(problem, starts)
        best = min(min(one.costs) for one in found.values())
        row, rates = [name, str(len(lower)), f"{best:.3f}"], []
        for one in found.values():
            rates.append(60.0 * one.converged(best) / one.seconds)
            row += [str(one.converged(best)), f"{one.seconds:.1f}", f"{rates[-1]:.1f}"]
        ratio = rates[0] / rates[1] if rates[1] else np.inf
        print("| " + " | ".join([*row, f"{ratio:.1f}"]) + " |", flush=True)
        if arguments.check is not None and not ratio >= arguments.check:
            below.append(name)
    if below:
        sys.exit(f"less than {arguments.check} times AMICI's rate: {', '.join(below)}")


if __name__ == "__main__":
    main()
