"""What the language cannot say is refused by its name, all of it at once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from networks import TABLES, decay, parameter, problem, reaction, rule, species

import dgd

libsbml = pytest.importorskip("libsbml", reason="python-libsbml is not installed: pip install 'dgd-models[petab]'")
pytest.importorskip("petab.v1", reason="petab is not installed: pip install 'dgd-models[petab]'")


def refused(path: Path, **options: str) -> list[str]:
    """What is refused, a line each."""
    with pytest.raises(dgd.ModelError, match="cannot be imported") as caught:
        dgd.from_petab(path, **options)
    first, *lines, last = str(caught.value).splitlines()
    assert first == f"the PEtab problem {path.name} cannot be imported:" and last == "docs/petab.md lists what can be"
    return [line.removeprefix("  - ") for line in lines]


def event(model: Any) -> None:
    one = model.createEvent()
    one.setId("dose")
    one.setUseValuesFromTriggerTime(True)
    trigger = one.createTrigger()
    trigger.setInitialValue(True)
    trigger.setPersistent(True)
    trigger.setMath(libsbml.parseL3Formula("time > 1"))


def fast(model: Any) -> None:
    reaction(model, "quick", {"A": -1}, "A").setFast(True)


def time_unit(model: Any) -> None:
    definition = model.createUnitDefinition()
    definition.setId("per_metre")
    one = definition.createUnit()
    one.setKind(libsbml.UNIT_KIND_METRE)
    one.setExponent(-1)
    one.setScale(0)
    one.setMultiplier(1)
    model.setTimeUnits("per_metre")


def without_law(model: Any) -> None:
    model.getReaction("loss").unsetKineticLaw()


def without_start(model: Any) -> None:
    species(model, "B", "c")
    reaction(model, "more", {"B": 1}, "k*A")


def formula(words: str) -> Callable[[Any], None]:
    return lambda model: model.getReaction("loss").getKineticLaw().setMath(libsbml.parseL3Formula(words)) and None


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (event, "event `dose`"),
        (lambda model: rule(model, "AlgebraicRule", "", "A - 1"), "an algebraic rule"),
        (fast, "fast reaction `quick`"),
        (time_unit, "unit of time `per_metre`, which is not a multiple of seconds"),
        (without_law, "reaction `loss` without a kinetic law"),
        (without_start, "species `B` without a start value"),
        (lambda model: rule(model, "InitialAssignment", "A", "2*A"), "the start value of `A`, which depends on itself"),
        (formula("k*delay(A, 1)"), "`delay` in a formula of the kinetic law of reaction `loss`"),
        (formula("k*rateOf(A)"), "`rateOf` in a formula of the kinetic law of reaction `loss`"),
        (
            formula("piecewise(k, A > 1)"),
            "a `piecewise` without a value for all other cases of the kinetic law of reaction `loss`",
        ),
    ],
)
def test_of_a_network(tmp_path: Path, spoil: Callable[[Any], None], words: str) -> None:
    # The last version that knows fast reactions.
    document = decay(3, 1)
    spoil(document.getModel())
    assert words in refused(problem(tmp_path, document))


def measured(rows: str) -> dict[str, str]:
    """A measurement table with more rows."""
    return {"measurements": TABLES["measurements"] + rows}


def observed(columns: str, cells: str) -> dict[str, str]:
    """An observable table of one row."""
    return {"observables": f"observableId\t{columns}\nobs\t{cells}\n"}


def expected(kind: str) -> dict[str, str]:
    """A parameter table with a prior."""
    head, row = TABLES["parameters"].splitlines()
    return {"parameters": f"{head}\tobjectivePriorType\tobjectivePriorParameters\n{row}\t{kind}\t0;1\n"}


def estimated(name: str) -> dict[str, str]:
    """A parameter table with one more."""
    return {"parameters": TABLES["parameters"] + f"{name}\tlin\t0\t10\t1\t1\n"}


PLAIN = "observableFormula\tnoiseFormula"


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        (
            measured("obs\tc0\t1\tinf\n"),
            "measurements at the steady state, in the experiment `c0`, unless `settle` is given",
        ),
        (measured("obs\tc0\t1\t-1\n"), "measurements at the time `-1.0`, in the experiment `c0`"),
        (
            observed(f"{PLAIN}\tnoiseDistribution", "A\t0.1\tlaplace"),
            "noise distribution `laplace` of observable `obs`",
        ),
        (
            observed(PLAIN, "A*observableParameter1_obs\t0.1"),
            "measurements of `obs` without a value of `observableParameter1_obs`",
        ),
        (
            observed(PLAIN, "A\tnoiseParameter1_obs"),
            "measurements of `obs` without a value of `noiseParameter1_obs`",
        ),
        (observed(PLAIN, "A +* 2\t0.1"), "the formula `A +* 2`"),
        (
            observed(f"{PLAIN}\tobservableTransformation", "A\t0.1\tlog") | measured("obs\tc0\t-3\t1\n"),
            "the measurement -3 of `obs`, which has no logarithm",
        ),
        (expected("logLaplace"), "prior `logLaplace` of parameter `k`"),
        (
            expected("parameterScaleLaplace"),
            "prior `parameterScaleLaplace` on the scale `log10` of parameter `k`",
        ),
        (estimated("A"), "parameter `A`, which is a state"),
        (estimated("loss"), "parameter `loss`, which the model has a rule for"),
        ({"conditions": "conditionId\tloss\nc0\t1\n"}, "`loss` in the condition table, which the model has a rule for"),
        ({"conditions": "conditionId\tk\nc0\t1\n"}, "`k` in the condition table, which the parameter table has, too"),
    ],
)
def test_of_the_tables(tmp_path: Path, tables: dict[str, str], words: str) -> None:
    assert any(line.startswith(words) for line in refused(problem(tmp_path, decay(), **tables)))


def test_everything_is_said_at_once(tmp_path: Path) -> None:
    document = decay()
    event(document.getModel())
    parameter(document.getModel(), "x", None)
    tables = observed(f"{PLAIN}\tnoiseDistribution", "A*x\t0.1\tlaplace")
    lines = refused(problem(tmp_path, document, **tables))
    assert lines == [
        "noise distribution `laplace` of observable `obs`",
        "event `dose`",
        "parameter `x` without a value",
    ]


@pytest.mark.parametrize(
    ("table", "old", "new", "words"),
    [
        ("measurements", "obs\tc0\t1", "obs\tc0\tone", "`one` is not a number, in the measurement table"),
        ("measurements", "obs\tc0\t1", "obs\tc9\t1", "has the condition `c9`, which the condition table has not"),
        ("parameters", "0.5\t1", "0.5\tmaybe", "`maybe` is not a number, in parameter `k`"),
        ("measurements", "obs\tc0\t1\t0\nobs\tc0\t0.5\t2\n", "", "has no measurements"),
    ],
)
def test_tables_with_mistakes(tmp_path: Path, table: str, old: str, new: str, words: str) -> None:
    assert old in TABLES[table]
    with pytest.raises(dgd.DataError, match=words):
        dgd.from_petab(problem(tmp_path, decay(), **{table: TABLES[table].replace(old, new)}))


def test_mistakes_in_formulas_are_those_of_the_language(tmp_path: Path) -> None:
    observables = TABLES["observables"].replace("\tA\t", "\tA*nobody\t")
    with pytest.raises(dgd.ModelError, match="nothing is called `nobody`"):
        dgd.from_petab(problem(tmp_path, decay(), observables=observables))


def test_what_is_no_problem_at_all(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="nowhere.yaml"):
        dgd.from_petab(tmp_path / "nowhere.yaml")
    (tmp_path / "list.yaml").write_text("- 1\n")
    with pytest.raises(dgd.DataError, match="list.yaml cannot be read by petab"):
        dgd.from_petab(tmp_path / "list.yaml")
    with pytest.raises(dgd.UsageError, match='`noise` must be "declared" or "estimated"'):
        dgd.from_petab(problem(tmp_path, decay()), noise="none")
