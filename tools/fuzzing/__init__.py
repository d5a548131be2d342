"""The parts of fuzz.py: changed files, what is done with them, and the child it is done in."""
