"""Formulas of SBML and PEtab, read by libSBML, as expressions of the language."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import libsbml

from ..names import PI
from ..refusal import Refused
from .expression import ONE, ZERO, Expression, call, name, number, operation, product, total

#: The name that stands for the time of a formula, in the problem's unit of time. It is no name of SBML.
TIME = "time "

# Functions that both have, by the name that the language gives them.
_SAME = {
    libsbml.AST_FUNCTION_ABS: "abs",
    libsbml.AST_FUNCTION_ARCCOS: "acos",
    libsbml.AST_FUNCTION_ARCSIN: "asin",
    libsbml.AST_FUNCTION_ARCTAN: "atan",
    libsbml.AST_FUNCTION_CEILING: "ceil",
    libsbml.AST_FUNCTION_COS: "cos",
    libsbml.AST_FUNCTION_COSH: "cosh",
    libsbml.AST_FUNCTION_EXP: "exp",
    libsbml.AST_FUNCTION_FLOOR: "floor",
    libsbml.AST_FUNCTION_LN: "log",
    libsbml.AST_FUNCTION_SIN: "sin",
    libsbml.AST_FUNCTION_SINH: "sinh",
    libsbml.AST_FUNCTION_TAN: "tan",
    libsbml.AST_FUNCTION_TANH: "tanh",
}
_RECIPROCALS = {
    libsbml.AST_FUNCTION_SEC: "cos",
    libsbml.AST_FUNCTION_CSC: "sin",
    libsbml.AST_FUNCTION_COT: "tan",
    libsbml.AST_FUNCTION_SECH: "cosh",
    libsbml.AST_FUNCTION_CSCH: "sinh",
    libsbml.AST_FUNCTION_COTH: "tanh",
}
_COMPARISONS = {
    libsbml.AST_RELATIONAL_GEQ: ">=",
    libsbml.AST_RELATIONAL_GT: ">",
    libsbml.AST_RELATIONAL_LEQ: "<=",
    libsbml.AST_RELATIONAL_LT: "<",
}
_REFUSED = {
    libsbml.AST_FUNCTION_DELAY: "`delay`",
    libsbml.AST_FUNCTION_RATE_OF: "`rateOf`",
    libsbml.AST_LAMBDA: "`lambda`",
}
_TRUE, _FALSE = operation("<", ZERO, ONE), operation("<", ONE, ZERO)


def of_sbml(node: Any) -> Expression:
    """A formula of an SBML model whose functions are expanded; raises :class:`Refused`."""
    return _number(_Reader(False).read(node))


def of_petab(formula: object) -> Expression:
    """A formula or number of a PEtab table; raises :class:`Refused`."""
    settings = libsbml.L3ParserSettings()
    settings.setParseLog(libsbml.L3P_PARSE_LOG_AS_LN)
    node = libsbml.parseL3FormulaWithSettings(str(formula), settings)
    if node is None:
        why = str(libsbml.getLastParseL3Error()).strip().splitlines()[-1]
        raise Refused(f"the formula `{formula}`, which cannot be read: {why}")
    return _number(_Reader(True).read(node))


class _Reader:
    """Reads the nodes of a formula."""

    def __init__(self, is_petab: bool) -> None:
        self._is_petab = is_petab

    def read(self, node: Any) -> Expression:
        """A node and all below it."""
        kind = node.getType()
        if kind in _REFUSED:
            raise Refused(f"{_REFUSED[kind]} in a formula")
        if node.isNumber() or kind in (libsbml.AST_RATIONAL, libsbml.AST_REAL_E):
            return _finite(node.getValue())
        if kind == libsbml.AST_NAME:
            return name(node.getName())
        constant = self._constant(kind)
        if constant is not None:
            return constant
        parts = [self.read(child) for child in _children(node)]
        made = _condition(kind, parts)
        if made is None:
            parts = list(map(_number, parts))
            made = _arithmetic(kind, parts) or self._function(node, kind, parts)
        if made is None:
            raise Refused(f"`{node.getName() or libsbml.formulaToL3String(node)}` in a formula")
        return made

    @staticmethod
    def _constant(kind: int) -> Expression | None:
        if kind == libsbml.AST_NAME_TIME:
            return name(TIME)
        if kind == libsbml.AST_NAME_AVOGADRO:
            return number(6.02214179e23)
        if kind == libsbml.AST_CONSTANT_PI:
            return name(PI)
        if kind == libsbml.AST_CONSTANT_E:
            return call("exp", ONE)
        if kind == libsbml.AST_CONSTANT_TRUE:
            return _TRUE
        if kind == libsbml.AST_CONSTANT_FALSE:
            return _FALSE
        return None

    def _function(self, node: Any, kind: int, parts: list[Expression]) -> Expression | None:
        if kind in _SAME:
            return call(_SAME[kind], parts[0])
        if kind in _RECIPROCALS:
            return operation("/", ONE, call(_RECIPROCALS[kind], parts[0]))
        if kind in _INVERSES:
            return _INVERSES[kind](parts[0])
        if kind in (libsbml.AST_FUNCTION_MIN, libsbml.AST_FUNCTION_MAX):
            return _folded("min" if kind == libsbml.AST_FUNCTION_MIN else "max", parts)
        if kind == libsbml.AST_FUNCTION_ROOT:
            return _root(parts)
        if kind == libsbml.AST_FUNCTION_LOG:
            # The base stands first in SBML, and last in PEtab where it is written out.
            swapped = self._is_petab and node.getName() == "log"
            return _logarithm(*(reversed(parts) if swapped else parts))
        if kind == libsbml.AST_FUNCTION_FACTORIAL:
            return call("exp", call("lgamma", operation("+", parts[0], ONE)))
        if kind == libsbml.AST_FUNCTION_QUOTIENT:
            ratio = operation("/", *parts)
            return operation("*", call("sign", ratio), call("floor", call("abs", ratio)))
        if kind == libsbml.AST_FUNCTION_REM:
            size = call("mod", call("abs", parts[0]), call("abs", parts[1]))
            return operation("*", call("sign", parts[0]), size)
        if kind == libsbml.AST_FUNCTION and self._is_petab and len(parts) == 1:
            return _of_petab_alone(node.getName(), parts[0])
        return None


def _children(node: Any) -> list[Any]:
    """The children of a node; of a sum of sums, or a product of products, all that are added or multiplied."""
    kind = node.getType()
    found = []
    todo = [node]
    while todo:
        one = todo.pop()
        if one is node or (kind in (libsbml.AST_PLUS, libsbml.AST_TIMES) and one.getType() == kind):
            todo += [one.getChild(k) for k in reversed(range(one.getNumChildren()))]
        else:
            found.append(one)
    return found


def _arithmetic(kind: int, parts: list[Expression]) -> Expression | None:
    if kind == libsbml.AST_PLUS:
        return total(parts)
    if kind == libsbml.AST_TIMES:
        return product(parts)
    if kind == libsbml.AST_MINUS:
        return operation("minus" if len(parts) == 1 else "-", *parts)
    if kind == libsbml.AST_DIVIDE:
        return operation("/", *parts)
    if kind in (libsbml.AST_POWER, libsbml.AST_FUNCTION_POWER):
        return operation("^", *parts)
    return None


def _condition(kind: int, parts: list[Expression]) -> Expression | None:
    if kind in _COMPARISONS:
        parts = list(map(_number, parts))
        pairs = [operation(_COMPARISONS[kind], *pair) for pair in zip(parts, parts[1:])]
        return _joined("and", pairs)
    if kind in (libsbml.AST_RELATIONAL_EQ, libsbml.AST_RELATIONAL_NEQ):
        same = _joined("and", [_same(*pair) for pair in zip(parts, parts[1:])])
        return same if kind == libsbml.AST_RELATIONAL_EQ else operation("not", same)
    if kind in (libsbml.AST_LOGICAL_AND, libsbml.AST_LOGICAL_OR):
        return _joined("and" if kind == libsbml.AST_LOGICAL_AND else "or", parts)
    if kind == libsbml.AST_LOGICAL_NOT:
        return operation("not", _truth(parts[0]))
    if kind == libsbml.AST_LOGICAL_IMPLIES:
        return operation("or", operation("not", _truth(parts[0])), _truth(parts[1]))
    if kind == libsbml.AST_LOGICAL_XOR:
        result = _FALSE
        for part in parts:
            result = operation("not", _same(result, _truth(part)))
        return result
    if kind == libsbml.AST_FUNCTION_PIECEWISE:
        if len(parts) % 2 == 0:
            raise Refused("a `piecewise` without a value for all other cases")
        as_all = _truth if all(map(_is_condition, parts[::2])) else _number
        result = as_all(parts[-1])
        for k in range(len(parts) - 3, -1, -2):
            result = operation("if", _truth(parts[k + 1]), as_all(parts[k]), result)
        return result
    return None


def _is_condition(formula: Expression) -> bool:
    """Whether a formula is true or false, and not a number."""
    if formula.kind == "if":
        return _is_condition(formula.parts[1])
    return formula.kind in ("<", "<=", ">", ">=", "and", "or", "not")


def _number(formula: Expression) -> Expression:
    """A formula as a number: a condition is 1 where it holds and 0 elsewhere."""
    return operation("if", _truth(formula), ONE, ZERO) if _is_condition(formula) else formula


def _truth(formula: Expression) -> Expression:
    """A formula as a condition: a number is true unless it is zero, and the language chooses numbers alone by `if`."""
    if not _is_condition(formula):
        return operation("not", _same(formula, ZERO))
    if formula.kind != "if":
        return formula
    condition, chosen, otherwise = map(_truth, formula.parts)
    first = operation("and", condition, chosen)
    return operation("or", first, operation("and", operation("not", condition), otherwise))


def _same(a: Expression, b: Expression) -> Expression:
    """Whether two numbers, or two conditions, are the same: numbers are not tested for equality in the language."""
    if _is_condition(a) or _is_condition(b):
        a, b = _truth(a), _truth(b)
        neither = operation("and", operation("not", a), operation("not", b))
        return operation("or", operation("and", a, b), neither)
    return operation("and", operation("<=", a, b), operation(">=", a, b))


def _joined(kind: str, parts: list[Expression]) -> Expression:
    """Conditions joined; of none, all are true and none is."""
    if not parts:
        return _TRUE if kind == "and" else _FALSE
    result = _truth(parts[0])
    for part in parts[1:]:
        result = operation(kind, result, _truth(part))
    return result


def _folded(function: str, parts: list[Expression]) -> Expression:
    result = parts[0]
    for part in parts[1:]:
        result = call(function, result, part)
    return result


def _root(parts: list[Expression]) -> Expression:
    degree, argument = (number(2), parts[0]) if len(parts) == 1 else parts
    if degree == number(2):
        return call("sqrt", argument)
    return operation("^", argument, operation("/", ONE, degree))


def _logarithm(*parts: Expression) -> Expression:
    base, argument = (number(10), parts[0]) if len(parts) == 1 else parts
    if base == number(10):
        return call("log10", argument)
    return operation("/", call("log", argument), call("log", base))


def _of_petab_alone(function: str, argument: Expression) -> Expression | None:
    if function == "log2":
        return _logarithm(number(2), argument)
    return call("sign", argument) if function == "sign" else None


def _finite(value: float) -> Expression:
    if not math.isfinite(value):
        raise Refused(f"the number `{value}` in a formula")
    return number(value)


def _square(x: Expression) -> Expression:
    return operation("^", x, number(2))


def _area_sinh(x: Expression) -> Expression:
    return call("log", operation("+", x, call("sqrt", operation("+", _square(x), ONE))))


def _area_cosh(x: Expression) -> Expression:
    return call("log", operation("+", x, call("sqrt", operation("-", _square(x), ONE))))


def _area_tanh(x: Expression) -> Expression:
    ratio = operation("/", operation("+", ONE, x), operation("-", ONE, x))
    return operation("/", call("log", ratio), number(2))


def _of_reciprocal(of: Callable[[Expression], Expression]) -> Callable[[Expression], Expression]:
    return lambda x: of(operation("/", ONE, x))


# Inverse functions that the language does not have, by those that it has.
_INVERSES: dict[int, Callable[[Expression], Expression]] = {
    libsbml.AST_FUNCTION_ARCSINH: _area_sinh,
    libsbml.AST_FUNCTION_ARCCOSH: _area_cosh,
    libsbml.AST_FUNCTION_ARCTANH: _area_tanh,
    libsbml.AST_FUNCTION_ARCCSCH: _of_reciprocal(_area_sinh),
    libsbml.AST_FUNCTION_ARCSECH: _of_reciprocal(_area_cosh),
    libsbml.AST_FUNCTION_ARCCOTH: _of_reciprocal(_area_tanh),
    libsbml.AST_FUNCTION_ARCCSC: _of_reciprocal(lambda x: call("asin", x)),
    libsbml.AST_FUNCTION_ARCSEC: _of_reciprocal(lambda x: call("acos", x)),
    libsbml.AST_FUNCTION_ARCCOT: _of_reciprocal(lambda x: call("atan", x)),
}
