"""Models: what they declare, and what can be asked of them."""
