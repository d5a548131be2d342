"""The best flight from cell to cell at given prices, compiled: one dynamic programme over time.

A flight is in one cell of a square lattice at the middle of each tick, and in the same one or one
of the eight around it at the middle of the next. The steps to them are numbered from 0 to 8; the
fourth is none.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.jit import compiled

STEPS = 9
ENDS = -1  # the flight goes on to no cell


class Contacts(NamedTuple):
    """What may be seen of particles in each tick, (N, ticks)."""

    x_m: Floats  # at the middle of the tick, from a corner of the lattice
    y_m: Floats
    reach_m: Floats  # who is in a cell farther away than this cannot see it; below 0: nobody can
    reward: Floats  # of a sighting, times the particle's weight; never rising


class Lattice(NamedTuple):
    """Cells, and from when on the UAV may be in them."""

    side_m: float
    first_tick: Ints  # (columns, rows)


class Place(NamedTuple):
    """A cell and a tick."""

    tick: int
    column: int
    row: int


@compiled
def may_see(contacts: Contacts, k: int, side_m: float, at: Place) -> bool:
    """Return whether a UAV that is in a cell in the middle of a tick may see a particle in it."""
    reach_m = contacts.reach_m[k, at.tick]
    x_m = contacts.x_m[k, at.tick] - at.column * side_m
    y_m = contacts.y_m[k, at.tick] - at.row * side_m
    dx, dy = max(0.0, -x_m, x_m - side_m), max(0.0, -y_m, y_m - side_m)
    return bool(reach_m >= 0.0 and dx * dx + dy * dy <= reach_m * reach_m)


@compiled
def fill_gains(contacts: Contacts, side_m: float, prices: Floats, i: int, gains: Floats) -> None:
    """Fill what being in a cell in a tick earns above prices, by the step that led there.

    A particle that may have been seen from the cell before is left out. The last row, at
    ``STEPS``, is for flights that begin there: ``gains`` is (``STEPS`` + 1, columns, rows).
    """
    gains[:] = 0.0
    columns, rows = gains.shape[1:]
    for k in range(len(prices)):
        gain, reach_m = contacts.reward[k, i] - prices[k], contacts.reach_m[k, i]
        if gain <= 0.0 or reach_m < 0.0:
            continue
        x, y = contacts.x_m[k, i] / side_m, contacts.y_m[k, i] / side_m
        wide = reach_m / side_m
        for column in range(max(0, int(x - wide)), min(columns - 1, int(x + wide)) + 1):
            for row in range(max(0, int(y - wide)), min(rows - 1, int(y + wide)) + 1):
                if not may_see(contacts, k, side_m, Place(i, column, row)):
                    continue
                gains[STEPS, column, row] += gain
                for step in range(STEPS if i > 0 else 0):
                    before = Place(i - 1, column + 1 - step // 3, row + 1 - step % 3)
                    if not may_see(contacts, k, side_m, before):
                        gains[step, column, row] += gain


@compiled
def best_flight(
    contacts: Contacts, lattice: Lattice, prices: Floats, steps: Ints, counts: Floats
) -> float:
    """Return the most that a flight earns above prices.

    Parameters
    ----------
    steps
        Is filled with how the best flight goes on from each cell, (ticks, columns, rows).
    counts
        Is filled with how often the best flight earns more than each price, (N,).
    """
    first_tick, side_m = lattice.first_tick, lattice.side_m
    columns, rows = first_tick.shape
    gains = np.empty((STEPS + 1, columns, rows))
    here, there = np.zeros((columns, rows)), np.zeros((columns, rows))
    most, begins, steps[-1] = 0.0, Place(len(steps), 0, 0), ENDS
    for i in range(len(steps) - 1, -1, -1):
        fill_gains(contacts, side_m, prices, i, gains)
        for column in range(columns):
            for row in range(rows):
                value = here[column, row] + gains[STEPS, column, row]
                if first_tick[column, row] == i and value > most:
                    most, begins = value, Place(i, column, row)
        if i > 0:
            go_on(lattice.first_tick, i, gains, here, there, steps[i - 1])
        here, there = there, here
    count_sold(contacts, side_m, prices, steps, begins, counts)
    return most


@compiled
def go_on(
    first_tick: Ints, i: int, gains: Floats, value: Floats, before: Floats, steps: Ints
) -> None:
    """Fill ``before`` and ``steps``: what flights earn that go on into a tick, and where they go.

    Parameters
    ----------
    value
        What flights earn after the tick from each cell, (columns, rows).
    """
    columns, rows = first_tick.shape
    for column in range(columns):
        for row in range(rows):
            before[column, row], steps[column, row] = 0.0, ENDS
            for to_column in range(max(0, column - 1), min(columns, column + 2)):
                for to_row in range(max(0, row - 1), min(rows, row + 2)):
                    step = 3 * (to_column - column + 1) + to_row - row + 1
                    then = gains[step, to_column, to_row] + value[to_column, to_row]
                    if then > before[column, row] and first_tick[to_column, to_row] <= i:
                        before[column, row], steps[column, row] = then, step


@compiled
def count_sold(
    contacts: Contacts, side_m: float, prices: Floats, steps: Ints, begins: Place, counts: Floats
) -> None:
    """Fill ``counts`` (N,) with how often a flight earns more than each price."""
    counts[:] = 0.0
    at, before, is_first = begins, begins, True
    while at.tick < len(steps):
        for k in range(len(prices)):
            is_sold = contacts.reward[k, at.tick] > prices[k] and may_see(contacts, k, side_m, at)
            if is_sold and (is_first or not may_see(contacts, k, side_m, before)):
                counts[k] += 1.0
        step = steps[at.tick, at.column, at.row]
        if step == ENDS:
            break
        before, is_first = at, False
        at = Place(at.tick + 1, at.column + step // 3 - 1, at.row + step % 3 - 1)
