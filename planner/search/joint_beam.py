"""Joint beam: orders of several UAVs grow side by side, always by a leg of the UAV free first.

A state is where each UAV is free and when, and when each particle is first seen by any of them.
States whose first UAV is free at about the same time compete, as orders of one UAV do in
`planner.search.beam`. The sensor is taken to miss nothing that comes within its radius.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from planner.arrays import Flags, Floats, Ints
from planner.detection.kernels.worth import Goal
from planner.search.beam import RewardToGo, beam_setting, bucket_s
from planner.search.kernels.beam import SAME, BeamSetting, ToGo, promise
from planner.search.kernels.joint_beam import (
    Gains,
    Movers,
    Moves,
    Sighted,
    first_gains,
    onward,
    see_first,
    see_next,
    still_to_earn,
)
from planner.search.problem import Problem, candidate_legs
from planner.search.stop import never
from planner.search.what_if import WhatIf

AT_BASE = -1  # in place of the leg flown last: the UAV has not taken off
RESTS = -1  # in place of a move: the UAV flies no more
DIGITS = 6  # to which states agree that are the same


@dataclass(frozen=True)
class JointBeam:
    """How a joint beam searches."""

    width: int  # states that go on from each stretch of time
    first_width: int  # the same while a UAV is still to take off
    reach_m: float = 0.0  # longest flight to the start of the next road; 0: it starts here


@dataclass(frozen=True, eq=False)
class _States:
    """M states of U UAVs, each one move after its parent."""

    parent: Ints  # (M,) of those that went on; -1: none
    mover: Ints  # (M,) who moved; -1: nobody has
    move: Ints  # (M,) along which of its ways, or which of its first legs, or RESTS
    leg: Ints  # (M, U) that each UAV has flown last, or AT_BASE
    free_s: Floats  # (M, U) when each is free, infinity: it rests
    reward: Floats  # (M,)
    unseen: Floats  # (M,) weight of the particles that nobody sees

    @classmethod
    def at_base(cls, problems: Sequence[Problem], unseen: float) -> "_States":
        """Return the state before the first take-off, alone."""
        none = np.full(1, -1)
        free_s = np.array([[problem.first_state.time_s for problem in problems]])
        leg = np.full(free_s.shape, AT_BASE, dtype=np.int32)
        return cls(none, none, none, leg, free_s, np.zeros(1), np.full(1, unseen))

    def __len__(self) -> int:
        return len(self.parent)

    def those(self, which: Ints | Flags) -> "_States":
        """Return some of the states."""
        return _States(*(column[which] for column in vars(self).values()))

    @property
    def first_free_s(self) -> Floats:
        """When a UAV is free again, (M,) seconds."""
        return np.asarray(self.free_s.min(axis=1))

    @property
    def take_off(self) -> Flags:
        """Where a UAV still has to take off that has not given it up, (M,)."""
        return np.asarray(((self.leg == AT_BASE) & (self.free_s < np.inf)).any(axis=1))


@dataclass(frozen=True, eq=False)
class _Flyer:
    """One UAV: how it can fly on from the end of any leg, and what its first legs see."""

    problem: Problem
    setting: BeamSetting
    first_leg: Ints  # (C,)
    first_end_s: Floats  # (C,) seconds
    first: Sighted

    @classmethod
    def of(cls, problem: Problem, reach_m: float) -> "_Flyer":
        """Return the UAV of a problem."""
        engine, start = WhatIf(problem), problem.first_state
        flown = engine.fly(start, candidate_legs(problem, start))
        sighted = Sighted(flown.first.astype(np.int64), flown.particle, flown.seen_at)
        return cls(problem, beam_setting(engine, reach_m), flown.leg, flown.end_s, sighted)

    @property
    def kind(self) -> tuple[float, ...]:
        """What it can do, which it may share with others: all that matters to a perfect sensor."""
        uav, sensor = self.problem.uav, self.problem.sensor
        home_m = (np.inf, np.inf) if uav.return_to_m is None else uav.return_to_m
        return (uav.speed_mps, uav.landing_s, *home_m, float(sensor.radius_m))

    def moves(self, states: _States, mover: int, seen: Floats, worth: tuple[Floats, Goal]) -> Moves:
        """Return its legs that can follow states; those before its take-off come first."""
        base = np.flatnonzero(states.leg[:, mover] == AT_BASE)
        away = np.flatnonzero(states.leg[:, mover] != AT_BASE)
        many = len(self.first_leg)
        gains = first_gains(self.first, seen[base], *worth)
        first = Moves(
            np.repeat(base, many),
            np.tile(np.arange(many), len(base)),
            np.tile(self.first_leg, len(base)),
            np.tile(self.first_end_s, len(base)),
            gains,
        )
        later = onward(_movers(states.those(away), mover), seen[away], self.setting)
        later = later._replace(state=away[later.state])
        reward, fresh = map(np.concatenate, zip(first.gains, later.gains, strict=True))
        return Moves(
            state=np.concatenate([first.state, later.state]),
            way=np.concatenate([first.way, later.way]),
            leg=np.concatenate([first.leg, later.leg]),
            end_s=np.concatenate([first.end_s, later.end_s]),
            gains=Gains(reward, fresh),
        )

    def seen_after(self, states: _States, mover: int, moves: Ints, seen: Floats) -> Floats:
        """Return when particles are seen once it has flown one leg on from each state, (m, N)."""
        base = states.leg[:, mover] == AT_BASE
        at_base, away = seen[base], seen[~base]
        see_first(moves[base], self.first, at_base)
        see_next(_movers(states.those(~base), mover), moves[~base], away, self.setting)
        after = np.empty_like(seen)
        after[base], after[~base] = at_base, away
        return after


def _movers(states: _States, mover: int) -> Movers:
    return Movers(states.free_s[:, mover].copy(), states.leg[:, mover].copy())


def joint_orders(
    problems: Sequence[Problem],
    beam: JointBeam,
    reward_to_go: RewardToGo,
    *,
    stop: Callable[[], bool] = never,
) -> tuple[list[list[int]], int]:
    """Return the order of legs of each UAV that earn most together, and the work that it took.

    Parameters
    ----------
    problems
        One for each UAV, on the same network, particles and objective.
    stop
        Asked between stretches of time; once it says so, the best orders so far are returned.
    """
    search = _Search(problems, beam, reward_to_go)
    search.grow(stop)
    return search.orders(), search.work


class _Search:
    """A joint beam as it grows: the states that went on, those that wait, and the best one."""

    def __init__(
        self, problems: Sequence[Problem], beam: JointBeam, reward_to_go: RewardToGo
    ) -> None:
        self._beam = beam
        self._to_go = ToGo(reward_to_go.brings, reward_to_go.first_s, reward_to_go.step_s)
        self._flyers = [_Flyer.of(problem, beam.reach_m) for problem in problems]
        kinds = [flyer.kind for flyer in self._flyers]
        self._kind = np.array([kinds.index(kind) for kind in kinds])
        index = self._flyers[0].setting.search_index
        self._weight, self._goal = index.weight, index.goal
        self._ends_s, self._bucket_s = problems[0].objective.ends_s, bucket_s(problems[0])
        start = _States.at_base(problems, float(self._weight.sum()))
        self._begins_s = float(start.free_s.min())
        self._went_on, self._best = start.those(np.zeros(1, dtype=bool)), start
        self._seen: list[Floats] = []  # when each of these sees the particles, (N,) seconds
        stretches = int(max(0.0, self._ends_s - self._begins_s) / self._bucket_s) + 1
        # While the first ones take off, a stretch is a take-off.
        self._waiting: list[list[_States]] = [[] for _ in range(len(problems) + stretches)]
        self._waiting[0].append(start)
        self.work = 0

    def grow(self, stop: Callable[[], bool]) -> None:
        """Let the states of one stretch of time after the other go on."""
        for number, waiting in enumerate(self._waiting):
            if stop():
                break
            if waiting:
                self._go_on(number, self._fittest(_joined(waiting)))
                waiting.clear()

    def orders(self) -> list[list[int]]:
        """Return the legs of each UAV in the best state."""
        orders: list[list[int]] = [[] for _ in self._flyers]
        state, row = self._best, 0
        while (mover := int(state.mover[row])) >= 0:
            if state.move[row] != RESTS:
                orders[mover].append(int(state.leg[row, mover]))
            state, row = self._went_on, int(state.parent[row])
        return [order[::-1] for order in orders]

    def _go_on(self, number: int, states: _States) -> None:
        """Let the UAV that is free first fly on in each of some states."""
        seen = self._seen_after(states)
        most = still_to_earn(states.first_free_s, seen, self._weight, self._goal)
        hopeful = states.reward + most > self._best.reward[0] * (1.0 + SAME)
        states, seen = states.those(hopeful), seen[hopeful]
        before = len(self._went_on)
        self._went_on = _joined([self._went_on, states])
        self._seen += list(seen)
        movers = states.free_s.argmin(axis=1)
        for mover, flyer in enumerate(self._flyers):
            mine = np.flatnonzero(movers == mover)
            if len(mine):
                parents = states.those(mine)
                moves = flyer.moves(parents, mover, seen[mine], (self._weight, self._goal))
                self.work += len(moves.state)
                self._keep(number, _moved(parents, before + mine, mover, moves))

    def _keep(self, number: int, states: _States) -> None:
        """Let states wait in their stretches of time."""
        if len(states) == 0:
            return
        top = int(np.argmax(states.reward))
        if states.reward[top] > self._best.reward[0]:
            self._best = states.those(np.array([top]))
        states = states.those(states.first_free_s < self._ends_s)
        after = ((states.first_free_s - self._begins_s) / self._bucket_s).astype(int)
        stretch = np.maximum(number + 1, len(self._flyers) + after)
        for one in np.unique(stretch).tolist():
            if one < len(self._waiting):
                self._waiting[one].append(states.those(stretch == one))

    def _fittest(self, states: _States) -> _States:
        """Return the most promising states, those that are the same once."""
        free_s = np.minimum(states.free_s, self._ends_s).mean(axis=1)
        rows = zip(free_s, states.reward, states.unseen, strict=True)
        promised = np.array([promise(*row, self._to_go) for row in rows])
        order, keys = np.argsort(-promised, kind="stable"), self._keys(states)
        width = self._beam.first_width if states.take_off.any() else self._beam.width
        kept: dict[bytes, int] = {}
        for i in order.tolist():
            kept.setdefault(keys[i], i)
            if len(kept) == width:
                break
        return states.those(np.array(list(kept.values()), dtype=np.int64))

    def _keys(self, states: _States) -> list[bytes]:
        """Return what states share that are the same but for who of the like is where."""
        to_node = self._flyers[0].setting.legs.to_node
        node = np.where(states.leg == AT_BASE, -1, to_node[states.leg])
        kind = np.broadcast_to(self._kind, node.shape)
        free_s = np.round(states.free_s, DIGITS)
        order = np.lexsort((free_s, node, kind), axis=1)
        where = [np.take_along_axis(column, order, axis=1) for column in (kind, node, free_s)]
        earned = np.round(np.stack([states.reward, states.unseen], axis=1), DIGITS)
        return [row.tobytes() for row in np.hstack([*where, earned])]

    def _seen_after(self, states: _States) -> Floats:
        """Return when states see particles, (m, N) seconds: as their parents, or in their move."""
        if not self._seen:
            return np.full((len(states), len(self._weight)), np.inf, dtype=np.float32)
        seen = np.stack([self._seen[parent] for parent in states.parent.tolist()])
        for mover, flyer in enumerate(self._flyers):
            mine = np.flatnonzero((states.mover == mover) & (states.move != RESTS))
            if len(mine):
                parents = self._went_on.those(states.parent[mine])
                seen[mine] = flyer.seen_after(parents, mover, states.move[mine], seen[mine])
        return seen


def _joined(parts: Sequence[_States]) -> _States:
    columns = zip(*(vars(part).values() for part in parts), strict=True)
    return _States(*map(np.concatenate, columns))


def _moved(parents: _States, index: Ints, mover: int, moves: Moves) -> _States:
    """Return the states after moves of one UAV; a parent without any rests."""
    idle = np.setdiff1d(np.arange(len(parents)), moves.state)
    many, who = len(moves.state), np.concatenate([moves.state, idle])
    after = parents.those(who)
    leg, free_s = after.leg.copy(), after.free_s.copy()
    reward, unseen = after.reward.copy(), after.unseen.copy()
    free_s[many:, mover] = np.inf
    leg[:many, mover], free_s[:many, mover] = moves.leg, moves.end_s
    reward[:many] += moves.gains.reward
    unseen[:many] = np.maximum(0.0, unseen[:many] - moves.gains.fresh)
    move = np.concatenate([moves.way, np.full(len(idle), RESTS, dtype=np.int32)])
    return _States(index[who], np.full(len(who), mover), move, leg, free_s, reward, unseen)
