"""What is asked: a plan names the track, the timeline, the ball and the library's folder, and how to go about it."""

from __future__ import annotations

from dataclasses import dataclass, field

from .annotation import Timeline
from .motion.track import Track

METHODS = ("path", "distance", "blocks")


@dataclass(frozen=True)
class Plan:
    """One player's order.

    track: the player's samples, cleaned (`motion.track.clean`), with the ball where the feed has it. timeline: the asked
    annotations (`annotation.read_timeline`), not yet filled. library: folder of the library. method: one of METHODS.
    catch_up: Faustino's logistic catch-up of §3.3.2 (method "distance" only). fps: output frames per second.
    alpha: weight of annotation against continuity (Faustino eq. 13). mirror: whether mirrored clips may be used.
    nearest: go on with the nearest words where the library lacks a key moment. seed: of every random choice.
    delta: metres of travelled distance that may stay wrong (Faustino §3.2.4). omega: gait thresholds (§3.1.1).
    made: whether made running may stand in where the track is faster than any recording (method "path" only).
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
    omega: float = 4.0
    made: bool = True
