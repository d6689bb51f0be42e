"""PEtab problems as models and recordings."""
