"""ODEBench with terms removed: 32 of its 63 systems (d'Ascoli et al., 2024), in `odebench/systems.json`.

The right-hand sides are expanded; one term is removed, or one from each of two equations. What is left is the
model, and its constants are known. The whole system is simulated from four starts: two to train, one to
validate, and one that no tool sees, which judges. All states have 200 readings with a noise of 1 % of their
spread; with half of them measured, every other state has none.
"""

import json
from pathlib import Path

import numpy as np
import sympy as sp
from problem import Problem, State, with_noise
from scipy.integrate import solve_ivp

SYSTEMS = Path(__file__).parent / "odebench" / "systems.json"
NAMES = "xyzw"
READINGS, NOISE = 200, 0.01
# Without each of the removed terms a training recording moves by so many standard deviations of the noise, and
# that of the judge by this share of the spread: otherwise nothing would be missing.
MATTERS, MATTERS_TO_JUDGE = 5.0, 0.1
# Seconds after which a system has left the range of numbers, or changes faster than 200 readings show.
SHORTER = {5: 8.0, 29: 3.0, 55: 1.5, 57: 2.0, 59: 2.0, 61: 1.5}
LENGTH = 10.0
MOST_EVALUATIONS = 20_000


def one_term(seed, number):
    return drawn(seed, number, "one", lambda system: system.single())


def two_terms(seed, number):
    return drawn(seed, number, "two", lambda system: system.pairs())


def half_measured(seed, number):
    return drawn(seed, number, "half", lambda system: system.single() if system.size > 1 else [])


def drawn(seed, number, kind, removals):
    """So many cases, one of each system in turn in random order."""
    entries = json.loads(SYSTEMS.read_text())
    random = np.random.default_rng([seed, ord(kind[0])])
    todo = []
    for entry in (entries[k] for k in random.permutation(len(entries))):
        system = System(entry, seed)
        if system.is_usable():
            possible = removals(system)
            todo.append((system, [possible[k] for k in random.permutation(len(possible))]))
    found = []
    while len(found) < number and any(removed for _, removed in todo):
        for system, removed in todo:
            while removed:
                gone = removed.pop()
                if all(system.matters((term,)) for term in gone):
                    found.append(system.problem(gone, kind))
                    break
            if len(found) == number:
                break
    return sorted(found, key=lambda problem: problem.name)


