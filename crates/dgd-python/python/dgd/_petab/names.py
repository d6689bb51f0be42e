"""Names that the language takes."""

from __future__ import annotations

#: Names of the language itself, which a problem may use for something else.
CLOCK, PI = "time of the run", "ratio of the circle"

# Words of the language, its names, and its functions, which a name in front of a parenthesis would hide.
_TAKEN = frozenset(
    "and or not if then else delay der time pi sqrt exp log log10 sin cos tan asin acos atan atan2 sinh cosh tanh abs "
    "sign min max complementary clamp floor ceil round mod hypot smoothstep erf erfc lgamma polygamma".split()
)


class Names:
    """Gives everything a unique name: its own, if the language accepts that."""

    def __init__(self) -> None:
        self._said = {CLOCK: "time", PI: "pi"}
        self._taken = set(_TAKEN)

    def of(self, which: str) -> str:
        """The name in the language for a name of the problem."""
        if which not in self._said:
            self._said[which] = self.fresh(which)
        return self._said[which]

    def fresh(self, wanted: str) -> str:
        """An unused name that is as close to this as possible; names of the problem count as used."""
        found = wanted if wanted[:1].isalpha() else f"x{wanted}"
        while found in self._taken:
            found += "_"
        self._taken.add(found)
        self._said.setdefault(found, found)
        return found
