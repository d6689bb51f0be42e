"""An SBML model as quantities: constants, formulas, and states with start values and rates."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..formula.expression import ONE, Expression, name, number, operation, product, total
from ..formula.mathml import of_sbml
from ..refusal import Refusals, Refused


@dataclass
class Quantity:
    """The quantity behind a name of the model."""

    name: str
    #: ``"constant"``, ``"formula"`` or ``"state"``.
    kind: str
    #: The value of a constant, the formula, or the start value of a state; None where the model says none.
    value: Expression | None
    #: Of a state: its change in the model's unit of time.
    rate: Expression | None = None
    doc: str = ""
    #: ``"species"``, ``"parameter"``, ``"compartment"``, ``"reaction"`` or ``"stoichiometry"``.
    origin: str = "parameter"
    #: Of a species that is an amount: its compartment. None where it is a concentration.
    amount_in: str | None = None


@dataclass
class Network:
    """A model: its quantities by name, in its own order."""

    name: str
    doc: str
    #: The model's unit of time, s.
    time_unit: float
    quantities: dict[str, Quantity] = field(default_factory=dict)


def network(document: Any, refusals: Refusals) -> Network:
    """The contents of a libSBML document. Unsupported constructs are added to ``refusals``."""
    document = document.clone()
    model = document.getModel()
    _refuse_whole(document, model, refusals)
    if model.getNumFunctionDefinitions() and not document.expandFunctionDefinitions():
        refusals.add("function definitions that libSBML cannot expand")
    return _Reader(model, refusals).read()


def _refuse_whole(document: Any, model: Any, refusals: Refusals) -> None:
    """Refuses constructs that prevent reading any of the model."""
    for k in range(document.getNumPlugins()):
        package = document.getPlugin(k).getPackageName()
        # Of level 2 it is an annotation, and this one only has functions, which are read or refused by name.
        if document.getLevel() > 2 and document.getPackageRequired(package) and package != "l3v2extendedmath":
            refusals.add(f"the SBML package `{package}`")
    for event in model.getListOfEvents():
        refusals.add(f"event `{event.getId() or event.getName() or '?'}`")
    for rule in model.getListOfRules():
        if rule.isAlgebraic():
            refusals.add("an algebraic rule")


class _Reader:
    """Reads the lists of a model."""

    def __init__(self, model: Any, refusals: Refusals) -> None:
        self._model, self._refusals = model, refusals
        self._quantities: dict[str, Quantity] = {}
        #: Of species whose amounts are states, while their concentrations are formulas.
        self._amounts: dict[str, Quantity] = {}
        self._assigned = {one.getSymbol(): one for one in model.getListOfInitialAssignments()}
        rules = [one for one in model.getListOfRules() if not one.isAlgebraic()]
        self._rules = {one.getVariable(): one for one in rules if one.isAssignment()}
        self._rates = {one.getVariable(): one for one in rules if one.isRate()}

    def read(self) -> Network:
        """The complete model."""
        model = self._model
        for one in model.getListOfCompartments():
            self._compartment(one)
        for one in model.getListOfParameters():
            self._add(one, _value(one.isSetValue(), one.getValue()))
        for one in model.getListOfSpecies():
            self._species(one)
        for one in model.getListOfReactions():
            self._reaction(one)
        for one in self._quantities.values():
            if one.kind == "state" and one.rate is None:
                one.kind = "constant"
        about = model.getName() or ""
        return Network(model.getId() or "model", about, self._time_unit(), self._quantities)

    def _formula(self, node: Any, of: str) -> Expression:
        """A formula; zero if it is refused."""
        if node is None:
            self._refusals.add(f"{of} without a formula")
            return number(0)
        try:
            return of_sbml(node)
        except Refused as error:
            self._refusals.add(f"{error} of {of}")
            return number(0)

    def _add(self, element: Any, value: Expression | None, origin: str = "parameter") -> Quantity:
        """A quantity by its rule, or else by its value, which an initial assignment replaces."""
        own = element.getId()
        what = f"{origin} `{own}`"
        one = Quantity(own, "constant", value, doc=_doc(element), origin=origin)
        if own in self._assigned:
            one.value = self._formula(self._assigned[own].getMath(), f"the initial assignment of {what}")
        if own in self._rules:
            one.kind = "formula"
            one.value = self._formula(self._rules[own].getMath(), f"the rule of {what}")
        if own in self._rates:
            one.kind = "state"
            one.rate = self._formula(self._rates[own].getMath(), f"the rate rule of {what}")
        self._quantities[own] = one
        return one

    def _compartment(self, element: Any) -> None:
        size = _value(element.isSetSize(), element.getSize())
        if size is None and element.getSpatialDimensions() == 0:
            size = ONE
        self._add(element, size, "compartment")

    def _species(self, element: Any) -> None:
        own, where = element.getId(), element.getCompartment()
        size = name(where)
        is_amount = element.getHasOnlySubstanceUnits()
        if element.isSetInitialConcentration():
            concentration = number(element.getInitialConcentration())
            value: Expression | None = operation("*", concentration, size) if is_amount else concentration
        else:
            amount = _value(element.isSetInitialAmount(), element.getInitialAmount())
            value = amount if amount is None or is_amount else operation("/", amount, size)
        one = self._add(element, value, "species")
        one.amount_in = where if is_amount else None
        is_reacting = not (element.getBoundaryCondition() or element.getConstant())
        if one.kind == "constant" and is_reacting:
            one.kind = "state"
        if one.kind in ("constant", "state") and own not in self._rates and not is_amount:
            self._by_amount(one, where)

    def _by_amount(self, one: Quantity, where: str) -> None:
        """Makes a concentration in a compartment whose size changes a formula of its amount."""
        if self._quantities[where].kind == "constant":
            return
        whole = f"{one.name}_amount"
        while self._model.getElementBySId(whole) is not None:
            whole += "_"
        start = None if one.value is None else operation("*", one.value, name(where))
        amount = Quantity(whole, one.kind, start, origin="species", amount_in=where)
        self._quantities[whole] = amount
        self._amounts[one.name] = amount
        one.kind, one.value = "formula", operation("/", name(whole), name(where))

    def _reaction(self, element: Any) -> None:
        own = element.getId()
        if element.isSetFast() and element.getFast():
            self._refusals.add(f"fast reaction `{own}`")
        law = element.getKineticLaw()
        if law is None:
            self._refusals.add(f"reaction `{own}` without a kinetic law")
            return
        rate = self._formula(law.getMath(), f"the kinetic law of reaction `{own}`")
        local = {}
        for one in [*law.getListOfParameters(), *law.getListOfLocalParameters()]:
            whole = f"{own}_{one.getId()}"
            local[one.getId()] = name(whole)
            value = _value(one.isSetValue(), one.getValue())
            self._quantities[whole] = Quantity(whole, "constant", value, doc=_doc(one))
        doc = _doc(element)
        self._quantities[own] = Quantity(own, "formula", rate.replaced(local), doc=doc, origin="reaction")
        for sign, side in (("minus", element.getListOfReactants()), ("+", element.getListOfProducts())):
            for reference in side:
                self._change(own, reference, sign)

    def _change(self, reaction: str, reference: Any, sign: str) -> None:
        """Adds the contribution of a reaction to a species; rates are in amounts."""
        which = reference.getSpecies()
        species = self._amounts.get(which) or self._quantities[which]
        count = self._stoichiometry(reaction, reference)
        if species.kind != "state" or species.name in self._rates:
            return
        element = self._model.getSpecies(which)
        factor = element if element.isSetConversionFactor() else self._model
        factors = [count, name(factor.getConversionFactor())] if factor.isSetConversionFactor() else [count]
        change = product([*factors, name(reaction)])
        if species.amount_in is None:
            change = operation("/", change, name(element.getCompartment()))
        change = operation("minus", change) if sign == "minus" else change
        species.rate = total([change] if species.rate is None else [species.rate, change])

    def _stoichiometry(self, reaction: str, reference: Any) -> Expression:
        """The number of a species in a reaction; one that has a name is a quantity."""
        if reference.isSetStoichiometryMath():
            formula = reference.getStoichiometryMath().getMath()
            return self._formula(formula, f"a stoichiometry in reaction `{reaction}`")
        value = number(reference.getStoichiometry() if reference.isSetStoichiometry() else 1.0)
        own = reference.getId()
        if not own:
            return value
        one = self._add(reference, value, "stoichiometry")
        return value if one.kind == "constant" and one.value == value else name(own)

    def _time_unit(self) -> float:
        """The unit of time, s: that of the model, or else seconds."""
        model = self._model
        which = model.getTimeUnits() if model.getLevel() > 2 else "time"
        definition = model.getUnitDefinition(which)
        if which in ("", "second", "dimensionless") or definition is None:
            return 1.0
        size = 1.0
        for one in definition.getListOfUnits():
            if not (one.isSecond() or one.isDimensionless()) or (one.isSecond() and one.getExponent() != 1):
                self._refusals.add(f"unit of time `{which}`, which is not a multiple of seconds")
            size *= (one.getMultiplier() * 10.0 ** one.getScale()) ** one.getExponent()
        return float(f"{size:.15g}")


def _value(is_set: bool, value: float) -> Expression | None:
    return number(value) if is_set and value == value else None


def _doc(element: Any) -> str:
    """The name of an element, if it is more informative than its identifier."""
    words = " ".join((element.getName() or "").split())
    return "" if words == element.getId() else words
