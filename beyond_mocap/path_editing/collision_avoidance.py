"""Collision avoidance: bodies on several paths wait a little at their start, or take a detour around each other.

A change costs seconds of waiting and metres to the side. The search takes the earliest collision and tries every remedy
that one of the two bodies (or both, each by half, as people do who meet head on) could apply, by the smallest amount
that resolves it. The few best sets of changes are kept and continued until none has a collision left that can be
resolved. Finally every change is reduced as much as the others allow. All of it is arithmetic on the same numbers in
the same order: the same bodies get the same changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .collisions import DISTANCE, HEIGHT, Collision, compute_least_gaps, find_collisions, find_collisions_at
from .detour import RISE, Follower, PathChange, compute_detour_width

_SPARE = 0.012  # metres kept beyond the distance: bodies move in curves between the samples of the search
_RATE, _FINER = 25.0, 3  # samples per second of the search; factor on it for the final check
_BEAM_WIDTHS, _MANY_COLLISIONS = (4, 2), 8  # sets of changes kept; the second number from so many collisions on
_MOST_REMEDIES = 4  # remedies tried for a collision, those with the lowest cost
_AROUND = 1.0  # seconds around a collision that a remedy must keep clear
_AMOUNTS, _FINE = 16, 0.003  # amounts tried at once; seconds or metres added to the smallest that suffices
_EVEN_COST, _LEFT_COST = 0.5, 0.25  # costs that favour two small detours over a large one, and keeping to the right
_DETOURS = 2  # of one body in one place
_TIGHT = 0.3  # a detour on the inside of a bend leaves at least this share of its length
_BIN, _LAG = 0.5, 0.5  # seconds: bins of the first test of who can meet; delay that detours can cause
_UNRESOLVED_COST = 10.0  # cost of an unresolved collision
_SHARES = (0.0, 0.5, 0.75, 0.9)  # of a change, tried when changes are reduced
_PATIENCE = 3.0  # remedies are searched for at most this many times the initial collisions
_ROUNDS = 2  # rounds of the whole search while collisions are left; each starts from the last result


@dataclass(frozen=True)
class Limits:
    """Limits and costs of changes.

    Attributes:
        distance: metres below which two bodies collide, see `collisions`.
        height: metres of a body.
        delay: seconds that a body waits at most.
        detour: metres to the side at most.
        delay_cost: of a second of waiting.
        detour_cost: of a metre to the side and back.
    """

    distance: float = DISTANCE
    height: float = HEIGHT
    delay: float = 2.0
    detour: float = 0.8
    delay_cost: float = 1.0
    detour_cost: float = 1.0


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
        self.required_gap = limits.distance + _SPARE
        begin = min(follower.times[0] for follower in followers)
        end = max(follower.times[-1] for follower in followers) + limits.delay
        self.clock = np.linspace(begin, end, max(int(np.ceil((end - begin) * _RATE)), 1) + 1)
        self.places, self.costs, self.remedies, self.collision_cache = {}, {}, {}, {}
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
            hits = find_collisions_at(0, rows, steps, times=self.clock, places=tracks, distance=self.required_gap,
                                      height=self.limits.height)
            for row, other in enumerate(new, start=1):
                pair = {"first": min(who, other), "second": max(who, other)}
                known[other, changes[other]] = [replace(hit, **pair) for hit in hits if hit.second == row]
        return [hit for other in others for hit in known[other, changes[other]]]

    def compute_score(self, state):
        """Compute the cost of a state, with a lower bound for the cost of its collisions; ties: fewer collisions."""
        to_come = sum(_UNRESOLVED_COST if state.build_key(collision) in state.unsolvable
                      else self.estimate_cost(collision) for collision in state.collisions)
        return sum(map(self.compute_cost, range(len(state.changes)), state.changes)) + to_come, len(state.collisions)

    def estimate_cost(self, collision):
        """Compute a lower bound for the cost of resolving a collision."""
        return self.limits.detour_cost * (self.required_gap - collision.gap)

    def compute_cost(self, who, change):
        """Compute the cost of a change: waiting, and metres to the side and back."""
        if (who, change) not in self.costs:
            limits, cost = self.limits, self.limits.delay_cost * change.delay
            if change.detours:
                sampled_path = self.followers[who].sampled_path
                aside = np.concatenate([[0.0], sampled_path.compute_offset(sampled_path.arc, change.detours), [0.0]])
                most = np.abs(aside).max() / limits.detour
                side_metres = 0.5 * np.abs(np.diff(aside)).sum()
                left_metres = 0.5 * np.abs(np.diff(np.maximum(aside, 0.0))).sum()
                cost += limits.detour_cost * (side_metres + _LEFT_COST * left_metres + _EVEN_COST * limits.detour
                                              * most**2)
            self.costs[who, change] = cost
        return self.costs[who, change]

    def build_children(self, state):
        """Build the states after each remedy for the earliest collision; the state itself if none is open."""
        collision = state.find_open_collision()
        if collision is None:
            return [state]
        key, children = state.build_key(collision), []
        if key not in self.remedies:
            self.remedies[key] = self.list_remedies(state, collision) if len(self.remedies) < self.patience else []
        for changed in self.remedies[key]:
            changes = list(state.changes)
            for who, change in changed.items():
                changes[who] = change
            left = self.update_collisions(tuple(changes), state.collisions, tuple(changed))
            children.append(_State(tuple(changes), left, state.unsolvable))
        return children or [replace(state, unsolvable=state.unsolvable | {key})]

    def list_remedies(self, state, collision):
        """List the remedies of a collision with the lowest costs: number of a body -> its change."""
        pair = [who for who in (collision.first, collision.second) if self.followers[who].path is not None]
        found = [self.find_wait(state, collision, who) for who in pair]
        found += [self.find_detour(state, collision, {who: side}) for who in pair for side in (-1.0, 1.0)]
        if len(pair) == 2:
            found += [self.find_detour(state, collision, dict(zip(pair, sides)))
                      for sides in ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0))]
        found = [way for way in found if way is not None]
        return sorted(found, key=lambda way: self.compute_added_cost(state, way))[:_MOST_REMEDIES]

    def compute_added_cost(self, state, remedy):
        """Compute the additional cost of a remedy."""
        return sum(self.compute_cost(who, change) - self.compute_cost(who, state.changes[who]) for who,
                   change in remedy.items())

    def find_wait(self, state, collision, who):
        """Find the shortest wait of one body that resolves a collision.

        Args:
            state: the changes so far.
            collision: the collision.
            who: number of the body that waits.
        Returns:
            The number of the body -> its change; None if no wait within the limits is enough.
        """
        if collision.start <= self.clock[0]:
            return None  # they are too near at their very start
        now, other = state.changes[who], collision.second if who == collision.first else collision.first
        times = self.select_times(collision)
        other_places = self.followers[other].at(times, state.changes[other])

        def measure_gap(more):
            later = self.followers[who].at((times - more[:, None]).ravel(), now).reshape(len(more), -1, 3)
            return self.compute_gap(later, other_places[None])

        def build_remedy(more):
            return {who: replace(now, delay=round(float(now.delay + more), 4))}

        return self.find_least_remedy(state, collision, measure_gap, build_remedy, self.limits.delay - now.delay)

    def find_detour(self, state, collision, sides):
        """Find the smallest detour that resolves a collision, to given sides and equal for all bodies that make one.

        Args:
            state: the changes so far.
            collision: the collision.
            sides: number of each body that makes one -> its side, -1 or 1.
        Returns:
            Number of a body -> its change; None if no detour within the limits is enough.
        """
        covers = {who: self.compute_cover(state, collision, who) for who in sides}
        if any(_is_crowded(state.changes[who], covers[who]) for who in sides):
            return None
        times = self.select_times(collision)

        def place_body(who, amounts):
            if who not in sides:
                return self.followers[who].at(times, state.changes[who])[None]
            train = self.build_train(who, covers[who], sides[who] * amounts[:, None])
            return self.followers[who].places_with_train(times, state.changes[who], train)

        def measure_gap(amounts):
            return self.compute_gap(place_body(collision.first, amounts), place_body(collision.second, amounts))

        def build_remedy(amount):
            trains = {who: _round_detours(self.build_train(who, covers[who], side * amount)) for who,
                      side in sides.items()}
            changes = state.changes
            return {who: replace(changes[who], detours=changes[who].detours + train) for who, train in trains.items()}

        least = self.find_least_remedy(state, collision, measure_gap, build_remedy, self.limits.detour)
        return least if least and all(self.is_possible(who, change) for who, change in least.items()) else None

    def find_least_remedy(self, state, collision, gap, remedy, most):
        """Find the remedy of the smallest amount that keeps both apart around a collision.

        Args:
            state: the changes so far.
            collision: the collision.
            gap: maps amounts (A,) to metres (A,) between both bodies.
            remedy: maps an amount to changes.
            most: largest amount.
        Returns:
            The changes of the smallest amount; None if none is enough.
        """
        low, high = 0.0, most
        for _ in range(2):  # a grid, then a finer one below its first amount that suffices
            amounts = low + (high - low) * np.arange(1, _AMOUNTS + 1) / _AMOUNTS
            enough = np.flatnonzero(gap(amounts) >= self.required_gap)
            if not len(enough):
                return None
            low, high = low if enough[0] == 0 else amounts[enough[0] - 1], amounts[enough[0]]
        for amount in (high, high + _FINE, high + 3 * _FINE, high + 8 * _FINE):
            if amount <= most + 1e-9 and self.is_clear(state, collision, remedy(amount)):
                return remedy(amount)
        return None

    def select_times(self, collision):
        """Select the times (T,) around a collision that a remedy must keep clear."""
        first = np.searchsorted(self.clock, collision.start - _AROUND)
        last = np.searchsorted(self.clock, collision.end + _AROUND + self.limits.delay)
        return self.clock[max(first - 1, 0) : last + 1]

    def compute_gap(self, first, second):
        """Compute the smallest gap (A,) m between bodies (A, T, 3)."""
        return compute_least_gaps(first, second, self.limits.distance, self.limits.height)

    def is_clear(self, state, collision, changed):
        """Return whether the two bodies are apart around the time of a collision, with these changes.

        Args:
            state: the changes so far.
            collision: the collision.
            changed: number of a body -> its change, in place of the one so far.
        """
        times = self.select_times(collision)
        first, second = (self.followers[who].at(times, changed.get(who, state.changes[who]))[None]
                         for who in (collision.first, collision.second))
        return self.compute_gap(first, second)[0] >= self.required_gap

    def compute_cover(self, state, collision, who):
        """Compute (first, last): metres along the original path between which a body must keep aside.

        Args:
            state: the changes so far.
            collision: the collision.
            who: number of the body.
        """
        follower, change = self.followers[who], state.changes[who]
        first, last = (follower.arc_at(time, change) for time in (collision.start, collision.end))
        if last < first and follower.sampled_path.closed:
            last += follower.sampled_path.length
        return first, max(first, last)

    def build_train(self, who, cover, offset):
        """Build the detours that keep a body aside all along the cover.

        Each begins to return where the next begins to leave, so that together they are one long detour.

        Args:
            who: number of the body.
            cover: (first, last) metres along its original path.
            offset: metres to the side, a number or an array; the numbers of the detours are of the same kind.
        Returns:
            (begin, width, offset) of each detour, metres.
        """
        first, last = cover
        width = np.maximum(compute_detour_width(offset, self.followers[who].speed), (last - first) / 3.0)
        more = np.maximum(np.ceil((last - first - (1.0 - 2.0 * RISE) * width) / ((1.0 - RISE) * width)), 0.0)
        begin, step = 0.5 * (first + last - (1.0 - RISE) * width * more), (1.0 - RISE) * width
        numbers = range(int(np.max(more)) + 1)
        return tuple((begin + number * step, width, offset * (number <= more)) for number in numbers)

    def is_possible(self, who, change):
        """Return whether a change is within the limits and leaves no loop in a bend."""
        sampled_path = self.followers[who].sampled_path
        aside = sampled_path.compute_offset(sampled_path.arc, change.detours)
        tight = (1.0 - sampled_path.curvature * aside < _TIGHT) & (np.abs(aside) > 0.05)
        waits, goes = change.delay <= self.limits.delay + 1e-9, np.abs(aside).max() <= self.limits.detour + 1e-3
        return waits and goes and not tight.any()

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
            if _rate_collisions(tried) <= _rate_collisions(state) and self.is_possible(who, changes[who]):
                return tried
        return state


def _is_crowded(change, cover):
    """Return whether a body with this change has enough detours between (first, last) metres."""
    there = [detour for detour in change.detours if abs(detour[0] - 0.5 * sum(cover)) < 0.5 * detour[1]]
    return len(there) >= 2 * _DETOURS


def _scale_detours(change, part, share):
    """Scale those detours of a change that have this (width, offset)."""
    scaled = [(middle, width, round(offset * share, 4) if (width, offset) == part else offset)
              for middle, width, offset in change.detours]
    return replace(change, detours=tuple(detour for detour in scaled if detour[2] != 0.0))


def _round_detours(detours):
    """Round detours to plain numbers, to a tenth of a millimetre."""
    return tuple(tuple(round(float(number), 4) for number in detour) for detour in detours)


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
        reach = search.required_gap + 2.0 * limits.detour + around[:, None, :rest] + around[None, :, shift:]
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
