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

from .collisions import DISTANCE, HEIGHT, Collision, collisions, collisions_at, least_gaps
from .detour import RISE, Change, Follower, gentle_width

_SPARE = 0.012  # metres kept beyond the distance: bodies move in curves between the samples of the search
_RATE, _FINER = 25.0, 3  # samples per second of the search; factor on it for the final check
_KEPT, _MANY = (4, 2), 8  # sets of changes kept; the second number from so many collisions on
_TRIED = 4  # remedies tried for a collision, those with the lowest cost
_AROUND = 1.0  # seconds around a collision that a remedy must keep clear
_AMOUNTS, _FINE = 16, 0.003  # amounts tried at once; seconds or metres added to the smallest that suffices
_EVEN, _LEFT = 0.5, 0.25  # costs that favour two small detours over a large one, and keeping to the right
_DETOURS = 2  # of one body in one place
_TIGHT = 0.3  # a detour on the inside of a bend leaves at least this share of its length
_BIN, _LAG = 0.5, 0.5  # seconds: bins of the first test of who can meet; delay that detours can cause
_UNMENDED = 10.0  # cost of an unresolved collision
_SHARES = (0.0, 0.5, 0.75, 0.9)  # of a change, tried when changes are reduced
_PATIENCE = 3.0  # remedies are searched for at most this many times the initial collisions
_AGAIN = 2  # rounds of the whole search while collisions are left; each starts from the last result


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

    changes: tuple[Change, ...]
    before: tuple[Collision, ...]
    left: tuple[Collision, ...]


@dataclass(frozen=True)
class _State:
    """A set of changes, the collisions that it leaves, and those of them without a remedy."""

    changes: tuple[Change, ...]
    collisions: tuple[Collision, ...]
    given_up: frozenset = frozenset()

    def open(self):
        """Find the earliest collision still to be resolved, or None."""
        return next((collision for collision in self.collisions if self.key(collision) not in self.given_up), None)

    def key(self, collision):
        """Build a key of a collision and the changes of both bodies: equal as long as the search for remedies would
        be.
        """
        first, second = collision.first, collision.second
        return first, second, self.changes[first], self.changes[second], round(collision.time, 1)


def resolved(followers: list[Follower], limits: Limits = Limits(), changes=None) -> Resolution:
    """Find the changes that keep these bodies apart, with the lowest total cost.

    Args:
        followers: the bodies; those without a path stay as they are, and collisions among them alone are ignored.
        limits: limits and costs.
        changes: one `PathChange` for each body that must hold at least; None for none.
    Returns:
        The changes, the initial and the unresolved collisions.
    """
    search = _Search(followers, limits)
    state = search.begin(tuple(changes or (Change(),) * len(followers)))
    before = state.collisions
    search.patience = int(_PATIENCE * len(before)) + 20
    for _ in range(_AGAIN):
        state = search.smaller(_mended(search, replace(state, given_up=frozenset())))
        if not state.collisions:
            break
    return Resolution(state.changes, before, search.left(state.changes))


def _mended(search: "_Search", state: "_State") -> "_State":
    """Find the best state reachable from this one, by a beam search."""
    states, rounds = [state], int(_PATIENCE * len(state.collisions)) + 20
    kept = _KEPT[len(state.collisions) >= _MANY]
    for _ in range(rounds):
        if states[0].open() is None:
            break
        found = {child.changes: child for state in states for child in search.children(state)}
        states = sorted(found.values(), key=search.score)[:kept]
    return states[0]


