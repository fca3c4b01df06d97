"""Construction of a motion: source frames placed on a track, feet planted, the ball met.

    construction = Construction(library=library, plan=plan, track=track, source=source, touches=touches)
    planted, steps = construction.construct_body()
    planted, ball = construction.solve_ball_contact(planted, steps)

The same steps serve a whole take, a part of one, the run-up to a throw and a passing player; the arguments differ.
Transitions are blended, heading and root follow the track, the body leans into its curves, feet are held where they
are in contact or step where they would be dragged, and the striking part is brought to the ball.
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

OTHERWISE = 0.4  # s on either side of a key moment without a clip, in which the body reaches for the ball and returns


@dataclass(frozen=True, eq=False, kw_only=True)
class Construction:
    """What a body is constructed from.

    Attributes:
        library: the clips.
        plan: the resolved plan.
        track: T frames at the output's rate, m in the library's size.
        source: T source frames as fetched, with their jumps at transitions.
        touches: where the body may meet the ball, in frames of the track.
        heading: (T,) rad that is given, NaN where it is free; None where nothing is given.
        old: the motion that stays at both ends, None for none.
        turns_to_ball: whether the body turns so that the striking part points at the ball.
        is_planned: whether the track is a planned path: it is kept exactly, the heading is given in all frames, and the
            body does not lean more than its source does.
    """

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
        """The source frames without jumps: each piece is blended into the next over frames that both recordings show.

        The blend lasts half as long as Faustino's window.
        """
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
        """Construct the body on its track with planted feet.

        Returns:
            The planted body (T frames) and the extra steps it takes.
        """
        heading = self.heading if self.planned else self._solve_heading()
        ground = root_with_sway(self.track.positions, self.smooth.sway, heading)
        pose = apply_heading(self.smooth.pose, heading)
        if not self.planned:
            ground, pose = self._pull_to_track(ground), self._lean(pose)
        return self._plant_feet(np.column_stack([ground, self.smooth.height]), pose)

    def meet_ball(self, planted: Planted, taken: Steps) -> tuple[Planted, np.ndarray]:
        """Bring the striking part to the ball at every touch.

        Args:
            planted: the body of `construct_body`.
            steps_taken: its steps.
        Returns:
            The body and the ball's centre (T, 3) m, both in the library's size.
        """
        track, size = self.track, self.plan.size
        samples = self.plan.track
        height = np.interp(track.times, samples.times, samples.ball_height_known.astype(float)) > 0.5
        skeleton, root, ball = self.library.skeleton, planted.root, track.ball
        if size != 1.0:  # solved in the player's size: the ball is the same for tall and short players
            skeleton, root, ball = skeleton.scaled(size), root * size, real_ball(ball, size)
        struck = strike(skeleton, root, planted.rotations, contacts=taken.standing.any(axis=2), ball=ball,
                        touches=self.touches, fps=self.plan.fps, measured=track.ball_measured, height_known=height)
        root, ball = (struck.root, struck.ball) if size == 1.0 else (struck.root / size, struck.ball / size)
        return replace(planted, root=root, rotations=struck.rotations), ball

    def _solve_heading(self) -> np.ndarray:
        """Solve the heading (T,) rad from given values, track and source, turned to the ball at touches."""
        given = self.heading if self.old is None else self.old.heading_of(self.smooth.pose)
        heading = solve_heading(self.track, self.smooth, given)
        if self.old is not None:
            track = self.old.turned_alike(self.track, heading)
            heading = heading if track is None else solve_heading(track, self.smooth, given)
        return heading + (1.0 - self._share) * self._turn_to_ball(heading) if self.faces_ball else heading

    @property
    def _share(self) -> np.ndarray | float:
        """(T,) share of the old motion in the result, or 0.0 without one."""
        return 0.0 if self.old is None else self.old.share

    def _turn_to_ball(self, heading: np.ndarray) -> np.ndarray:
        """Compute the extra turn (T,) rad to the ball for a heading (T,) rad."""
        ground = root_with_sway(self.track.positions, self.smooth.sway, heading)
        root, pose = np.column_stack([ground, self.smooth.height]), apply_heading(self.smooth.pose, heading)
        return turn_to_ball(self.library.skeleton, root, pose, ball=self.track.ball, touches=self.touches,
                            fps=self.track.fps)

    def _pull_to_track(self, ground: np.ndarray) -> np.ndarray:
        """Remove the slow drift of the root, ground (T, 2) m, from the track."""
        window = self.plan.asked.root_window
        if self.old is not None:
            return self.old.pulled(ground, self.track, window)
        return pulled_to_track(ground, self.track.raw, self.plan.fps, window)

    def _lean(self, pose: np.ndarray) -> np.ndarray:
        """Lean the body (T, J, 4) into the track's curves by what its source lacks."""
        track, smooth = self.track, self.smooth
        lean = missing_lean(track.speed, track.direction, smooth.velocity, turn=smooth.turn, seams=smooth.seams,
                            fps=self.plan.fps)
        return lean_into_curves(self.library.skeleton, pose, track.direction, lean)

    def _plant_feet(self, root: np.ndarray, pose: np.ndarray) -> tuple[Planted, Steps]:
        """Hold the feet or let them step; add no steps where the ball may be met, nor where the old motion stays."""
        skeleton, fps, standing = self.library.skeleton, self.plan.fps, self.smooth.standing
        share, at = np.broadcast_to(self._share, len(root)), np.arange(len(root))
        free = share == 0.0
        # no steps within the entry and exit of a touch
        for touch in self.touches:
            free &= (at < touch.frame - touch.entry) | (at > touch.frame + touch.leave)
        kept = None if self.old is None else self.old.kept_steps()
        taken = steps(skeleton, root, pose, standing=standing, fps=fps, given=kept, free=free)
        root = root + np.column_stack([(1.0 - share)[:, None] * taken.sway, np.zeros(len(root))])
        root, pose = self._absorb_foot_slide(root, taken, 1.0 - share)
        return plant(skeleton, root, pose, taken.standing, fps, moves=taken.moves), taken

    def _absorb_foot_slide(self, root: np.ndarray, taken: Steps, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Move and turn the body a little where its feet would slide.

        Args:
            root: (T, 3) m, world.
            steps_taken: the steps.
            free: (T,) 1 where the body may yield, 0 where it must stay.
        Returns:
            Root (T, 3) m and local rotations (T, J, 4).
        """
        move, turn = absorb_foot_slide(self.library.skeleton, root, taken.rotations, taken.standing, self.plan.fps)
        pulled = pulled_to_track(root[:, :2] + move, self.track.raw, self.plan.fps, self.plan.asked.root_window)
        ground = root[:, :2] + free[:, None] * (pulled - root[:, :2])
        return np.concatenate([ground, root[:, 2:]], axis=1), apply_heading(taken.rotations, free * turn)


def apply_heading(pose: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Turn poses in the facing frame so that the body faces a heading.

    Args:
        pose: (T, J, 4) local rotations, the root's in the facing frame.
        heading: (T,) rad, world.
    Returns:
        (T, J, 4) local rotations, the root's in the world frame.
    """
    out = pose.copy()
    out[:, 0] = quaternion.multiply(quaternion.about_up(heading), pose[:, 0])
    return out


def solve_heading(track: SampledTrack, source: Footage, given: np.ndarray | None = None) -> np.ndarray:
    """Solve the heading: the compromise between the track's direction and the source's own turning.

    Args:
        track: T frames; a body in place or moving slowly turns to the gaze target of the track.
        source: T source frames without jumps.
        given: (T,) rad that the heading has to be, NaN where it is free.
    Returns:
        (T,) rad, unwrapped.
    """
    firm = turning_firmness(source.standing, source.height, track.fps)
    aim = track.direction + wanted_offset(track)
    return facing(track.direction, track.speed, source.velocity, source.turn, given, firm=firm, aim=aim)


def find_touches(library: Library, fps: float, edit: EditList, keys: tuple[KeyResult, ...]) -> tuple[Touch, ...]:
    """Find where the body may meet the ball.

    These are all key moments that are played, and those for which the library has no clip at all: there the requested
    part reaches for the ball if it is near enough (a runner's head for a header).

    Args:
        library: the clips.
        fps: output frames per second.
        edit: the edit list with its placed keys.
        keys: the result of every key moment.
    Returns:
        Touches in frames at `fps`.
    """
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
    """Report the result of every key moment of a request.

    Args:
        library: the clips.
        fps: output frames per second.
        request: the request.
        edit: the edit list, at the library's rate.
        shown_frames: the source frames shown, at `fps`.
    """
    return tuple(_key_result(library, fps, order, edit=edit, played=played, number=number)
                 for number in range(len(order.keys)))


def _key_result(library: Library, fps: float, order: Wanted, edit: EditList, played: Shown, number: int) -> KeyResult:
    """Report one key moment: where its clip's key frame is played, or what is shown in its place."""
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
