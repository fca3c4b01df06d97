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

from ..ball.flight import meet_wall
from ..ball.physics import BASEBALL, FOOTBALL
from ..base.errors import BeyondMocapError, Cancelled, InputError
from ..files.bvh import bvh
from ..library.scan import TABLE_NAME as ANNOTATIONS_NAME
from ..library.scan import Annotations, find_clips
from ..motion import quaternion
from ..motion.humanoid import Humanoid, identify
from ..motion.motion import Motion, cubic_at, end_positions, forward_kinematics, place, pose_kinematics
from ..motion.retargeting.retarget import Retargeter
from ..motion.skeleton import Skeleton
from ..synthetic.throws import grip_of
from .networks.chains import chains_of
from .networks.example import Example, example_of, mirrored
from .throw_records import ACTIONS, TABLE_NAME, Action, KnownThrow, is_known, read_known, read_table

_PAGE = "docs/throws/throw-examples.md"
_AT_REST = 3.0  # m/s; slower balls were not thrown
_OF_FOOT = 1.2  # a ball's speed over the foot's: Kellis and Katis 2007, J. Sports Sci. Med. 6, 154-165 (1.06 to 1.3)
_SHIFTED_FLOOR = 0.03  # m, height of the lowest point up to which the floor counts as at 0
_LOOK = 0.001  # s before and after the release between which the ball's speed is measured on the joints' splines
_AROUND = 0.8  # s beyond an example's ends that are read too, for the networks' windows
_ON_GROUND = 0.4  # m; a toe below this kicks a ball on the ground
_LATE = 0.03  # s by which a foot's key moment may precede or follow the contact
_TARGET_AWAY = (0.5, 200.0)  # m, range of distances from the release to the target
_UNDER_FLOOR = 0.5  # m that a target may be below the estimated floor


