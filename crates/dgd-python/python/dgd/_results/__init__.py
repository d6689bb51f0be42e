"""Results of each piece of work."""