class System:
    """A system of ODEBench with its four trajectories."""

    def __init__(self, entry, seed):
        self.id, self.size, self.what = entry["id"], entry["dim"], entry["eq_description"]
        self.seed, self.random = seed, np.random.default_rng([seed, self.id])
        self.symbols = sp.symbols(list(NAMES[:self.size]), real=True)
        by_name = {f"x_{k}": symbol for k, symbol in enumerate(self.symbols)}
        self.rates = [sp.sympify(text.replace("^", "**"), locals=by_name) for text in entry["substituted"][0]]
        self.terms = [self._terms(rate) for rate in self.rates]
        self.length = SHORTER.get(self.id, LENGTH)
        starts = [np.array(start, float) for start in entry["init"]]
        self.trajectories = [self._simulated(self.rates, start) for start in self._starts(*starts)]
        if self.is_usable():
            spread = np.max([np.std(x, axis=1) for x in self.trajectories[:3]], axis=0)
            self.noise = np.maximum(NOISE * spread, 1e-9)

    def _terms(self, rate):
        expanded = sp.Add.make_args(sp.expand(rate))
        return expanded if len(expanded) > 1 else sp.Add.make_args(rate)

    def _starts(self, first, last):
        low, high = np.minimum(first, last), np.maximum(first, last)
        between = lambda: low + (high - low) * self.random.uniform(0.2, 0.8, self.size)
        return [first, between(), last, between()]

    def _simulated(self, rates, start, near=None):
        """None where it leaves the range of numbers, that of `near`, or takes too long."""
        rate = sp.lambdify(self.symbols, rates, "numpy")
        evaluations = 0

        def counted(_, x):
            nonlocal evaluations
            evaluations += 1
            if evaluations > MOST_EVALUATIONS:
                raise OverflowError
            return np.array(rate(*x), float)

        limit = 1e6 if near is None else 30 * np.abs(near).max() + 1
        far = lambda _, x: np.abs(x).max() - limit
        far.terminal = True
        time = np.linspace(0, self.length, READINGS)
        try:
            with np.errstate(all="ignore"):
                solved = solve_ivp(counted, (0, self.length), start, "LSODA", time, rtol=1e-9, atol=1e-11,
                                   events=far)
        except (OverflowError, ValueError):
            return None
        is_whole = solved.success and solved.y.shape[1] == READINGS and np.isfinite(solved.y).all()
        return solved.y if is_whole else None

    def is_usable(self):
        return all(trajectory is not None for trajectory in self.trajectories)

    def single(self):
        """All terms, but none that alone makes a constant rate, nor the only term of the only equation."""
        return [((k, term),) for k, terms in enumerate(self.terms) for term in terms
                if len(terms) > 1 or (self.size > 1 and not term.is_number)]

    def pairs(self):
        single = self.single()
        return [a + b for k, a in enumerate(single) for b in single[k + 1:] if a[0][0] != b[0][0]]

    def _left(self, gone):
        return [sp.Add(*(term for term in terms if (k, term) not in gone))
                for k, terms in enumerate(self.terms)]

    def matters(self, gone):
        left = self._left(gone)

        def misses(trajectory, scale):
            known = self._simulated(left, trajectory[:, 0], near=trajectory)
            return known is None or bool(np.any(
                np.sqrt(np.mean((known - trajectory) ** 2, axis=1)) > scale))

        train, judge = self.trajectories[:2], self.trajectories[3]
        return (any(misses(trajectory, MATTERS * self.noise) for trajectory in train)
                and misses(judge, MATTERS_TO_JUDGE * np.std(judge, axis=1)))

    def problem(self, gone, kind):
        names, left = NAMES[:self.size], self._left(gone)
        seen = names[::2] if kind == "half" else names
        noise = {name: float(f"{std:.4g}") for name, std in zip(names, self.noise) if name in seen}
        number = "".join(f"{k}{self.terms[k].index(term)}" for k, term in gone)
        time = np.linspace(0, self.length, READINGS)
        random = np.random.default_rng([self.seed, self.id, int(f"1{number}"), ord(kind[0])])
        plain = [{"time": time} | dict(zip(names, x)) for x in self.trajectories]
        recordings = {name: with_noise(recording, noise, random)
                      for name, recording in zip(("train1", "train2", "valid"), plain)}
        lines = [f"/// {self.what}, as far as it is known.", f"model ode{self.id}"]
        lines += [f"state {name} [1] = {self.trajectories[0][k, 0]:.6g}" for k, name in enumerate(names)]
        lines += [f"equation e{name}: 1 [s]*der({name}) = {in_dgd(rate)}" for name, rate in zip(names, left)]
        lines += [f"output {name} noise {std:.4g}" for name, std in noise.items()]
        return Problem(
            name=f"ode{self.id:02d}_{kind}_{number}",
            text="\n".join(lines) + "\n",
            states={name: State(f"e{name}", "1", sp.sstr(rate)) for name, rate in zip(names, left)},
            noise=noise,
            recordings=recordings | {"judge": plain[3]},
            missing={f"e{names[k]}": sp.sstr(term) for k, term in gone},
            places=[{f"e{names[k]}" for k, _ in gone}],
            targets={f"e{name}": "1" for name in names},
        )


def in_dgd(rate):
    text = sp.sstr(rate.evalf(8))
    return text.replace("**", "^").replace("Abs", "abs").replace("cot(", "1/tan(")
