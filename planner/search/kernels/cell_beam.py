"""A beam of free flights, compiled: states of the same tick compete with each other.

A state is a place and a time to which a chain of straight flights leads, and what they have seen.
From each state that goes on, rays are flown: in evenly spread headings, towards places such as
nodes, and none at all, which is to hover. A ray that is flown once gives a new state at each of
several lengths. States wait in chains by tick; of those about as near to each other as the sensor
reaches only the most promising goes on.
"""

from typing import NamedTuple

import numpy as np

from planner.arrays import Floats, Ints
from planner.detection.kernels.closest_approach import Vector, Window
from planner.detection.kernels.worth import reward_of
from planner.jit import compiled
from planner.search.kernels.beam import pack, unpack, with_a_free_slot
from planner.search.kernels.cell_index import SEEN, CellIndex, Looked, look
from planner.search.kernels.motion import Course
from planner.search.kernels.turning import REST, Turning, corner_loss, direction, ground_speed

PARENT, NEXT, SLOT = 0, 1, 2  # NEXT: in the tick's chain; SLOT: of the unseen's bits
# UNSEEN: weight of the particles not seen; SET_OUT: when the flight to there began, seconds
TIME, X, Y, REWARD, UNSEEN, SET_OUT = 0, 1, 2, 3, 4, 5
FIGURES = 6
KNOWN, SLOTS, BEST, RAYS = 0, 1, 2, 3  # states known, slots used, the best state, rays flown

SAME = 1e-9  # of a reward: less is none
FORGOTTEN = 1e-3  # who is unseen with less than that is not looked for any more


class CellStates(NamedTuple):
    """The states known so far, with room for more: M in all."""

    links: Ints  # (3, M) rows PARENT, NEXT, SLOT; -1: none
    figures: Floats  # (6, M) rows TIME (s), X, Y (m), REWARD, UNSEEN, SET_OUT (s)
    # (S, ceil(N / 8)) bytes: in each slot the unseen particles, one bit each; or, if the sensor may
    # miss, (S, 2 N): how probably each is unseen
    masks: Ints
    heads: Ints  # (T,) the first state of each tick's chain, -1: none
    counts: Ints  # (4,) KNOWN, SLOTS, BEST, RAYS


class Rays(NamedTuple):
    """The rays that are flown from each state."""

    velocity: Floats  # (D, 2) m/s; 0, 0: hovers
    stops: Ints  # (L,) after how many ticks of a ray a state is made, rising
    places: Floats  # (V, 2) metres, flown to as well where a ray of that length leads there
    turning: Turning


class Field(NamedTuple):
    """Where and until when may be flown."""

    low_x_m: float
    low_y_m: float
    high_x_m: float
    high_y_m: float
    home_x_m: float  # where the UAV has to land; infinity: anywhere
    home_y_m: float
    home_mps: float  # over ground on the way there
    homeward_s: float  # and by which its corners delay it
    landing_s: float  # by when it has to land
    ends_s: float  # when sightings cease to count


class Crowd(NamedTuple):
    """Which states of a tick go on."""

    width: int  # at most so many
    apart_m: float  # one in each square of this size
    wide_m: float  # and no more than ``dense`` in each of this one
    dense: int


class Setting(NamedTuple):
    """What a beam moves in."""

    cells: CellIndex
    rays: Rays
    field: Field
    crowd: Crowd


@compiled
def nobody_seen(many: int, may_miss: bool) -> Looked:
    """Return room to note who of so many particles is seen."""
    entries = many if may_miss else 0
    return Looked(
        np.zeros(many, np.int32),
        np.zeros(entries),
        np.zeros(entries),
        np.zeros(entries + 1, np.int64),
    )


@compiled
def pack_unseen(looked: Looked, mask: Ints) -> None:
    """Write into bits, (ceil(N / 8),) bytes, who is not ``SEEN``, (N,); or who is how unseen."""
    seen_in = looked.seen_in
    if len(looked.miss) > 0:
        pack(looked.miss, mask, FORGOTTEN)
        return
    for b in range(len(mask)):
        bits = 0
        for j in range(min(8, len(seen_in) - 8 * b)):
            bits |= (seen_in[8 * b + j] != SEEN) << j
        mask[b] = bits


@compiled
def unpack_unseen(mask: Ints, looked: Looked) -> None:
    """Write 0 for whoever is unseen, at least in part, else ``SEEN``, (N,)."""
    seen_in = looked.seen_in
    if len(looked.miss) > 0:
        unpack(mask, looked.miss)
        for who in range(len(seen_in)):
            seen_in[who] = 0 if looked.miss[who] > 0.0 else SEEN
        return
    for b in range(len(mask)):
        for j in range(min(8, len(seen_in) - 8 * b)):
            seen_in[8 * b + j] = 0 if (mask[b] >> j) & 1 else SEEN


