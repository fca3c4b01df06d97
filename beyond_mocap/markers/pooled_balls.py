"""The ball's place in the hand, from all throws of a folder together (Fredriksson section 6.1, equation 6.1).

One throw hardly determines it: its marker stays at one place of the ball, so that the centre may lie on any side of it.
Throws of the same hand have the marker elsewhere on the ball, and all of these places lie on one sphere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..ball.physics import THROWN_BALLS
from ..base.errors import InputError
from ..motion.hand import Hand, build_hand
from ..motion.motion import Motion
from .model.model import BallMarker, MarkerModel
from .reconstruct import Reconstruction, ReconstructSettings, move_trial_down
from .release.held_ball import estimate_usual_place
from .release.release import Release, ReleaseSettings, estimate_release
from .release.throwing_hand import HandBall, fit_hand_ball
from .trial import MarkerTrial
from .trial_preparation import find_marker_set, prepare_trial

_MIN_THROWS = 2
_MAX_MISFIT = 0.006  # metres, median distance of the markers from the sphere, above which grips differ too much


@dataclass(frozen=True, eq=False, kw_only=True)
class ReconstructedThrow:
    """What is kept of a reconstructed throw, until those of its folder are pooled.

    Attributes:
        name: of its results.
        read: reads the trial again.
        motion: its motion.
        model: its model.
        release: its own release.
        lowered_by: metres by which trial and motion were moved down.
    """

    name: str
    read: Callable[[], MarkerTrial]
    motion: Motion
    model: MarkerModel
    release: Release
    lowered_by: float


def select_throw(name: str, read: Callable[[], MarkerTrial], result: Reconstruction) -> list[ReconstructedThrow]:
    """Return the throw of a reconstruction, [] where no ball's marker is visible in the hand."""
    if result.release is None or not len(result.release.held) or result.model.ball is not None:
        return []
    return [ReconstructedThrow(name=name, read=read, motion=result.motion, model=result.model, release=result.release,
                               lowered_by=result.lowered_by)]


def pool_balls(throws: Sequence[ReconstructedThrow], settings: ReconstructSettings = ReconstructSettings()
               ) -> Iterator[tuple[ReconstructedThrow, MarkerModel, Release]]:
    """Fit one place of the ball for each hand of each subject, and estimate the releases again with it.

    Args:
        throws: throws of one folder.
        settings: the options of their reconstruction.
    Yields:
        Each throw whose hand has at least two, its model with the ball's place, and its release.
    """
    groups: dict[tuple, list[ReconstructedThrow]] = {}
    for throw in throws:
        key = throw.model.subject, throw.release.side, throw.release.ball_label, throw.model.skeleton.names
        groups.setdefault(key, []).append(throw)
    for group in groups.values():
        if len(group) < _MIN_THROWS:
            continue
        ball = fit_pooled_ball([throw.release for throw in group], build_hand(group[0].motion, group[0].release.side),
                               settings.radius or THROWN_BALLS[settings.ball].radius)
        for throw in group if ball is not None else ():
            yield _estimate_again(throw, ball, len(group), settings)


def fit_pooled_ball(releases: Sequence[Release], hand: Hand, radius: float) -> HandBall | None:
    """Fit the ball's centre to the markers of several throws of one hand.

    Args:
        releases: the throws.
        hand: the hand in one of them.
        radius: metres, of the ball; with few places of the marker it cannot be fitted, too.
    Returns:
        The ball in the hand; None where the markers lie on no sphere of that radius, as with different grips.
    Source: Fredriksson section 6.1, equation (6.1).
    """
    points = np.concatenate([release.held for release in releases])
    ball = fit_hand_ball(points, radius, estimate_usual_place(hand))
    off = np.abs(np.linalg.norm(points - ball.centre, axis=-1) - ball.radius)
    return ball if float(np.median(off)) <= _MAX_MISFIT else None


def _estimate_again(throw: ReconstructedThrow, ball: HandBall, count: int, settings: ReconstructSettings
                    ) -> tuple[ReconstructedThrow, MarkerModel, Release]:
    """Estimate the release of a throw with a known place of the ball; its own one stays where that fails."""
    side, label = throw.release.side, throw.release.ball_label
    x, y, z = (float(value) for value in ball.centre)
    joint = throw.model.skeleton.index(f"{side.capitalize()}Hand")
    model = replace(throw.model, ball=BallMarker(label, joint, (x, y, z), ball.radius))
    trial = throw.read()
    marker_set = find_marker_set(trial, throw.model, settings.marker_set)
    trial = move_trial_down(prepare_trial(trial, marker_set), throw.lowered_by)
    try:
        release = estimate_release(trial, throw.motion, ReleaseSettings(label, ball.radius, side, settings.ball,
                                                                        centre=(x, y, z)))
    except InputError:
        return throw, model, throw.release
    note = f"the ball's place in the hand is that of {count} throws"
    return throw, model, replace(release, notes=(*release.notes, note))
