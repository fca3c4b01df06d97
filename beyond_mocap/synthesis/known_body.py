"""Stretches of a player whose body is known, as cameras have seen it: they are shown as they are, and what is
synthesized around them leads into them.

The search is drawn to source frames that move as the known body does near its ends (`KnownFeatures`). There the known
body's lead over the synthesized one fades within FADE_SECONDS, its feet where they stand (`edit_blending`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..base.easing import quintic_step_by_powers
from ..base.time_series import find_runs
from ..base.vectors import measure_lengths
from ..library.features import Frames, compute_raw_features, select_feature_joints
from ..motion import quaternion
from ..motion.foot_plant import PlantResult
from ..motion.humanoid import compute_heading_from_positions, identify_joints
from ..motion.motion import compute_pose
from ..motion.skeleton import Skeleton, freeze_array
from .construct.edit_blending import Pose, step_over
from .construct.extra_steps import Steps

SOURCE = "joints"
"""What stands for a clip where a known body is shown."""

FADE_SECONDS = 0.6
"""Seconds beside a known body in which its lead over the synthesized one fades: a step."""

LONGEST_FADE = 1.2
"""Seconds in which it fades at most, where a foot stands."""

LEAD_SECONDS = 0.6
"""Seconds within a known body, from either end, in which the search follows it."""

_JOINTS_SECONDS = 0.3  # s in which a lead of joints fades: a swing. Longer, it adds up with the next one
_VELOCITY_SECONDS = 0.05  # s over which the difference in velocity at an end goes on
_FIXED_SECONDS = 0.15  # s at either end of a fade in which feet stay where they are (`edit_blending.step_over`)
_RAISED = 0.03  # m by which a foot that was in contact is off the ground
_MARGIN = 1.0  # s of a body that are kept beyond the span that it is cut to


@dataclass(frozen=True, eq=False)
class KnownBody:
    """A stretch of a body, in the player's size on the library's skeleton.

    Attributes:
        first: frame of the first one on the track's clock, counted from 0 s.
        fps: frames per second, the plan's.
        root: (T, 3) m, world, whole millimetres.
        rotations: (T, J, 4) local, as whole numbers of 1 / UNIT.
        heel_toe_contacts: (T, 2, 2) bool.
    """

    UNIT = 32767

    first: int
    fps: float
    root: np.ndarray
    rotations: np.ndarray
    heel_toe_contacts: np.ndarray

    def __post_init__(self):
        for name, kind in (("root", float), ("rotations", np.int16), ("heel_toe_contacts", bool)):
            object.__setattr__(self, name, freeze_array(getattr(self, name), kind))

    def __len__(self) -> int:
        return len(self.root)

    @property
    def start(self) -> float:
        """Seconds of the first frame."""
        return self.first / self.fps

    @property
    def end(self) -> float:
        """Seconds of the last frame."""
        return (self.first + len(self) - 1) / self.fps

    @property
    def pose(self) -> Pose:
        """Root (T, 3) m and local rotations (T, J, 4)."""
        turns = self.rotations / float(self.UNIT)
        return self.root, turns / measure_lengths(turns)[..., None]

    def compute_heading(self, skeleton: Skeleton) -> np.ndarray:
        """Compute the heading (T,) rad, unwrapped."""
        return np.unwrap(compute_heading_from_positions(skeleton, compute_pose(skeleton, *self.pose)[0]))


def build_known_body(first: int, fps: float, pose: Pose, heel_toe_contacts: np.ndarray) -> KnownBody:
    """Build a known body from root (T, 3) m and local rotations (T, J, 4), rounded as files store it."""
    return KnownBody(first, fps, np.round(pose[0], 3), np.rint(pose[1] * KnownBody.UNIT), heel_toe_contacts)


def cut_bodies(bodies: Sequence[KnownBody], start: float, end: float) -> tuple[KnownBody, ...]:
    """Cut known bodies to what a span, s, shows, with a second on either side."""
    out = []
    for body in bodies:
        low = max(int(np.ceil((start - _MARGIN) * body.fps)) - body.first, 0)
        high = min(int(np.floor((end + _MARGIN) * body.fps)) + 1 - body.first, len(body))
        if high - low >= 2:
            out.append(replace(body, first=body.first + low, root=body.root[low:high],
                               rotations=body.rotations[low:high],
                               heel_toe_contacts=body.heel_toe_contacts[low:high]))
    return tuple(out)


class KnownFeatures:
    """How known bodies move near their ends, as features of a library.

    Attributes:
        values: (T, D) of each frame of a track at the library's rate.
        counts: (T,) bool, frames within LEAD_SECONDS of an end of a body, and within it.
    """

    def __init__(self, bodies: Sequence[KnownBody], frames: Frames, skeleton: Skeleton, times: np.ndarray,
                 size: float = 1.0):
        """Compute the features.

        Args:
            bodies: the known bodies.
            frames: of the library.
            skeleton: its skeleton.
            times: (T,) s of the track's frames.
            size: how many times as tall as the library's skeleton the player is.
        """
        self.values = np.zeros((len(times), frames.features.shape[1]), np.float32)
        self.counts = np.zeros(len(times), bool)
        for body in bodies:
            away = np.minimum(times - body.start, body.end - times)
            near = np.flatnonzero((away > -1e-6) & (away <= LEAD_SECONDS))
            if len(body) >= 3 and len(near):
                own = _compute_features(body, frames, skeleton, size)
                self.values[near] = own[np.clip(np.rint(times[near] * body.fps).astype(int) - body.first, 0,
                                                len(body) - 1)]
                self.counts[near] = True

    def measure_distance(self, frame: int, features: np.ndarray) -> np.ndarray:
        """Measure how far (K,) m features (K, D) are from the known body at a frame of the track."""
        return measure_lengths(features - self.values[frame])


def _compute_features(body: KnownBody, frames: Frames, skeleton: Skeleton, size: float) -> np.ndarray:
    """Compute the features (T, D) of a body."""
    places = compute_pose(skeleton, body.pose[0] / size, body.pose[1])[0]
    heading = np.unwrap(compute_heading_from_positions(skeleton, places))
    return (compute_raw_features(places[:, select_feature_joints(skeleton)], heading, body.fps).astype(np.float32)
            - frames.mean) @ frames.basis


def find_shown_frames(bodies: Sequence[KnownBody], times: np.ndarray) -> np.ndarray:
    """Find the frames (T,) bool, at times (T,) s, that show a known body."""
    shown = np.zeros(len(times), bool)
    for body in bodies:
        shown |= (times >= body.start - 1e-6) & (times <= body.end + 1e-6)
    return shown


def name_known_frames(fields: Mapping[str, Any], bodies: Sequence[KnownBody], times: np.ndarray) -> dict[str, Any]:
    """Name SOURCE as the clip of the frames that show a known body, and add its ends to the transitions.

    Args:
        fields: `clips`, `clip` and `seams` of a take, among others (`provenance.build_provenance_fields`).
        bodies: the known bodies.
        times: (T,) s of the take's frames.
    Returns:
        The fields.
    """
    shown = find_shown_frames(bodies, times)
    if not shown.any():
        return dict(fields)
    ends = np.flatnonzero(np.diff(shown.astype(np.int8))) + 1
    kept = fields["seams"][~shown[np.minimum(fields["seams"], len(shown) - 1)]]
    return {**fields, "clips": (*fields["clips"], SOURCE),
            "clip": np.where(shown, len(fields["clips"]), fields["clip"]),
            "clip_frame": np.where(shown, np.arange(len(times)), fields["clip_frame"]),
            "mirrored": fields["mirrored"] & ~shown, "seams": np.union1d(kept, ends)}


def show_bodies(skeleton: Skeleton, planted: PlantResult, steps: Steps, bodies: Sequence[KnownBody], first: int,
                *, fps: float, size: float = 1.0) -> tuple[PlantResult, Steps]:  # fmt: skip
    """Show known bodies in a constructed motion, and let the frames beside them lead into them.

    Args:
        skeleton: the library's.
        planted: T frames.
        steps: their contacts.
        bodies: known bodies at the same rate.
        first: frame of the track's clock of the motion's first one.
        fps: frames per second.
        size: how many times as tall as the library's skeleton the player is.
    Returns:
        The motion and its contacts; frames farther than FADE_SECONDS from a known body keep their bits.
    """
    if not bodies:
        return planted, steps
    pose, contacts, shown = _lay_bodies(planted, steps, bodies, first, size)
    for run in find_runs(~shown):
        sides = [edge for edge in (run[0] - 1, run[1]) if 0 <= edge < len(shown)]
        if sides:
            pose, contacts = _join_run(skeleton, pose, planted, contacts, run=run, sides=sides, fps=fps)
    moved = np.where(shown[:, None], 0.0, planted.correction), np.where(shown[:, None], 0.0, planted.miss)
    raised = steps.heel_toe_contacts.any(axis=2) & ~contacts.any(axis=2)
    flat = np.where(shown[:, None], contacts.all(axis=2), steps.contacts & ~raised)
    return (
        replace(planted, root=pose[0], rotations=pose[1], correction=moved[0], miss=moved[1]),
        replace(steps, rotations=pose[1], heel_toe_contacts=contacts, contacts=flat,
                stepped=steps.stepped & ~shown[:, None]),
    )


def _lay_bodies(planted: PlantResult, steps: Steps, bodies: Sequence[KnownBody], first: int,
                size: float) -> tuple[Pose, np.ndarray, np.ndarray]:
    """Lay known bodies over a motion: the pose, heel and toe contacts (T, 2, 2), and the frames (T,) that show one."""
    root, rotations = planted.root.copy(), planted.rotations.copy()
    contacts, shown = steps.heel_toe_contacts.copy(), np.zeros(len(root), bool)
    for body in bodies:
        low, high = max(body.first - first, 0), min(body.first + len(body) - first, len(root))
        if high > low:
            own, (place, turn) = slice(low + first - body.first, high + first - body.first), body.pose
            root[low:high] = place[own] / size
            rotations[low:high] = quaternion.match_signs(turn[own], planted.rotations[low:high])
            contacts[low:high], shown[low:high] = body.heel_toe_contacts[own], True
    return (root, rotations), contacts, shown


def _join_run(skeleton: Skeleton, pose: Pose, planted: PlantResult, contacts: np.ndarray, *, run: tuple[int, int],
              sides: Sequence[int], fps: float) -> tuple[Pose, np.ndarray]:
    """Let a run of frames lead into the known bodies at `sides`; contacts end where a foot is raised by that."""
    low, high = run
    reach = _find_reach(contacts[low:high], len(sides) > 1, edge_is_first=low > 0, fps=fps)
    pose = _fade_leads(pose, planted, run, sides, reach=reach, fps=fps)
    contacts = _lift_feet(skeleton, pose, planted, contacts, run=run, sides=sides, fps=fps)
    near = np.min([np.abs(np.arange(low, high) - edge) for edge in sides], axis=0) <= reach
    for first, end in find_runs(near):
        pose, contacts = step_over(skeleton, pose, contacts, (low + first, low + end), fps, is_firm=True)
    return pose, contacts


def _lift_feet(skeleton: Skeleton, pose: Pose, planted: PlantResult, contacts: np.ndarray, *, run: tuple[int, int],
               sides: Sequence[int], fps: float) -> np.ndarray:
    """Return contacts (T, 2, 2) that end where a foot of a run is raised by its lead, and beside a body that has it in
    the air.
    """
    (low, high), out, frames = run, contacts.copy(), int(np.ceil(_FIXED_SECONDS * fps))
    inside = slice(low, high)
    out[inside] &= ~_find_raised(skeleton, [(one[0][inside], one[1][inside]) for one in (
        pose, (planted.root, planted.rotations))])
    for edge in sides:
        fixed = slice(max(edge - frames, low), min(edge + frames + 1, high))
        out[fixed] &= out[edge].any(axis=1)[:, None]
    return out


def _find_reach(contacts: np.ndarray, is_between: bool, *, edge_is_first: bool, fps: float) -> int:
    """Find over how many frames beside a body its lead fades: until both feet have been lifted, so that neither has to
    slide to where the synthesized one stands.

    Args:
        contacts: (T, 2, 2) bool, heel and toe contacts of the frames beside the body, or between two.
        is_between: whether there is a body at either end.
        edge_is_first: whether a body is at the first end.
        fps: frames per second.
    """
    lifted = ~contacts.any(axis=2)
    ways = [lifted] * edge_is_first + [lifted[::-1]] * (is_between or not edge_is_first)
    fixed = int(np.ceil(_FIXED_SECONDS * fps))
    first = fixed + max(int(np.argmax(np.append(way[fixed:, side], True))) for way in ways for side in (0, 1))
    frames = np.clip(first + fixed, FADE_SECONDS * fps, LONGEST_FADE * fps)
    return int(min(frames, len(contacts))) if is_between else int(frames)


def _find_raised(skeleton: Skeleton, poses: Sequence[Pose]) -> np.ndarray:
    """Find where heel and toe (T, 2, 2) bool are clearly higher in the first of two motions than in the second."""
    body = identify_joints(skeleton)
    ends = [[limb.foot, limb.toe_or_foot] for limb in (body.left, body.right)]
    faded, before = (compute_pose(skeleton, *pose)[0][:, ends, 2] for pose in poses)
    return faded - before > _RAISED


def _fade_leads(pose: Pose, planted: PlantResult, run: tuple[int, int], sides: Sequence[int], *, reach: int,
                fps: float) -> Pose:
    """Add the leads of the known bodies at `sides` to a run of frames. Each fades over `reach` frames, that of joints
    over _JOINTS_SECONDS, so that in a short run the one passes into the other.
    """
    at = np.arange(*run)
    move, turns = np.zeros((len(at), 3)), np.zeros((len(at), pose[1].shape[1], 3))
    for edge in sides:
        away = np.abs(at - edge)
        share, own = (quintic_step_by_powers(np.clip(1.0 - away / (frames + 1.0), 0.0, 1.0))[:, None]
                      for frames in (reach, min(reach, _JOINTS_SECONDS * fps)))
        shares = np.where(np.arange(turns.shape[1]) == 0, share, own)
        lead = _measure_lead(pose, planted, edge, inner=edge - 1 if edge < run[0] else edge + 1)
        gone = _VELOCITY_SECONDS * fps * (1.0 - np.exp(-away / (_VELOCITY_SECONDS * fps)))
        move += share * (lead[0] + gone[:, None] * lead[1])
        turns += shares[:, :, None] * (lead[2] + gone[:, None, None] * lead[3])
    out = pose[0].copy(), pose[1].copy()
    out[0][run[0] : run[1]] = planted.root[at] + move
    out[1][run[0] : run[1]] = quaternion.multiply(planted.rotations[at], quaternion.from_rotation_vector(turns))
    return out


def _measure_lead(pose: Pose, planted: PlantResult, edge: int, inner: int) -> tuple[np.ndarray, ...]:
    """Measure how far the known body is ahead of the synthesized one in its last frame `edge`, and how fast that grows
    from the frame `inner` on: of the root (3,) m and a frame, of joints (J, 3) rad and a frame.
    """
    inner = int(np.clip(inner, 0, len(pose[0]) - 1))
    move, before = (pose[0][one] - planted.root[one] for one in (edge, inner))
    turn, earlier = (quaternion.to_rotation_vector(quaternion.multiply(
        quaternion.inverse(planted.rotations[one]), pose[1][one])) for one in (edge, inner))
    return move, move - before, turn, turn - earlier
