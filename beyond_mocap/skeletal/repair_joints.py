"""Repair what trackers confuse: left and right of a body, and two people who pass each other."""

from __future__ import annotations

import numpy as np

from ..files.joints.landmarks import LANDMARKS

_MIN_WIDTH = 0.08  # metres between left and right on the ground; nearer, the body is seen from above its side
_LONGEST_GAP = 10  # frames in which a person cannot turn round
_SWAP_GAIN = 1.0  # metres by which the steps of two people must be shorter if they are exchanged


def repair_sides(landmarks: tuple[str, ...], positions: np.ndarray) -> tuple[np.ndarray, int]:
    """Exchange left and right where a tracker has confused them.

    The line from the right to the left of hips and shoulders turns steadily; where it leaps to its opposite, sides were
    exchanged or come back. Which of the two stretches is right follows from the feet, whose toes are ahead, and the
    nose. In a gap a person may turn round: what lies behind it is judged by itself.

    Args:
        landmarks: L names, each side's with the other side's.
        positions: (T, L, 3) metres, NaN where not seen.
    Returns:
        (T, L, 3), and the number of frames in which sides were exchanged.
    """
    across = _measure_across(landmarks, positions)
    wide = np.flatnonzero(np.linalg.norm(across, axis=1) > _MIN_WIDTH)
    ahead = _measure_ahead(landmarks, positions)
    is_wrong = np.zeros(len(positions), dtype=bool)
    for part in np.split(wide, np.flatnonzero(np.diff(wide) > _LONGEST_GAP) + 1):
        is_wrong[part] = _find_exchanged(across[part], ahead[part])
    out = positions.copy()
    out[is_wrong] = positions[is_wrong][:, _list_mirrored(landmarks)]
    return out, int(is_wrong.sum())


def _find_exchanged(across: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Find the frames (T,) bool in which sides are exchanged, from right to left and to the front (T, 2)."""
    leaps = np.sum(across[1:] * across[:-1], axis=1) < 0.0
    parity = np.concatenate([np.zeros(min(len(across), 1)), np.cumsum(leaps)]) % 2
    # with left across, forward is left turned by a right angle: (y, -x)
    facing = np.sum(np.stack([across[:, 1], -across[:, 0]], axis=1) * ahead, axis=1)
    evidence = np.nansum(np.where(parity == 0, facing, -facing))
    if evidence == 0.0:  # no toes and no nose: most frames are right
        evidence = np.sum(parity == 0) - np.sum(parity == 1)
    return parity == (1 if evidence > 0.0 else 0)


def _list_mirrored(landmarks: tuple[str, ...]) -> list[int]:
    """List for each of LANDMARKS the index of the one on the other side."""
    other = {"left": "right", "right": "left"}
    return [landmarks.index("_".join(other.get(word, word) for word in name.split("_"))) for name in landmarks]


def _measure_across(landmarks: tuple[str, ...], positions: np.ndarray) -> np.ndarray:
    """Measure the mean vector (T, 2) from right to left hip and shoulder on the ground; 0 where neither is seen."""
    vectors = [positions[:, landmarks.index(f"left_{part}"), :2] - positions[:, landmarks.index(f"right_{part}"), :2]
               for part in ("hip", "shoulder") if f"left_{part}" in landmarks and f"right_{part}" in landmarks]
    if not vectors:
        return np.zeros((len(positions), 2))
    return np.nan_to_num(_average(np.stack(vectors)))


def _measure_ahead(landmarks: tuple[str, ...], positions: np.ndarray) -> np.ndarray:
    """Measure where toes and nose point on the ground (T, 2); NaN where they are not seen."""
    vectors = []
    for side in ("left", "right"):
        for toe in ("big_toe", "foot", "small_toe"):
            if f"{side}_{toe}" in landmarks and f"{side}_ankle" in landmarks:
                vectors.append(positions[:, landmarks.index(f"{side}_{toe}"), :2]
                               - positions[:, landmarks.index(f"{side}_ankle"), :2])
    if "nose" in landmarks and "left_ear" in landmarks and "right_ear" in landmarks:
        ears = [positions[:, landmarks.index(f"{side}_ear"), :2] for side in ("left", "right")]
        vectors.append(positions[:, landmarks.index("nose"), :2] - 0.5 * (ears[0] + ears[1]))
    return _average(np.stack(vectors)) if vectors else np.full((len(positions), 2), np.nan)


def _average(vectors: np.ndarray) -> np.ndarray:
    """Return the mean over the first axis of what is seen, NaN where nothing is."""
    seen = np.isfinite(vectors)
    count = seen.sum(axis=0)
    return np.where(count > 0, np.where(seen, vectors, 0.0).sum(axis=0) / np.maximum(count, 1), np.nan)


def repair_identities(people: np.ndarray) -> tuple[np.ndarray, list[tuple[int, int, int]]]:
    """Exchange two people from the frame on in which each leaps to where the other was.

    Args:
        people: (P, T, len(LANDMARKS), 3) metres on one clock, NaN where not seen.
    Returns:
        The same, and (frame, first, second) of each exchange.
    """
    out = people.copy()
    places = np.stack([_average(np.moveaxis(person, 1, 0)) for person in people])  # (P, T, 3)
    order = np.tile(np.arange(len(people))[:, None], (1, people.shape[1]))
    found = []
    for frame in _find_leaps(places):
        before, now = places[:, frame - 1], places[:, frame]
        step = np.linalg.norm(now[None] - before[:, None], axis=2)  # from each person's place to each one's
        for one in range(len(people)):
            for other in range(one + 1, len(people)):
                gain = step[one, one] + step[other, other] - step[one, other] - step[other, one]
                if gain > _SWAP_GAIN:
                    places[[one, other], frame:] = places[[other, one], frame:]
                    order[[one, other], frame:] = order[[other, one], frame:]
                    step[:, [one, other]] = step[:, [other, one]]
                    found.append((int(frame), one, other))
    for person, source in enumerate(order):
        out[person] = people[source, np.arange(people.shape[1])]
    return out, found


def _find_leaps(places: np.ndarray) -> np.ndarray:
    """Find frames at which two or more people move farther than half of _SWAP_GAIN from one frame to the next."""
    steps = np.linalg.norm(np.diff(places, axis=1), axis=2)
    return np.flatnonzero((steps > 0.5 * _SWAP_GAIN).sum(axis=0) >= 2) + 1


def spread_landmarks(landmarks: tuple[str, ...], positions: np.ndarray) -> np.ndarray:
    """Return positions (T, len(LANDMARKS), 3) of all known landmarks, NaN where a feed has none."""
    out = np.full((len(positions), len(LANDMARKS), 3), np.nan)
    out[:, [LANDMARKS.index(name) for name in landmarks]] = positions
    return out
