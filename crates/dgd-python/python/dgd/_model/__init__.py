"""Models: their declarations and methods."""
