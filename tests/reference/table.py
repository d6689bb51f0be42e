"""Columns with units: reading recordings and writing reference solutions."""

import csv
from pathlib import Path

HERE = Path(__file__).parent


def read(path):
    """Header and rows of numbers of a CSV file; lines that begin with # are comments."""
    with open(path, newline="") as file:
        lines = list(csv.reader(line for line in file if not line.startswith("#")))
    return lines[0], [[float(x) for x in line] for line in lines[1:]]


def write(name, comments, header, rows):
    """Writes `name` beside this script, every number with the digits that give it back exactly."""
    with open(HERE / name, "w", newline="\n") as file:
        for comment in comments:
            file.write(f"# {comment}\n")
        file.write(",".join(header) + "\n")
        for row in rows:
            file.write(",".join(repr(float(x)).removesuffix(".0") for x in row) + "\n")


def sensitivity_header(unknowns, parameters):
    """`d(h)/d(c0) [m/m]` for every pair, the unknown outside; both are lists of (name, unit)."""

    def group(unit):
        return f"({unit})" if any(x in unit for x in "*/") else unit

    return [f"d({y})/d({p}) [{a}/{group(b)}]" for y, a in unknowns for p, b in parameters]


def largest_difference(rows, others):
    """Largest difference of each column over the column's largest value; the worst one."""
    worst = 0.0
    for column, other in zip(zip(*rows), zip(*others)):
        size = max(abs(float(x)) for x in column) or 1.0
        worst = max(worst, max(abs(float(x) - float(y)) for x, y in zip(column, other)) / size)
    return worst
