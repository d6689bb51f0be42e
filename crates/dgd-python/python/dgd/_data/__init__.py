"""Recordings in: frames, arrays, dictionaries and files to columns of numbers with units and times."""
