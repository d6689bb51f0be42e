"""Formulas as trees: the names they read, substitution, and their text in the language."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Expression:
    """A number, a name, or an operation.

    ``kind`` is ``"number"``, ``"name"``, an operator as the language writes it, ``"minus"`` for the sign and for what
    is taken away in a sum, ``"if"`` with condition and two values, or ``"call"`` of the function ``name``.
    """

    kind: str
    parts: tuple[Expression, ...] = ()
    name: str = ""
    value: float = 0.0

    def __str__(self) -> str:
        return text(self)

    @property
    def names(self) -> set[str]:
        """All names that it reads, without those of functions."""
        if self.kind == "name":
            return {self.name}
        return set().union(*(part.names for part in self.parts))

    def replaced(self, by: Mapping[str, Expression]) -> Expression:
        """The formula with expressions substituted for names, all at once."""
        if self.kind == "name":
            return by.get(self.name, self)
        if not self.parts:
            return self
        return operation(self.kind, *(part.replaced(by) for part in self.parts), name=self.name)

    def renamed(self, new: Callable[[str], str]) -> Expression:
        """The formula with other names."""
        return self.replaced({old: name(new(old)) for old in self.names})


def number(value: float) -> Expression:
    """A number; one below zero has a sign in front."""
    if value < 0:
        return Expression("minus", (Expression("number", value=-value),))
    return Expression("number", value=float(value))


def name(which: str) -> Expression:
    """A name."""
    return Expression("name", name=which)


def call(function: str, *arguments: Expression) -> Expression:
    """A function of the language."""
    return Expression("call", arguments, function)


ZERO, ONE = number(0), number(1)


def operation(kind: str, *parts: Expression, name: str = "") -> Expression:
    """An operation, without factors of one and terms of zero. Sums and products have any number of parts."""
    if kind == "+":
        return total(list(parts))
    if kind == "*":
        return product(list(parts))
    if kind == "-":
        return total([parts[0], operation("minus", parts[1])])
    if kind == "/" and parts[1] == ONE:
        return parts[0]
    if kind == "minus" and parts[0].kind == "minus":
        return parts[0].parts[0]
    if kind == "minus" and parts[0] == ZERO:
        return ZERO
    return Expression(kind, parts, name)


def total(terms: list[Expression]) -> Expression:
    """The sum of terms, those of sums among them one by one."""
    single = [part for term in terms for part in (term.parts if term.kind == "+" else (term,)) if part != ZERO]
    if len(single) < 2:
        return single[0] if single else ZERO
    return Expression("+", tuple(single))


def product(factors: list[Expression]) -> Expression:
    """The product of factors, those of products among them one by one."""
    single = [part for one in factors for part in (one.parts if one.kind == "*" else (one,)) if part != ONE]
    if ZERO in single:
        return ZERO
    if len(single) < 2:
        return single[0] if single else ONE
    return Expression("*", tuple(single))


# What binds tighter stands higher. A sign goes with the product behind it: `-a*b` is one of either.
_STRENGTH = {
    "if": 0,
    "or": 1,
    "and": 2,
    "not": 3,
    "<": 4,
    "<=": 4,
    ">": 4,
    ">=": 4,
    "+": 5,
    "*": 6,
    "/": 6,
    "minus": 6,
    "^": 8,
    "call": 9,
    "number": 9,
    "name": 9,
}


def text(expression: Expression) -> str:
    """The formula as the language writes it."""
    kind, parts = expression.kind, expression.parts
    own = _STRENGTH[kind]
    if kind == "number":
        return _number(expression.value)
    if kind == "name":
        return expression.name
    if kind == "call":
        return f"{expression.name}({', '.join(map(text, parts))})"
    if kind == "if":
        return f"if {text(parts[0])} then {_within(parts[1], 1)} else {text(parts[2])}"
    if kind == "not":
        return f"not {_within(parts[0], 9)}"
    if kind == "minus":
        return f"-{_within(parts[0], own)}"
    if kind == "^":
        # Read from the right.
        return f"{_within(parts[0], own + 1)}^{_within(parts[1], own)}"
    if kind == "+":
        return _within(parts[0], own) + "".join(map(_term, parts[1:]))
    mark = kind if kind in "*/" else f" {kind} "
    # A condition on the right of one of its kind needs no parentheses.
    rest = [_within(part, own if kind in ("and", "or") and part.kind == kind else own + 1) for part in parts[1:]]
    return mark.join([_within(parts[0], own), *rest])


def _term(part: Expression) -> str:
    """A term that is not the first."""
    if part.kind == "minus":
        return f" - {_within(part.parts[0], _STRENGTH['*'])}"
    return f" + {_within(part, _STRENGTH['*'])}"


def _within(part: Expression, least: int) -> str:
    """A part, in parentheses if it binds less than that."""
    words = text(part)
    return words if _STRENGTH[part.kind] >= least else f"({words})"


def _number(value: float) -> str:
    """The fewest digits that are read back to the same number."""
    if value.is_integer() and value < 1e15:
        return str(int(value))
    return repr(value).replace("e+", "e")
