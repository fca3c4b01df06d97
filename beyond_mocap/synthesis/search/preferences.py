"""Preferences of the search besides the request: clips of a style, the strong foot, players out of step, other clips.

Players out of step: players with similar tracks get the same clips, and where they begin them at the same time they
move in unison. A clip that is played runs along with the clock: a player that shows its second s at time t of the match
is s - t ahead of it, and this is the lag. Every player prefers lags that are PERIOD apart, and players who come near
each other get different ones (`match.crowd.variety.choose_lags`).

Other clips: a search for another solution pays for frames that an earlier one has shown, and a little for other frames
of the same clips. It is a cost, not a ban: where nothing else comes near the request, they are shown again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import PurePosixPath

import numpy as np

from ...annotation.ball_contact import SENDING, may_use_foot
from ...annotation.vocabulary import SIDES, compute_edit_distance
from ...base.errors import InputError
from ...library.keys import Key
from ...library.library import Library

AVOIDED_COST = 1000.0
"""Cost of a stretch that shows an avoided label: more than a whole track of anything else."""

WEAK_FOOT_WEIGHT = 1.5
"""Cost of serving a key moment with the weak foot, in metres per second of missed speed."""

UNUSUAL_FOOT_WEIGHT = 0.15
"""The same with the foot that the library's own players seldom kick with, where no strong foot is given: as much as a
quarter of a metre of the ball's place."""

_SIDES = frozenset(SIDES)

PERIOD = 3.6
"""Seconds from one preferred lag to the next."""

SPREAD = 0.6180339887
"""Share of a period by which each clip's places in it are ahead of those of the clip before: a clip that is shorter
than a period has room for some lags only, and others have room for the rest. Multiples of the golden section are spread
evenly."""

PREFERRED_RANGE, FULL_COST_RANGE = 0.05, 0.45
"""Seconds from a preferred lag up to which there is no cost, and from which on there is the full cost."""

REUSE_COST = 2.5
"""Cost per slot of the same source frames, that of a metre per second of missed speed."""
SAME_CLIP_COST = 0.6
"""Cost per slot of other frames of the same clip, or of its mirror image."""
SHOWN_MARGIN = 0.25
"""Seconds around shown source frames that count as shown."""


MANNER_COST = 0.4
"""Cost per slot of a clip whose manner is not the player's. On ten windows of a match and five folders it brings the
manners that are shown in one minute a quarter nearer to the player's, for 3 % more cuts; twice that costs 10 %."""

STYLE_COST = 3.0  # per unit of the setting's weight: as much as changes of recording cost


def compute_style_cost(library: Library, style: Sequence[str], weight: float) -> np.ndarray | None:
    """Compute the cost of library frames that are not of a style.

    A frame is of the style if it carries one of its labels, or belongs to a clip that one of its patterns
    names.

    Args:
        library: the clips, N frames.
        style: labels, or patterns of folders and clips.
        weight: cost per slot.
    Returns:
        (N,) float32, None where there is no style.
    Raises:
        InputError: for an entry that matches nothing.
    """
    if not style or not weight:
        return None
    frames = library.frames
    matches = np.zeros(len(frames), bool)
    for entry in style:
        word, clips = entry.lower(), np.array([matches_pattern(clip.path, entry) for clip in library.clips])
        carries = frames.words[:, [i for i, known in enumerate(frames.vocabulary) if known == word]].any(axis=1)
        if not carries.any() and not clips.any():
            nearest = ", ".join(_list_nearest_names(library, word))
            raise InputError("style", repr(entry), "a label, folder or clip of the library", f"nearest: {nearest}")
        matches |= carries | clips[frames.clip]
    return np.where(matches, 0.0, STYLE_COST * weight).astype(np.float32)


def compute_manner_cost(library: Library, manner: int) -> np.ndarray | None:
    """Compute the cost (N,) float32 of library frames that move unlike a player; None for a manner below 0, none."""
    if manner < 0:
        return None
    return np.float32(MANNER_COST) * library.manners.measure_difference(manner)[library.frames.clip]


def _list_nearest_names(library: Library, name: str) -> list[str]:
    """List the library's labels, folders and clips that differ least from a name."""
    paths = [PurePosixPath(clip.path) for clip in library.clips if not clip.is_synthetic]
    names = {*library.labels, *(path.stem for path in paths), *(part for path in paths for part in path.parts[:-1])}
    return sorted(names, key=lambda other: (compute_edit_distance(name, other.lower()), other))[:3]


def matches_pattern(path: str, pattern: str) -> bool:
    """Return whether a pattern names a clip's path below the library.

    It may be the path itself with * and ?, one of its folders, or its file name with or without ending; letter case
    does not count.
    """
    path, pattern = path.lower(), pattern.lower().replace("\\", "/").rstrip("/")
    whole = PurePosixPath(path)
    names = (path, whole.name, whole.stem, *map(str, whole.parents), *whole.parts[:-1])
    return any(fnmatchcase(name, pattern) for name in names if name != ".")