@compiled
def has_room(i: int, kept: Ints, figures: Floats, crowd: Crowd) -> bool:
    """Tell whether a state may go on beside those that do so already."""
    x, y, near = figures[X, i], figures[Y, i], 0
    apart_m, wide_m = crowd.apart_m, crowd.wide_m
    for other in kept:
        u, v = figures[X, other], figures[Y, other]
        near += u // wide_m == x // wide_m and v // wide_m == y // wide_m
        if u // apart_m == x // apart_m and v // apart_m == y // apart_m:
            return False
    return bool(near < crowd.dense)


@compiled
def chosen(tick: int, states: CellStates, crowd: Crowd, brings: float) -> Ints:
    """Return the states of a tick that go on, the most promising first.

    Promise is what a state has earned, and ``brings`` per unit of weight that it has not seen.
    Equal promise is settled by the order in which states came to be.
    """
    links, figures = states.links, states.figures
    many, i = 0, states.heads[tick]
    while i >= 0:
        many += 1
        i = links[NEXT, i]
    mine, lacks = np.empty(many, np.int32), np.empty(many)
    i = states.heads[tick]
    for j in range(many - 1, -1, -1):
        mine[j], lacks[j] = i, -figures[REWARD, i] - brings * figures[UNSEEN, i]
        i = links[NEXT, i]
    kept, count = np.empty(min(crowd.width, many), np.int32), 0
    for j in np.argsort(lacks, kind="mergesort"):
        if count == len(kept):
            break
        if has_room(mine[j], kept[:count], figures, crowd):
            kept[count] = mine[j]
            count += 1
    return kept[:count]


@compiled
def course_between(i: int, to: int, figures: Floats) -> Course:
    """Return the straight flight from one state to another."""
    begin_s = figures[SET_OUT, to]
    lasts_s = figures[TIME, to] - begin_s
    vx, vy = (figures[X, to] - figures[X, i]) / lasts_s, (figures[Y, to] - figures[Y, i]) / lasts_s
    return Course(figures[X, i], figures[Y, i], vx, vy, begin_s)


@compiled
def heading_of(i: int, states: CellStates) -> Vector:
    """Return in which direction a state was flown to; 0, 0 if it hovers, or has not set out."""
    figures, parent = states.figures, states.links[PARENT, i]
    if parent < 0:
        return REST
    return direction(figures[X, i] - figures[X, parent], figures[Y, i] - figures[Y, parent])


@compiled
def note_unseen(i: int, states: CellStates, index: CellIndex, looked: Looked) -> None:
    """Find out whom a state has not seen: its parent's, less those of the flight from there."""
    links, figures, parent = states.links, states.figures, states.links[PARENT, i]
    if parent < 0:
        unpack_unseen(states.masks[links[SLOT, i]], looked)
        return
    unpack_unseen(states.masks[links[SLOT, parent]], looked)
    span = Window(figures[SET_OUT, i], figures[TIME, i])
    course = course_between(parent, i, figures)
    if len(looked.miss) == 0:
        look(course, span, index, looked, int(SEEN))
        return
    look(course, span, index, looked, 1)
    for who in range(len(looked.miss)):
        if looked.seen_in[who] == 1:
            looked.miss[who], looked.seen_in[who] = looked.left[who], 0


@compiled
def with_room(count: int, links: Ints, figures: Floats) -> tuple[Ints, Floats]:
    """Return the same states with room for ``count`` at least."""
    many = links.shape[1]
    if count <= many:
        return links, figures
    more_links = np.full((3, 2 * count), -1, dtype=np.int32)
    more_figures = np.empty((FIGURES, 2 * count))
    more_links[:, :many], more_figures[:, :many] = links, figures
    return more_links, more_figures


@compiled
def is_within(x: float, y: float, moment_s: float, field: Field) -> bool:
    """Tell whether a flight may end at a place and time: it lies in the field, home is in reach."""
    if not (field.low_x_m <= x <= field.high_x_m and field.low_y_m <= y <= field.high_y_m):
        return False
    if moment_s > field.ends_s or moment_s > field.landing_s:
        return False
    if not field.home_x_m < np.inf:
        return True
    dx, dy = field.home_x_m - x, field.home_y_m - y
    flies_s = np.sqrt(dx * dx + dy * dy) / field.home_mps + field.homeward_s
    return bool(moment_s + flies_s <= field.landing_s)