def examples_in(
    folder: str | Path, action: str = "throw", fps: float = 30.0, skeleton: Skeleton | None = None,
    told: Callable[[str], None] = lambda line: None, *, mirror: bool = False,
    progress: Callable[[float, str], None] = lambda share, text: None, cancelled: Callable[[], bool] = lambda: False,
) -> list[Example]:
    """Read the examples of an action below a folder, each in its own frame.

    Args:
        folder: folder of recordings.
        action: "throw" or "kick".
        fps: frames per second of the examples.
        skeleton: retarget all examples to this one; None keeps their own.
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
    if skeleton is not None:
        chains_of(skeleton)
    folder = Path(folder)
    clips = find_clips(folder)
    names = [path.relative_to(folder).as_posix() for path in clips]
    words, table = Annotations(folder, clips), read_table(folder, ACTIONS[action], set(names))
    _tell_strangers(words, ACTIONS[action], folder, told)
    bring = _Bring(skeleton)
    found: list[Example] = []
    without: list[str] = []
    for order, (path, name) in enumerate(zip(clips, names)):
        if cancelled():
            raise Cancelled("cancelled")
        progress(order / len(clips), path.name)
        if not is_known(path, ACTIONS[action], words, table.get(name)):
            without.append(name)
            continue
        try:
            found += _of_clip(path, name, ACTIONS[action], words=words, rows=table.get(name), fps=fps, bring=bring,
                              told=told)
        except InputError as error:
            told(f"{name}: left out, {error}")
    if len(without) == len(clips):
        raise _nothing(folder, action, clips, words)
    if without:
        told(f"{folder}: {len(without)} of {len(clips)} recordings left out because no {action} is annotated in them, "
             f"for example {without[0]}")  # fmt: skip
    if not found:
        raise InputError(folder, f"every {action} in it is left out", "at least one readable example",
                         f"see the notes, and {_PAGE}")  # fmt: skip
    if not mirror:
        return found
    twins = (replace(mirrored(example), name=f"{example.name} (mirrored)") for example in found)
    return [each for pair in zip(found, twins) for each in pair]


def _tell_strangers(words: Annotations, action: Action, folder: Path, told: Callable[[str], None]) -> None:
    """Report each table of annotations below the folder that names missing recordings."""
    for table, rows in words.tables.items():
        if table != folder.absolute() and folder.absolute() not in table.parents:
            continue  # table of a larger library, which may have other recordings
        named = [name for name, its in rows.items() if any(action.words & set(one.words) for one in its)]
        missing = [name for name in named if not (table / name).is_file()]
        if missing:
            told(
                f"{table / ANNOTATIONS_NAME}: names {len(missing)} missing recordings, for example {missing[0]}"
            )


def _nothing(folder: Path, action: str, clips: list[Path], words: Annotations) -> InputError:
    """Build the error for a folder without the action; it says if the folder has the other action."""
    names = {path.relative_to(folder).as_posix() for path in clips}
    for other, its in ACTIONS.items():
        rows = read_table(folder, its, names) if other != action else {}
        count = sum(is_known(path, its, words, rows.get(path.relative_to(folder).as_posix())) for path in clips)
        if other != action and count:
            found = f"{len(clips)} BVH files, none with a {action}, {count} with a {other}"
            return InputError(
                folder, found, f"recordings of a {action}", f"choose another folder, or the action {other}"
            )
    wanted = " or ".join(sorted(ACTIONS[action].words))
    return InputError(
        folder, f"{len(clips)} BVH files, none with a {action}", f"a key moment with the label {wanted}",
        f"write NAME.txt beside NAME.bvh, or {TABLE_NAME}; see {_PAGE}",
    )


def _of_clip(path, name: str, action: Action, words: Annotations, rows, fps: float, bring, told) -> list[Example]:
    """Read all examples of one recording."""
    motion = bvh.read(path).motion
    every = read_known(path, motion.fps, action, words, rows)
    above = Path(name).parent.as_posix()
    usual = above if above != "." else motion.skeleton.fingerprint
    out = []
    for order, known in enumerate(every):
        own = name if len(every) == 1 else f"{name} {order + 1}"
        try:
            out.append(_example(own, motion, known, action=action, fps=fps, bring=bring, who=known.subject or usual))
        except BeyondMocapError as error:
            told(f"{own}: left out, {error}")
    return out


class _Bring:
    """Retarget motions to one skeleton; each rig is analysed once."""

    def __init__(self, skeleton: Skeleton | None):
        self.skeleton = skeleton
        self._rigs: dict[str, Retargeter] = {}

    def __call__(self, motion: Motion) -> Motion:
        if self.skeleton is None or motion.skeleton.same_bones(self.skeleton, 1e-4):
            return motion
        key = motion.skeleton.fingerprint
        if key not in self._rigs:
            self._rigs[key] = Retargeter(motion, self.skeleton)
        return self._rigs[key].carry(motion)


def _example(
    name: str, motion: Motion, known: KnownThrow, action: Action, fps: float, bring: _Bring, who: str
) -> Example:
    """Cut out one example, retarget it to the requested skeleton and rate, and move it to its own frame."""
    if known.release is None:
        raise InputError("release", "no time", f"release_s in {TABLE_NAME} or a key moment")
    if not 0.1 <= known.release <= motion.duration - 0.1:
        raise InputError("release", f"{known.release:g} s", f"within the recording of {motion.duration:.2f} s")
    if action.ball is FOOTBALL and known.launch is None and known.speed is None:
        known = replace(known, release=_contact(motion, known, action))
    motion, known = _on_floor(motion, known)
    first, cut = _cut(motion, known, action)
    release = known.release - first
    limb = _fastest(cut, release, action) if known.limb is None else known.limb
    position, launch = _launched(cut, release, limb, known)
    if np.linalg.norm(launch) < _AT_REST:
        raise InputError("ball", f"{np.linalg.norm(launch):.1f} m/s at the release", f"at least {_AT_REST:g} m/s")
    impact = _wall(position, launch, action) if known.target is None else _checked(known.target, position, launch)
    there = bring(cut)
    if there is not cut:  # the same launch from the position of the retargeted hand
        impact = impact + _ball(there, release, limb) - _ball(cut, release, limb)
    begin, end = _stretch(motion, known, action)
    return example_of(name, who, there, limb=limb, release=release, impact=impact, launch=launch, fps=fps,
                      span=(begin - first, end - first))


def _checked(target: np.ndarray, position: np.ndarray, launch: np.ndarray) -> np.ndarray:
    """Check that a ball that leaves `position` can fly through the recorded target (3,) m; InputError if it cannot."""
    way = target - position
    away, (low, high) = float(np.linalg.norm(way)), _TARGET_AWAY
    if not low <= away <= high:
        raise InputError(
            "target", f"{away:.3g} m from the ball at the release", f"{low:g} to {high:g} m", "check the unit"
        )
    if target[2] < -_UNDER_FLOOR:
        raise InputError("target", f"{-target[2]:.2f} m below the floor", "a point above it",
                         "check that Z is up in the table")  # fmt: skip
    if way[:2] @ launch[:2] <= 0.0:
        raise InputError("target", "a point behind the ball", "a point ahead of it", "check the axes in the table")
    return target


def _stretch(motion: Motion, known: KnownThrow, action: Action) -> tuple[float, float]:
    """Return the first and last second of an example."""
    begin, end = known.stretch or (known.release, known.release)
    begin = np.clip(begin, known.release - action.before[1], known.release - action.before[0])
    end = np.clip(end, known.release + action.after[0], known.release + action.after[1])
    return max(float(begin), 0.0), min(float(end), motion.duration)


def _cut(motion: Motion, known: KnownThrow, action: Action) -> tuple[float, Motion]:
    """Cut out an example and its surroundings that windows include; also return the first second."""
    begin, end = _stretch(motion, known, action)
    first = max(int(np.floor((begin - _AROUND) * motion.fps)), 0)
    last = min(int(np.ceil((end + _AROUND) * motion.fps)), len(motion) - 1)
    frames = slice(first, last + 1)
    cut = replace(motion, root_positions=motion.root_positions[frames], rotations=motion.rotations[frames])
    return first / motion.fps, cut


def _on_floor(motion: Motion, known: KnownThrow) -> tuple[Motion, KnownThrow]:
    """Move a motion so that its floor is at 0, if the recording has it elsewhere."""
    places, _ = forward_kinematics(motion)
    lowest = np.concatenate([places, end_positions(motion)], axis=1)[..., 2].min(axis=1)
    floor = float(np.quantile(lowest, 0.05))
    if abs(floor) <= _SHIFTED_FLOOR:
        return motion, known
    down = np.array([0.0, 0.0, -floor])
    target = None if known.target is None else known.target + down
    return place(motion, 0.0, down), replace(known, target=target)


def _joint(body: Humanoid, limb: int) -> int:
    side = body.left if limb % 2 == 0 else body.right
    joint = side.hand if limb < 2 else side.toe_or_foot
    if joint is None:
        raise InputError("skeleton", "no hands", "a body with arms and hands")
    return joint


def _places(motion: Motion, seconds: np.ndarray, limb: int) -> np.ndarray:
    """Compute where the ball would be, (N, 3) m, at seconds (N,): in the hand, or at the toe."""
    root, local = cubic_at(motion, np.asarray(seconds) * motion.fps)
    places, turns = pose_kinematics(motion.skeleton, root, local)
    joint = _joint(identify(motion.skeleton), limb)
    if limb >= 2:
        return places[:, joint]
    grip = grip_of(motion.skeleton, ("left", "right")[limb], BASEBALL.radius)
    return places[:, joint] + quaternion.rotate(turns[:, joint], grip)


def _ball(motion: Motion, seconds: float, limb: int) -> np.ndarray:
    return _places(motion, np.array([seconds]), limb)[0]


def _velocity(motion: Motion, seconds: float, limb: int) -> np.ndarray:
    """Measure the velocity (3,) m/s of the ball from the joints' rotations."""
    before, after = _places(motion, seconds + np.array([-_LOOK, _LOOK]), limb)
    return (after - before) / (2.0 * _LOOK)


