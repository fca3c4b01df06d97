"""Source frames laid on a track, for a whole take, a part of one, the run-up to a throw and a passing player.

    construction = Construction(library=library, plan=plan, track=track, source=source, touches=touches)
    planted, steps = construction.lay_out()
    planted, ball = construction.meet_ball(planted, steps)

Transitions are faded, heading and root follow the track, the body leans into its curves, feet are held where they are
in contact or step where they would be dragged, and what strikes is brought to the ball. How each step is done stands in
a module of its own; what differs between the four is an argument here. `find_touches` says where the body may meet the
ball, `key_results` how each key moment came out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...annotation import spoken
from ...annotation.ball_contact import striking_part
from ...annotation.gaits import wanted_offset
from ...library.library import Library
from ...motion import quaternion
from ...motion.foot_plant import Planted, plant
from ...motion.track import SampledTrack
from ..own_size import real_ball
from ..plan import ResolvedPlan
from ..search.edit_list import EditList
from ..search.footage import Footage, Shown, overlap
from ..search.wanted import Wanted, needed
from ..take import KeyResult
from .hand_over import OldMotion
from .on_track import (
    absorb_foot_slide,
    facing,
    lean_into_curves,
    missing_lean,
    pulled_to_track,
    root_with_sway,
    turn_to_ball,
    turning_firmness,
)
from .steps import Steps, steps
from .strike import Touch, strike
from .transitions import fade_share, faded_rotations, faded_values

OTHERWISE = 0.4  # s around a key moment that no clip shows in which the body comes to the ball and goes back


@dataclass(frozen=True, eq=False, kw_only=True)
class Construction:
    """What a body is constructed from.

    library: the clips.
    plan: what is asked.
    track: T frames at the output's rate, m in the library's size.
    source: T frames as fetched.
    touches: where the body may meet the ball, in frames of the track.
    heading: (T,) rad that is given, NaN where it is free; None where nothing is given.
    old: the motion that stays at both ends, None for none.
    faces_ball: whether the body turns so that what strikes points at the ball.
    planned: whether the track is a planned path: it is kept exactly, the heading is given in all frames, and the body
        does not lean more than its source does."""

    library: Library
    plan: ResolvedPlan
    track: SampledTrack
    source: Footage
    touches: Sequence[Touch] = ()
    heading: np.ndarray | None = None
    old: OldMotion | None = None
    faces_ball: bool = True
    planned: bool = False

    @cached_property
    def smooth(self) -> Footage:
        """The source frames without jumps: each piece fades into the next over what both recordings show, half as long
        as Faustino's window."""
        source = self.source
        over = overlap(self.library, source, 0.25 * self.plan.asked.seam_window * self.plan.fps)
        weight = fade_share(over.through, over.after)
        return replace(
            source,
            pose=faded_rotations(source.pose, over.at, over.pose, over.through, over.after),
            height=faded_values(source.height, over.at, over.height, weight),
            sway=faded_values(source.sway, over.at, over.sway, weight),
        )

    def lay_out(self) -> tuple[Planted, Steps]:
        """The body on its track, feet planted, and the steps they take."""
        heading = self.heading if self.planned else self._solve_heading()
        ground = root_with_sway(self.track.positions, self.smooth.sway, heading)
        pose = apply_heading(self.smooth.pose, heading)
        if not self.planned:
            ground, pose = self._pull_to_track(ground), self._lean(pose)
        return self._plant_feet(np.column_stack([ground, self.smooth.height]), pose)

    def meet_ball(self, planted: Planted, taken: Steps) -> tuple[Planted, np.ndarray]:
        """The body with what strikes on the ball at every touch, and the ball (T, 3) m."""
        track, size = self.track, self.plan.size
        samples = self.plan.track
        height = np.interp(track.times, samples.times, samples.ball_height_known.astype(float)) > 0.5
        skeleton, root, ball = self.library.skeleton, planted.root, track.ball
        if size != 1.0:  # the ball is as large for a tall player as for a short one
            skeleton, root, ball = skeleton.scaled(size), root * size, real_ball(ball, size)
        struck = strike(skeleton, root, planted.rotations, contacts=taken.standing.any(axis=2), ball=ball,
                        touches=self.touches, fps=self.plan.fps, measured=track.ball_measured, height_known=height)
        root, ball = (struck.root, struck.ball) if size == 1.0 else (struck.root / size, struck.ball / size)
        return replace(planted, root=root, rotations=struck.rotations), ball

    def _solve_heading(self) -> np.ndarray:
        """(T,) rad: between what is given, the compromise of track and source; to the ball at the touches."""
        given = self.heading if self.old is None else self.old.heading_of(self.smooth.pose)
        heading = solve_heading(self.track, self.smooth, given)
        if self.old is not None:
            track = self.old.turned_alike(self.track, heading)
            heading = heading if track is None else solve_heading(track, self.smooth, given)
        return heading + (1.0 - self._share) * self._turn_to_ball(heading) if self.faces_ball else heading

    @property
    def _share(self) -> np.ndarray | float:
        """(T,) of the old motion in what comes out."""
        return 0.0 if self.old is None else self.old.share

    def _turn_to_ball(self, heading: np.ndarray) -> np.ndarray:
        ground = root_with_sway(self.track.positions, self.smooth.sway, heading)
        root, pose = np.column_stack([ground, self.smooth.height]), apply_heading(self.smooth.pose, heading)
        return turn_to_ball(self.library.skeleton, root, pose, ball=self.track.ball, touches=self.touches,
                            fps=self.track.fps)

    def _pull_to_track(self, ground: np.ndarray) -> np.ndarray:
        window = self.plan.asked.root_window
        if self.old is not None:
            return self.old.pulled(ground, self.track, window)
        return pulled_to_track(ground, self.track.raw, self.plan.fps, window)

    def _lean(self, pose: np.ndarray) -> np.ndarray:
        """(T, J, 4) of a body that leans into the track's curves as far as its source does not."""
        track, smooth = self.track, self.smooth
        lean = missing_lean(track.speed, track.direction, smooth.velocity, turn=smooth.turn, seams=smooth.seams,
                            fps=self.plan.fps)
        return lean_into_curves(self.library.skeleton, pose, track.direction, lean)

    def _plant_feet(self, root: np.ndarray, pose: np.ndarray) -> tuple[Planted, Steps]:
        """Feet held or stepping; no steps are added where the ball may be met, nor where the old motion stays."""
        skeleton, fps, standing = self.library.skeleton, self.plan.fps, self.smooth.standing
        share, at = np.broadcast_to(self._share, len(root)), np.arange(len(root))
        free = share == 0.0
        for touch in self.touches:
            free &= (at < touch.frame - touch.entry) | (at > touch.frame + touch.leave)
        kept = None if self.old is None else self.old.kept_steps()
        taken = steps(skeleton, root, pose, standing=standing, fps=fps, given=kept, free=free)
        root = root + np.column_stack([(1.0 - share)[:, None] * taken.sway, np.zeros(len(root))])
        root, pose = self._absorb_foot_slide(root, taken, 1.0 - share)
        return plant(skeleton, root, pose, taken.standing, fps, moves=taken.moves), taken

    def _absorb_foot_slide(self, root: np.ndarray, taken: Steps, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Root (T, 3) m and local rotations (T, J, 4) of a body that yields where its feet would slide, as far as it is
        `free` (T,) to: 1, or nothing at 0."""
        move, turn = absorb_foot_slide(self.library.skeleton, root, taken.rotations, taken.standing, self.plan.fps)
        pulled = pulled_to_track(root[:, :2] + move, self.track.raw, self.plan.fps, self.plan.asked.root_window)
        ground = root[:, :2] + free[:, None] * (pulled - root[:, :2])
        return np.concatenate([ground, root[:, 2:]], axis=1), apply_heading(taken.rotations, free * turn)


def apply_heading(pose: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Turn poses (T, J, 4) local, the root's in the facing frame, so that the body faces heading (T,) rad."""
    out = pose.copy()
    out[:, 0] = quaternion.multiply(quaternion.about_up(heading), pose[:, 0])
    return out


def solve_heading(track: SampledTrack, source: Footage, given: np.ndarray | None = None) -> np.ndarray:
    """(T,) rad, unwrapped: the compromise between the track's direction and the source's own turning.

    track: T frames; a body that stands or goes slowly turns to what it looks at there. source: T frames without jumps.
    given: (T,) rad that the heading has to be, NaN where it is free."""
    firm = turning_firmness(source.standing, source.height, track.fps)
    aim = track.direction + wanted_offset(track)
    return facing(track.direction, track.speed, source.velocity, source.turn, given, firm=firm, aim=aim)


def find_touches(library: Library, fps: float, edit: EditList, keys: tuple[KeyResult, ...]) -> tuple[Touch, ...]:
    """Where the body may meet the ball: every key moment that is played, and every one for which the library has no
    clip at all, so that something else is shown: there the asked part of that comes to the ball if it is near enough
    (a runner's head to a header). In frames at `fps`."""
    found, served = [], set()
    for placed in edit.keys:
        result = keys[placed.wanted]
        entry, leave = np.multiply(needed(library, placed.key), fps / library.fps)
        found.append(Touch(result.frame, result.words, float(entry), float(leave)))
        served.add(placed.wanted)
    alone = OTHERWISE * fps
    for number, result in enumerate(keys):
        lacks = result.used_instead is not None and number not in served and not striking_part(result.words)
        if lacks and all(abs(result.frame - touch.frame) > alone for touch in found):
            found.append(Touch(result.frame, result.asked.words, alone, alone))
    return tuple(found)


def key_results(library: Library, fps: float, order: Wanted, edit: EditList, played: Shown) -> tuple[KeyResult, ...]:
    """How every key moment of an order came out in `played`, whose frames are at `fps`."""
    return tuple(_key_result(library, fps, order, edit=edit, played=played, number=number)
                 for number in range(len(order.keys)))


def _key_result(library: Library, fps: float, order: Wanted, edit: EditList, played: Shown, number: int) -> KeyResult:
    """How key moment `number` came out: where its clip's key frame is played, or what stands in for it."""
    key = order.keys[number]
    at = key.frame * fps / library.fps
    near = int(np.clip(round(at), 0, len(played.clip) - 1))
    clip, shown = int(played.clip[near]), float(played.clip_frame[near])
    placed = next((p for p in edit.keys if p.wanted == number and p.key.clip == clip), None)
    words = spoken(placed.key.words if placed else library.clips[clip].words_at(shown))
    if placed is not None:
        inside = np.flatnonzero(played.piece == played.piece[near])
        if len(inside) > 1 and np.all(np.diff(played.clip_frame[inside]) > 0):
            at = float(np.interp(placed.key.frame, played.clip_frame[inside], inside))
        shown = placed.key.frame
    source = library.clips[clip]
    instead = words if key.used_instead and not key.choices else key.used_instead
    return KeyResult(asked=key.asked, frame=at, clip=source.path, clip_frame=shown, mirrored=source.mirrored,
                     words=words, used_instead=instead)
