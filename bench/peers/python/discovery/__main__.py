"""Tools that look for a missing effect, on the same cases: dgd, PySINDy, and refits with the least BIC.

    python bench/peers/python/discovery DGD CASES [--tools …] [--kinds …] [--cases PATTERN] [--out DIR]

DGD is the program, CASES a folder that `discovery_bank --write` or `problems` has made. The table goes to the
standard output, a line for each case to the standard error. With --out each line is kept there, and what is
kept is not run again.
"""

import argparse
import importlib
import json
import resource
import statistics
import sys
import time
from dataclasses import asdict
from pathlib import Path

import bank
import terms.case

#: Each tool with its module.
TOOLS = {"dgd discover": "own", "PySINDy": "sindy", "refit-all, BIC": "refit_all"}
CASES = {kind: bank.Case for kind in bank.KINDS} | {kind: terms.case.Case for kind in terms.case.KINDS}


def said_by(tool, case):
    """The answer, with the seconds that a processor needed for it: no load of the machine is in them."""
    said = importlib.import_module(case.package + TOOLS[tool]).said
    begin = processor()
    says = said(case)
    says.seconds = processor() - begin
    return says


def processor():
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def main():
    parser = argparse.ArgumentParser(prog="discovery")
    parser.add_argument("dgd")
    parser.add_argument("cases_folder", metavar="cases", type=Path)
    parser.add_argument("--tools", nargs="+", default=list(TOOLS), choices=TOOLS)
    parser.add_argument("--kinds", nargs="+", default=list(CASES), choices=CASES)
    parser.add_argument("--cases", default="*")
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    rows = []
    for tool in asked.tools:
        answers = [(case.kind, kept(tool, case, asked.out)) for case in cases(asked)]
        rows += [row(tool, kind, [says for of, says in answers if of == kind]) for kind in asked.kinds]
    print("| | | cases | right name | right place only | wrong | none | median seconds | longest |")
    print("|---|---|---|---|---|---|---|---|---|")
    print("\n".join(filter(None, rows)))


def cases(asked):
    """All cases of these kinds; twins are left out."""
    for folder in sorted(asked.cases_folder.glob(asked.cases)):
        kind = json.loads((folder / "truth.json").read_text())["kind"] if folder.is_dir() else None
        if kind in asked.kinds:
            yield CASES[kind](folder, asked.dgd)


def kept(tool, case, out):
    path = out and out / tool.split(",")[0].replace(" ", "_") / f"{case.name}.said.json"
    if path and path.exists():
        return bank.Said(**json.loads(path.read_text()))
    says = said_by(tool, case)
    marks = [(says.is_right_name, "name"), (says.is_right_place, "place"), (says.is_wrong, "WRONG")]
    mark = next((word for holds, word in marks if holds), "-")
    line = f"{tool:15} {case.name:45} {mark:6} {says.seconds:6.1f} s  {says.text}"
    print(line, file=sys.stderr, flush=True)
    if path:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(says), indent=1) + "\n")
    return says


def row(tool, kind, answers):
    if not answers:
        return ""
    seconds = [says.seconds for says in answers]
    count = lambda mark: sum(getattr(says, mark) for says in answers)
    placed = "" if kind == "nothing" else count("is_right_place")
    is_none = lambda says: not (says.is_right_name or says.is_right_place or says.is_wrong)
    cells = [tool, kind, len(answers), count("is_right_name"), placed, count("is_wrong"),
             sum(map(is_none, answers)), f"{statistics.median(seconds):.1f}", f"{max(seconds):.1f}"]
    return f"| {' | '.join(map(str, cells))} |"


if __name__ == "__main__":
    main()
