"""Sections of blocks turned into what each output frame shows and how far it has travelled (Faustino §3.2.4,
§3.3.2)."""

from __future__ import annotations

import numpy as np

from ...library.library import Library
from .blocks import FINEST, BlockSearch, Candidates
from .edit_list import EditList, PlacedKey, find_seams
from .locomotion import Section, travelled_distance
from .wanted import pool_frame

CATCH_UP_FRAMES = 60


# Where one block ends and the next begins: the boundary moved by a few frames to where the two clips agree best.
#
# Faustino §3.2.5 shifts the exit and the entry frame separately by gradient descent; the motion then changes its
# length, key moments miss their frame and travelled distance drifts (his own §5.2.1 names this as the main source of
# his distance errors). We shift both by the same number of frames: one clip plays a little longer and the other
# begins as much later, so every other frame stays where it was, and with so few possibilities all of them are tried.


REACH = 3


# Playing a stretch so that it travels what it should, when it should (Faustino §3.3.2).


STEEPNESS = 4.59512


def catch_up(error: float, frames: int, window: int) -> np.ndarray:
    """(frames,) metres of `error` regained by each frame of a locomotion stretch, spread over its first `window` frames
    by the logistic of eq. 27, 28.

    Eq. 27 runs from 1 % to 99 % of the error; it is stretched here to run from 0 to all of it, so that the next section
    does not inherit a rest."""
    window = max(1, min(window, frames))
    at = np.minimum(np.arange(frames), window)
    logistic = 1.0 / (1.0 + np.exp(-STEEPNESS / (window / 2.0) * (at - window / 2.0)))
    low = 1.0 / (1.0 + np.exp(STEEPNESS))
    return error * (logistic - low) / (1.0 - 2.0 * low)


def warp(source: np.ndarray, target: np.ndarray, idle: float = 1e-3) -> np.ndarray:
    """Fractional source frames (F,) to show so that each output frame has travelled its share of the way.

    source: (M,) metres travelled at each source frame, target: (F,) at each output frame, both from 0 and not
    decreasing. Both are taken as shares of their totals, so that the whole stretch is played. `idle` metres are added
    per frame on both sides: where nobody moves, time itself passes."""
    m, f = len(source), len(target)
    if m < 2 or f < 2:
        return np.zeros(f)
    own = np.maximum.accumulate(source - source[0]) + idle * np.arange(m)
    asked = np.maximum.accumulate(target - target[0]) + idle * np.arange(f) * ((m - 1) / (f - 1))
    share = asked * (own[-1] / asked[-1])
    return np.interp(share, own, np.arange(m))


def edit_list(library: Library, clip: np.ndarray, frame: np.ndarray, keys: tuple[PlacedKey, ...], fixed) -> EditList:
    """An edit list from per-frame clips (T,) and library frames (T,), its seams moved to the best of +-3 frames.

    fixed: output frames (key moments) across which no seam may move."""
    clip, frame = clip.copy(), frame.astype(float).copy()
    seams = find_seams(clip, frame)
    fixed = sorted(fixed)
    for number, seam in enumerate(seams):
        low = max([0, *seams[number - 1 : number].tolist(), *[f + 1 for f in fixed if f < seam]])
        high = min([len(clip), *seams[number + 1 : number + 2].tolist(), *[f for f in fixed if f >= seam]])
        _move(library, clip, frame, seam=int(seam), low=low, high=high)
    return EditList(clip, frame, find_seams(clip, frame), keys)


def _move(library: Library, clip, frame, seam: int, low: int, high: int) -> None:
    """Moves one seam within low < seam < high, in place."""
    shifts = [s for s in range(-REACH, REACH + 1) if low < seam + s < high]
    before, after = (clip[seam - 1], frame[seam - 1]), (clip[seam], frame[seam])
    costs = [_gap(library, before, after, s) for s in shifts]
    if not costs or np.min(costs) == np.inf:
        return
    shift = shifts[int(np.lexsort((np.abs(shifts), np.round(costs, 9)))[0])]
    for s in range(0, shift):
        clip[seam + s], frame[seam + s] = before[0], before[1] + 1 + s
    for s in range(shift, 0):
        clip[seam + s], frame[seam + s] = after[0], after[1] + s


def _gap(library: Library, before, after, shift: int) -> float:
    """Distance between the frame that would follow before the seam and the one after it: C of §3.2.5; inf outside a
    clip."""
    frames = library.frames
    places = []
    for (clip, frame), step in ((before, shift + 1), (after, shift)):
        at = int(round(frame)) + step
        if not frames.first[clip] <= at < frames.first[clip] + frames.count[clip]:
            return np.inf
        places.append(at)
    return float(np.linalg.norm(frames.features[places[0]] - frames.features[places[1]]))


def placed_keys(search: BlockSearch) -> tuple[PlacedKey, ...]:
    """The key moments that the search's blocks show."""
    return tuple(PlacedKey(*served) for _, served in sorted(search.key_in_slot.items()))


def frames_of(blocks: Candidates) -> tuple[np.ndarray, np.ndarray]:
    """Clip and library frame of every frame of the blocks, (8 K,) each."""
    frame = blocks.start[:, None] + np.arange(FINEST)
    return np.repeat(blocks.clip, FINEST), frame.ravel()


