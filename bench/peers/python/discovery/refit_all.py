"""Refit the model with each effect of the library in turn, and take the one with the least BIC."""

import math

from bank import Said

# Differences of the criterion above 10 are called very strong evidence (Kass and Raftery, 1995).
STRONG = 10.0


def said(case):
    base = criterion(case)
    with_effect = {name: criterion(case, path) for name, path in case.effects.items()}
    name = min(with_effect, key=with_effect.get, default=None)
    if name is None or not with_effect[name] < base - STRONG:
        return Said(text="nothing", is_right_name=case.kind == "nothing")
    wanted = case.truth.get("effects", [])
    return Said(is_right_name=wanted == [name],
                is_right_place=wanted != [name] and name in wanted,
                is_wrong=name not in wanted,
                text=f"{name} ({with_effect[name] - base:.0f})")


def criterion(case, effect=None):
    """Σ n ln(mean square) over the outputs, and k ln N; infinite where the fit fails."""
    applied = ["--apply", str(effect)] if effect else []
    fit = case.run("fit", case.path("model.dgd"), "--data", case.path("train.csv"), *applied)
    return math.inf if fit is None else of(fit)


def of(fit):
    """The criterion of a fit that dgd has made."""
    qualities = [output["quality"]["train"] for output in fit["outputs"].values()]
    samples = sum(quality["samples"] for quality in qualities)
    estimated = len(fit["parameters"]) + sum(len(start["values"]) for start in fit["starts"])
    return (sum(quality["samples"] * math.log(quality["mse"]) for quality in qualities)
            + estimated * math.log(samples))
