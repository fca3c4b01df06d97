"""Remedies of a collision on paths: the shortest wait, or the smallest detours, that keep two bodies apart."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .collisions import DISTANCE, HEIGHT, compute_least_gaps
from .detour import RISE, Follower, PathChange, compute_detour_width

_SPARE = 0.012  # metres kept beyond the distance: bodies move in curves between the samples of the search
_MOST_REMEDIES = 4  # remedies tried for a collision, those with the lowest cost
_AROUND = 1.0  # seconds around a collision that a remedy must keep clear
_AMOUNTS, _FINE = 16, 0.003  # amounts tried at once; seconds or metres added to the smallest that suffices
_EVEN_COST, _LEFT_COST = 0.5, 0.25  # costs that favour two small detours over a large one, and keeping to the right
_DETOURS = 2  # of one body in one place
_TIGHT = 0.3  # a detour on the inside of a bend leaves at least this share of its length


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


class RemedySearch:
    """The bodies on one clock, and the remedies for any two of them.

    Attributes:
        required_gap: metres that two bodies keep apart on the clock.
    """

    def __init__(self, followers: list[Follower], limits: Limits, clock: np.ndarray):
        self.followers, self.limits, self.clock = followers, limits, clock
        self.required_gap = limits.distance + _SPARE
        self.costs: dict[tuple[int, PathChange], float] = {}

    def list_remedies(self, changes, collision):
        """List the remedies of a collision with the lowest costs.

        Args:
            changes: what is already changed, of each body.
            collision: the collision.
        Returns:
            For each remedy, number of a body -> its change.
        """
        pair = [who for who in (collision.first, collision.second) if self.followers[who].path is not None]
        found = [self.find_wait(changes, collision, who) for who in pair]
        found += [self.find_detour(changes, collision, {who: side}) for who in pair for side in (-1.0, 1.0)]
        if len(pair) == 2:
            found += [self.find_detour(changes, collision, dict(zip(pair, sides)))
                      for sides in ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0))]
        found = [way for way in found if way is not None]
        return sorted(found, key=lambda way: self.compute_added_cost(changes, way))[:_MOST_REMEDIES]

    def compute_cost(self, who, change):
        """Compute the cost of a change: waiting, and metres to the side and back.

        Args:
            who: number of the body.
            change: its change.
        Returns:
            The cost.
        """
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

    def estimate_cost(self, collision):
        """Compute a lower bound for the cost of resolving a collision."""
        return self.limits.detour_cost * (self.required_gap - collision.gap)

    def compute_added_cost(self, changes, remedy):
        """Compute the additional cost of a remedy."""
        return sum(self.compute_cost(who, change) - self.compute_cost(who, changes[who])
                   for who, change in remedy.items())

    def find_wait(self, changes, collision, who):
        """Find the shortest wait of one body that resolves a collision.

        Args:
            changes: one `PathChange` for each body, so far.
            collision: the collision.
            who: number of the body that waits.
        Returns:
            The number of the body -> its change; None if no wait within the limits is enough.
        """
        if collision.start <= self.clock[0]:
            return None  # they are too near at their very start
        now, other = changes[who], collision.second if who == collision.first else collision.first
        times = self.select_times(collision)
        other_places = self.followers[other].at(times, changes[other])

        def measure_gap(more):
            later = self.followers[who].at((times - more[:, None]).ravel(), now).reshape(len(more), -1, 3)
            return self.compute_gap(later, other_places[None])

        def build_remedy(more):
            return {who: replace(now, delay=round(float(now.delay + more), 4))}

        return self.find_least_remedy(changes, collision, measure_gap, build_remedy, self.limits.delay - now.delay)

    def find_detour(self, changes, collision, sides):
        """Find the smallest detour that resolves a collision, to given sides and equal for all bodies that make one.

        Args:
            changes: one `PathChange` for each body, so far.
            collision: the collision.
            sides: number of each body that makes one -> its side, -1 or 1.
        Returns:
            Number of a body -> its change; None if no detour within the limits is enough.
        """
        covers = {who: self.compute_cover(changes, collision, who) for who in sides}
        if any(_is_crowded(changes[who], covers[who]) for who in sides):
            return None
        times = self.select_times(collision)

        def place_body(who, amounts):
            if who not in sides:
                return self.followers[who].at(times, changes[who])[None]
            train = self.build_train(who, covers[who], sides[who] * amounts[:, None])
            return self.followers[who].places_with_train(times, changes[who], train)

        def measure_gap(amounts):
            return self.compute_gap(place_body(collision.first, amounts), place_body(collision.second, amounts))

        def build_remedy(amount):
            trains = {who: _round_detours(self.build_train(who, covers[who], side * amount))
                      for who, side in sides.items()}
            return {who: replace(changes[who], detours=changes[who].detours + train) for who, train in trains.items()}

        least = self.find_least_remedy(changes, collision, measure_gap, build_remedy, self.limits.detour)
        return least if least and all(self.is_possible(who, change) for who, change in least.items()) else None

    def find_least_remedy(self, changes, collision, gap, remedy, most):
        """Find the remedy of the smallest amount that keeps both apart around a collision.

        Args:
            changes: one `PathChange` for each body, so far.
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
            if amount <= most + 1e-9 and self.is_clear(changes, collision, remedy(amount)):
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

    def is_clear(self, changes, collision, changed):
        """Return whether the two bodies are apart around the time of a collision, with these changes.

        Args:
            changes: one `PathChange` for each body, so far.
            collision: the collision.
            changed: number of a body -> its change, in place of the one so far.
        """
        times = self.select_times(collision)
        first, second = (self.followers[who].at(times, changed.get(who, changes[who]))[None]
                         for who in (collision.first, collision.second))
        return self.compute_gap(first, second)[0] >= self.required_gap

    def compute_cover(self, changes, collision, who):
        """Compute (first, last): metres along the original path between which a body must keep aside.

        Args:
            changes: one `PathChange` for each body, so far.
            collision: the collision.
            who: number of the body.
        """
        follower, change = self.followers[who], changes[who]
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


def _is_crowded(change, cover):
    """Return whether a body with this change has enough detours between (first, last) metres."""
    there = [detour for detour in change.detours if abs(detour[0] - 0.5 * sum(cover)) < 0.5 * detour[1]]
    return len(there) >= 2 * _DETOURS


def _round_detours(detours):
    """Round detours to plain numbers, to a tenth of a millimetre."""
    return tuple(tuple(round(float(number), 4) for number in detour) for detour in detours)
