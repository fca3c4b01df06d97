"""Convert sections of blocks to an edit list and travelled distance (Faustino 2016, §3.2.4, §3.3.2)."""

from __future__ import annotations

import numpy as np

from ...library.library import Library
from .blocks import FINEST_LENGTH, BlockCandidates, BlockSearch
from .edit_list import EditList, PlacedKey, find_transitions
from .locomotion import Section, compute_travelled_distance
from .request import library_frame

# The boundary between two blocks moves by a few frames to where the two clips agree best.
#
# Faustino §3.2.5 shifts the exit and the entry frame separately by gradient descent; the motion then changes its
# length, key moments miss their frame and travelled distance drifts (the thesis itself, §5.2.1, names this as the main
# source of its distance errors). Here both shift by the same number of frames: one clip plays a little longer and the
# other begins as much later, so every other frame stays where it was. With so few possibilities all of them are tried.


MAX_TRANSITION_SHIFT = 3  # frames that a boundary may move


# Time warping of a stretch so that it travels the right distance at the right time (Faustino §3.3.2).


LOGISTIC_STEEPNESS = 4.59512  # ln 99: the logistic of eq. 27 runs from 1 % to 99 %


def distribute_error(error: float, frames: int, window: int) -> np.ndarray:
    """Distribute a distance error over the first frames of a locomotion stretch by a logistic.

    Eq. 27 runs from 1 % to 99 % of the error; it is stretched here to run from 0 to all of it, so that the next section
    does not inherit a rest.

    Args:
        error: m to be regained.
        frames: number of frames.
        window: frames over which it is regained.
    Returns:
        (frames,) m regained up to each frame.
    Source: Faustino 2016, §3.3.2, eq. 27, 28.
    """
    window = max(1, min(window, frames))
    at = np.minimum(np.arange(frames), window)
    logistic = 1.0 / (1.0 + np.exp(-LOGISTIC_STEEPNESS / (window / 2.0) * (at - window / 2.0)))
    low = 1.0 / (1.0 + np.exp(LOGISTIC_STEEPNESS))
    return error * (logistic - low) / (1.0 - 2.0 * low)


def warp_time(source: np.ndarray, target: np.ndarray, idle: float = 1e-3) -> np.ndarray:
    """Compute which source frames to show so that each output frame has travelled its share of the distance.

    Both distances are taken as shares of their totals, so that the whole stretch is played.

    Args:
        source: (M,) m travelled at each source frame, from 0, not decreasing.
        target: (F,) m travelled at each output frame, from 0, not decreasing.
        idle: m added per frame on both sides: where the body does not move, time itself passes.
    Returns:
        (F,) fractional source frames.
    Source: Faustino 2016, §3.3.2.
    """
    m, f = len(source), len(target)
    if m < 2 or f < 2:
        return np.zeros(f)
    source_distance = np.maximum.accumulate(source - source[0]) + idle * np.arange(m)
    target_distance = np.maximum.accumulate(target - target[0]) + idle * np.arange(f) * ((m - 1) / (f - 1))
    # scale the target to the source's total, then invert the source's distance
    share = target_distance * (source_distance[-1] / target_distance[-1])
    return np.interp(share, source_distance, np.arange(m))


def build_edit_list(library: Library, clip: np.ndarray, frame: np.ndarray, keys: tuple[PlacedKey, ...],
                    fixed) -> EditList:
    """Build an edit list and move its transitions to the best of +-3 frames.

    Args:
        library: the clips.
        clip: (T,) clip of each output frame.
        frame: (T,) library frame of each.
        keys: the placed key moments.
        fixed: output frames (key moments) across which no transition may move.
    """
    clip, frame = clip.copy(), frame.astype(float).copy()
    transitions = find_transitions(clip, frame)
    fixed = sorted(fixed)
    for number, transition in enumerate(transitions):
        # between the neighbouring transitions and the fixed frames on either side
        low = max([0, *transitions[number - 1 : number].tolist(), *[f + 1 for f in fixed if f < transition]])
        high = min([len(clip), *transitions[number + 1 : number + 2].tolist(), *[f for f in fixed if f >= transition]])
        _move_transition(library, clip, frame, transition=int(transition), low=low, high=high)
    return EditList(clip, frame, find_transitions(clip, frame), keys)


