"""What SBML says, against closed formulas and SciPy: amounts, compartments, rules, functions, and the time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from networks import compartment, decay, parameter, problem, reaction, rule, species

import dgd

pytest.importorskip("petab.v1", reason="petab is not installed: pip install 'dgd-models[petab]'")
TIMES = (0.0, 0.5, 2.0, 5.0)
SECOND = (
    "format_version: 2.0.0\nparameter_files: [parameters.tsv]\ncondition_files: [conditions.tsv]\n"
    "experiment_files: [experiments.tsv]\nmeasurement_files: [measurements.tsv]\nobservable_files: [observables.tsv]\n"
    "model_files:\n  decay:\n    location: model.xml\n    language: sbml\n"
)


def measured(*observables: str, noise: str = "0.1") -> dict[str, str]:
    """Tables that measure these quantities at all times."""
    rows = [f"y_{k}\tc0\t1\t{time}\n" for k in range(len(observables)) for time in TIMES]
    return {
        "observables": "observableId\tobservableFormula\tnoiseFormula\n"
        + "".join(f"y_{k}\t{one}\t{noise}\n" for k, one in enumerate(observables)),
        "measurements": "observableId\tsimulationConditionId\tmeasurement\ttime\n" + "".join(rows),
    }


def simulated(path: Path, count: int) -> np.ndarray:
    """Simulations, a row for each observable."""
    return np.asarray(dgd.from_petab(path).simulation(rtol=1e-10)["simulation"]).reshape(count, -1)


@pytest.mark.parametrize(("level", "version"), [(2, 4), (3, 1), (3, 2)])
def test_a_decay(tmp_path: Path, level: int, version: int) -> None:
    path = problem(tmp_path, decay(level, version), **measured("A", "k*A", "time", "loss"))
    values = simulated(path, 4)
    t = np.array(TIMES)
    assert np.allclose(values, [2 * np.exp(-t / 2), np.exp(-t / 2), t, np.exp(-t / 2)], rtol=1e-8)


def test_amounts_and_concentrations_in_compartments_of_a_size(tmp_path: Path) -> None:
    document = decay()
    model = document.getModel()
    compartment(model, "half", 0.5)
    compartment(model, "four", 4.0)
    # From a concentration in `half` to an amount in `four`, by a rate of amounts of a/2 a unit of time.
    species(model, "a", "half", amount=3.0)
    species(model, "b", "four", concentration=0.25, is_amount=True)
    reaction(model, "moves", {"a": -2, "b": 3}, "q*a", {"q": 0.25})
    t = np.array(TIMES)
    # d(0.5 a)/dt = -2·0.25 a, so that a falls as exp(-t) from 6; b gains 3/2 of what is lost.
    a = 6 * np.exp(-t)
    b = 1 + 1.5 * 0.5 * (6 - a)
    assert np.allclose(simulated(problem(tmp_path, document, **measured("a", "b")), 2), [a, b], rtol=1e-8)


def test_rules_assignments_functions_and_fixed_species(tmp_path: Path) -> None:
    scipy_integrate = pytest.importorskip("scipy.integrate")
    import libsbml

    document = decay()
    model = document.getModel()
    function = model.createFunctionDefinition()
    function.setId("hill")
    function.setMath(libsbml.parseL3Formula("lambda(x, n, K, x^n/(K^n + x^n))"))
    for name, value in (("n", 2.0), ("K", 0.8), ("slow", None), ("twice", None), ("late", None), ("level", None)):
        parameter(model, name, value, is_constant=name in ("n", "K"))
    species(model, "F", "c", concentration=1.5, is_boundary=True)
    species(model, "P", "c", concentration=0.0)
    rule(model, "AssignmentRule", "twice", "2*A + late")
    rule(model, "AssignmentRule", "late", "piecewise(0.3, time >= 1, 0.1)")
    rule(model, "RateRule", "slow", "-slow/3 + late*F")
    rule(model, "InitialAssignment", "slow", "level + twice")
    rule(model, "InitialAssignment", "level", "K*A")
    reaction(model, "makes", {"F": -1, "P": 1}, "c*hill(twice, n, K)*F*level")
    path = problem(tmp_path, document, **measured("A", "slow", "P", "twice", "F", "level"))

    def late(t: float) -> float:
        return 0.3 if t >= 1 else 0.1

    def rates(t: float, y: np.ndarray) -> list[float]:
        twice = 2 * y[0] + late(t)
        return [-0.5 * y[0], -y[1] / 3 + late(t) * 1.5, twice**2 / (0.64 + twice**2) * 1.5 * 1.6]

    start = [2.0, 1.6 + 4.1, 0.0]
    first = scipy_integrate.solve_ivp(rates, (0, 1), start, "DOP853", [0, 0.5], rtol=1e-12, atol=1e-14)
    end = scipy_integrate.solve_ivp(rates, (0, 1 - 1e-12), start, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    second = scipy_integrate.solve_ivp(rates, (1, 5), end, "DOP853", [2, 5], rtol=1e-12, atol=1e-14)
    y = np.hstack([first.y, second.y])
    twice = 2 * y[0] + [late(t) for t in TIMES]
    wanted = [*y, twice, np.full(4, 1.5), np.full(4, 1.6)]
    assert np.allclose(simulated(path, 6), wanted, rtol=1e-7)


def test_a_model_of_level_1(tmp_path: Path) -> None:
    import libsbml

    path = problem(tmp_path, decay(), **measured("A"))
    (tmp_path / "model.xml").write_text(
        """<?xml version="1.0" encoding="UTF-8"?>
