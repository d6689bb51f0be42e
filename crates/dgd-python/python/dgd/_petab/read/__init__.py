"""What a problem says, before anything is made of it."""