def _move_transition(library: Library, clip, frame, transition: int, low: int, high: int) -> None:
    """Move one transition within low < transition < high, in place."""
    shifts = [s for s in range(-MAX_TRANSITION_SHIFT, MAX_TRANSITION_SHIFT + 1) if low < transition + s < high]
    before, after = (clip[transition - 1], frame[transition - 1]), (clip[transition], frame[transition])
    costs = [_measure_pose_gap(library, before, after, s) for s in shifts]
    if not costs or np.min(costs) == np.inf:
        return
    # lowest cost first (rounded), then the smallest move
    shift = shifts[int(np.lexsort((np.abs(shifts), np.round(costs, 9)))[0])]
    # one of these loops is empty: the piece before plays on, or the piece after begins sooner
    for s in range(0, shift):
        clip[transition + s], frame[transition + s] = before[0], before[1] + 1 + s
    for s in range(shift, 0):
        clip[transition + s], frame[transition + s] = after[0], after[1] + s


def _measure_pose_gap(library: Library, before, after, shift: int) -> float:
    """Measure the distance between the frame that would follow before a transition and the one after it; inf outside a
    clip.

    Source: Faustino 2016, C of §3.2.5.
    """
    frames = library.frames
    places = []
    for (clip, frame), step in ((before, shift + 1), (after, shift)):
        at = int(round(frame)) + step
        if not frames.first[clip] <= at < frames.first[clip] + frames.count[clip]:
            return np.inf
        places.append(at)
    return float(np.linalg.norm(frames.features[places[0]] - frames.features[places[1]]))


def list_placed_keys(search: BlockSearch) -> tuple[PlacedKey, ...]:
    """List the key moments that the search's blocks show."""
    return tuple(PlacedKey(*served) for _, served in sorted(search.key_in_slot.items()))


def list_block_frames(blocks: BlockCandidates) -> tuple[np.ndarray, np.ndarray]:
    """Return clip and library frame (8 K,) of every frame of K blocks."""
    frame = blocks.start[:, None] + np.arange(FINEST_LENGTH)
    return np.repeat(blocks.clip, FINEST_LENGTH), frame.ravel()


def build_straight_edit(search: BlockSearch, blocks: BlockCandidates) -> EditList:
    """Join the blocks, cut to the request's length, with transitions moved to where clips agree best."""
    clip, frame = list_block_frames(blocks)
    count = len(search.request)
    fixed = [int(round(key.frame)) for key in search.request.keys if key.choices]
    return build_edit_list(search.library, clip[:count], frame[:count], list_placed_keys(search), fixed)


def build_warped_edit(search: BlockSearch, sections: list[Section], catch_up: bool) -> tuple[EditList, np.ndarray]:
    """Play the sections so that locomotion follows the track's speed.

    Other sections are played as recorded and travel what the recording did; what they lose or gain against the track is
    regained in the locomotion that follows, or stays.

    Args:
        search: the block search.
        sections: its blocks, with cycles added or removed.
        catch_up: whether lost distance is regained, within the plan's `catch_up_window`.
    Returns:
        The edit list, and (T,) m travelled by each output frame.
    """
    clip, frame = list_block_frames(_join_sections(sections))
    source = build_edit_list(search.library, clip, frame, (), _list_key_frames(search, sections))
    piece = np.zeros(len(source), int)
    piece[source.transitions] = 1
    piece = np.cumsum(piece)
    track_distance, clip_distance = compute_travelled_distance(search.request.track), _compute_clip_distance(
        search.library, source)
    catch_up_frames = max(1, round(search.request.plan.catch_up_window * search.library.fps)) if catch_up else 0
    places, travelled, low = [], [], 0
    for section in sections:
        # low .. high: the section among the joined source frames; `out`: the section among the output frames
        high = low + FINEST_LENGTH * len(section.blocks)
        out = _section_frames(section, len(track_distance))
        so_far = travelled[-1][-1] if travelled else 0.0
        at, metres = _warp_section(section, clip_distance[low:high] - clip_distance[low], track_distance[out], so_far,
                                   catch_up_frames)
        places.append(low + at)
        travelled.append(so_far + metres)
        low = high
    place = np.concatenate(places)
    return _play_frames(source, piece, place, list_placed_keys(search)), np.concatenate(travelled)


