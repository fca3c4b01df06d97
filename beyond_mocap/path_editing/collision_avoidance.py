"""Collision avoidance: bodies on several paths wait a little at their start, or take a detour around each other.

A change costs seconds of waiting and metres to the side. The search takes the earliest collision and tries every remedy
that one of the two bodies (or both, each by half, as people do who meet head on) could apply, by the smallest amount
that resolves it (`remedies`). The few best sets of changes are kept and continued until none has a collision left that
can be resolved. Finally every change is reduced as much as the others allow. All of it is arithmetic on the same
numbers in the same order: the same bodies get the same changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .collisions import Collision, find_collisions, find_collisions_at
from .detour import Follower, PathChange
from .remedies import Limits, RemedySearch

_RATE, _FINER = 25.0, 3  # samples per second of the search; factor on it for the final check
_BEAM_WIDTHS, _MANY_COLLISIONS = (4, 2), 8  # sets of changes kept; the second number from so many collisions on
_BIN, _LAG = 0.5, 0.5  # seconds: bins of the first test of who can meet; delay that detours can cause
_UNRESOLVED_COST = 10.0  # cost of an unresolved collision
_SHARES = (0.0, 0.5, 0.75, 0.9)  # of a change, tried when changes are reduced
_PATIENCE = 3.0  # remedies are searched for at most this many times the initial collisions
_ROUNDS = 2  # rounds of the whole search while collisions are left; each starts from the last result


@dataclass(frozen=True)
class Resolution:
    """The result of collision avoidance.

    Attributes:
        changes: one for each follower.
        before: the initial collisions.
        unresolved: collisions that remain within the limits, with the numbers of the changed bodies.
    """

    changes: tuple[PathChange, ...]
    before: tuple[Collision, ...]
    unresolved: tuple[Collision, ...]


@dataclass(frozen=True)
class _State:
    """A set of changes, the collisions that it leaves, and those of them without a remedy."""

    changes: tuple[PathChange, ...]
    collisions: tuple[Collision, ...]
    unsolvable: frozenset = frozenset()

    def find_open_collision(self):
        """Find the earliest collision still to be resolved, or None."""
        return next((candidate for candidate in self.collisions if self.build_key(candidate) not in self.unsolvable),
                    None)

    def build_key(self, collision):
        """Build a key of a collision and the changes of both bodies: equal as long as the search for remedies would
        be.
        """
        first, second = collision.first, collision.second
        return first, second, self.changes[first], self.changes[second], round(collision.time, 1)


def resolve_collisions(followers: list[Follower], limits: Limits = Limits(), changes=None) -> Resolution:
    """Find the changes that keep these bodies apart, with the lowest total cost.

    Args:
        followers: the bodies; those without a path stay as they are, and collisions among them alone are ignored.
        limits: limits and costs.
        changes: one `PathChange` for each body that must hold at least; None for none.
    Returns:
        The changes, the initial and the unresolved collisions.
    """
    search = _Search(followers, limits)
    state = search.build_start(tuple(changes or (PathChange(),) * len(followers)))
    before = state.collisions
    search.patience = int(_PATIENCE * len(before)) + 20
    for _ in range(_ROUNDS):
        state = search.reduce_changes(_search_best_state(search, replace(state, unsolvable=frozenset())))
        if not state.collisions:
            break
    return Resolution(state.changes, before, search.find_unresolved(state.changes))


def _search_best_state(search: "_Search", state: "_State") -> "_State":
    """Find the best state reachable from this one, by a beam search."""
    states, rounds = [state], int(_PATIENCE * len(state.collisions)) + 20
    beam_width = _BEAM_WIDTHS[len(state.collisions) >= _MANY_COLLISIONS]
    for _ in range(rounds):
        if states[0].find_open_collision() is None:
            break
        found = {child.changes: child for state in states for child in search.build_children(state)}
        states = sorted(found.values(), key=search.compute_score)[:beam_width]
    return states[0]


class _Search:
    """The bodies on one clock, with caches of all that is tried."""

    def __init__(self, followers, limits):
        self.followers, self.limits = followers, limits
        begin = min(follower.times[0] for follower in followers)
        end = max(follower.times[-1] for follower in followers) + limits.delay
        self.clock = np.linspace(begin, end, max(int(np.ceil((end - begin) * _RATE)), 1) + 1)
        self.remedies = RemedySearch(followers, limits, self.clock)
        self.places, self.remedies_found, self.collision_cache = {}, {}, {}
        self.patience = 0  # limit of collisions for which remedies are searched
        self.possible_meetings = _find_possible_meetings(self)

    def build_start(self, changes) -> _State:
        """Build the first state."""
        everyone = tuple(range(len(changes)))
        return _State(changes, self.update_collisions(changes, (), everyone))

    def compute_track(self, who, change):
        """Compute the places (T, 3) m of a changed body on the clock."""
        if (who, change) not in self.places:
            self.places[who, change] = self.followers[who].at(self.clock, change)
        return self.places[who, change]

    def update_collisions(self, changes, collisions, changed):
        """Update the collisions, by time, for bodies whose changes are new.

        Args:
            changes: one `PathChange` for each body.
            collisions: those before the changes.
            changed: numbers of the bodies whose changes are new.
        Returns:
            The collisions that are left.
        """
        found = [collision for collision in collisions if not {collision.first, collision.second} & set(changed)]
        for rank, who in enumerate(changed):
            found += self.find_body_collisions(who, changes, changed[:rank])
        return tuple(sorted(found, key=lambda collision: (collision.start, collision.first, collision.second)))

    def find_unresolved(self, changes):
        """Find the collisions that changes leave, at a higher rate than the search's."""
        times = np.linspace(self.clock[0], self.clock[-1], _FINER * (len(self.clock) - 1) + 1)
        places = np.stack([follower.at(times, change) for follower, change in zip(self.followers, changes)])
        fixed = [follower.path is None for follower in self.followers]
        found = find_collisions(times, places, self.limits.distance, self.limits.height)
        return tuple(collision for collision in found if not (fixed[collision.first] and fixed[collision.second]))

    def find_body_collisions(self, who, changes, without):
        """Find the collisions of one body, except those with the bodies `without`.

        Args:
            who: number of the body.
            changes: one `PathChange` for each body.
            without: numbers of the bodies to ignore.
        """
        known = self.collision_cache.setdefault((who, changes[who]), {})
        others = [other for other in self.possible_meetings[who] if other not in without]
        new = [other for other in others if (other, changes[other]) not in known]
        if new:
            rows = np.repeat(np.arange(1, len(new) + 1), [len(self.possible_meetings[who][other]) for other in new])
            steps = np.concatenate([self.possible_meetings[who][other] for other in new])
            tracks = np.stack([self.compute_track(body, changes[body]) for body in (who, *new)])
            hits = find_collisions_at(0, rows, steps, times=self.clock, places=tracks,
                                      distance=self.remedies.required_gap, height=self.limits.height)
            for row, other in enumerate(new, start=1):
                pair = {"first": min(who, other), "second": max(who, other)}
                known[other, changes[other]] = [replace(hit, **pair) for hit in hits if hit.second == row]
        return [hit for other in others for hit in known[other, changes[other]]]

    def compute_score(self, state):
        """Compute the cost of a state, with a lower bound for the cost of its collisions; ties: fewer collisions."""
        to_come = sum(_UNRESOLVED_COST if state.build_key(collision) in state.unsolvable
                      else self.remedies.estimate_cost(collision) for collision in state.collisions)
        changes_cost = sum(map(self.remedies.compute_cost, range(len(state.changes)), state.changes))
        return changes_cost + to_come, len(state.collisions)

    def build_children(self, state):
        """Build the states after each remedy for the earliest collision; the state itself if none is open."""
        collision = state.find_open_collision()
        if collision is None:
            return [state]
        key, children = state.build_key(collision), []
        if key not in self.remedies_found:
            may_search = len(self.remedies_found) < self.patience
            self.remedies_found[key] = self.remedies.list_remedies(state.changes, collision) if may_search else []
        for changed in self.remedies_found[key]:
            changes = list(state.changes)
            for who, change in changed.items():
                changes[who] = change
            left = self.update_collisions(tuple(changes), state.collisions, tuple(changed))
            children.append(_State(tuple(changes), left, state.unsolvable))
        return children or [replace(state, unsolvable=state.unsolvable | {key})]

    def reduce_changes(self, state):
        """Reduce each change as much as the others allow: drop it, or scale it."""
        for who, change in enumerate(state.changes):
            for part in sorted({(width, offset) for _, width, offset in change.detours}, key=str):
                state = self.reduce_part(state, who, lambda now, share, part=part: _scale_detours(now, part, share))
            if state.changes[who].delay:
                state = self.reduce_part(state, who, lambda now, share: replace(now, delay=round(now.delay * share, 4)))
        return state

    def reduce_part(self, state, who, shared):
        """Choose the smallest share of a part of one body's change that adds no collision.

        Args:
            state: the changes so far.
            who: number of the body.
            shared: maps its change and a share to the reduced change.
        Returns:
            The state with the reduced change, or the same state.
        """
        for share in _SHARES:
            changes = list(state.changes)
            changes[who] = shared(state.changes[who], share)
            left = self.update_collisions(tuple(changes), state.collisions, (who,))
            tried = replace(state, changes=tuple(changes), collisions=left)
            if _rate_collisions(tried) <= _rate_collisions(state) and self.remedies.is_possible(who, changes[who]):
                return tried
        return state


