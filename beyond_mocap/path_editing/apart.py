"""Bodies on several paths keep apart: some wait a little before they set out, some go round each other.

A change costs seconds of waiting and metres gone sideways. The earliest collision is taken, and every way to mend it
that one of the two (or both, each by half, as people do who meet head on) could take is tried by the least amount that
mends it; the few best sets of changes so far are kept and gone on with until none has a collision left that can be
mended. At last every change is made as small as the others allow. All of it is arithmetic on the same numbers in the
same order: the same bodies get the same changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .collisions import DISTANCE, HEIGHT, Collision, collisions, collisions_at, least_gaps
from .detour import RISE, Change, Follower, gentle_width

_SPARE = 0.012  # metres kept beyond the distance: bodies move in curves between the search's own times
_RATE, _FINER = 25.0, 3  # times per second at which the search looks; at the end so many times as often
_KEPT, _MANY = (4, 2), 8  # sets of changes gone on with; fewer from so many collisions on
_TRIED = 4  # ways to mend a collision, the cheapest of them
_AROUND = 1.0  # seconds around a collision in which what mends it must be clear
_AMOUNTS, _FINE = 16, 0.003  # how many amounts are tried at once; seconds and metres
_EVEN, _LEFT = 0.5, 0.25  # two small detours are rather taken than a large one; people keep to the right
_DETOURS = 2  # of one body in one place
_TIGHT = 0.3  # a detour on the inside of a bend leaves at least this share of its length
_BIN, _LAG = 0.5, 0.5  # seconds: how finely it is looked at first who may meet; what detours may cost
_UNMENDED = 10.0  # what a collision that stays costs
_SHARES = (0.0, 0.5, 0.75, 0.9)
_PATIENCE = 3.0  # ways are looked for at most for so many times as many collisions as there were
_AGAIN = 2  # times that it is gone over where something is left; from what was found it goes on otherwise


@dataclass(frozen=True)
class Limits:
    """distance, height: metres, see `collisions`. delay: most seconds that anybody waits. detour: most metres to the
    side. delay_cost, detour_cost: of a second of waiting, and of a metre to the side and back."""

    distance: float = DISTANCE
    height: float = HEIGHT
    delay: float = 2.0
    detour: float = 0.8
    delay_cost: float = 1.0
    detour_cost: float = 1.0


@dataclass(frozen=True)
class Resolution:
    """changes: one for each follower. before: the collisions there were. left: those that could not be mended within
    the limits, with the numbers of the changed bodies."""

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

    changes: what has been asked of them already and shall stay at least (one Change each). Bodies without a path stay
    as they are; collisions among those alone are nobody's concern here."""
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
    """The best state found from this one on."""
    states, rounds = [state], int(_PATIENCE * len(state.collisions)) + 20
    kept = _KEPT[len(state.collisions) >= _MANY]
    for _ in range(rounds):
        if states[0].open() is None:
            break
        found = {child.changes: child for state in states for child in search.children(state)}
        states = sorted(found.values(), key=search.score)[:kept]
    return states[0]


