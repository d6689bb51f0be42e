"""What `dgd discover` says, by the rules of `bench/discovery_bank/score.rs`."""

from bank import Said

# So many alternatives beside a name, and so many of the first descriptions count.
MOST_ALTERNATIVES, MOST_DESCRIPTIONS = 2, 3
SYNONYMS = [
    {"viscous_drag", "viscous_friction", "leak", "linear_loss"},
    {"quadratic_drag", "power_loss", "quadratic_loss"},
    {"dry_friction", "coulomb_friction"},
    {"unmeasured_flow", "step_disturbance", "constant_disturbance"},
    {"cubic_stiffness", "cubic_spring", "cubic_loss"},
    {"backlash", "play", "dead_zone"},
    {"input_delay", "delayed_input"},
    {"input_saturation", "input_limit"},
    {"rate_limit", "input_rate_limit"},
    {"dead_band", "input_dead_band"},
    {"periodic_disturbance", "sine_disturbance", "oscillation"},
]


def said(case):
    answer = case.run("discover", case.path("model.dgd"), "--data", case.path("train.csv"),
                      "--valid", case.path("valid.csv"))
    return scored(case, answer or {"verdict": "error"})


def scored(case, answer):
    named = [[read(effect), *map(read, effect.get("alternatives") or [])]
             for effect in answer.get("effects") or []]
    unexplained = answer.get("unexplained") or []
    described = [*(answer.get("described") or []),
                 *(entry for place in unexplained for entry in place.get("described") or [])]
    described = list(map(read, described))
    firsts = [plain(place["target"]) for k, place in enumerate(unexplained)
              if k == 0 or all(other.get("tied") for other in unexplained[1:k + 1])]
    says = Said(text=" + ".join(effect[0][0] + str(effect[0][1] or "") for effect in named)
                or f"{answer['verdict']} {firsts[0] if firsts else ''}".strip())
    score = {"nothing": of_nothing, "library": of_library, "template": of_template,
             "parameter": of_parameter}[case.kind]
    says.is_right_name, says.is_right_place, says.is_wrong = score(case, answer, named, described, firsts)
    return says


def of_nothing(case, answer, named, described, firsts):
    return answer["verdict"] == "sufficient", False, bool(named)


def of_library(case, answer, named, described, firsts):
    wanted = sorted(case.truth["effects"])
    names = sorted(first[0][0] for first in named)
    is_in = all(any(len(few) <= 1 + MOST_ALTERNATIVES and want in [name for name, _ in few]
                    for few in named) for want in wanted)
    if names == wanted or (len(names) == len(wanted) and is_in):
        return True, False, False
    is_described = not names and all(want in [name for name, _ in described] for want in wanted)
    return False, is_described, not all(name in wanted for name in names)


def of_template(case, answer, named, described, firsts):
    accepted = list(map(read, case.truth["accepted"]))
    if len(named) == 1:
        few = named[0] if len(named[0]) <= 1 + MOST_ALTERNATIVES else named[0][:1]
        if any(is_one_of(name, accepted) for name in few):
            return True, False, False
    is_described = any(is_one_of(name, accepted) for name in described[:MOST_DESCRIPTIONS])
    is_placed = not named and any(place in targets for place in firsts for _, targets in accepted)
    is_wrong = not all(is_one_of(few[0], accepted) for few in named)
    return False, is_described or is_placed, is_wrong


def of_parameter(case, answer, named, described, firsts):
    parameter, places = case.truth["parameter"], list(map(read, case.truth["places"]))
    is_change = lambda name: name[0].startswith("parameter") and parameter in name[1]
    is_right = lambda name: is_change(name) or is_one_of(name, places)
    are_right = [is_right(few[0]) for few in named]
    if named and all(are_right):
        return True, False, False
    is_placed = (parameter in firsts or any(place in case.truth["places"] for place in firsts)
                 or any(map(is_change, described[:MOST_DESCRIPTIONS])))
    return False, is_placed, not all(are_right)


def read(entry):
    """A name without its form, and what it is applied to."""
    text = entry if isinstance(entry, str) else entry["name"]
    name, _, targets = text.partition("(")
    targets = [plain(target) for target in targets.rstrip(") ").split(",") if target.strip()]
    if not targets and not isinstance(entry, str) and entry.get("target"):
        targets = [plain(entry["target"])]
    return name.split("/")[0].strip(), targets


def plain(place):
    return place.strip().removeprefix("sensor ")


def is_one_of(name, accepted):
    are_alike = lambda a, b: a == b or any(a in names and b in names for names in SYNONYMS)
    return any(are_alike(name[0], other[0]) and set(other[1]) <= set(name[1]) for other in accepted)