class _Search:
    """The bodies on one clock, with caches of all that is tried."""

    def __init__(self, followers, limits):
        self.followers, self.limits = followers, limits
        self.wanted = limits.distance + _SPARE
        begin = min(follower.times[0] for follower in followers)
        end = max(follower.times[-1] for follower in followers) + limits.delay
        self.clock = np.linspace(begin, end, max(int(np.ceil((end - begin) * _RATE)), 1) + 1)
        self.places, self.costs, self.found, self.known = {}, {}, {}, {}
        self.patience = 0  # limit of collisions for which remedies are searched
        self.may_meet = _may_meet(self)

    def begin(self, changes) -> _State:
        """Build the first state."""
        everyone = tuple(range(len(changes)))
        return _State(changes, self.after(changes, (), everyone))

    def track(self, who, change):
        """Compute the places (T, 3) m of a changed body on the clock."""
        if (who, change) not in self.places:
            self.places[who, change] = self.followers[who].at(self.clock, change)
        return self.places[who, change]

    def after(self, changes, collisions, changed):
        """Update the collisions, by time, for bodies whose changes are new."""
        found = [collision for collision in collisions if not {collision.first, collision.second} & set(changed)]
        for rank, who in enumerate(changed):
            found += self.met(who, changes, changed[:rank])
        return tuple(sorted(found, key=lambda collision: (collision.start, collision.first, collision.second)))

    def left(self, changes):
        """Find the collisions that changes leave, at a higher rate than the search's."""
        times = np.linspace(self.clock[0], self.clock[-1], _FINER * (len(self.clock) - 1) + 1)
        places = np.stack([follower.at(times, change) for follower, change in zip(self.followers, changes)])
        fixed = [follower.path is None for follower in self.followers]
        found = collisions(times, places, self.limits.distance, self.limits.height)
        return tuple(collision for collision in found if not (fixed[collision.first] and fixed[collision.second]))

    def met(self, who, changes, without):
        """Find the collisions of one body, except those with the bodies `without`."""
        known = self.known.setdefault((who, changes[who]), {})
        others = [other for other in self.may_meet[who] if other not in without]
        new = [other for other in others if (other, changes[other]) not in known]
        if new:
            rows = np.repeat(np.arange(1, len(new) + 1), [len(self.may_meet[who][other]) for other in new])
            steps = np.concatenate([self.may_meet[who][other] for other in new])
            tracks = np.stack([self.track(body, changes[body]) for body in (who, *new)])
            hits = collisions_at(0, rows, steps, times=self.clock, places=tracks, distance=self.wanted,
                                 height=self.limits.height)
            for row, other in enumerate(new, start=1):
                pair = {"first": min(who, other), "second": max(who, other)}
                known[other, changes[other]] = [replace(hit, **pair) for hit in hits if hit.second == row]
        return [hit for other in others for hit in known[other, changes[other]]]

    def score(self, state):
        """Compute the cost of a state, with a lower bound for the cost of its collisions; ties: fewer collisions."""
        to_come = sum(_UNMENDED if state.key(collision) in state.given_up else self.least(collision)
                      for collision in state.collisions)
        return sum(map(self.cost, range(len(state.changes)), state.changes)) + to_come, len(state.collisions)

    def least(self, collision):
        """Compute a lower bound for the cost of resolving a collision."""
        return self.limits.detour_cost * (self.wanted - collision.gap)

    def cost(self, who, change):
        """Compute the cost of a change: waiting, and metres to the side and back."""
        if (who, change) not in self.costs:
            limits, cost = self.limits, self.limits.delay_cost * change.delay
            if change.detours:
                way = self.followers[who].way
                aside = np.concatenate([[0.0], way.aside(way.arc, change.detours), [0.0]])
                most = np.abs(aside).max() / limits.detour
                gone = 0.5 * np.abs(np.diff(aside)).sum()
                left = 0.5 * np.abs(np.diff(np.maximum(aside, 0.0))).sum()
                cost += limits.detour_cost * (gone + _LEFT * left + _EVEN * limits.detour * most**2)
            self.costs[who, change] = cost
        return self.costs[who, change]

    def children(self, state):
        """Build the states after each remedy for the earliest collision; the state itself if none is open."""
        collision = state.open()
        if collision is None:
            return [state]
        key, children = state.key(collision), []
        if key not in self.found:
            self.found[key] = self.ways(state, collision) if len(self.found) < self.patience else []
        for changed in self.found[key]:
            changes = list(state.changes)
            for who, change in changed.items():
                changes[who] = change
            left = self.after(tuple(changes), state.collisions, tuple(changed))
            children.append(_State(tuple(changes), left, state.given_up))
        return children or [replace(state, given_up=state.given_up | {key})]

    def ways(self, state, collision):
        """List the remedies of a collision with the lowest costs: number of a body -> its change."""
        pair = [who for who in (collision.first, collision.second) if self.followers[who].path is not None]
        found = [self.wait(state, collision, who) for who in pair]
        found += [self.round(state, collision, {who: side}) for who in pair for side in (-1.0, 1.0)]
        if len(pair) == 2:
            found += [self.round(state, collision, dict(zip(pair, sides)))
                      for sides in ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0))]
        found = [way for way in found if way is not None]
        return sorted(found, key=lambda way: self.more(state, way))[:_TRIED]

    def more(self, state, way):
        """Compute the additional cost of a remedy."""
        return sum(self.cost(who, change) - self.cost(who, state.changes[who]) for who, change in way.items())

    def wait(self, state, collision, who):
        """Find the shortest wait of one body that resolves a collision."""
        if collision.start <= self.clock[0]:
            return None  # they are too near at their very start
        now, other = state.changes[who], collision.second if who == collision.first else collision.first
        times = self.around(collision)
        standing = self.followers[other].at(times, state.changes[other])

        def gap(more):
            later = self.followers[who].at((times - more[:, None]).ravel(), now).reshape(len(more), -1, 3)
            return self.gap(later, standing[None])

        def way(more):
            return {who: replace(now, delay=round(float(now.delay + more), 4))}

        return self.least_way(state, collision, gap, way, self.limits.delay - now.delay)

    def round(self, state, collision, sides):
        """Find the smallest detour that resolves a collision, to given sides and equal for all bodies that make one."""
        covers = {who: self.cover(state, collision, who) for who in sides}
        if any(_crowded(state.changes[who], covers[who]) for who in sides):
            return None
        times = self.around(collision)

        def beside(who, amounts):
            if who not in sides:
                return self.followers[who].at(times, state.changes[who])[None]
            train = self.train(who, covers[who], sides[who] * amounts[:, None])
            return self.followers[who].with_more(times, state.changes[who], train)

        def gap(amounts):
            return self.gap(beside(collision.first, amounts), beside(collision.second, amounts))

        def way(amount):
            trains = {who: _rounded(self.train(who, covers[who], side * amount)) for who, side in sides.items()}
            changes = state.changes
            return {who: replace(changes[who], detours=changes[who].detours + train) for who, train in trains.items()}

        least = self.least_way(state, collision, gap, way, self.limits.detour)
        return least if least and all(self.possible(who, change) for who, change in least.items()) else None

    def least_way(self, state, collision, gap, way, most):
        """Find the remedy of the smallest amount that keeps both apart around a collision.

        gap: maps amounts (A,) to metres (A,); remedy: maps an amount to changes; most: largest amount.
        """
        low, high = 0.0, most
        for _ in range(2):  # a grid, then a finer one below its first amount that suffices
            amounts = low + (high - low) * np.arange(1, _AMOUNTS + 1) / _AMOUNTS
            enough = np.flatnonzero(gap(amounts) >= self.wanted)
            if not len(enough):
                return None
            low, high = low if enough[0] == 0 else amounts[enough[0] - 1], amounts[enough[0]]
        for amount in (high, high + _FINE, high + 3 * _FINE, high + 8 * _FINE):
            if amount <= most + 1e-9 and self.clear(state, collision, way(amount)):
                return way(amount)
        return None

    def around(self, collision):
        """Select the times (T,) around a collision that a remedy must keep clear."""
        first = np.searchsorted(self.clock, collision.start - _AROUND)
        last = np.searchsorted(self.clock, collision.end + _AROUND + self.limits.delay)
        return self.clock[max(first - 1, 0) : last + 1]

    def gap(self, first, second):
        """Compute the smallest gap (A,) m between bodies (A, T, 3)."""
        return least_gaps(first, second, self.limits.distance, self.limits.height)

    def clear(self, state, collision, changed):
        """Return whether the two bodies are apart around the time of a collision, with these changes."""
        times = self.around(collision)
        first, second = (self.followers[who].at(times, changed.get(who, state.changes[who]))[None]
                         for who in (collision.first, collision.second))
        return self.gap(first, second)[0] >= self.wanted

    def cover(self, state, collision, who):
        """Compute (first, last): metres along the original path between which a body must keep aside."""
        follower, change = self.followers[who], state.changes[who]
        first, last = (follower.arc_at(time, change) for time in (collision.start, collision.end))
        if last < first and follower.way.closed:
            last += follower.way.length
        return first, max(first, last)

    def train(self, who, cover, offset):
        """Build the detours that keep a body aside all along the cover.

        Each begins to return where the next begins to leave, so that together they are one long detour. offset: a
        number or an array, and so are the numbers of the detours.
        """
        first, last = cover
        width = np.maximum(gentle_width(offset, self.followers[who].speed), (last - first) / 3.0)
        more = np.maximum(np.ceil((last - first - (1.0 - 2.0 * RISE) * width) / ((1.0 - RISE) * width)), 0.0)
        begin, step = 0.5 * (first + last - (1.0 - RISE) * width * more), (1.0 - RISE) * width
        numbers = range(int(np.max(more)) + 1)
        return tuple((begin + number * step, width, offset * (number <= more)) for number in numbers)

    def possible(self, who, change):
        """Return whether a change is within the limits and leaves no loop in a bend."""
        way = self.followers[who].way
        aside = way.aside(way.arc, change.detours)
        tight = (1.0 - way.bend * aside < _TIGHT) & (np.abs(aside) > 0.05)
        waits, goes = change.delay <= self.limits.delay + 1e-9, np.abs(aside).max() <= self.limits.detour + 1e-3
        return waits and goes and not tight.any()

    def smaller(self, state):
        """Reduce each change as much as the others allow: drop it, or scale it."""
        for who, change in enumerate(state.changes):
            for part in sorted({(width, offset) for _, width, offset in change.detours}, key=str):
                state = self.scaled(state, who, lambda now, share, part=part: _with_share(now, part, share))
            if state.changes[who].delay:
                state = self.scaled(state, who, lambda now, share: replace(now, delay=round(now.delay * share, 4)))
        return state

    def scaled(self, state, who, shared):
        """Choose the smallest share of a part of one body's change that adds no collision."""
        for share in _SHARES:
            changes = list(state.changes)
            changes[who] = shared(state.changes[who], share)
            left = self.after(tuple(changes), state.collisions, (who,))
            tried = replace(state, changes=tuple(changes), collisions=left)
            if _trouble(tried) <= _trouble(state) and self.possible(who, changes[who]):
                return tried
        return state


