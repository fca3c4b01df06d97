"""A search that looks at speed, turning and words together with continuity, over the whole track.

Faustino searches for words first and repairs distance afterwards; his §6.1 and §6.2 wish for position, distance and
orientation inside the main search. Here every slot of about eight frames offers every frame of the library at five rates;
its cost is how far speed, turn, facing and words are from what the track asks, plus what the change of pose costs. A beam
keeps the best states of every slot. Key moments are slots of their own, as long as the clips that serve them need, and the
beam has to pass through one of these clips at exactly the asked time.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..annotation import DISCRETE
from ..errors import Cancelled, InputError
from ..library.keys import Key
from ..library.library import Library
from .annotation_cost import AnnotationCost
from .edit_list import EditList, PlacedKey, find_seams, replaced
from .wanted import Wanted, needed, pool_frame

SLOT = 8
SHORTEST = 6
RATES = np.array([0.875, 0.9375, 1.0, 1.0625, 1.125])
KEY_RATES = np.array([0.7, 0.85, 1.0, 1.15, 1.3])
MEMORY_SLOTS = 15
BUCKET = 40


@dataclass(frozen=True)
class Width:
    """How much a search looks at: `beam` states are kept of every slot; `candidates` pairs of library frame and rate are
    weighed against them, the cheapest of the `looked_at` pairs nearest to the asked speed."""

    beam: int = 64
    candidates: int = 1500
    looked_at: int = 30000


NARROW = Width(beam=4, candidates=100, looked_at=2000)
"""What is left when somebody waits for the end."""


@dataclass(frozen=True)
class Weights:
    """What a unit of each misfit costs. speed per m/s; turn per radian and slot; facing per radian off the direction of
    travel; words for lacking all of the asked ones; unasked for frames of an action that nobody asked for, or that carry no
    word; made for a made gait, which steps in only where recordings miss the speed by more; rate per unit of warp; switch
    for any cut; pose per metre of joint distance; rate_change per unit; replay for a stretch shown less than 4 s ago.
    """

    speed: float = 1.0
    turn: float = 0.5
    facing: float = 0.1
    words: float = 0.6
    unasked: float = 0.5
    made: float = 0.2
    rate: float = 0.24
    switch: float = 0.1
    pose: float = 1.0
    rate_change: float = 0.16
    replay: float = 1.5


@dataclass(frozen=True)
class Slot:
    """Output frames first .. end at the library's rate; keys: (number of the wanted key, its choices) or None."""

    first: int
    end: int
    key: tuple[int, tuple[Key, ...]] | None = None

    def __len__(self) -> int:
        return self.end - self.first


@dataclass(frozen=True, eq=False)
class Between:
    """A stretch to be searched anew, frames first .. end of `edit` at the library's rate. What `edit` shows before and
    behind stays: the search sets out from the one and pays for the way to the other."""

    edit: EditList
    first: int
    end: int


@dataclass(frozen=True, eq=False)
class States:
    """B ways to fill a slot: clip (B,), start (B,) library frame, rate (B,), cost (B,) of the best way here, back (B,)
    state of the slot before, choice (B,) of a key's clips or -1, recent (B, M) buckets shown lately."""

    clip: np.ndarray
    start: np.ndarray
    rate: np.ndarray
    cost: np.ndarray
    back: np.ndarray
    choice: np.ndarray
    recent: np.ndarray


