"""Tools that look for a missing effect, on the same cases: dgd, PySINDy, and refits with the least BIC.

    python benches/peers/python/discovery DGD BANK [--tools …] [--kinds …] [--cases PATTERN] [--out DIR]

DGD is the program, BANK a folder that `discovery_bank --write` has made. The table goes to the standard
output, a line for each case to the standard error. With --out each line is kept there, and what is kept is
not run again.
"""

import argparse
import json
import resource
import statistics
import sys
import time
from dataclasses import asdict
from pathlib import Path

import bank

TOOLS = ("dgd discover", "PySINDy", "refit-all, BIC")


def said_by(tool, case):
    """The answer, with the seconds that a processor needed for it: no load of the machine is in them."""
    if tool == "PySINDy":
        from sindy import said
    elif tool == "dgd discover":
        from own import said
    else:
        from refit_all import said
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
    parser.add_argument("bank")
    parser.add_argument("--tools", nargs="+", default=TOOLS, choices=TOOLS)
    parser.add_argument("--kinds", nargs="+", default=bank.KINDS, choices=bank.KINDS)
    parser.add_argument("--cases", default="*")
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    rows = []
    for tool in asked.tools:
        cases = bank.cases(asked.bank, asked.dgd, asked.cases, asked.kinds)
        answers = [(case.kind, kept(tool, case, asked.out)) for case in cases]
        rows += [row(tool, kind, [says for of, says in answers if of == kind]) for kind in asked.kinds]
    print("| | | cases | right name | right place only | wrong | median seconds | longest |")
    print("|---|---|---|---|---|---|---|---|")
    print("\n".join(filter(None, rows)))


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
    cells = [tool, kind, len(answers), count("is_right_name"), placed, count("is_wrong"),
             f"{statistics.median(seconds):.1f}", f"{max(seconds):.1f}"]
    return f"| {' | '.join(map(str, cells))} |"


if __name__ == "__main__":
    main()
