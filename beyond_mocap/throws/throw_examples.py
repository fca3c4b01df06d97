"""Read a folder of recorded throws or kicks as examples for networks (Fredriksson sections 4.4 and 7.1).

A throw is found by the annotation of its recording, in the library's labels (`throwb` or `throw` with the release as
key moment, `kick` with the contact), by a row of `throws.csv`, or by the report that `release` wrote beside it.
Unknown values are measured from the motion: which hand or foot, how fast the ball leaves, and where it would hit a
wall.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..ball.flight import find_wall_impact
from ..ball.physics import BASEBALL, FOOTBALL
from ..base.errors import BeyondMocapError, InputError, UserCancelledError, format_count
from ..files.bvh import bvh
from ..library.folder.annotations import TABLE_NAME as ANNOTATIONS_NAME
from ..library.folder.annotations import Annotations
from ..library.folder.recordings import find_clips
from ..motion import quaternion
from ..motion.humanoid import Humanoid, identify_joints
from ..motion.motion import (
    Motion,
    compute_end_positions,
    compute_pose,
    forward_kinematics,
    place_motion,
    sample_frames_cubic,
)
from ..motion.retargeting.retarget import Retargeter
from ..synthetic.throws import find_grip
from .networks.chains import find_chains
from .networks.example import Example, build_example, mirror_example
from .throw_records import ACTIONS, TABLE_NAME, Action, KnownThrow, is_known, read_known, read_table

_PAGE = "docs/reference/throw-examples.md"
_MIN_LAUNCH_SPEED = 3.0  # m/s; slower balls were not thrown
# a ball's speed over the foot's: Kellis and Katis 2007, J. Sports Sci. Med. 6, 154-165 (1.06 to 1.3)
_FOOT_SPEED_RATIO = 1.2
_FLOOR_TOLERANCE = 0.03  # m, height of the lowest point up to which the floor counts as at 0
_HALF_STEP = 0.001  # s before and after the release between which the ball's speed is measured on the joints' splines
_MARGIN_SECONDS = 0.8  # s beyond an example's ends that are read too, for the networks' windows
_MAX_GROUND_KICK = 0.4  # m; a toe below this kicks a ball on the ground
_CONTACT_TOLERANCE = 0.03  # s by which a foot's key moment may precede or follow the contact
_TARGET_DISTANCE = (0.5, 200.0)  # m, range of distances from the release to the target
_MAX_BELOW_FLOOR = 0.5  # m that a target may be below the estimated floor


def read_examples(
    folder: str | Path, action: str = "throw", fps: float = 30.0, target: Motion | None = None,
    report: Callable[[str], None] = lambda line: None, *, mirror: bool = False,
    progress: Callable[[float, str], None] = lambda share, text: None, cancelled: Callable[[], bool] = lambda: False,
) -> list[Example]:
    """Read the examples of an action below a folder, each in its own frame.

    Args:
        folder: folder of recordings.
        action: "throw" or "kick".
        fps: frames per second of the examples.
        target: retarget all examples to its skeleton; it shows how that rig is used. None keeps their own.
        report: receives one line for each throw that is left out with the reason, and one for all recordings without
            any.
        mirror: also return the mirror image of each, with the other hand or foot.
        progress: receives a share of 0 .. 1 and a text.
        cancelled: returns True to stop.
    Raises:
        InputError: if there is no folder, no example in it, an unreadable table, or a skeleton without hands or
            feet.
    """
    if action not in ACTIONS:
        raise InputError("action", action, " or ".join(ACTIONS))
    if target is not None:
        find_chains(target.skeleton)
    folder = Path(folder)
    clips = find_clips(folder)
    names = [path.relative_to(folder).as_posix() for path in clips]
    annotations, table = Annotations(folder, clips), read_table(folder, ACTIONS[action], set(names))
    _report_missing(annotations, ACTIONS[action], folder, report)
    retarget = _CachedRetargeter(target)
    found: list[Example] = []
    unannotated: list[str] = []
    for order, (path, name) in enumerate(zip(clips, names)):
        if cancelled():
            raise UserCancelledError("cancelled")
        progress(order / len(clips), path.name)
        if not is_known(path, ACTIONS[action], annotations, table.get(name)):
            unannotated.append(name)
            continue
        try:
            found += _read_clip(path, name, ACTIONS[action], annotations=annotations, rows=table.get(name), fps=fps,
                                retarget=retarget, report=report)
        except InputError as error:
            report(f"{name}: left out, {error}")
    if len(unannotated) == len(clips):
        raise _describe_missing(folder, action, clips, annotations)
    if unannotated:
        report(f"{folder}: {len(unannotated)} of {len(clips)} recordings left out because no {action} is annotated in "
               f"them, for example {unannotated[0]}")  # fmt: skip
    if not found:
        raise InputError(folder, f"every {action} in it is left out", "at least one readable example",
                         f"see the notes, and {_PAGE}")  # fmt: skip
    if not mirror:
        return found
    mirror_images = (replace(mirror_example(example), name=f"{example.name} (mirrored)") for example in found)
    return [each for pair in zip(found, mirror_images) for each in pair]


def _report_missing(annotations: Annotations, action: Action, folder: Path, report: Callable[[str], None]) -> None:
    """Report each table of annotations below the folder that names missing recordings."""
    for table, rows in annotations.tables.items():
        if table != folder.absolute() and folder.absolute() not in table.parents:
            continue  # table of a larger library, which may have other recordings
        named = [name for name, its in rows.items() if any(action.labels & set(one.words) for one in its)]
        missing = [name for name in named if not (table / name).is_file()]
        if missing:
            report(
                f"{table / ANNOTATIONS_NAME}: names "
                f"{format_count(len(missing), 'missing recording')}, for example {missing[0]}"
            )


def _describe_missing(folder: Path, action: str, clips: list[Path], annotations: Annotations) -> InputError:
    """Build the error for a folder without the action; it says if the folder has the other action."""
    names = {path.relative_to(folder).as_posix() for path in clips}
    for other, its in ACTIONS.items():
        rows = read_table(folder, its, names) if other != action else {}
        count = sum(is_known(path, its, annotations, rows.get(path.relative_to(folder).as_posix())) for path in clips)
        if other != action and count:
            found = f"{len(clips)} BVH files, none with a {action}, {count} with a {other}"
            return InputError(folder, found, f"recordings of a {action}",
                              f"choose another folder, or the action or the model for a {other}")
    label_names = " or ".join(sorted(ACTIONS[action].labels))
    return InputError(
        folder, f"{len(clips)} BVH files, none with a {action}", f"a key moment with the label {label_names}",
        f"write NAME.txt beside NAME.bvh, or {TABLE_NAME}; see {_PAGE}",
    )


def _read_clip(path, name: str, action: Action, annotations: Annotations, rows, fps: float, retarget,
               report) -> list[Example]:
    """Read all examples of one recording."""
    motion = bvh.read_bvh(path).motion
    every = read_known(path, motion.fps, action, annotations, rows)
    above = Path(name).parent.as_posix()
    usual = above if above != "." else motion.skeleton.fingerprint
    out = []
    for order, known in enumerate(every):
        own = name if len(every) == 1 else f"{name} {order + 1}"
        try:
            out.append(_build_example(own, motion, known, action=action, fps=fps, retarget=retarget,
                                      subject=known.subject or usual))
        except BeyondMocapError as error:
            report(f"{own}: left out, {error}")
    return out


class _CachedRetargeter:
    """Retarget motions to one skeleton; each rig is analysed once.

    Another rig is compared with the target's motion: from its rest pose alone, necks and hands would be turned. Bodies
    of one rig hold themselves as they were recorded.
    """

    def __init__(self, target: Motion | None):
        self.target = target
        self._rigs: dict[str, Retargeter] = {}

    def __call__(self, motion: Motion) -> Motion:
        if self.target is None or motion.skeleton.has_same_bones(self.target.skeleton, 1e-4):
            return motion
        key = motion.skeleton.fingerprint
        if key not in self._rigs:
            example = None if motion.skeleton.names == self.target.skeleton.names else self.target
            self._rigs[key] = Retargeter(motion, self.target.skeleton, example=example)
        return self._rigs[key].retarget(motion)


def _build_example(
    name: str, motion: Motion, known: KnownThrow, action: Action, fps: float, retarget: _CachedRetargeter, subject: str
) -> Example:
    """Cut out one example, retarget it to the requested skeleton and rate, and move it to its own frame."""
    if known.release is None:
        raise InputError("release", "no time", f"release_s in {TABLE_NAME} or a key moment")
    if not 0.1 <= known.release <= motion.duration - 0.1:
        raise InputError("release", f"{known.release:g} s", f"within the recording of {motion.duration:.2f} s")
    if action.ball is FOOTBALL and known.launch is None and known.speed is None:
        known = replace(known, release=_find_contact(motion, known, action))
    motion, known = _move_to_floor(motion, known)
    first, cut = _cut_example(motion, known, action)
    release = known.release - first
    limb = _find_fastest_limb(cut, release, action) if known.limb is None else known.limb
    position, launch = _compute_launch(cut, release, limb, known)
    if np.linalg.norm(launch) < _MIN_LAUNCH_SPEED:
        raise InputError("ball", f"{np.linalg.norm(launch):.1f} m/s at the release",
                         f"at least {_MIN_LAUNCH_SPEED:g} m/s")
    impact = _find_wall_impact(position, launch, action) if known.target is None else _check_target(known.target,
            position, launch)
    retargeted = retarget(cut)
    if retargeted is not cut:  # the same launch from the position of the retargeted hand
        impact = impact + _compute_ball_position(retargeted, release, limb) - _compute_ball_position(cut, release, limb)
    begin, end = _find_span(motion, known, action)
    return build_example(name, subject, retargeted, limb=limb, release=release, impact=impact, launch=launch, fps=fps,
                         span=(begin - first, end - first))


def _check_target(target: np.ndarray, position: np.ndarray, launch: np.ndarray) -> np.ndarray:
    """Check that a ball that leaves `position` can fly through the recorded target (3,) m; InputError if it cannot."""
    to_target = target - position
    distance, (low, high) = float(np.linalg.norm(to_target)), _TARGET_DISTANCE
    if not low <= distance <= high:
        raise InputError(
            "target", f"{distance:.3g} m from the ball at the release", f"{low:g} to {high:g} m", "check the unit"
        )
    if target[2] < -_MAX_BELOW_FLOOR:
        raise InputError("target", f"{-target[2]:.2f} m below the floor", "a point above it",
                         "check that Z is up in the table")  # fmt: skip
    if to_target[:2] @ launch[:2] <= 0.0:
        raise InputError("target", "a point behind the ball", "a point ahead of it", "check the axes in the table")
    return target


def _find_span(motion: Motion, known: KnownThrow, action: Action) -> tuple[float, float]:
    """Return the first and last second of an example."""
    begin, end = known.stretch or (known.release, known.release)
    begin = np.clip(begin, known.release - action.before[1], known.release - action.before[0])
    end = np.clip(end, known.release + action.after[0], known.release + action.after[1])
    return max(float(begin), 0.0), min(float(end), motion.duration)


def _cut_example(motion: Motion, known: KnownThrow, action: Action) -> tuple[float, Motion]:
    """Cut out an example and its surroundings that windows include; also return the first second."""
    begin, end = _find_span(motion, known, action)
    first = max(int(np.floor((begin - _MARGIN_SECONDS) * motion.fps)), 0)
    last = min(int(np.ceil((end + _MARGIN_SECONDS) * motion.fps)), len(motion) - 1)
    frames = slice(first, last + 1)
    cut = replace(motion, root_positions=motion.root_positions[frames], rotations=motion.rotations[frames])
    return first / motion.fps, cut


def _move_to_floor(motion: Motion, known: KnownThrow) -> tuple[Motion, KnownThrow]:
    """Move a motion so that its floor is at 0, if the recording has it elsewhere."""
    places, _ = forward_kinematics(motion)
    lowest = np.concatenate([places, compute_end_positions(motion)], axis=1)[..., 2].min(axis=1)
    floor = float(np.quantile(lowest, 0.05))
    if abs(floor) <= _FLOOR_TOLERANCE:
        return motion, known
    down = np.array([0.0, 0.0, -floor])
    target = None if known.target is None else known.target + down
    return place_motion(motion, 0.0, down), replace(known, target=target)


def _find_joint(body: Humanoid, limb: int) -> int:
    side = body.left if limb % 2 == 0 else body.right
    joint = side.hand if limb < 2 else side.toe_or_foot
    if joint is None:
        raise InputError("skeleton", "no hands", "a body with arms and hands")
    return joint


def _compute_ball_positions(motion: Motion, seconds: np.ndarray, limb: int) -> np.ndarray:
    """Compute where the ball would be, (N, 3) m, at seconds (N,): in the hand, or at the toe."""
    root, local = sample_frames_cubic(motion, np.asarray(seconds) * motion.fps)
    places, turns = compute_pose(motion.skeleton, root, local)
    joint = _find_joint(identify_joints(motion.skeleton), limb)
    if limb >= 2:
        return places[:, joint]
    grip = find_grip(motion.skeleton, ("left", "right")[limb], BASEBALL.radius)
    return places[:, joint] + quaternion.rotate(turns[:, joint], grip)


def _compute_ball_position(motion: Motion, seconds: float, limb: int) -> np.ndarray:
    return _compute_ball_positions(motion, np.array([seconds]), limb)[0]


def _measure_velocity(motion: Motion, seconds: float, limb: int) -> np.ndarray:
    """Measure the velocity (3,) m/s of the ball from the joints' rotations."""
    before, after = _compute_ball_positions(motion, seconds + np.array([-_HALF_STEP, _HALF_STEP]), limb)
    return (after - before) / (2.0 * _HALF_STEP)


