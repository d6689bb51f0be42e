"""SBML models and PEtab problems that tests write themselves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

TABLES = {
    "parameters": "parameterId\tparameterScale\tlowerBound\tupperBound\tnominalValue\testimate\n"
    "k\tlog10\t1e-3\t10\t0.5\t1\n",
    "conditions": "conditionId\nc0\n",
    "observables": "observableId\tobservableFormula\tnoiseFormula\nobs\tA\t0.1\n",
    "measurements": "observableId\tsimulationConditionId\tmeasurement\ttime\nobs\tc0\t1\t0\nobs\tc0\t0.5\t2\n",
}


def decay(level: int = 3, version: int = 2) -> Any:
    """A document with one species `A` of 2 that decays by `k` in a compartment `c` of 1."""
    import libsbml

    document = libsbml.SBMLDocument(level, version)
    model = document.createModel()
    model.setId("decay")
    compartment(model, "c", 1.0)
    parameter(model, "k", 0.5)
    species(model, "A", "c", concentration=2.0)
    reaction(model, "loss", {"A": -1}, "k*A*c")
    return document


def compartment(model: Any, name: str, size: float) -> None:
    """Adds a compartment."""
    one = model.createCompartment()
    one.setId(name)
    one.setSize(size)
    one.setSpatialDimensions(3)
    one.setConstant(True)


def parameter(model: Any, name: str, value: float | None, is_constant: bool = True) -> None:
    """Adds a parameter."""
    one = model.createParameter()
    one.setId(name)
    one.setConstant(is_constant)
    if value is not None:
        one.setValue(value)


def species(
    model: Any,
    name: str,
    where: str,
    concentration: float | None = None,
    amount: float | None = None,
    is_amount: bool = False,
    is_boundary: bool = False,
) -> Any:
    """Adds a species, which is an amount or a concentration."""
    one = model.createSpecies()
    one.setId(name)
    one.setCompartment(where)
    one.setHasOnlySubstanceUnits(is_amount)
    one.setBoundaryCondition(is_boundary)
    one.setConstant(False)
    if concentration is not None:
        one.setInitialConcentration(concentration)
    if amount is not None:
        one.setInitialAmount(amount)
    return one


def reaction(model: Any, name: str, changes: dict[str, float], rate: str, local: dict[str, float] | None = None) -> Any:
    """Adds a reaction by what it does to species, and its rate of amounts."""
    import libsbml

    one = model.createReaction()
    one.setId(name)
    one.setReversible(False)
    for which, count in changes.items():
        reference = one.createProduct() if count > 0 else one.createReactant()
        reference.setSpecies(which)
        reference.setStoichiometry(abs(count))
        reference.setConstant(True)
    law = one.createKineticLaw()
    law.setMath(libsbml.parseL3Formula(rate))
    for which, value in (local or {}).items():
        own = law.createLocalParameter()
        own.setId(which)
        own.setValue(value)
    return one


def rule(model: Any, kind: str, name: str, formula: str) -> None:
    """Adds an assignment rule, a rate rule, an algebraic rule or an initial assignment."""
    import libsbml

    one = getattr(model, f"create{kind}")()
    if kind == "InitialAssignment":
        one.setSymbol(name)
    elif kind != "AlgebraicRule":
        one.setVariable(name)
    one.setMath(libsbml.parseL3Formula(formula))


def problem(folder: Path, document: Any, **tables: str) -> Path:
    """Writes a problem of version 1; the path of its YAML file. Tables that are not given are those of a decay."""
    import libsbml

    folder.mkdir(parents=True, exist_ok=True)
    libsbml.writeSBMLToFile(document, str(folder / "model.xml"))
    for name, table in {**TABLES, **tables}.items():
        (folder / f"{name}.tsv").write_text(table)
    path = folder / "problem.yaml"
    path.write_text(
        "format_version: 1\nparameter_file: parameters.tsv\nproblems:\n- condition_files: [conditions.tsv]\n"
        "  measurement_files: [measurements.tsv]\n  observable_files: [observables.tsv]\n  sbml_files: [model.xml]\n"
    )
    return path


def judged(path: Path, simulation: Any) -> tuple[float, float]:
    """Log-likelihood and χ² of a simulation by petab's own calculation."""
    import petab.v1 as petab

    problem = petab.Problem.from_yaml(str(path))
    tables = (problem.measurement_df.reset_index(drop=True), simulation, problem.observable_df, problem.parameter_df)
    return petab.calculate_llh(*tables), petab.calculate_chi2(*tables)
