"""What is asked: a plan names the track, the timeline, the ball and the library's folder, and how to go about it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from .annotation import Timeline
from .errors import InputError
from .motion.track import SMOOTHING_SECONDS, Track

METHODS = ("path", "distance", "blocks")
LIMITS = {
    "alpha": (0.0, 1.0),
    "delta": (0.0, 100.0),
    "omega": (0.0, 100.0),
    "seam_window": (0.0, 4.0),
    "track_window": (0.2, 5.0),
    "root_window": (0.2, 5.0),
}
"""Least and most of a plan's numbers; outside them there is no sense in it."""


@dataclass(frozen=True)
class Plan:
    """One player's order.

    track: the player's samples, cleaned (`motion.track.clean`), with the ball where the feed has it. timeline: the
    asked annotations (`annotation.read_timeline`), not yet filled. library: folder of the library. method: one of
    METHODS. catch_up: Faustino's logistic catch-up of §3.3.2 (method "distance" only). fps: output frames per second.
    alpha: weight of annotation against continuity (Faustino eq. 13; for "path" `synthesis.balance`). mirror: whether
    mirrored clips may be used.
    nearest: go on with the nearest words where the library lacks a key moment. seed: of every random choice.
    delta: metres of travelled distance that may stay wrong (Faustino §3.2.4). omega: gait thresholds (§3.1.1), 1 or
    more; 0: by "path" where the recordings' own labels change, else the paper's 4.
    made: whether made clips may stand in where recordings lack a speed (method "path" only; `library.made`).
    seam_window: seconds over which a jump at a seam is spread (eq. 25, twice its s; "path" fades over half of it).
    track_window: seconds of the window that takes the feed's jitter out (`motion.track.smoothed`). root_window: seconds
    of the window behind which the root is pulled onto the track (method "path" only; the root error is measured with
    1.5). gaits: (gait word, clip) pairs, which clip stands for which gait (§3.1.1); other gaits are found among all
    clips.

    InputError for a number outside LIMITS.
    """

    track: Track
    timeline: Timeline = field(default_factory=Timeline)
    library: str = ""
    method: str = "path"
    catch_up: bool = True
    fps: float = 30.0
    alpha: float = 0.2
    mirror: bool = True
    nearest: bool = False
    seed: int = 0
    delta: float = 0.5
    omega: float = 0.0
    made: bool = True
    seam_window: float = 0.8
    track_window: float = SMOOTHING_SECONDS
    root_window: float = 1.5
    gaits: tuple[tuple[str, str], ...] = ()

    def __post_init__(self):
        for name, (least, most) in LIMITS.items():
            if not least <= getattr(self, name) <= most:
                raise InputError(name, f"{getattr(self, name):g}", f"{least:g} to {most:g}")
        if 0.0 < self.omega < 1.0:
            raise InputError("omega", f"{self.omega:g}", "1 or more, or 0 for the usual thresholds")


def gait_choices(texts: Iterable[str]) -> tuple[tuple[str, str], ...]:
    """(gait word, clip) of each text "WORD=CLIP", blanks around either left out; InputError for any other text and for
    a word that comes twice."""
    pairs = []
    for text in texts:
        word, _, clip = (part.strip() for part in text.partition("="))
        if not word or not clip:
            raise InputError("--gait", f"{text!r}", "WORD=CLIP, such as walking=folder/walk.bvh")
        if word.lower() in dict(pairs):
            raise InputError("--gait", f"{word!r} twice", "one clip for each gait")
        pairs.append((word.lower(), clip.replace("\\", "/")))
    return tuple(pairs)
