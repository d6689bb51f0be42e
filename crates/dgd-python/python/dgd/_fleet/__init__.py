"""Work on many wells, as pieces that a cluster computes."""
