"""The cell magic ``%%dgd``: a cell is a model."""

from __future__ import annotations

import shlex
from typing import Any

from .._errors import DgdError, UsageError
from .._model.model import Model, parse

_HELP = "write `%%dgd NAME`, and behind it `variant=CHOICE` for each variant, as in `%%dgd m flow=static`"


def register(ipython: Any) -> None:
    """Gives a notebook the magic."""

    def dgd(line: str, cell: str) -> Model | None:
        words = shlex.split(line)
        name = words[0] if words and "=" not in words[0] else None
        choices = words if name is None else words[1:]
        if not all("=" in choice for choice in choices) or (name is not None and not name.isidentifier()):
            raise UsageError(_HELP)
        variant = dict(choice.split("=", 1) for choice in choices)
        try:
            model = parse(cell, variant=variant)
        except DgdError as error:
            # The message has the place in the cell; the way to it through Python says nothing.
            ipython.write_err(f"{error}\n") if hasattr(ipython, "write_err") else print(error)
            return None
        ipython.user_ns[name or "model"] = model
        return model

    dgd.__doc__ = f"Compiles the cell as a model and assigns it: {_HELP}."
    ipython.register_magic_function(dgd, magic_kind="cell", magic_name="dgd")
