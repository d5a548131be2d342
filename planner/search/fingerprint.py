"""A digest of all that a plan or a problem holds: whether two are the same, bit for bit."""

import dataclasses
import hashlib
from collections.abc import Iterator

import numpy as np


def fingerprint(thing: object) -> str:
    """Return the SHA-256 of all that a plan or a problem holds."""
    return hashlib.sha256(b"\x00".join(_bytes(thing))).hexdigest()


def _bytes(thing: object) -> Iterator[bytes]:
    if isinstance(thing, np.ndarray):
        yield repr((thing.dtype, thing.shape)).encode() + thing.tobytes()
    elif dataclasses.is_dataclass(thing):
        for one in dataclasses.fields(thing):
            yield from _bytes(getattr(thing, one.name))
    elif isinstance(thing, tuple):
        for part in thing:
            yield from _bytes(part)
    else:
        yield repr(thing).encode()
