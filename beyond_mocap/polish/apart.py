"""Bodies on several paths keep apart: some wait a little before they set out, some go round each other.

A change costs seconds of waiting and metres gone sideways. The earliest collision is taken, and every way to mend it that
one of the two (or both, each by half, as people do who meet head on) could take is tried by the least amount that
mends it; the few best sets of changes so far are kept and gone on with until none has a collision left that can be mended.
At last every change is made as small as the others allow. All of it is arithmetic on the same numbers in the same order:
the same bodies get the same changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .collisions import DISTANCE, HEIGHT, Collision, collisions_of
from .detour import RISE, gentle_width
from .follower import Change, Follower

_SPARE = 0.004  # metres kept beyond the distance: bodies move in curves between the search's own times
_RATE = 20.0  # times per second at which the search looks
_KEPT = 4  # sets of changes gone on with
_AROUND = 1.0  # seconds around a collision in which what mends it must be clear
_DELAY_STEP, _FINE = 0.1, 0.005  # seconds and metres
_EVEN, _LEFT = 0.05, 0.01  # two small detours are rather taken than a large one; people keep to the right
_TIGHT = 0.3  # a detour on the inside of a bend leaves at least this share of its length
_UNMENDED = 10.0  # what a collision that stays costs
_TWICE = 3.0  # ways are tried for at most this many times as many collisions as there were, and some


@dataclass(frozen=True)
class Limits:
    """distance, height: metres, see `collisions`. delay: most seconds that anybody waits. detour: most metres to the side.
    delay_cost, detour_cost: of a second of waiting, and of a metre to the side and back."""

    distance: float = DISTANCE
    height: float = HEIGHT
    delay: float = 2.0
    detour: float = 0.8
    delay_cost: float = 1.0
    detour_cost: float = 1.0


@dataclass(frozen=True)
class Resolution:
    """changes: one for each follower. before: the collisions there were. left: those that could not be mended within the
    limits, with the numbers of the changed bodies."""

    changes: tuple[Change, ...]
    before: tuple[Collision, ...]
    left: tuple[Collision, ...]


@dataclass(frozen=True)
class _State:
    """A set of changes, the collisions it leaves, and for which of them no way was found."""

    changes: tuple[Change, ...]
    collisions: tuple[Collision, ...]
    given_up: frozenset = frozenset()

    def open(self):
        """The earliest collision still to be mended, or None."""
        return next((collision for collision in self.collisions if self.key(collision) not in self.given_up), None)

    def key(self, collision):
        """Says that nothing has changed since no way was found."""
        first, second = collision.first, collision.second
        return first, second, self.changes[first], self.changes[second], round(collision.time, 1)


def resolved(followers: list[Follower], limits: Limits = Limits(), changes=None) -> Resolution:
    """The changes that keep these bodies apart, least in all.

    changes: what has been asked of them already and shall stay at least (one Change each). Bodies without a path stay as
    they are; collisions among those alone are nobody's concern here.
    """
    search = _Search(followers, limits)
    state = search.begin(tuple(changes or (Change(),) * len(followers)))
    before, states, rounds = state.collisions, [state], int(_TWICE * len(state.collisions)) + 20
    for _ in range(rounds):
        if states[0].open() is None:
            break
        found = {child.changes: child for state in states for child in search.children(state)}
        states = sorted(found.values(), key=search.score)[:_KEPT]
    best = search.smaller(states[0])
    return Resolution(best.changes, before, best.collisions)


class _Search:
    """The bodies on one clock, and what is tried with them."""

    def __init__(self, followers, limits):
        self.followers, self.limits = followers, limits
        self.wanted = limits.distance + _SPARE
        begin = min(follower.times[0] for follower in followers)
        end = max(follower.times[-1] for follower in followers) + limits.delay
        self.clock = np.linspace(begin, end, max(int(np.ceil((end - begin) * _RATE)), 1) + 1)
        self.places, self.costs = {}, {}

    def begin(self, changes) -> _State:
        """Where the search sets out."""
        everyone = tuple(range(len(changes)))
        return _State(changes, self.after(changes, (), everyone))

    def track(self, who, change):
        """Places (T, 3) of a changed body on the clock."""
        if (who, change) not in self.places:
            self.places[who, change] = self.followers[who].at(self.clock, change)
        return self.places[who, change]

    def after(self, changes, collisions, changed):
        """All collisions, by time, where those of the `changed` bodies are to be found anew."""
        found = [collision for collision in collisions if not {collision.first, collision.second} & set(changed)]
        tracks = np.stack([self.track(who, change) for who, change in enumerate(changes)])
        for rank, who in enumerate(changed):
            others = [other for other in range(len(changes)) if other not in changed[:rank] and self.concerns(who, other)]
            found += collisions_of(who, others, self.clock, tracks, self.wanted, self.limits.height)
        return tuple(sorted(found, key=lambda collision: (collision.start, collision.first, collision.second)))

    def concerns(self, one, other):
        """Whether one of the two can give way."""
        return self.followers[one].path is not None or self.followers[other].path is not None

    def score(self, state):
        """What a state costs, with what its collisions will cost at least."""
        to_come = sum(_UNMENDED if state.key(collision) in state.given_up else self.least(collision)
                      for collision in state.collisions)
        return sum(map(self.cost, range(len(state.changes)), state.changes)) + to_come, len(state.collisions)

    def least(self, collision):
        """What mending a collision costs, seen from afar."""
        return self.limits.detour_cost * (self.wanted - collision.gap)

    def cost(self, who, change):
        """What a change costs: waiting, and metres to the side and back."""
        if (who, change) not in self.costs:
            limits, cost = self.limits, self.limits.delay_cost * change.delay
            if change.detours:
                way = self.followers[who].way
                aside = np.concatenate([[0.0], way.aside(way.arc, change.detours), [0.0]])
                most = np.abs(aside).max() / limits.detour
                gone = 0.5 * np.abs(np.diff(aside)).sum()
                left = 0.5 * np.abs(np.diff(np.minimum(aside, 0.0))).sum()
                cost += limits.detour_cost * (gone + _LEFT * left + _EVEN * limits.detour * most**2)
            self.costs[who, change] = cost
        return self.costs[who, change]

    def children(self, state):
        """The states after the earliest collision is mended in each possible way; the state itself where none is open."""
        collision = state.open()
        if collision is None:
            return [state]
        children = []
        for changed in self.ways(state, collision):
            changes = list(state.changes)
            for who, change in changed.items():
                changes[who] = change
            left = self.after(tuple(changes), state.collisions, tuple(changed))
            children.append(_State(tuple(changes), left, state.given_up))
        return children or [replace(state, given_up=state.given_up | {state.key(collision)})]

    def ways(self, state, collision):
        """Each way to mend a collision: number of a body -> its change."""
        pair = [who for who in (collision.first, collision.second) if self.followers[who].path is not None]
        found = [self.wait(state, collision, who) for who in pair]
        found += [self.round(state, collision, {who: side}) for who in pair for side in (1.0, -1.0)]
        if len(pair) == 2:
            found += [self.round(state, collision, dict(zip(pair, sides)))
                      for sides in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0))]
        return [way for way in found if way is not None]

    def wait(self, state, collision, who):
        """The shortest wait of one body that mends a collision."""
        if collision.start <= self.clock[0]:
            return None  # where they begin they are too near
        now = state.changes[who]

        def way(more):
            return {who: replace(now, delay=round(now.delay + more, 4))}

        low = 0.0
        for high in np.arange(_DELAY_STEP, self.limits.delay - now.delay + 1e-9, _DELAY_STEP):
            if self.clear(state, collision, way(high)):
                return way(self.bisected(state, collision, way, low, high))
            low = high
        return None

    def round(self, state, collision, sides):
        """The smallest detour, to these sides and equal for all who make one, that mends a collision."""
        covers = {who: self.cover(state, collision, who) for who in sides}

        def way(amount):
            return {who: self.aside(who, state.changes[who], covers[who], side * amount) for who, side in sides.items()}

        most = self.limits.detour
        if not self.clear(state, collision, way(most)):
            return None
        least = way(self.bisected(state, collision, way, 0.0, most))
        return least if all(self.possible(who, change) for who, change in least.items()) else None

    def bisected(self, state, collision, way, low, high):
        """The least amount between one that does not mend and one that does."""
        while high - low > _FINE:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.clear(state, collision, way(middle)) else (middle, high)
        return high

    def cover(self, state, collision, who):
        """(first, last): metres along its path as it was between which a body has to be aside."""
        follower, change = self.followers[who], state.changes[who]
        first, last = (follower.arc_at(time, change) for time in (collision.start, collision.end))
        if last < first and follower.way.closed:
            last += follower.way.length
        return first, max(first, last)

    def aside(self, who, change, cover, offset):
        """The change with a detour more: as many side by side as it takes to be aside all along, each begins where the
        one before ends, and together they are one long one."""
        first, last = cover
        width = gentle_width(offset, self.followers[who].speed)
        more = max(int(np.ceil((last - first - (1.0 - 2.0 * RISE) * width) / ((1.0 - RISE) * width))), 0)
        middles = 0.5 * (first + last) + (1.0 - RISE) * width * (np.arange(more + 1) - 0.5 * more)
        added = tuple((round(float(middle), 4), round(float(width), 4), round(offset, 4)) for middle in middles)
        return replace(change, detours=change.detours + added)

    def possible(self, who, change):
        """Whether a change keeps to the limits and leaves no loop in a bend."""
        way = self.followers[who].way
        aside = way.aside(way.arc, change.detours)
        tight = (1.0 + way.bend * aside < _TIGHT) & (np.abs(aside) > 0.05)
        return change.delay <= self.limits.delay + 1e-9 and np.abs(aside).max() <= self.limits.detour + 1e-3 and not tight.any()

    def clear(self, state, collision, changed):
        """Whether the two are apart around the time of a collision, with these changes."""
        first = np.searchsorted(self.clock, collision.start - _AROUND)
        last = np.searchsorted(self.clock, collision.end + _AROUND + self.limits.delay)
        times = self.clock[max(first - 1, 0) : last + 1]
        places = [self.followers[who].at(times, changed.get(who, state.changes[who]))
                  for who in (collision.first, collision.second)]
        return not collisions_of(0, (1,), times, np.stack(places), self.wanted, self.limits.height)

    def smaller(self, state):
        """The state with each change as small as the others allow: left out, or a part of it."""
        for who, change in enumerate(state.changes):
            for part in sorted({(width, offset) for _, width, offset in change.detours}, key=str):
                state = self.scaled(state, who, lambda now, share, part=part: _with_share(now, part, share))
            if state.changes[who].delay:
                state = self.scaled(state, who, lambda now, share: replace(now, delay=round(now.delay * share, 4)))
        return state

    def scaled(self, state, who, shared):
        """The state with the least share of a part of one body's change that brings no collision."""
        low, high, best, allowed = 0.0, 1.0, state, _trouble(state)
        share = 0.0
        while high - low > 0.05 or share == 0.0:
            changes = list(state.changes)
            changes[who] = shared(state.changes[who], share)
            tried = replace(state, changes=tuple(changes), collisions=self.after(tuple(changes), state.collisions, (who,)))
            if _trouble(tried) <= allowed and self.possible(who, changes[who]):
                high, best = share, tried
            else:
                low = share
            if share == 0.0 and high == 0.0:
                break
            share = 0.5 * (low + high)
        return best


def _with_share(change, part, share):
    """A change with those of its detours that have this (width, offset) made smaller."""
    kept = [(middle, width, round(offset * share, 4) if (width, offset) == part else offset)
            for middle, width, offset in change.detours]
    return replace(change, detours=tuple(detour for detour in kept if detour[2] != 0.0))


def _trouble(state):
    """How many collisions a state has, and how deep they are."""
    return len(state.collisions), -round(sum(collision.gap for collision in state.collisions), 6)
