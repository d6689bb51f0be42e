"""Combines a network and the tables of its problem into a model."""

from __future__ import annotations

from .conditions import Conditions
from .formula.expression import ONE, ZERO, Expression, name, number, operation
from .formula.mathml import TIME
from .model import State, Written
from .names import CLOCK
from .observables import outputs
from .read.sbml import Network, Quantity
from .read.tables import OWN, Tables
from .refusal import Refusals


def written(network: Network, tables: Tables, is_noise_declared: bool, refusals: Refusals) -> Written:
    """The model of a problem. Unsupported constructs are added to ``refusals``."""
    return _Builder(network, tables, refusals).build(is_noise_declared)


class _Builder:
    """Assembles a model."""

    def __init__(self, network: Network, tables: Tables, refusals: Refusals) -> None:
        self._quantities = network.quantities
        self._tables, self._refusals = tables, refusals
        self._written = Written(network.name, network.doc, network.time_unit)
        self._targets = sorted(set().union(*(one.targets for one in tables.experiments.values())))
        for name_of_problem in (*network.quantities, *tables.parameters, *self._targets):
            self._written.names.of(name_of_problem)
        self._keys = [
            (one.name, k) for one in tables.experiments.values() for k in range(len(one.phases))
        ]
        self._written.columns = {key: {} for key in self._keys}
        self._conditions = Conditions(self._written, self._keys)

    def build(self, is_noise_declared: bool) -> Written:
        """The complete model."""
        whole, names = self._written, self._written.names
        for one in self._tables.experiments.values():
            if one.before is not None:
                self._refusals.add(f"pre-equilibration, in the experiment `{one.name}`, unless `settle` is given")
        self._estimated()
        self._conditional()
        self._without_unit_compartments()
        whole.unit_name, whole.time_name = names.fresh("unit_of_time"), names.fresh("t")
        known = self._quantities.values()
        starts = {one.name: self._at_start(one) for one in known if one.kind == "state"}
        constants = {one.name: one.value for one in known if one.kind == "constant" and one.value is not None}
        whole.outputs, whole.places = outputs(self._tables, names, constants, is_noise_declared, self._refusals)
        for quantity in known:
            self._declare(quantity, starts)
        self._time()
        self._prune()
        return whole

    def _estimated(self) -> None:
        """Replaces parameters of the model by those of the table."""
        for parameter in self._tables.parameters.values():
            known = self._quantities.pop(parameter.name, None)
            if known is not None and known.kind != "constant":
                what = "is a state" if known.kind == "state" else "the model has a rule for"
                self._refusals.add(f"parameter `{parameter.name}`, which {what}")
            self._written.parameters[parameter.name] = parameter

    def _conditional(self) -> None:
        """Replaces values of the model by those of the conditions."""
        for target in self._targets:
            if target in self._written.parameters:
                self._refusals.add(f"`{target}` in the condition table, which the parameter table has, too")
                continue
            one = self._quantities.get(target) or Quantity(target, "constant", None)
            if one.kind == "formula":
                self._refusals.add(f"`{target}` in the condition table, which the model has a rule for")
                continue
            one.value = self._conditional_value(one)
            self._quantities[target] = one

    def _conditional_value(self, one: Quantity) -> Expression:
        """The value of a constant in all phases, or the initial value of a state; by default its own."""
        values: dict[tuple[str, int], Expression] = {}
        for experiment in self._tables.experiments.values():
            value = one.value
            for k, phase in enumerate(experiment.phases):
                if one.kind == "state" and k > 0:
                    break
                value = phase.values.get(one.name, value)
                value = one.value if value == OWN else value
                values[experiment.name, k] = self._missing(one) if value is None else value
        if one.kind == "constant":
            return self._conditions.formula(one.name, values, one.doc)
        self._jumps(one)
        return self._conditions.formula(self._written.names.fresh(f"{one.name}_start"), values, one.doc)

    def _jumps(self, one: Quantity) -> None:
        """The value that a phase sets a state to at its beginning; unchanged if the condition sets none."""
        for k in range(1, max(len(experiment.phases) for experiment in self._tables.experiments.values())):
            values = {
                (experiment.name, k): experiment.phases[k].values.get(one.name, OWN)
                for experiment in self._tables.experiments.values()
                if len(experiment.phases) > k
            }
            if any(value != OWN for value in values.values()):
                goes_on = {OWN.name: name(one.name)}
                told = {key: value.replaced(goes_on) for key, value in values.items()}
                formula = self._conditions.formula(self._written.names.fresh(f"{one.name}_set"), told, one.doc)
                self._written.resets.setdefault(k, {})[one.name] = formula

    def _missing(self, one: Quantity) -> Expression:
        self._refusals.add(f"{one.origin} `{one.name}` without a {'start ' * (one.kind == 'state')}value")
        return ZERO

    def _without_unit_compartments(self) -> None:
        """Omits the sizes of compartments of size one."""
        units = {
            one.name: ONE
            for one in self._quantities.values()
            if one.origin == "compartment" and one.kind == "constant" and one.value == ONE
        }
        for one in self._quantities.values():
            if one.name not in units:
                one.value = None if one.value is None else one.value.replaced(units)
                one.rate = None if one.rate is None else one.rate.replaced(units)

    def _at_start(self, one: Quantity) -> Expression:
        """The initial value of a state: varying quantities in it have their initial values."""
        if one.value is None:
            return self._missing(one)
        return self._started(one.value, (one.name,))

    def _started(self, formula: Expression, within: tuple[str, ...]) -> Expression:
        by: dict[str, Expression] = {TIME: ZERO}
        for each in sorted(formula.names):
            one = self._quantities.get(each)
            if one is None or not self._changes(each):
                continue
            if each in within:
                self._refusals.add(f"the start value of `{each}`, which depends on itself")
                return ZERO
            by[each] = self._missing(one) if one.value is None else self._started(one.value, (*within, each))
        return formula.replaced(by)

    def _changes(self, which: str, above: tuple[str, ...] = ()) -> bool:
        """Whether a name is a state or the time, or depends on one."""
        one = self._quantities.get(which)
        if one is None or which in above:
            return which == TIME
        if one.kind == "state":
            return True
        reads = one.value.names if one.value is not None else set()
        return any(self._changes(each, (*above, which)) for each in reads)

    def _declare(self, one: Quantity, starts: dict[str, Expression]) -> None:
        """Writes a quantity as an item of the language."""
        whole = self._written
        if one.kind == "state":
            assert one.rate is not None
            whole.states[one.name] = State(starts[one.name], one.rate, one.doc)
        elif one.name in whole.inputs:
            return
        elif one.value is None:
            # It is refused below, where anything reads it.
            return
        elif one.kind == "constant" and not one.value.names:
            whole.constants[one.name] = (one.value, one.doc)
        elif one.kind == "constant":
            whole.lets[one.name] = (self._started(one.value, (one.name,)), one.doc)
        else:
            whole.lets[one.name] = (one.value, one.doc)

    def _time(self) -> None:
        """The time of formulas, in the model's unit, and resets at the beginning of phases."""
        whole = self._written
        experiments = self._tables.experiments
        lengths = {(one, k): number(experiments[one].run_in) for one, k in self._keys}
        run_in = self._conditions.formula(whole.names.fresh("run_in"), lengths, "when the measurements begin")
        if whole.resets:
            whole.phase = self._conditions.phase()
        time = {TIME: name(whole.time_name)}
        whole.lets = {one: (value.replaced(time), doc) for one, (value, doc) in whole.lets.items()}
        whole.states = {
            one: State(is_.start, is_.rate.replaced(time), is_.doc) for one, is_ in whole.states.items()
        }
        for one in whole.outputs:
            one.formula = one.formula.replaced(time)
            one.noise = None if one.noise is None else one.noise.replaced(time)
        whole.resets = {
            k: {one: formula.replaced(time) for one, formula in resets.items()} for k, resets in whole.resets.items()
        }
        since = operation("-", operation("/", name(CLOCK), name(whole.unit_name)), run_in)
        whole.lets = {whole.time_name: (since, "the time in its unit"), **whole.lets}

    def _prune(self) -> None:
        """Omits quantities that nothing reads."""
        whole = self._written
        todo = [formula for is_ in whole.states.values() for formula in (is_.start, is_.rate)]
        todo += [formula for resets in whole.resets.values() for formula in resets.values()]
        todo += [whole.phase] if whole.phase is not None else []
        todo += [formula for one in whole.outputs for formula in (one.formula, one.noise) if formula is not None]
        read: set[str] = set()
        while todo:
            for each in todo.pop().names - read:
                read.add(each)
                if each in whole.lets:
                    todo.append(whole.lets[each][0])
        for each in sorted(read):
            one = self._quantities.get(each)
            if one is not None and one.kind != "state" and one.value is None:
                self._missing(one)
        whole.constants = {one: what for one, what in whole.constants.items() if one in read}
        whole.parameters = {one: what for one, what in whole.parameters.items() if one in read}
        whole.inputs = {one: what for one, what in whole.inputs.items() if one in read}
        whole.lets = {one: what for one, what in whole.lets.items() if one in read}
        for columns in whole.columns.values():
            for unread in columns.keys() - whole.inputs.keys():
                del columns[unread]