def _crowded(change, cover):
    """Return whether a body with this change has enough detours between (first, last) metres."""
    there = [detour for detour in change.detours if abs(detour[0] - 0.5 * sum(cover)) < 0.5 * detour[1]]
    return len(there) >= 2 * _DETOURS


def _with_share(change, part, share):
    """Scale those detours of a change that have this (width, offset)."""
    kept = [(middle, width, round(offset * share, 4) if (width, offset) == part else offset)
            for middle, width, offset in change.detours]
    return replace(change, detours=tuple(detour for detour in kept if detour[2] != 0.0))


def _rounded(detours):
    """Round detours to plain numbers, to a tenth of a millimetre."""
    return tuple(tuple(round(float(number), 4) for number in detour) for detour in detours)


def _trouble(state):
    """Count the collisions of a state, with their depth for ties."""
    return len(state.collisions), -round(sum(collision.gap for collision in state.collisions), 6)


def _may_meet(search):
    """Find, for each body, the others that changes within the limits could bring close.

    Returns for each body the others with the steps (M,) of the clock in which they could meet. Pairs of which neither
    can yield are left out.
    """
    limits, followers = search.limits, search.followers
    stride = max(int(round(_BIN * _RATE)), 1)
    begins = np.arange(0, len(search.clock) - 1, stride)
    tracks = np.stack([search.track(who, Change())[:, :2] for who in range(len(followers))])
    # Each bin of `stride` samples is a disc: its middle sample, and the radius `around` of the movement within the bin.
    middle = tracks[:, np.minimum(begins + stride // 2, len(search.clock) - 1)]
    apart = [np.abs(tracks[:, np.minimum(begins + step, len(search.clock) - 1)] - middle) for step in range(stride + 1)]
    around = np.linalg.norm(np.max(apart, axis=0), axis=2)
    late = int(np.ceil((limits.delay + _LAG) / _BIN))
    meet = np.zeros((len(followers), len(followers), len(begins)), dtype=bool)
    for shift in range(min(late + 1, len(begins))):
        rest = len(begins) - shift
        off = middle[:, None, :rest] - middle[None, :, shift:]
        reach = search.wanted + 2.0 * limits.detour + around[:, None, :rest] + around[None, :, shift:]
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