def find_unusual_foot(library: Library) -> str:
    """Find the side of the foot with which the recorded players seldom send a ball; "" where neither is."""
    own = [key.labels for key in library.keys if not library.clips[key.clip].mirrored
           and not library.clips[key.clip].is_synthetic and SENDING & key.labels and may_use_foot(key.labels)]
    left, right = (sum(side in labels for labels in own) for side in SIDES)
    return "" if left == right else SIDES[int(left > right)]


def compute_weak_foot_cost(
    requested: Iterable[str], choices: Sequence[Key], weak_foot: str, weight: float = WEAK_FOOT_WEIGHT
) -> np.ndarray:
    """Compute the cost of serving a key moment with the weak foot.

    Nothing where the request names a side, where no foot meets the ball, or where no foot is preferred.

    Args:
        requested: requested labels.
        choices: K key moments of the library.
        weak_foot: "left", "right" or "".
        weight: cost of the weak foot.
    Returns:
        (K,).
    """
    if not weak_foot or _SIDES.intersection(requested):
        return np.zeros(len(choices))
    weak = [weak_foot in key.labels and may_use_foot(key.labels) for key in choices]
    return weight * np.array(weak, float)


@dataclass(frozen=True, eq=False)
class LagPreference:
    """A player's preference for a lag.

    Attributes:
        place: (N,) int, place of each library frame in the period.
        table: (2 P,) float32, cost of a lag per slot, two periods of P frames.
        start: frame of the track's first frame on the match's clock.
    """

    place: np.ndarray
    table: np.ndarray
    start: int

    def compute_cost(self, first: int, place: np.ndarray) -> np.ndarray:
        """Compute the cost (K,) of showing library frames at places (K,) of the period from the track's frame `first`
        on.
        """
        # place - time modulo the period; the table holds two periods, so the sum of two remainders needs no further
        # modulo
        return self.table[(-first - self.start) % (len(self.table) // 2) :].take(place)


def build_lag_preference(library: Library, lag: float, variety: float, start: float) -> LagPreference | None:
    """Build the preference of a player.

    Args:
        library: the clips.
        lag: s that the player prefers.
        variety: m/s of missed speed per slot that it is worth; 0 for no preference.
        start: s of the track's first frame on the match's clock.
    Returns:
        The preference, None without one.
    """
    if not variety:
        return None
    frames = library.frames
    period = round(PERIOD * library.fps)
    offset = np.arange(len(frames.first)) * SPREAD % 1.0 * period
    place = (np.arange(len(frames)) - frames.first[frames.clip] + offset.astype(int)[frames.clip]) % period
    off = np.arange(period) / period - lag / PERIOD
    away = np.abs(off - np.round(off)) * PERIOD
    table = variety * np.clip((away - PREFERRED_RANGE) / (FULL_COST_RANGE - PREFERRED_RANGE), 0.0, 1.0)
    return LagPreference(place, np.tile(table, 2).astype(np.float32), round(start * library.fps))


@dataclass(frozen=True)
class UsedStretch:
    """A piece of a clip that has been shown.

    Attributes:
        clip: path below the library.
        mirrored: whether its mirror image was shown.
        first: first frame of the clip, at the library's rate.
        last: last one.
    """

    clip: str
    mirrored: bool
    first: float
    last: float


def list_used_stretches(library: Library, edit, first: int, end: int) -> tuple[UsedStretch, ...]:
    """List the source frames that frames first .. end of an edit list show."""
    found = []
    for low, high in edit.pieces:
        low, high = max(low, first), min(high, end)
        if low < high:
            clip = int(edit.clip[low])
            frames = edit.frame[low:high] - library.frames.first[clip]
            source = library.clips[clip]
            found.append(UsedStretch(source.path, source.mirrored, float(frames.min()), float(frames.max())))
    return tuple(dict.fromkeys(found))


def compute_reuse_cost(library: Library, used: tuple[UsedStretch, ...]) -> np.ndarray:
    """Compute the extra cost (N,) float32 per slot of every library frame; unknown clips are left out."""
    cost = np.zeros(len(library.frames), np.float32)
    frames, around = library.frames, SHOWN_MARGIN * library.fps
    place = {(clip.path, clip.mirrored): number for number, clip in enumerate(library.clips)}
    clips = {piece.clip for piece in used}
    for number, clip in enumerate(library.clips):
        if clip.path in clips:
            cost[frames.first[number] : frames.first[number] + frames.count[number]] = SAME_CLIP_COST
    for piece in used:
        number = place.get((piece.clip, piece.mirrored))
        if number is None:
            continue
        start, last = frames.first[number], frames.first[number] + frames.count[number] - 1
        low = max(start, int(np.floor(start + piece.first - around)))
        high = min(last, int(np.ceil(start + piece.last + around)))
        cost[low : high + 1] = REUSE_COST
    return cost