def _scale_detours(change, part, share):
    """Scale those detours of a change that have this (width, offset)."""
    scaled = [(middle, width, round(offset * share, 4) if (width, offset) == part else offset)
              for middle, width, offset in change.detours]
    return replace(change, detours=tuple(detour for detour in scaled if detour[2] != 0.0))


def _rate_collisions(state):
    """Count the collisions of a state, with their depth for ties."""
    return len(state.collisions), -round(sum(collision.gap for collision in state.collisions), 6)


def _find_possible_meetings(search):
    """Find, for each body, the others that changes within the limits could bring close.

    Returns for each body the others with the steps (M,) of the clock in which they could meet. Pairs of which neither
    can yield are left out.
    """
    limits, followers = search.limits, search.followers
    stride = max(int(round(_BIN * _RATE)), 1)
    begins = np.arange(0, len(search.clock) - 1, stride)
    tracks = np.stack([search.compute_track(who, PathChange())[:, :2] for who in range(len(followers))])
    # Each bin of `stride` samples is a disc: its middle sample, and the radius `around` of the movement within the bin.
    middle = tracks[:, np.minimum(begins + stride // 2, len(search.clock) - 1)]
    deviation = [np.abs(tracks[:, np.minimum(begins + step, len(search.clock) - 1)] - middle)
                 for step in range(stride + 1)]
    around = np.linalg.norm(np.max(deviation, axis=0), axis=2)
    late = int(np.ceil((limits.delay + _LAG) / _BIN))
    meet = np.zeros((len(followers), len(followers), len(begins)), dtype=bool)
    for shift in range(min(late + 1, len(begins))):
        rest = len(begins) - shift
        off = middle[:, None, :rest] - middle[None, :, shift:]
        reach = search.remedies.required_gap + 2.0 * limits.detour + around[:, None, :rest] + around[None, :, shift:]
        near = np.einsum("ijbk,ijbk->ijb", off, off) <= reach**2
        for both in range(shift, late + 1):  # one body waits for `both` bins, the other for both - shift
            last = min(len(begins), rest + both)
            meet[:, :, both:last] |= near[:, :, : last - both]
    meet |= meet.transpose(1, 0, 2)
    fixed = np.array([follower.path is None for follower in followers])
    meet &= ~(fixed[:, None] & fixed[None])[:, :, None]
    meet[np.arange(len(fixed)), np.arange(len(fixed))] = False
    steps = np.repeat(meet, stride, axis=2)[:, :, : len(search.clock) - 1]
    return [{int(other): np.flatnonzero(of[other]) for other in np.flatnonzero(of.any(axis=1))} for of in steps]
