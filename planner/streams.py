"""One seed at the door; from it, random streams by name.

A stream depends on the seed and its own name alone. Adding a method or a target shifts nobody
else's draws, and a planner cannot meet the truth's stream unless it asks for it by name.
"""

import hashlib

import numpy as np

from planner.checked import whole


def stream(seed: int, *name: str | int) -> np.random.Generator:
    """Return the random stream that belongs to ``name`` under ``seed``.

    Parameters
    ----------
    seed
        The scenario's seed, zero or greater.
    name
        Words and numbers that name the use, such as ``"truth", 3``.

    Raises
    ------
    InputError
        If the seed is no whole number from 0 on, or a name holds anything else.
    """
    seed = whole("seed", seed)
    # NumPy's scalars stand for what they hold: it is the text of a name that makes its stream.
    name = tuple(str(one) if isinstance(one, str) else whole("name", one) for one in name)
    digest = hashlib.sha256("\x1f".join(map(repr, name)).encode()).digest()
    key = tuple(int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4))
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