<sbml xmlns="http://www.sbml.org/sbml/level1" level="1" version="2"><model name="old">
<listOfCompartments><compartment name="c" volume="2"/></listOfCompartments>
<listOfSpecies><species name="A" compartment="c" initialAmount="6"/></listOfSpecies>
<listOfParameters><parameter name="k" value="1"/></listOfParameters>
<listOfReactions><reaction name="loss" reversible="false">
<listOfReactants><speciesReference species="A"/></listOfReactants><kineticLaw formula="k * A * c * pow(2, -1)"/>
</reaction></listOfReactions></model></sbml>"""
    )
    assert libsbml.readSBML(str(tmp_path / "model.xml")).getNumErrors(libsbml.LIBSBML_SEV_ERROR) == 0
    assert np.allclose(simulated(path, 1), 3 * np.exp(-np.array(TIMES) / 4), rtol=1e-8)


@pytest.mark.parametrize(
    ("unit", "column"), [(60, "time [min]"), (3600, "time [h]"), (86400, "time [d]"), (7, "time [s]")]
)
def test_the_unit_of_time(tmp_path: Path, unit: int, column: str) -> None:
    import libsbml

    document = decay()
    model = document.getModel()
    definition = model.createUnitDefinition()
    definition.setId("own")
    one = definition.createUnit()
    one.setKind(libsbml.UNIT_KIND_SECOND)
    one.setMultiplier(unit)
    one.setExponent(1)
    one.setScale(0)
    model.setTimeUnits("own")
    p = dgd.from_petab(problem(tmp_path, document, **measured("A", "time")))
    (recording,) = p.recordings.values()
    assert next(iter(recording)) == column
    values = simulated(tmp_path / "problem.yaml", 2)
    assert np.allclose(values, [2 * np.exp(-np.array(TIMES) / 2), TIMES], rtol=1e-8)


def test_compartments_that_grow_stoichiometry_by_formulas_and_conversion(tmp_path: Path) -> None:
    document = decay()
    model = document.getModel()
    compartment(model, "bag", 2.0)
    model.getCompartment("bag").setConstant(False)
    rule(model, "RateRule", "bag", "0.5")
    # A concentration in the bag, of which nothing is lost but which is diluted; and one that is fed.
    species(model, "kept", "bag", concentration=3.0)
    species(model, "fed", "bag", amount=1.0)
    parameter(model, "many", 4.0)
    model.getSpecies("fed").setConversionFactor("many")
    reaction(model, "feeding", {"fed": 1}, "0.25*c")
    reference = model.getReaction("feeding").getProduct(0)
    reference.setId("share")
    reference.setConstant(False)
    rule(model, "AssignmentRule", "share", "2*A")
    t = np.array(TIMES)
    bag, a = 2 + t / 2, 2 * np.exp(-t / 2)
    # d(amount)/dt = 4·2·A·0.25, and A is 2 exp(-t/2).
    fed = 1 + 4 * 2 * 0.25 * 4 * (1 - np.exp(-t / 2))
    path = problem(tmp_path, document, **measured("bag", "kept", "fed", "share"))
    assert np.allclose(simulated(path, 4), [bag, 6 / bag, fed / bag, 2 * a], rtol=1e-8)


def test_conditions_and_numbers_in_place_of_each_other(tmp_path: Path) -> None:
    document = decay()
    model = document.getModel()
    for which, formula in (
        ("same", "piecewise(1, k == 0.5, 2)"),
        ("other", "piecewise(1, k != 0.5, 2)"),
        ("counted", "3*(A > 1) + (time < 1)"),
        ("either", "piecewise(1, xor(A > 1, time < 1, k > 0), 0)"),
        ("follows", "piecewise(1, implies(time < 1, A > 1.9), 0)"),
        ("nested", "piecewise(5, piecewise(A > 1, time < 1, k > 9), 7)"),
        ("counts", "factorial(3) + quotient(-7, 2) + rem(-7, 2)"),
    ):
        parameter(model, which, None, is_constant=False)
        rule(model, "AssignmentRule", which, formula)
    # A is 2, 1.56, 0.74 and 0.16.
    wanted = [[1] * 4, [2] * 4, [4, 4, 0, 0], [1, 1, 1, 1], [1, 0, 1, 1], [5, 5, 7, 7], [2] * 4]
    names = ("same", "other", "counted", "either", "follows", "nested", "counts")
    assert np.allclose(simulated(problem(tmp_path, document, **measured(*names)), 7), wanted, rtol=1e-12)


def test_conditions_give_start_values_constants_and_parameters(tmp_path: Path) -> None:
    document = decay()
    model = document.getModel()
    parameter(model, "gain", 3.0)
    p = dgd.from_petab(
        problem(
            tmp_path,
            document,
            parameters="parameterId\tparameterScale\tlowerBound\tupperBound\tnominalValue\testimate\n"
            "big\tlin\t0\t10\t5\t1\nk_slow\tlog\t1e-3\t10\t0.1\t0\n",
            conditions="conditionId\tA\tgain\tk\tc\n"
            "one\t4\t\t0.3\t1\n"
            "two\t\tbig\tk_slow\t1\n"
            "three\tbig\t2\t0.3\t2\n",
            observables="observableId\tobservableFormula\tnoiseFormula\nobs\tgain*A + k\t0.1\n",
            measurements="observableId\tsimulationConditionId\tmeasurement\ttime\n"
            + "".join(f"obs\t{which}\t1\t2\n" for which in ("one", "two", "three")),
        )
    )
    values = p.simulation(rtol=1e-10)["simulation"]
    wanted = [3 * 4 * np.exp(-0.6) + 0.3, 5 * 2 * np.exp(-0.2) + 0.1, 2 * 5 * np.exp(-0.6) + 0.3]
    assert np.allclose(values, wanted, rtol=1e-8)
    moved = p.simulation({"big": 6.0, "k_slow": 0.2}, rtol=1e-10)["simulation"]
    wanted = [3 * 4 * np.exp(-0.6) + 0.3, 6 * 2 * np.exp(-0.4) + 0.2, 2 * 6 * np.exp(-0.6) + 0.3]
    assert np.allclose(moved, wanted, rtol=1e-8)
    assert p.model.parameters["k_slow"].fixed and not p.model.parameters["big"].fixed


def test_names_that_the_language_has_for_itself(tmp_path: Path) -> None:
    document = decay()
    model = document.getModel()
    for name, value in (("t", 2.0), ("exp", 3.0), ("delay", 5.0), ("_1", 7.0), ("pi", 11.0), ("unit_of_time", 13.0)):
        parameter(model, name, value)
    path = problem(tmp_path, document, **measured("t*exp*delay*_1*A*unit_of_time", "sin(time) + A", noise="t"))
    t = np.array(TIMES)
    a = 2 * np.exp(-t / 2)
    assert np.allclose(simulated(path, 2), [2730 * a, np.sin(t) + a], rtol=1e-8)


def test_what_is_measured_at_the_steady_state(tmp_path: Path) -> None:
    document = decay()
    reaction(document.getModel(), "feed", {"A": 1}, "3*c")
    tables = {
        "conditions": "conditionId\tk\nslow\t0.5\nfast\t20\n",
        "parameters": "parameterId\tparameterScale\tlowerBound\tupperBound\tnominalValue\testimate\n",
        "measurements": "observableId\tsimulationConditionId\tmeasurement\ttime\n"
        + "".join(f"obs\t{which}\t1\t{time}\n" for which in ("slow", "fast") for time in (1, "inf", "inf")),
    }
    path = problem(tmp_path, document, **tables)
    p = dgd.from_petab(path, settle=60.0)
    slow, fast = 6 - 4 * np.exp(-0.5), 0.15 + 1.85 * np.exp(-20)
    assert np.allclose(p.simulation(rtol=1e-10)["simulation"], [slow, 6, 6, fast, 0.15, 0.15], rtol=1e-8)
    with pytest.warns(dgd.DgdWarning, match="not at rest at the end of `slow`: `A`; give a longer"):
        dgd.from_petab(path, settle=6.0)


def test_doses_in_one_experiment_of_version_2(tmp_path: Path) -> None:
    problem(tmp_path, decay())
    (tmp_path / "conditions.tsv").write_text("conditionId\ttargetId\ttargetValue\ndose\tA\tA + more\n")
    (tmp_path / "experiments.tsv").write_text(
        "experimentId\ttime\tconditionId\nonce\t0\t\nonce\t2\tdose\ntwice\t0\t\ntwice\t1\tdose\ntwice\t2\tdose\n"
    )
    (tmp_path / "parameters.tsv").write_text(
        "parameterId\tlowerBound\tupperBound\tnominalValue\testimate\nk\t0.01\t10\t0.5\ttrue\nmore\t0\t10\t3\ttrue\n"
    )
    rows = "".join(f"obs\t{which}\t1\t{time}\n" for which in ("once", "twice") for time in (1, 2, 3))
    (tmp_path / "measurements.tsv").write_text("observableId\texperimentId\tmeasurement\ttime\n" + rows)
    (tmp_path / "problem.yaml").write_text(SECOND)
    e = np.exp(-0.5)
    # What is measured at the time of a dose has it.
    wanted = [[2 * e, 2 * e**2 + 3, 2 * e**3 + 3 * e], [2 * e + 3, 2 * e**2 + 3 * e + 3, 2 * e**3 + 3 * e**2 + 3 * e]]
    assert np.allclose(simulated(tmp_path / "problem.yaml", 2), wanted, rtol=1e-8)


def test_several_changes_in_one_experiment_of_version_2(tmp_path: Path) -> None:
    problem(tmp_path, decay())
    (tmp_path / "conditions.tsv").write_text("conditionId\ttargetId\ttargetValue\nfast\tk\t1\nslow\tk\tk_slow/2\n")
    (tmp_path / "experiments.tsv").write_text("experimentId\ttime\tconditionId\ne\t0\tfast\ne\t1\tslow\ne\t3\tfast\n")
    (tmp_path / "parameters.tsv").write_text(
        "parameterId\tlowerBound\tupperBound\tnominalValue\testimate\nk_slow\t0.01\t10\t0.4\ttrue\n"
    )
    rows = "".join(f"obs\te\t1\t{time}\n" for time in (0, 1, 2, 3, 4))
    (tmp_path / "measurements.tsv").write_text("observableId\texperimentId\tmeasurement\ttime\n" + rows)
    (tmp_path / "problem.yaml").write_text(SECOND)
    spent = np.array([0, 1, 1.2, 1.4, 2.4])
    assert np.allclose(simulated(tmp_path / "problem.yaml", 1), 2 * np.exp(-spent), rtol=1e-8)
