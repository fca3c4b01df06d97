"""Convert sections of blocks to an edit list and travelled distance (Faustino 2024, §3.2.4, §3.3.2)."""

from __future__ import annotations

import numpy as np

from ...library.library import Library
from .blocks import FINEST, BlockSearch, Candidates
from .edit_list import EditList, PlacedKey, find_seams
from .locomotion import Section, travelled_distance
from .wanted import pool_frame

CATCH_UP_FRAMES = 60  # output frames over which a distance error is regained


# The boundary between two blocks moves by a few frames to where the two clips agree best.
#
# Faustino §3.2.5 shifts the exit and the entry frame separately by gradient descent; the motion then changes its
# length, key moments miss their frame and travelled distance drifts (the thesis itself, §5.2.1, names this as the main
# source of its distance errors). Here both shift by the same number of frames: one clip plays a little longer and the
# other begins as much later, so every other frame stays where it was. With so few possibilities all of them are tried.


REACH = 3  # frames that a boundary may move


# Time warping of a stretch so that it travels the right distance at the right time (Faustino §3.3.2).


STEEPNESS = 4.59512  # ln 99: the logistic of eq. 27 runs from 1 % to 99 %


def catch_up(error: float, frames: int, window: int) -> np.ndarray:
    """Distribute a distance error over the first frames of a locomotion stretch by a logistic.

    Eq. 27 runs from 1 % to 99 % of the error; it is stretched here to run from 0 to all of it, so that the next section
    does not inherit a rest.

    Args:
        error: m to be regained.
        frames: number of frames.
        window: frames over which it is regained.
    Returns:
        (frames,) m regained up to each frame.
    Source: Faustino 2024, §3.3.2, eq. 27, 28.
    """
    window = max(1, min(window, frames))
    at = np.minimum(np.arange(frames), window)
    logistic = 1.0 / (1.0 + np.exp(-STEEPNESS / (window / 2.0) * (at - window / 2.0)))
    low = 1.0 / (1.0 + np.exp(STEEPNESS))
    return error * (logistic - low) / (1.0 - 2.0 * low)


def warp(source: np.ndarray, target: np.ndarray, idle: float = 1e-3) -> np.ndarray:
    """Compute which source frames to show so that each output frame has travelled its share of the distance.

    Both distances are taken as shares of their totals, so that the whole stretch is played.

    Args:
        source: (M,) m travelled at each source frame, from 0, not decreasing.
        target: (F,) m travelled at each output frame, from 0, not decreasing.
        idle: m added per frame on both sides: where the body does not move, time itself passes.
    Returns:
        (F,) fractional source frames.
    Source: Faustino 2024, §3.3.2.
    """
    m, f = len(source), len(target)
    if m < 2 or f < 2:
        return np.zeros(f)
    own = np.maximum.accumulate(source - source[0]) + idle * np.arange(m)
    asked = np.maximum.accumulate(target - target[0]) + idle * np.arange(f) * ((m - 1) / (f - 1))
    # scale the target to the source's total, then invert the source's distance
    share = asked * (own[-1] / asked[-1])
    return np.interp(share, own, np.arange(m))


def edit_list(library: Library, clip: np.ndarray, frame: np.ndarray, keys: tuple[PlacedKey, ...], fixed) -> EditList:
    """Build an edit list and move its transitions to the best of +-3 frames.

    Args:
        library: the clips.
        clip: (T,) clip of each output frame.
        frame: (T,) library frame of each.
        keys: the placed key moments.
        fixed: output frames (key moments) across which no transition may move.
    """
    clip, frame = clip.copy(), frame.astype(float).copy()
    seams = find_seams(clip, frame)
    fixed = sorted(fixed)
    for number, seam in enumerate(seams):
        # between the neighbouring transitions and the fixed frames on either side
        low = max([0, *seams[number - 1 : number].tolist(), *[f + 1 for f in fixed if f < seam]])
        high = min([len(clip), *seams[number + 1 : number + 2].tolist(), *[f for f in fixed if f >= seam]])
        _move(library, clip, frame, seam=int(seam), low=low, high=high)
    return EditList(clip, frame, find_seams(clip, frame), keys)


def _move(library: Library, clip, frame, seam: int, low: int, high: int) -> None:
    """Move one transition within low < transition < high, in place."""
    shifts = [s for s in range(-REACH, REACH + 1) if low < seam + s < high]
    before, after = (clip[seam - 1], frame[seam - 1]), (clip[seam], frame[seam])
    costs = [_gap(library, before, after, s) for s in shifts]
    if not costs or np.min(costs) == np.inf:
        return
    # lowest cost first (rounded), then the smallest move
    shift = shifts[int(np.lexsort((np.abs(shifts), np.round(costs, 9)))[0])]
    # one of these loops is empty: the piece before plays on, or the piece after begins sooner
    for s in range(0, shift):
        clip[seam + s], frame[seam + s] = before[0], before[1] + 1 + s
    for s in range(shift, 0):
        clip[seam + s], frame[seam + s] = after[0], after[1] + s