def _join_sections(sections: list[Section]) -> BlockCandidates:
    """Join the blocks of all sections."""
    return BlockCandidates(
        np.concatenate([s.blocks.clip for s in sections]), np.concatenate([s.blocks.start for s in sections])
    )


def _section_frames(section: Section, count: int) -> slice:
    """Return the output frames of a section, of `count`."""
    return slice(section.first * FINEST_LENGTH, min(section.end * FINEST_LENGTH, count))


def _list_key_frames(search: BlockSearch, sections: list[Section]) -> list[int]:
    """List the frames of the joined sections that show a key moment."""
    out, low = [], 0
    for section in sections:
        for key in search.request.keys:
            inside = int(round(key.frame)) - section.first * FINEST_LENGTH
            if key.choices and not section.is_locomotion and 0 <= inside < FINEST_LENGTH * len(section.blocks):
                out.append(low + inside)
        low += FINEST_LENGTH * len(section.blocks)
    return out


def _compute_clip_distance(library: Library, source: EditList) -> np.ndarray:
    """Compute the distance (M,) m that the clips travel up to each frame of `source`.

    Across a transition nothing is travelled except what the frame before it would have continued to do.
    """
    frames = library.frames
    first, last = frames.first[source.clip], frames.first[source.clip] + frames.count[source.clip] - 1
    at = np.clip(np.round(source.frame).astype(int), first, last)
    step = np.linalg.norm(frames.velocity[at], axis=1) / library.fps
    return np.concatenate([[0.0], np.cumsum(step[:-1])])


def _warp_section(section: Section, clip_distance: np.ndarray, track_distance: np.ndarray, so_far: float,
                  catch_up_frames: int):
    """Compute the source frames (F,) of a section and the distance (F,) m from its start, for its F output frames."""
    count = len(track_distance)
    if not count:
        return np.zeros(0), np.zeros(0)
    if not section.is_locomotion:
        return np.arange(count, dtype=float), clip_distance[:count]
    goal = track_distance - track_distance[0]
    if catch_up_frames:
        goal = goal + distribute_error(float(track_distance[0]) - so_far, count, catch_up_frames)
    goal = np.maximum.accumulate(goal - goal[0])
    return warp_time(clip_distance, goal), goal


def _play_frames(source: EditList, piece: np.ndarray, place: np.ndarray, keys) -> EditList:
    """Build the edit list that plays frames `place` (T,) of `source`.

    Pieces stay apart, and one that shows a frame twice does not jump back for it.
    """
    nearest = np.clip(np.floor(place + 1e-6).astype(int), 0, len(source) - 1)
    after = np.minimum(nearest + 1, len(source) - 1)
    together = (piece[after] == piece[nearest]) & (after > nearest)
    step = np.where(together, source.frame[after] - source.frame[nearest], 1.0)
    frame = source.frame[nearest] + step * (place - nearest)
    transitions = np.flatnonzero(np.diff(piece[nearest]) != 0) + 1
    return EditList(source.clip[nearest], frame, transitions, keys)


def align_keys(library: Library, edit: EditList, request) -> EditList:
    """Shift each key's piece by the fraction of a frame that the search's grid left.

    Args:
        library: the clips.
        edit: the edit list, at the library's rate.
        request: the request.
    """
    frame = edit.frame.copy()
    for placed in edit.keys:
        at = request.keys[placed.number].frame
        low = next(piece for piece in edit.pieces if piece[0] <= int(round(at)) < piece[1])
        index = np.arange(*low)
        current = np.interp(at, index, frame[index]) if len(index) > 1 else frame[index][0]
        goal = library_frame(library, placed.key)
        if np.all(edit.clip[index] == placed.key.clip) and abs(goal - current) < 2.0:
            frame[index] += goal - current
    return EditList(edit.clip, frame, edit.transitions, edit.keys)
