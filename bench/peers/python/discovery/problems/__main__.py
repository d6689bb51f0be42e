"""Problems of others, each with terms that its model lacks: a folder for each case, as the peers read it.

    python bench/peers/python/discovery/problems OUT [--seed 1] [--each 20] [--kinds …]

ODEBench with terms removed, SciML's two showcases, and buildings with a term in one regime. The same seed
gives the same cases. --each is the number of cases of each kind of ODEBench.
"""

import argparse
from pathlib import Path

import buildings
import removed
import showcases

KINDS = {
    "one term": removed.one_term,
    "two terms": removed.two_terms,
    "half measured": removed.half_measured,
    "showcase": showcases.problems,
    "regime": buildings.problems,
}


def main():
    parser = argparse.ArgumentParser(prog="problems")
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--each", type=int, default=20)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    asked = parser.parse_args()
    for kind in asked.kinds:
        number = 0
        for problem in KINDS[kind](asked.seed, asked.each):
            problem.write(asked.out, kind)
            number += 1
        print(f"{kind}: {number} cases")


if __name__ == "__main__":
    main()
