"""The score of an answer by its simulation, and the simulation of formulas.

    python -m pytest -q bench/peers/python/discovery
"""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp
from terms.own import targets
from terms.score import LIMIT, Answer, error, scored
from terms.simulate import simulated

STATES = {"x": {"equation": "rabbits", "rate": "1.3*x", "unit": "1"},
          "y": {"equation": "wolves", "rate": "-1.8*y", "unit": "1"}}


@pytest.fixture(name="case")
def animals():
    """Lotka–Volterra without both interactions."""
    time = np.linspace(0, 5, 101)
    rate = lambda _, x: [1.3 * x[0] - 0.9 * x[0] * x[1], -1.8 * x[1] + 0.8 * x[0] * x[1]]
    x, y = solve_ivp(rate, (0, 5), [3.1, 4.4], t_eval=time, rtol=1e-10, atol=1e-12).y
    judged = pd.DataFrame({"time": time, "x": x, "y": y})
    return SimpleNamespace(states=STATES, given={}, places=[{"rabbits", "wolves"}], judged=judged)


def said(case, formulas, is_claimed=True):
    """What a tool says that adds these formulas, by equations."""
    by_state = {name: formulas.get(state["equation"]) for name, state in STATES.items()}
    off = error(case, simulated(case, by_state, case.judged, {"x": 3.1, "y": 4.4}))
    return scored(case, Answer("formulas", list(formulas), is_claimed, off))


def marks(says):
    return says.is_right_name, says.is_right_place, says.is_wrong


@pytest.mark.parametrize("rabbits, wolves", [
    ("-0.9*x*y", "0.8*x*y"),
    ("-x*y + x*y/10", "x*y/(1 + 1/4)"),
    ("-exp(log(0.9) + log(x) + log(y))", "0.2*((x + y)**2 - (x - y)**2)"),
    ("-0.9001*x*y + 1e-4*x**2", "0.7999*x*y"),
])
def test_any_algebraic_form_of_the_missing_terms_is_right(case, rabbits, wolves):
    assert marks(said(case, {"rabbits": rabbits, "wolves": wolves})) == (True, False, False)


@pytest.mark.parametrize("rabbits, wolves", [
    ("0.9*x*y", "0.8*x*y"),
    ("-0.9*x*y", "-0.8*x*y"),
    ("-0.7*x*y", "0.8*x*y"),
    ("-0.9*x*y**2", "0.8*x*y"),
    ("-0.9*x", "0.8*y"),
])
def test_a_wrong_sign_coefficient_or_form_is_wrong(case, rabbits, wolves):
    assert marks(said(case, {"rabbits": rabbits, "wolves": wolves})) == (False, False, True)


def test_half_of_what_is_missing_is_wrong(case):
    assert marks(said(case, {"wolves": "0.8*x*y"})) == (False, False, True)


def test_what_predicts_but_stands_elsewhere_is_wrong(case):
    right = said(case, {"rabbits": "-0.9*x*y", "wolves": "0.8*x*y"})
    elsewhere = scored(case, Answer("formulas", ["rabbits"], True, 0.1 * LIMIT))
    assert right.is_right_name
    assert marks(elsewhere) == (False, False, True)


def test_without_a_claim_the_first_place_counts(case):
    assert marks(scored(case, Answer("", ["wolves"]))) == (False, True, False)
    assert marks(scored(case, Answer("", ["sensor x", "wolves"]))) == (False, False, False)
    assert marks(scored(case, Answer())) == (False, False, False)


def test_a_simulation_that_does_not_end_is_off_without_limit(case):
    assert error(case, None) == np.inf
    ran_away = {"x": np.full(101, np.inf), "y": case.judged["y"]}
    assert error(case, ran_away) == np.inf
    short = {"x": case.judged["x"][:50], "y": case.judged["y"][:50]}
    assert error(case, short) == np.inf
    assert marks(said(case, {"rabbits": "x**3", "wolves": "0.8*x*y"})) == (False, False, True)


def test_the_error_is_that_of_the_worst_state_over_its_spread(case):
    moved = {"x": case.judged["x"], "y": case.judged["y"] + 0.1 * np.std(case.judged["y"])}
    assert error(case, moved) == pytest.approx(0.1, rel=1e-6)


def test_inputs_are_held_or_linear():
    frame = pd.DataFrame({"time": [0.0, 1.0, 2.0], "u": [1.0, 3.0, 0.0], "x": [0.0, 0.0, 0.0]})
    states = {"x": {"equation": "ex", "rate": "u", "unit": "1"}}
    for how, last in (("hold", 4.0), ("linear", 3.5)):
        case = SimpleNamespace(states=states, given={"u": how})
        assert simulated(case, {}, frame, {"x": 0.0})["x"][-1] == pytest.approx(last)


def test_a_template_names_what_it_is_applied_to():
    named = {"name": "parameter_varies(mu, C_s)", "target": "mu"}
    assert {"mu", "C_s"} == set(targets(named))
    assert targets({"target": "rabbits", "formula": "-0.9 * x*y"}) == ["rabbits"]
