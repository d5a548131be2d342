"""No targets at all: futures for whom only the UAV of a problem matters."""

import numpy as np

from planner.futures.futures import Futures

_NOTHING = np.zeros(0)
NO_TARGETS = Futures(
    time_s=_NOTHING,
    x_m=_NOTHING,
    y_m=_NOTHING,
    first_knot=np.zeros(1, np.int64),
    weight=_NOTHING,
    gone=np.zeros(0, np.bool_),
)