def _gap(library: Library, before, after, shift: int) -> float:
    """Measure the distance between the frame that would follow before a transition and the one after it; inf outside a
    clip.

    Source: Faustino 2024, C of §3.2.5.
    """
    frames = library.frames
    places = []
    for (clip, frame), step in ((before, shift + 1), (after, shift)):
        at = int(round(frame)) + step
        if not frames.first[clip] <= at < frames.first[clip] + frames.count[clip]:
            return np.inf
        places.append(at)
    return float(np.linalg.norm(frames.features[places[0]] - frames.features[places[1]]))


def placed_keys(search: BlockSearch) -> tuple[PlacedKey, ...]:
    """List the key moments that the search's blocks show."""
    return tuple(PlacedKey(*served) for _, served in sorted(search.key_in_slot.items()))


def frames_of(blocks: Candidates) -> tuple[np.ndarray, np.ndarray]:
    """Return clip and library frame (8 K,) of every frame of K blocks."""
    frame = blocks.start[:, None] + np.arange(FINEST)
    return np.repeat(blocks.clip, FINEST), frame.ravel()


def straight_edit(search: BlockSearch, blocks: Candidates) -> EditList:
    """Join the blocks, cut to the request's length, with transitions moved to where clips agree best."""
    clip, frame = frames_of(blocks)
    count = len(search.wanted)
    fixed = [int(round(key.frame)) for key in search.wanted.keys if key.choices]
    return edit_list(search.library, clip[:count], frame[:count], placed_keys(search), fixed)


def warped_edit(search: BlockSearch, sections: list[Section], catching_up: bool) -> tuple[EditList, np.ndarray]:
    """Play the sections so that locomotion follows the track's speed.

    Other sections are played as recorded and travel what the recording did; what they lose or gain against the track is
    regained in the locomotion that follows, or stays.

    Args:
        search: the block search.
        sections: its blocks, with cycles added or removed.
        regains_distance: whether lost distance is regained.
    Returns:
        The edit list, and (T,) m travelled by each output frame.
    """
    clip, frame = frames_of(_joined(sections))
    source = edit_list(search.library, clip, frame, (), _fixed(search, sections))
    piece = np.zeros(len(source), int)
    piece[source.seams] = 1
    piece = np.cumsum(piece)
    asked, own = travelled_distance(search.wanted.track), _own_distance(search.library, source)
    shown, travelled, low = [], [], 0
    for section in sections:
        # low .. high: the section among the joined source frames; `out`: the section among the output frames
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
    """Join the blocks of all sections."""
    return Candidates(
        np.concatenate([s.blocks.clip for s in sections]), np.concatenate([s.blocks.start for s in sections])
    )


def _section_frames(section: Section, count: int) -> slice:
    """Return the output frames of a section, of `count`."""
    return slice(section.first * FINEST, min(section.end * FINEST, count))


def _fixed(search: BlockSearch, sections: list[Section]) -> list[int]:
    """List the frames of the joined sections that show a key moment."""
    out, low = [], 0
    for section in sections:
        for key in search.wanted.keys:
            inside = int(round(key.frame)) - section.first * FINEST
            if key.choices and not section.locomotion and 0 <= inside < FINEST * len(section.blocks):
                out.append(low + inside)
        low += FINEST * len(section.blocks)
    return out


def _own_distance(library: Library, source: EditList) -> np.ndarray:
    """Compute the distance (M,) m that the clips travel up to each frame of `source`.

    Across a transition nothing is travelled except what the frame before it would have continued to do.
    """
    frames = library.frames
    first, last = frames.first[source.clip], frames.first[source.clip] + frames.count[source.clip] - 1
    at = np.clip(np.round(source.frame).astype(int), first, last)
    step = np.linalg.norm(frames.velocity[at], axis=1) / library.fps
    return np.concatenate([[0.0], np.cumsum(step[:-1])])


def _played(section: Section, own: np.ndarray, asked: np.ndarray, so_far: float, catching_up: bool):
    """Compute the source frames (F,) of a section and the distance (F,) m from its start, for its F output frames."""
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
    """Build the edit list that plays frames `place` (T,) of `source`.

    Pieces stay apart, and one that shows a frame twice does not jump back for it.
    """
    nearest = np.clip(np.floor(place + 1e-6).astype(int), 0, len(source) - 1)
    after = np.minimum(nearest + 1, len(source) - 1)
    together = (piece[after] == piece[nearest]) & (after > nearest)
    step = np.where(together, source.frame[after] - source.frame[nearest], 1.0)
    frame = source.frame[nearest] + step * (place - nearest)
    seams = np.flatnonzero(np.diff(piece[nearest]) != 0) + 1
    return EditList(source.clip[nearest], frame, seams, keys)


def exact_keys(library: Library, edit: EditList, wanted) -> EditList:
    """Shift each key's piece by the fraction of a frame that the search's grid left.

    Args:
        library: the clips.
        edit: the edit list, at the library's rate.
        request: the request.
    """
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