class _Search:
    """The bodies on one clock, and what is tried with them."""

    def __init__(self, followers, limits):
        self.followers, self.limits = followers, limits
        self.wanted = limits.distance + _SPARE
        begin = min(follower.times[0] for follower in followers)
        end = max(follower.times[-1] for follower in followers) + limits.delay
        self.clock = np.linspace(begin, end, max(int(np.ceil((end - begin) * _RATE)), 1) + 1)
        self.places, self.costs, self.found, self.known = {}, {}, {}, {}
        self.patience = 0  # for how many collisions ways are looked for
        self.may_meet = _may_meet(self)

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
        for rank, who in enumerate(changed):
            found += self.met(who, changes, changed[:rank])
        return tuple(sorted(found, key=lambda collision: (collision.start, collision.first, collision.second)))

    def left(self, changes):
        """The collisions that changes leave, looked at more finely than while searching."""
        times = np.linspace(self.clock[0], self.clock[-1], _FINER * (len(self.clock) - 1) + 1)
        places = np.stack([follower.at(times, change) for follower, change in zip(self.followers, changes)])
        fixed = [follower.path is None for follower in self.followers]
        found = collisions(times, places, self.limits.distance, self.limits.height)
        return tuple(collision for collision in found if not (fixed[collision.first] and fixed[collision.second]))

    def met(self, who, changes, without):
        """The collisions of one body, but for those with the bodies `without`."""
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
                left = 0.5 * np.abs(np.diff(np.maximum(aside, 0.0))).sum()
                cost += limits.detour_cost * (gone + _LEFT * left + _EVEN * limits.detour * most**2)
            self.costs[who, change] = cost
        return self.costs[who, change]

    def children(self, state):
        """The states after the earliest collision is mended in each possible way; the state where none is open."""
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
        """Each way to mend a collision: number of a body -> its change."""
        pair = [who for who in (collision.first, collision.second) if self.followers[who].path is not None]
        found = [self.wait(state, collision, who) for who in pair]
        found += [self.round(state, collision, {who: side}) for who in pair for side in (-1.0, 1.0)]
        if len(pair) == 2:
            found += [self.round(state, collision, dict(zip(pair, sides)))
                      for sides in ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0))]
        found = [way for way in found if way is not None]
        return sorted(found, key=lambda way: self.more(state, way))[:_TRIED]

    def more(self, state, way):
        """What a way costs beyond what is spent."""
        return sum(self.cost(who, change) - self.cost(who, state.changes[who]) for who, change in way.items())

    def wait(self, state, collision, who):
        """The shortest wait of one body that mends a collision."""
        if collision.start <= self.clock[0]:
            return None  # where they begin they are too near
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
        """The smallest detour, to these sides and equal for all who make one, that mends a collision."""
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
        """The way of the least amount that keeps both apart around a collision; gap(amounts (A,)) -> metres (A,)."""
        low, high = 0.0, most
        for _ in range(2):
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
        """Times (T,) around a collision in which what mends it must be clear."""
        first = np.searchsorted(self.clock, collision.start - _AROUND)
        last = np.searchsorted(self.clock, collision.end + _AROUND + self.limits.delay)
        return self.clock[max(first - 1, 0) : last + 1]

    def gap(self, first, second):
        """Metres (A,) between bodies (A, T, 3) when they are nearest."""
        return least_gaps(first, second, self.limits.distance, self.limits.height)

    def clear(self, state, collision, changed):
        """Whether the two are apart around the time of a collision, with these changes."""
        times = self.around(collision)
        first, second = (self.followers[who].at(times, changed.get(who, state.changes[who]))[None]
                         for who in (collision.first, collision.second))
        return self.gap(first, second)[0] >= self.wanted

    def cover(self, state, collision, who):
        """(first, last): metres along its path as it was between which a body has to be aside."""
        follower, change = self.followers[who], state.changes[who]
        first, last = (follower.arc_at(time, change) for time in (collision.start, collision.end))
        if last < first and follower.way.closed:
            last += follower.way.length
        return first, max(first, last)

    def train(self, who, cover, offset):
        """Detours that keep a body aside all along: each begins to come back where the next begins to leave, and
        together they are one long one. offset: a number or an array, and so are theirs."""
        first, last = cover
        width = np.maximum(gentle_width(offset, self.followers[who].speed), (last - first) / 3.0)
        more = np.maximum(np.ceil((last - first - (1.0 - 2.0 * RISE) * width) / ((1.0 - RISE) * width)), 0.0)
        begin, step = 0.5 * (first + last - (1.0 - RISE) * width * more), (1.0 - RISE) * width
        numbers = range(int(np.max(more)) + 1)
        return tuple((begin + number * step, width, offset * (number <= more)) for number in numbers)

    def possible(self, who, change):
        """Whether a change keeps to the limits and leaves no loop in a bend."""
        way = self.followers[who].way
        aside = way.aside(way.arc, change.detours)
        tight = (1.0 - way.bend * aside < _TIGHT) & (np.abs(aside) > 0.05)
        waits, goes = change.delay <= self.limits.delay + 1e-9, np.abs(aside).max() <= self.limits.detour + 1e-3
        return waits and goes and not tight.any()

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
        for share in _SHARES:
            changes = list(state.changes)
            changes[who] = shared(state.changes[who], share)
            left = self.after(tuple(changes), state.collisions, (who,))
            tried = replace(state, changes=tuple(changes), collisions=left)
            if _trouble(tried) <= _trouble(state) and self.possible(who, changes[who]):
                return tried
        return state


def _crowded(change, cover):
    """Whether a body with this change makes detours enough between (first, last) metres."""
    there = [detour for detour in change.detours if abs(detour[0] - 0.5 * sum(cover)) < 0.5 * detour[1]]
    return len(there) >= 2 * _DETOURS


def _with_share(change, part, share):
    """A change with those of its detours that have this (width, offset) made smaller."""
    kept = [(middle, width, round(offset * share, 4) if (width, offset) == part else offset)
            for middle, width, offset in change.detours]
    return replace(change, detours=tuple(detour for detour in kept if detour[2] != 0.0))


def _rounded(detours):
    """Detours as plain numbers, to a tenth of a millimetre."""
    return tuple(tuple(round(float(number), 4) for number in detour) for detour in detours)


def _trouble(state):
    """How many collisions a state has, and how deep they are."""
    return len(state.collisions), -round(sum(collision.gap for collision in state.collisions), 6)


def _may_meet(search):
    """For each body the others with which changes within the limits could bring it together, each with the steps (M,)
    of the clock in which they could; two of which neither can give way are nobody's concern."""
    limits, followers = search.limits, search.followers
    stride = max(int(round(_BIN * _RATE)), 1)
    begins = np.arange(0, len(search.clock) - 1, stride)
    tracks = np.stack([search.track(who, Change())[:, :2] for who in range(len(followers))])
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
        for both in range(shift, late + 1):  # one waited by `both`, the other by both - shift
            last = min(len(begins), rest + both)
            meet[:, :, both:last] |= near[:, :, : last - both]
    meet |= meet.transpose(1, 0, 2)
    fixed = np.array([follower.path is None for follower in followers])
    meet &= ~(fixed[:, None] & fixed[None])[:, :, None]
    meet[np.arange(len(fixed)), np.arange(len(fixed))] = False
    steps = np.repeat(meet, stride, axis=2)[:, :, : len(search.clock) - 1]
    return [{int(other): np.flatnonzero(of[other]) for other in np.flatnonzero(of.any(axis=1))} for of in steps]