def straight_edit(search: BlockSearch, blocks: Candidates) -> EditList:
    """The blocks one after the other, cut to the order's length, seams moved to where clips agree best."""
    clip, frame = frames_of(blocks)
    count = len(search.wanted)
    fixed = [int(round(key.frame)) for key in search.wanted.keys if key.choices]
    return edit_list(search.library, clip[:count], frame[:count], placed_keys(search), fixed)


def warped_edit(search: BlockSearch, sections: list[Section], catching_up: bool) -> tuple[EditList, np.ndarray]:
    """The sections played so that locomotion goes at the track's speed, and (T,) metres travelled by each output frame.

    Other sections are played as recorded and travel what the recording did; what they lose or gain against the track is
    regained in the locomotion that follows (`catching_up`), or stays."""
    clip, frame = frames_of(_joined(sections))
    source = edit_list(search.library, clip, frame, (), _fixed(search, sections))
    piece = np.zeros(len(source), int)
    piece[source.seams] = 1
    piece = np.cumsum(piece)
    asked, own = travelled_distance(search.wanted.track), _own_distance(search.library, source)
    shown, travelled, low = [], [], 0
    for section in sections:
        high = low + FINEST * len(section.blocks)
        out = _section_frames(section, len(asked))
        so_far = travelled[-1][-1] if travelled else 0.0
        at, metres = _played(section, own[low:high] - own[low], asked[out], so_far, catching_up)
        shown.append(low + at)
        travelled.append(so_far + metres)
        low = high
    place = np.concatenate(shown)
    return _read_through(source, piece, place, placed_keys(search)), np.concatenate(travelled)


def _joined(sections: list[Section]) -> Candidates:
    return Candidates(
        np.concatenate([s.blocks.clip for s in sections]), np.concatenate([s.blocks.start for s in sections])
    )


def _section_frames(section: Section, count: int) -> slice:
    return slice(section.first * FINEST, min(section.end * FINEST, count))


def _fixed(search: BlockSearch, sections: list[Section]) -> list[int]:
    """Frames of the joined sections that show a key moment."""
    out, low = [], 0
    for section in sections:
        for key in search.wanted.keys:
            inside = int(round(key.frame)) - section.first * FINEST
            if key.choices and not section.locomotion and 0 <= inside < FINEST * len(section.blocks):
                out.append(low + inside)
        low += FINEST * len(section.blocks)
    return out


def _own_distance(library: Library, source: EditList) -> np.ndarray:
    """(M,) metres that the clips travel up to each frame of `source`; nothing is travelled across a seam but what the
    frame before it would have gone on to do."""
    frames = library.frames
    first, last = frames.first[source.clip], frames.first[source.clip] + frames.count[source.clip] - 1
    at = np.clip(np.round(source.frame).astype(int), first, last)
    step = np.linalg.norm(frames.velocity[at], axis=1) / library.fps
    return np.concatenate([[0.0], np.cumsum(step[:-1])])


def _played(section: Section, own: np.ndarray, asked: np.ndarray, so_far: float, catching_up: bool):
    """Source frames (F,) within the section and metres (F,) travelled from its start, for its F output frames."""
    count = len(asked)
    if not count:
        return np.zeros(0), np.zeros(0)
    if not section.locomotion:
        return np.arange(count, dtype=float), own[:count]
    goal = asked - asked[0]
    if catching_up:
        goal = goal + catch_up(float(asked[0]) - so_far, count, CATCH_UP_FRAMES)
    goal = np.maximum.accumulate(goal - goal[0])
    return warp(own, goal), goal


def _read_through(source: EditList, piece: np.ndarray, place: np.ndarray, keys) -> EditList:
    """What is shown when frames `place` (T,) of `source` are played; pieces stay apart, and one that shows a frame
    twice does not go back for it."""
    nearest = np.clip(np.floor(place + 1e-6).astype(int), 0, len(source) - 1)
    after = np.minimum(nearest + 1, len(source) - 1)
    together = (piece[after] == piece[nearest]) & (after > nearest)
    step = np.where(together, source.frame[after] - source.frame[nearest], 1.0)
    frame = source.frame[nearest] + step * (place - nearest)
    seams = np.flatnonzero(np.diff(piece[nearest]) != 0) + 1
    return EditList(source.clip[nearest], frame, seams, keys)


def exact_keys(library: Library, edit: EditList, wanted) -> EditList:
    """The edit list with each key's piece shifted by the part of a frame that the search's grid left over."""
    frame = edit.frame.copy()
    for placed in edit.keys:
        at = wanted.keys[placed.wanted].frame
        low = next(piece for piece in edit.pieces if piece[0] <= int(round(at)) < piece[1])
        index = np.arange(*low)
        shown = np.interp(at, index, frame[index]) if len(index) > 1 else frame[index][0]
        goal = pool_frame(library, placed.key)
        if np.all(edit.clip[index] == placed.key.clip) and abs(goal - shown) < 2.0:
            frame[index] += goal - shown
    return EditList(edit.clip, frame, edit.seams, edit.keys)
