"""Formulas as trees, read from SBML and PEtab, and written in the language."""
