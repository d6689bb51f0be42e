"""What `dgd discover` says where terms are missing."""

import json
import re
import tempfile
from pathlib import Path

from terms.score import LIMIT, Answer, error_of_model, scored


def said(case):
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "found"
        case.run("discover", case.model, *case.data(), "--valid", case.valid, "-o", out)
        result = out / "result.json"
        if not result.exists():
            return scored(case, Answer("no answer"))
        return scored(case, answered(case, json.loads(result.read_text()), out))


def answered(case, result, out):
    if result["verdict"] in ("effects", "law"):
        named = result["effects"] if result["verdict"] == "effects" else result["law"]["terms"]
        text = " and ".join(f"{one['target']}: {one['formula']}" if "formula" in one else one["name"]
                            for one in named)
        places = [place for one in named for place in targets(one)]
        return Answer(text, places, True, error_of_model(case, out / case.model.name))
    found = result.get("unexplained") or []
    if not found:
        return Answer(result["verdict"])
    first = found[0]
    return guessed(case, first, out) or Answer(f"unexplained {first['target']}", [first["target"]])


def targets(named):
    """The target, and what a template is applied to: `leak(level)`."""
    return [named["target"], *re.findall(r"\w+", named.get("name", "").partition("(")[2])]


def guessed(case, first, out):
    """The formula at the first place, where it is one of an equation and predicts; else only the place counts."""
    guess, text = first.get("guess"), case.model.read_text()
    line = re.search(rf"^equation {first['target']}: .*$", text, re.MULTILINE)
    if not guess or not line:
        return None
    model = out / "guessed.dgd"
    model.write_text(text.replace(line[0], f"{line[0]} + ({guess['formula']})"))
    off = error_of_model(case, model)
    says = f"{first['target']} guess {guess['formula']}"
    return Answer(says, [first["target"]], True, off) if off < LIMIT else None