def _fastest(motion: Motion, release: float, action: Action) -> int:
    """Find the hand or foot that moves faster at the release."""
    speeds = [np.linalg.norm(_velocity(motion, release, limb)) for limb in action.limbs]
    return action.limbs[int(np.argmax(speeds))]


def _contact(motion: Motion, known: KnownThrow, action: Action) -> float:
    """Find the second near the key moment at which the foot is fastest.

    Derived key moments precede or follow the contact.
    """
    limb = _fastest(motion, known.release, action) if known.limb is None else known.limb
    seconds = known.release + np.linspace(-_LATE, _LATE, 13)
    return float(seconds[int(np.argmax([np.linalg.norm(_velocity(motion, at, limb)) for at in seconds]))])


def _launched(motion: Motion, release: float, limb: int, known: KnownThrow) -> tuple[np.ndarray, np.ndarray]:
    """Compute position (3,) m and velocity (3,) m/s of the ball at the release."""
    position = _ball(motion, release, limb)
    if known.launch is not None:
        return position, known.launch
    velocity = _velocity(motion, release, limb)
    if limb >= 2:
        velocity = _OF_FOOT * velocity * [1.0, 1.0, float(velocity[2] > 0.0)]
        if position[2] < _ON_GROUND:
            position = np.array([*position[:2], FOOTBALL.radius])
    speed = float(np.linalg.norm(velocity))
    return position, velocity if known.speed is None or speed < 1e-6 else velocity * (known.speed / speed)


def _wall(position: np.ndarray, launch: np.ndarray, action: Action) -> np.ndarray:
    """Compute where the ball hits a vertical wall at the usual distance, or the ground before it."""
    ahead = launch[:2] / max(float(np.hypot(*launch[:2])), 1e-9)
    return meet_wall(position, launch, action.ball, position[:2] + action.wall * ahead, ahead)[0]