@compiled
def fly_ray(
    course: Course, lasts_s: float, i: int, states: CellStates, looked: Looked, setting: Setting
) -> None:
    """Fly straight on from a state; make a new state after some of the ticks, and at the end."""
    links, figures, _, heads, counts = states
    index, rays = setting.cells, setting.rays
    x, y, vx, vy, begin_s = course
    ticks, number, tick_s = index.ticks, counts[RAYS] + 1, index.ticks.lasts_s
    counts[RAYS] = number
    reward, unseen, stop, done, now_s = figures[REWARD, i], figures[UNSEEN, i], 0, 0, begin_s
    over_s = begin_s + lasts_s
    while now_s < over_s:
        done += 1
        until_s = min(begin_s + done * tick_s, over_s)
        new_x, new_y = x + vx * (until_s - begin_s), y + vy * (until_s - begin_s)
        if not is_within(new_x, new_y, until_s, setting.field):
            break
        gain = look(course, Window(now_s, until_s), index, looked, number)
        reward, unseen, now_s = reward + gain.reward, unseen - gain.weight, until_s
        if done < rays.stops[stop] and until_s < over_s:
            continue
        stop += 1
        new = counts[KNOWN]
        counts[KNOWN] += 1
        links[PARENT, new], links[SLOT, new] = i, -1
        figures[TIME, new], figures[X, new], figures[Y, new] = until_s, new_x, new_y
        figures[REWARD, new], figures[UNSEEN, new] = reward, max(0.0, unseen)
        figures[SET_OUT, new] = begin_s
        at = int((until_s - ticks.begin_s) / tick_s + 1e-6)
        if at < len(heads):
            links[NEXT, new], heads[at] = heads[at], new
        if reward > figures[REWARD, counts[BEST]] * (1.0 + SAME):
            counts[BEST] = new


@compiled
def fly_on(i: int, states: CellStates, looked: Looked, setting: Setting) -> None:
    """Fly all rays from a state.

    A corner delays the flight after it. Who is near meanwhile will be seen as it sets out.
    """
    figures, rays = states.figures, setting.rays
    now_s, x, y = figures[TIME, i], figures[X, i], figures[Y, i]
    heading = heading_of(i, states)
    longest_s = rays.stops[-1] * setting.cells.ticks.lasts_s
    for d in range(len(rays.velocity)):
        vx, vy = rays.velocity[d, 0], rays.velocity[d, 1]
        begin_s = now_s + corner_loss(heading, direction(vx, vy), rays.turning)
        fly_ray(Course(x, y, vx, vy, begin_s), longest_s, i, states, looked, setting)
    for p in range(len(rays.places)):
        dx, dy = rays.places[p, 0] - x, rays.places[p, 1] - y
        way = direction(dx, dy)
        lasts_s = np.sqrt(dx * dx + dy * dy) / ground_speed(way, rays.turning)
        if 1e-6 < lasts_s <= longest_s:
            begin_s = now_s + corner_loss(heading, way, rays.turning)
            course = Course(x, y, dx / lasts_s, dy / lasts_s, begin_s)
            fly_ray(course, lasts_s, i, states, looked, setting)


@compiled
def grow_tick(tick: int, states: CellStates, setting: Setting, brings: float) -> CellStates:
    """Let the chosen states of a tick fly on along all rays; return the states then known.

    ``brings`` is the reward that a unit of unseen weight usually brings from then on.
    """
    links, figures, masks, heads, counts = states
    rays, goal = setting.rays, setting.cells.goal
    most_new = (len(rays.velocity) + len(rays.places)) * (len(rays.stops) + 1)
    looked = nobody_seen(len(setting.cells.weight), setting.cells.rate_per_s < np.inf)
    for i in chosen(tick, states, setting.crowd, brings):
        most = figures[REWARD, i] + figures[UNSEEN, i] * reward_of(figures[TIME, i], goal)
        if most <= figures[REWARD, counts[BEST]] * (1.0 + SAME) and i > 0:
            continue
        now = CellStates(links, figures, masks, heads, counts)
        note_unseen(i, now, setting.cells, looked)
        if links[SLOT, i] < 0:
            masks = with_a_free_slot(masks, counts[SLOTS])
            links[SLOT, i] = counts[SLOTS]
            pack_unseen(looked, masks[counts[SLOTS]])
            counts[SLOTS] += 1
        links, figures = with_room(counts[KNOWN] + most_new, links, figures)
        fly_on(i, CellStates(links, figures, masks, heads, counts), looked, setting)
    return CellStates(links, figures, masks, heads, counts)
