"""A motion relative to its own path: everything of a path edit that does not depend on the new path.

The path is fitted, the body's place and rotations are taken relative to its moving frame (Path editing §3.1), and the
ground under the feet is measured; once for all edits of a motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.errors import InputError
from ..motion import contacts, quaternion
from ..motion.humanoid import compute_heading, identify_joints
from ..motion.motion import Motion, forward_kinematics
from ..motion.path.arc_length import ArcLength
from ..motion.path.path import Path
from . import ground_contact, path_frame, path_time
from .loops import Loop, find_loops
from .path_edit_settings import PathEditSettings
from .path_frame import MovingFrame, Residuals
from .path_time import PathProfile

STILL_LENGTH = 0.05
"""Metres of path below which a motion counts as standing still."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PathEditSource:
    """A motion relative to its own path: everything that does not depend on the new one.

    Attributes:
        motion: as recorded.
        standing: (T, 2, 2) bool, contact of left and right, heel and toe.
        path: the motion's own path; its parameter is seconds.
        arc: the arc length of that path.
        moving: the moving frame in every frame.
        residuals: the motion in the moving frame.
        frame: the one of FRAMES that they are relative to.
        has_legs: whether it has feet that can be planted.
        is_still: whether it stays in place.
        sole: metres from the ground to the foremost joint of a flat foot.
        warnings: for the user.
    """

    motion: Motion
    standing: np.ndarray
    path: Path
    arc: ArcLength
    moving: MovingFrame
    residuals: Residuals
    frame: str
    has_legs: bool
    is_still: bool
    sole: float = 0.0
    warnings: tuple[str, ...] = ()

    @cached_property
    def loops(self) -> tuple[Loop, ...]:
        """Where the motion can be repeated, lowest cost first; searched on first use."""
        return find_loops(self.residuals)

    @cached_property
    def profile(self) -> PathProfile:
        """Slope and curvature of the motion's own path."""
        return path_time.build_profile(self.path, self.arc)

    @cached_property
    def curvature(self) -> np.ndarray:
        """(T,) 1/m, curvature of the motion's own path over the ground."""
        return ground_contact.compute_curvature(self.path, np.arange(len(self.motion)) / self.motion.fps)

    def sample_profile(self, rows: Residuals) -> PathProfile:
        """Sample the profile of the motion's own path at every row."""
        metres = self.arc.distance_at(rows.frames / rows.fps)
        return path_time.sample_profile(self.profile, metres, rows.step * rows.fps)

    def sample_slope(self, rows: Residuals) -> np.ndarray:
        """Sample the slope (N,) radians of the motion's own path at every row."""
        return np.interp(rows.frames, np.arange(len(self.moving.slope)), self.moving.slope)


def prepare_source(motion: Motion, settings: PathEditSettings, standing: np.ndarray | None = None,
                   path: Path | None = None) -> PathEditSource:
    """Compute a motion relative to its own path.

    Args:
        motion: two frames or more.
        settings: how the path is fitted, and the frame of the residuals.
        standing: (T, 2, 2) bool, contact of left and right, heel and toe; None: detected
            (`contacts.detect_heel_toe_contacts`).
        path: its own path, with seconds from the first frame as parameter; None: fitted.
    Returns:
        The source for `path_edit.edit_path`.
    Raises:
        InputError: for fewer than two frames.
    """
    if len(motion) < 2:
        raise InputError("motion", f"{len(motion)} frame", "two frames or more")
    has_legs, messages = _check_legs(motion)
    if standing is None:
        standing = contacts.detect_heel_toe_contacts(motion) if has_legs else np.zeros((len(motion), 2, 2), dtype=bool)
    if path is None:
        path = (path_frame.fit_path(motion, standing, settings.fit, settings.degree) if has_legs
                else _fit_root_path(motion, settings))
    times = np.arange(len(motion)) / motion.fps
    arc = ArcLength(path)
    metres = arc.distance_at(times)
    is_still = bool(metres[-1] - metres[0] < STILL_LENGTH)
    moving = path_frame.build_moving_frame(path.at(times), path.at(times, 1), metres, motion.fps,
                                           compute_mean_heading(motion, has_legs))
    place, turned = path_frame.to_moving_frame(settings.frame, moving, motion.root_positions, motion.rotations[:, 0])
    rotations = motion.rotations.copy()
    rotations[:, 0] = turned
    under, up = _measure_own_ground(motion, standing, path, arc=arc, moving=moving,
                                    metres=metres) if has_legs else _build_flat_ground(len(motion))
    residuals = Residuals(place=place, rotations=rotations, step=np.diff(metres, prepend=metres[:1]),
                          standing=np.asarray(standing, bool), frames=np.arange(len(motion), dtype=float),
                          turn=np.diff(moving.heading, prepend=moving.heading[:1]), under=under, up=up, fps=motion.fps,
                          skeleton=motion.skeleton)
    sole = contacts.estimate_recorded_floor(motion)[1] if has_legs else 0.0
    return PathEditSource(motion=motion, standing=residuals.standing, path=path, arc=arc, moving=moving,
                          residuals=residuals, frame=settings.frame, has_legs=has_legs, is_still=is_still, sole=sole,
                          warnings=messages)


def _measure_own_ground(motion: Motion, standing: np.ndarray, path: Path, arc: ArcLength, moving: MovingFrame,
                        metres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measure the ground under the feet on the motion's own path: metres (T, 2) above it, and normals (T, 2, 3) in
    the frame.
    """
    if ground_contact.is_level(path, arc):
        return _build_flat_ground(len(motion))
    body = identify_joints(motion.skeleton)
    joints = [[limb.foot, limb.toe_or_foot] for limb in (body.left, body.right)]
    feet = forward_kinematics(motion)[0][:, joints]
    clear = np.zeros((len(motion), 2))
    surface = ground_contact.build_path_surface(path, arc, metres)
    found = ground_contact.compute_footing(feet[..., :2], standing, clear, motion.fps, surface)
    back = quaternion.from_up_angle(-moving.heading)[:, None]
    return found.height - moving.origin[:, 2:], quaternion.rotate(back, found.normal)


def _build_flat_ground(count: int) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((count, 2)), np.tile([0.0, 0.0, 1.0], (count, 2, 1))


def _check_legs(motion: Motion) -> tuple[bool, tuple[str, ...]]:
    try:
        identify_joints(motion.skeleton)
    except InputError:
        return False, ("the skeleton has no recognizable legs: feet are not planted, and the body does not lean",)
    return True, ()


def compute_mean_heading(motion: Motion, has_legs: bool) -> float:
    """Compute the mean heading of the body, for a path without movement.

    Args:
        motion: the motion.
        has_legs: whether its skeleton has legs; without, the heading is 0.
    Returns:
        Radians, world frame.
    """
    if not has_legs:
        return 0.0
    headings = compute_heading(motion)
    return float(np.arctan2(np.sin(headings).mean(), np.cos(headings).mean()))


def _fit_root_path(motion: Motion, settings: PathEditSettings) -> Path:
    """Fit the path of a body without legs: that of its root, at the usual height of its lowest joint."""
    places, _ = forward_kinematics(motion)
    line = motion.root_positions.copy()
    line[:, 2] = contacts.resolve_floor_height(float(np.percentile(places[..., 2].min(axis=1), 2)))
    times = np.arange(len(line)) / motion.fps
    if settings.fit == "spline":
        return path_frame.fit_spline(line, times)
    return path_frame.fit_polynomial(line, times, settings.degree)