class Offer:
    """What a library offers to a slot, whatever is asked: speed, turn and validity (R, N) of every frame at every rate,
    the pairs in the order of their speed, and words by frame. Worked out once and kept as long as the library."""

    _kept: weakref.WeakKeyDictionary[Library, dict[bytes, "Offer"]] = weakref.WeakKeyDictionary()

    @classmethod
    def of(cls, library: Library, allowed: np.ndarray) -> "Offer":
        """The library's offer with the clips of `allowed` (C,) bool."""
        kept = cls._kept.setdefault(library, {})
        if allowed.tobytes() not in kept:
            kept[allowed.tobytes()] = cls(library, allowed)
        return kept[allowed.tobytes()]

    def __init__(self, library: Library, allowed: np.ndarray):
        """Works it all out; `of` does so only once."""
        self.frames = library.frames
        self.annotation = AnnotationCost(library.frames)
        made = np.array([clip.made for clip in library.clips])
        self.made = made[library.frames.clip]
        self.bucket = (np.arange(len(library.frames)) // BUCKET).astype(int)
        self.speed, self.turn, lasts = map(np.stack, zip(*(played_speed_and_turn(library, rate) for rate in RATES)))
        self.valid = lasts & allowed[library.frames.clip]
        usable = np.flatnonzero(self.valid)
        self.by_speed = usable[np.argsort(self.speed.ravel()[usable], kind="stable")]
        self.speeds = self.speed.ravel()[self.by_speed]
        self.off_travel = np.abs(np.arctan2(self.frames.velocity[:, 1], self.frames.velocity[:, 0]))
        self._missing: dict[frozenset[str], np.ndarray] = {}
        self._other: dict[frozenset[str], np.ndarray] = {}

    def missing_share(self, words: frozenset[str]) -> np.ndarray:
        """(N,) share of the words that each frame lacks."""
        if words not in self._missing:
            self._missing[words] = self.annotation.missing_share(words)
        return self._missing[words]

    def unasked(self, words: frozenset[str]) -> np.ndarray:
        """(N,) bool: frames that show an action (a kick, a jump) nobody asked for, or nothing that is annotated."""
        if words not in self._other:
            names = self.frames.vocabulary
            actions = [i for i, word in enumerate(names) if word in DISCRETE and word not in words]
            self._other[words] = self.frames.words[:, actions].any(axis=1) | ~self.frames.words.any(axis=1)
        return self._other[words]


class PathSearch:
    """One search; `run()` gives the edit list.

    between: search this stretch only and keep the rest. hurry: when it says so the rest is searched by a narrow beam, and
    `hurried` is the frame from which on, else None; before the first slot is filled it ends the search as `cancelled` does.
    """

    def __init__(
        self,
        library: Library,
        wanted: Wanted,
        weights: Weights = Weights(),
        progress: Callable[[float, str], None] | None = None,
        cancelled: Callable[[], bool] | None = None,
        hurry: Callable[[], bool] | None = None,
        between: Between | None = None,
    ):
        self.library, self.wanted, self.weights, self.between = library, wanted, weights, between
        self.frames = library.frames
        self.offer = Offer.of(library, wanted.allowed)
        self.width, self.hurried = Width(), None
        self._report = progress or (lambda fraction, text: None)
        self._cancelled = cancelled or (lambda: False)
        self._hurry = hurry or (lambda: False)

    def run(self) -> EditList:
        """The cheapest way through all slots that the beam finds; InputError where no clip is as long as a slot."""
        if not len(self.offer.by_speed):
            raise InputError(
                self.library.folder or "library", f"no clip of more than {SLOT} frames at {self.library.fps:g} per second",
                "clips of a second or more", "add longer recordings",
            )
        first, end = (self.between.first, self.between.end) if self.between else (0, len(self.wanted))
        slots = slots_between_keys(self.library, self.wanted, first, end)
        before, last = self._arriving() if first > 0 else (None, None)
        layers: list[States] = []
        for number, slot in enumerate(slots):
            self._stop_or_hurry(slot, number)
            self._report(number / len(slots), "Searching")
            before, last = self._layer(slot, before, last), slot
            layers.append(before)
        if end < len(self.wanted):
            layers[-1] = self._leaving(layers[-1], slots[-1])
        return self._read(slots, layers)

    def _stop_or_hurry(self, slot: Slot, number: int) -> None:
        if self._cancelled() or number == 0 and self._hurry():
            raise Cancelled("synthesis: cancelled")
        if self.hurried is None and self._hurry():
            self.width, self.hurried = NARROW, slot.first

    def _arriving(self) -> tuple[States, Slot]:
        """The one state from which a stretch sets out, and its slot: the frame before, and what was shown up to there."""
        first, edit = self.between.first, self.between.edit
        at = np.array([first - 1])
        shown = edit.frame[np.maximum(first - SLOT * np.arange(MEMORY_SLOTS, 0, -1), 0)]
        recent = self.offer.bucket[self._inside(shown)][None, :]
        nothing = np.zeros(1, int)
        state = States(edit.clip[at], edit.frame[at], _steps(edit, at), np.zeros(1), nothing, nothing - 1, recent)
        return state, Slot(first - 1, first)

    def _leaving(self, states: States, last: Slot) -> States:
        """The last states, with what it costs to come to the frame that stays behind the stretch."""
        edit, at = self.between.edit, np.array([self.between.end])
        ends = states.start + states.rate * len(last)
        start, rate = edit.frame[at], _steps(edit, at)
        cut = self._switch_costs(states, ends, start, rate)[:, 0]
        same = (states.clip == edit.clip[at]) & (np.abs(ends - start) < 1e-6)
        on = self.weights.rate_change * np.abs(states.rate - rate)
        return replace(states, cost=states.cost + np.where(same, on, cut))

    def _layer(self, slot: Slot, before: States | None, last: Slot | None) -> States:
        """The best states of one slot, given those of the slot before."""
        clip, start, rate, unary, choice = self._key_states(slot) if slot.key else self._free_states(slot)
        if before is None:
            return self._first(clip, start, rate, unary, choice)
        ends = before.start + before.rate * len(last)
        through = before.cost[:, None] + self._switch_costs(before, ends, start, rate)
        back = np.argmin(through, axis=0)
        cost = through[back, np.arange(len(start))] + unary
        options = [(clip, start, rate, cost, back, choice)]
        if slot.key is None:
            options.append(self._continued(slot, before, ends))
        return self._kept(before, *(np.concatenate(parts) for parts in zip(*options)))

    def _first(self, clip, start, rate, unary, choice) -> States:
        best = np.argsort(unary, kind="stable")[: self.width.beam]
        recent = np.full((len(best), MEMORY_SLOTS), -1)
        recent[:, -1] = self.offer.bucket[self._inside(start[best])]
        back = np.zeros(len(best), int)
        return States(clip[best], start[best], rate[best], unary[best], back, choice[best], recent)

    def _kept(self, before: States, clip, start, rate, cost, back, choice) -> States:
        """The cheapest, as many as the beam keeps, with their memory moved on by one slot."""
        best = np.argsort(cost, kind="stable")[: self.width.beam]
        start, back = start[best], back[best]
        recent = np.roll(before.recent[back], -1, axis=1)
        recent[:, -1] = self.offer.bucket[self._inside(start)]
        return States(clip[best], start, rate[best], cost[best], back, choice[best], recent)

    def _inside(self, frame: np.ndarray) -> np.ndarray:
        return np.clip(np.round(frame).astype(int), 0, len(self.frames) - 1)

    def _free_states(self, slot: Slot):
        """The cheapest pairs of library frame and rate for a slot without a key moment.

        Only the pairs nearest to the asked speed are looked at: the others' misfit in speed alone would put them behind,
        and a large library is searched as fast as a small one.
        """
        many, looked_at = self.width.candidates, self.width.looked_at
        middle = int(np.searchsorted(self.offer.speeds, self._asked(slot)[0]))
        low = int(np.clip(middle - looked_at // 2, 0, max(0, len(self.offer.by_speed) - looked_at)))
        pairs = self.offer.by_speed[low : low + looked_at]
        number, start = np.divmod(pairs, len(self.frames))
        cost = self._misfit(slot, number, start)
        best = np.sort(np.argpartition(cost, many)[:many]) if len(cost) > many else np.arange(len(cost))
        number, start, cost = number[best], start[best], cost[best]
        states = self.frames.clip[start], start.astype(float), RATES[number], cost, np.full(len(cost), -1)
        kept = self._as_before(slot)
        return tuple(np.concatenate(pair) for pair in zip(states, kept)) if kept else states

    def _as_before(self, slot: Slot):
        """What the edit list shows in a slot of a stretch that is searched anew, as one more state, so that the search
        may come back to it; None where it is cut there."""
        if self.between is None or np.any((self.between.edit.seams > slot.first) & (self.between.edit.seams < slot.end)):
            return None
        edit, at = self.between.edit, np.array([slot.first])
        rate = _steps(edit, at)
        number = np.abs(RATES[:, None] - rate).argmin(axis=0)
        cost = self._misfit(slot, number, self._inside(edit.frame[at]))
        return edit.clip[at], edit.frame[at], rate, cost, np.full(1, -1)

    def _misfit(self, slot: Slot, number: np.ndarray, frame: np.ndarray) -> np.ndarray:
        """(K,) what library frames (K,), played from there on at RATES[number (K,)], cost in a slot; inf where the clip
        ends before or may not be used."""
        wanted_speed, wanted_turn = self._asked(slot)
        w, moving, offer = self.weights, min(1.0, wanted_speed), self.offer
        cost = w.speed * np.abs(offer.speed[number, frame] - wanted_speed)
        turn = offer.turn[number, frame] * (len(slot) / SLOT)
        cost += w.turn * (0.3 + 0.7 * moving) * np.abs(turn - wanted_turn)
        cost += w.facing * moving * offer.off_travel[frame] + w.rate * np.abs(RATES[number] - 1.0)
        words = self.wanted.asked[(slot.first + slot.end) // 2]
        if words:
            cost += w.words * offer.missing_share(words)[frame]
        cost += w.unasked * offer.unasked(words or frozenset())[frame] + w.made * offer.made[frame]
        return np.where(offer.valid[number, frame], cost, np.inf)

    def _asked(self, slot: Slot) -> tuple[float, float]:
        """Mean speed in m/s and change of direction in radians that the track asks over a slot."""
        track = self.wanted.track
        last = min(slot.end, len(track.times) - 1)
        speed = float(track.speed[slot.first : last + 1].mean())
        return speed, float(track.direction[last] - track.direction[slot.first]) * min(1.0, speed)

    def _key_states(self, slot: Slot):
        """A state per clip that can serve the slot's key moment at the asked time, and per rate. A kick that was recorded
        slower than the player runs is played faster, within the limits of what may give way (../shared/metrics.md)."""
        number, choices = slot.key
        wanted_speed, _ = self._asked(slot)
        choice = np.repeat(np.arange(len(choices)), len(KEY_RATES))
        rate = np.tile(KEY_RATES, len(choices))
        clip = np.array([key.clip for key in choices])[choice]
        middle = np.array([pool_frame(self.library, key) for key in choices])[choice]
        start = middle - rate * (self.wanted.keys[number].frame - slot.first)
        first, last = self.frames.first[clip], self.frames.first[clip] + self.frames.count[clip] - 1
        held = np.maximum(first - start, 0) + np.maximum(start + rate * len(slot) - last, 0)
        span = np.round(start[:, None] + rate[:, None] * np.arange(len(slot))).astype(int)
        speed = rate * self.frames.speed[np.clip(span, first[:, None], last[:, None])].mean(axis=1)
        stretch = np.maximum(np.abs(rate - 1.0) - 0.15, 0.0)
        misfit = self.weights.speed * np.abs(speed - wanted_speed) + self.weights.rate * np.abs(rate - 1.0) + 4.0 * stretch
        return clip, start, rate, (misfit + 0.1 * held) * (len(slot) / SLOT), choice

    def _switch_costs(self, before: States, ends: np.ndarray, start: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """(B, K) cost of cutting from each kept state to each candidate."""
        a, b = self.frames.features[self._inside(ends)], self.frames.features[self._inside(start)]
        square = (a * a).sum(1)[:, None] + (b * b).sum(1) - 2.0 * (a @ b.T)
        cost = self.weights.switch + self.weights.pose * np.sqrt(np.maximum(square, 0.0))
        cost += self.weights.rate_change * np.abs(before.rate[:, None] - rate[None, :])
        return cost + self.weights.replay * self._seen(before)[:, self.offer.bucket[self._inside(start)]]

    def _seen(self, before: States) -> np.ndarray:
        """(B, buckets) whether a state has lately shown a bucket of frames or its neighbours."""
        seen = np.zeros((len(before.start), self.offer.bucket[-1] + 3), bool)
        row = np.arange(len(before.start))[:, None]
        for shift in (0, 1, 2):
            seen[row, np.maximum(before.recent + shift, 0)] = True
        return seen[:, 1:-1]

    def _continued(self, slot: Slot, before: States, ends: np.ndarray):
        """Going on without a cut, at each rate; a slot a little longer than SLOT must still end inside the clip."""
        back = np.repeat(np.arange(len(ends)), len(RATES))
        number = np.tile(np.arange(len(RATES)), len(ends))
        clip, start, rate = before.clip[back], ends[back], RATES[number]
        first, last = self.frames.first[clip], self.frames.first[clip] + self.frames.count[clip] - 1
        inside = (start >= first) & (start + rate * len(slot) <= last)
        unary = np.where(inside, self._misfit(slot, number, self._inside(start)), np.inf)
        cost = before.cost[back] + unary + self.weights.rate_change * np.abs(rate - before.rate[back])
        return clip, start, rate, cost, back, np.full(len(back), -1)

    def _read(self, slots: list[Slot], layers: list[States]) -> EditList:
        """Follows the cheapest last state back to the first."""
        state = int(np.argmin(layers[-1].cost))
        clip, frame = np.empty(len(self.wanted), int), np.empty(len(self.wanted))
        keys = []
        for slot, states in zip(slots[::-1], layers[::-1]):
            frame[slot.first : slot.end] = states.start[state] + states.rate[state] * np.arange(len(slot))
            clip[slot.first : slot.end] = states.clip[state]
            if slot.key:
                key = slot.key[1][states.choice[state]]
                keys.append(PlacedKey(slot.key[0], key))
            state = int(states.back[state])
        keys = tuple(keys[::-1])
        if self.between:
            return replaced(self.between.edit, slots[0].first, slots[-1].end, clip, frame, keys)
        return EditList(clip, frame, find_seams(clip, frame), keys)


def _steps(edit: EditList, at: np.ndarray) -> np.ndarray:
    """(K,) library frames that an edit list goes on by at its frames `at` (K,), as played within their pieces."""
    starts = np.array([low for low, _ in edit.pieces])
    piece = np.searchsorted(starts, at, side="right") - 1
    low, high = starts[piece], np.append(starts[1:], len(edit))[piece]
    one = np.clip(at, low, np.maximum(high - 2, low))
    return np.where(high - low > 1, edit.frame[np.minimum(one + 1, len(edit) - 1)] - edit.frame[one], 1.0)


def slots_between_keys(library: Library, wanted: Wanted, first: int = 0, last: int | None = None) -> list[Slot]:
    """Frames first .. last (all of them) cut into slots: one per served key moment there, as long as its clips' entry and
    exit, and slots of about eight frames between. Key moments that crowd each other share the frames between them."""
    last = len(wanted) if last is None else last
    served = [(number, key) for number, key in enumerate(wanted.keys) if key.choices and first <= round(key.frame) < last]
    edges = [float(first), *[(a[1].frame + b[1].frame) / 2 for a, b in zip(served, served[1:])], float(last)]
    slots: list[Slot] = []
    reached = first
    for (number, key), low, high in zip(served, edges, edges[1:]):
        entry, leave = np.mean([needed(library, choice) for choice in key.choices], axis=0)
        at = int(round(key.frame))
        first = max(reached, min(at, int(np.ceil(max(low, key.frame - entry)))))
        end = min(last, max(at + 1, int(min(high, key.frame + leave))))
        # what is left beside a key moment is too short for a clip of its own: seams that close cannot be smoothed
        first = reached if first - reached < SHORTEST else first
        end = last if last - end < SHORTEST else end
        slots += _evenly(reached, first) + [Slot(first, end, (number, key.choices))]
        reached = end
    return slots + _evenly(reached, last)


def _evenly(first: int, end: int) -> list[Slot]:
    """Slots of about SLOT frames between two frames."""
    count = max(1, round((end - first) / SLOT)) if end > first else 0
    edges = [first + round(i * (end - first) / count) for i in range(count + 1)] if count else []
    return [Slot(low, high) for low, high in zip(edges, edges[1:])]


def played_speed_and_turn(library: Library, rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Per library frame, if a slot starts there at `rate`: (N,) mean speed in m/s, (N,) turn of the body in radians, (N,)
    whether the clip lasts that long."""
    frames = library.frames
    after = np.arange(len(frames)) + SLOT * rate
    valid = frames.left_in_clip >= SLOT * rate
    low = np.minimum(np.floor(after).astype(int), len(frames) - 2)
    weight = after - low
    weight[~valid] = 0.0
    low[~valid] = np.minimum(np.arange(len(frames))[~valid], len(frames) - 2)
    path = frames.path[low] * (1 - weight)[:, None] + frames.path[low + 1] * weight[:, None]
    heading = frames.heading[low] * (1 - weight) + frames.heading[low + 1] * weight
    speed = np.linalg.norm(path - frames.path, axis=1) * library.fps / SLOT
    return speed, heading - frames.heading, valid
