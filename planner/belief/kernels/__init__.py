"""Compiled code: the only place where numba is used, through `planner.jit`."""
