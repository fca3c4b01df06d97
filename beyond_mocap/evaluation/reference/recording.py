"""The figures of one uncut recording, frame by frame at the output's frame rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...appearance.arm_clearance import measure_arm_depth
from ...appearance.mesh import BodyMesh
from ...appearance.trunk import Trunk
from ...library.clip import Clip
from ...library.keys import collect_keys
from ...motion.humanoid import identify_joints
from ...motion.motion import forward_kinematics, resample
from ...motion.track import smooth_zero_phase_hann
from ...synthesis.quality import movement
from .. import realism
from ..body_physics import BodyPhysics, measure_body_physics
from ..naturalness import BodyCourse, find_stands, measure_course
from ..touches import Kick, find_side, is_foot_reception, is_kick, measure_kick, measure_legs, measure_reception


@dataclass(frozen=True, eq=False, kw_only=True)
class Recording:
    """Figures of one uncut clip at the output's frame rate, T frames.

    Attributes:
        path: of the clip.
        rate: its own frames per second.
        features: (T, 6 J) m, float32, from `realism.build_pose_features`.
        sway, surge, speed: (T,) m, m/s, m/s.
        contact_speed: (T, 2) m/s, NaN without contact.
        skating: (T,) bool.
        heel_rest: height of its heel joint on a flat foot, m.
        support: (T, 2) m, height of the feet in contact.
        tip: (T,) m, height of the lowest tip.
        jerk: (T-3,) m/s^3.
        smoothness: (T,) m from each frame to the next, NaN at the end.
        stances: (S, 3) first frame, end and side.
        travel: (S,) m, travel of the stances.
        stands: (T,) bool, whether its body stands.
        contacts: (T, 2) bool, feet on the ground.
        course: where its body faces and goes, at 30 frames per second.
        kicks: those that its labels name.
        receptions: m/s of the foot at receptions that its labels name.
        physics: how its mass moves, at 30 frames per second.
        arm_depth: (T,) m by which an arm is inside the trunk, negative outside.
    """

    path: str
    rate: float
    features: np.ndarray
    sway: np.ndarray
    surge: np.ndarray
    speed: np.ndarray
    contact_speed: np.ndarray
    skating: np.ndarray
    heel_rest: float
    support: np.ndarray
    tip: np.ndarray
    jerk: np.ndarray
    smoothness: np.ndarray
    stances: np.ndarray
    travel: np.ndarray
    stands: np.ndarray
    contacts: np.ndarray
    course: BodyCourse
    kicks: tuple[Kick, ...]
    receptions: tuple[float, ...]
    physics: BodyPhysics
    arm_depth: np.ndarray


def measure_recording(clip: Clip, fps: float, boots: BodyMesh, trunk: Trunk) -> Recording:
    """Measure one clip, uncut, frame by frame.

    Args:
        clip: the clip.
        fps: frames per second of the output.
        boots, trunk: of the library's body.
    Returns:
        Its figures.
    """
    motion = resample(clip.recording, fps)
    skeleton, hips = motion.skeleton, identify_joints(motion.skeleton).hips
    positions, rotations = forward_kinematics(motion)
    pelvis, feet = positions[:, hips, :2], positions[:, movement.list_foot_joints(skeleton)]
    source_frames = np.minimum(np.rint(np.arange(len(motion)) * clip.motion.fps / fps).astype(int), len(clip.motion)
                               - 1)
    contacts = clip.contacts[source_frames]
    spans = movement.list_stances(contacts)
    heel_rest, floor = movement.measure_heel_rest(feet, contacts), float(np.percentile(feet[:, :, 1, 2], 2))
    course = measure_course(skeleton, positions, fps)
    kicks, receptions = _measure_labelled_touches(clip, positions, fps, contacts, course)
    return Recording(
        path=clip.path, rate=clip.motion.fps, features=realism.build_pose_features(skeleton, positions, fps, hips),
        sway=movement.measure_sway(pelvis, fps), surge=movement.measure_surge(pelvis, fps),
        speed=movement.measure_travel_speed(pelvis, fps),
        contact_speed=np.concatenate([movement.measure_contact_speeds(feet, contacts, fps), [[np.nan, np.nan]]]),
        skating=np.append(movement.find_skating_steps(feet[:, :, 1], floor, fps), False), heel_rest=heel_rest,
        support=movement.measure_support_height(feet, contacts, heel_rest),
        tip=movement.measure_tip_height(skeleton, positions, rotations), jerk=movement.compute_jerk(positions, fps),
        smoothness=np.append(realism.measure_smoothness(skeleton, positions, fps), np.nan), stances=spans,
        travel=movement.measure_stance_travel(feet[:, :, 1], spans), course=course, kicks=kicks, receptions=receptions,
        stands=find_stands(smooth_zero_phase_hann(pelvis, fps, movement.ROOT_WINDOW), fps), contacts=contacts,
        physics=measure_body_physics(motion, positions, rotations, course, boots),
        arm_depth=measure_arm_depth(skeleton, positions, rotations, trunk),
    )  # fmt: skip


def _measure_labelled_touches(
    clip: Clip, positions: np.ndarray, fps: float, contacts: np.ndarray, course: BodyCourse
) -> tuple[tuple[Kick, ...], tuple[float, ...]]:
    """Measure the kicks and receptions (m/s of the foot) that a clip's labels name."""
    keys = [key for key in collect_keys([clip]) if is_kick(key.labels) or is_foot_reception(key.labels)]
    if not keys:
        return (), ()
    legs = measure_legs(clip.motion.skeleton, positions, fps, contacts, course)
    found = [(key.labels, (key.frame / clip.motion.fps, find_side(key.labels))) for key in keys]
    return (tuple(measure_kick(legs, *at) for labels, at in found if is_kick(labels)),
            tuple(measure_reception(legs, *at) for labels, at in found if is_foot_reception(labels)))
