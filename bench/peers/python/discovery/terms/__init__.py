"""Problems in which terms of equations are missing: their cases, the tools on them, and their score."""