def _find_fastest_limb(motion: Motion, release: float, action: Action) -> int:
    """Find the hand or foot that moves faster at the release."""
    speeds = [np.linalg.norm(_measure_velocity(motion, release, limb)) for limb in action.limbs]
    return action.limbs[int(np.argmax(speeds))]


def _find_contact(motion: Motion, known: KnownThrow, action: Action) -> float:
    """Find the second near the key moment at which the foot is fastest.

    Derived key moments precede or follow the contact.
    """
    limb = _find_fastest_limb(motion, known.release, action) if known.limb is None else known.limb
    seconds = known.release + np.linspace(-_CONTACT_TOLERANCE, _CONTACT_TOLERANCE, 13)
    return float(seconds[int(np.argmax([np.linalg.norm(_measure_velocity(motion, at, limb)) for at in seconds]))])


def _compute_launch(motion: Motion, release: float, limb: int, known: KnownThrow) -> tuple[np.ndarray, np.ndarray]:
    """Compute position (3,) m and velocity (3,) m/s of the ball at the release."""
    position = _compute_ball_position(motion, release, limb)
    if known.launch is not None:
        return position, known.launch
    velocity = _measure_velocity(motion, release, limb)
    if limb >= 2:
        velocity = _FOOT_SPEED_RATIO * velocity * [1.0, 1.0, float(velocity[2] > 0.0)]
        if position[2] < _MAX_GROUND_KICK:
            position = np.array([*position[:2], FOOTBALL.radius])
    speed = float(np.linalg.norm(velocity))
    return position, velocity if known.speed is None or speed < 1e-6 else velocity * (known.speed / speed)


def _find_wall_impact(position: np.ndarray, launch: np.ndarray, action: Action) -> np.ndarray:
    """Compute where the ball hits a vertical wall at the usual distance, or the ground before it."""
    ahead = launch[:2] / max(float(np.hypot(*launch[:2])), 1e-9)
    return find_wall_impact(position, launch, action.ball, position[:2] + action.wall * ahead, ahead)[0]
