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
from functools import cached_property, partial

import numpy as np

from ...annotation import sort_labels
from ...annotation.ball_contact import choose_contact_labels, find_striking_part
from ...base.easing import smoothstep
from ...library.library import Library
from ...motion import quaternion
from ...motion.foot_plant import PlantResult, plant_feet
from ...motion.mass import SEGMENT_MASSES
from ...motion.momentum_polish import obey_momentum
from ...motion.motion import Motion
from ...motion.toe_roll import roll_toes
from ...motion.track import SampledTrack
from ..ball_pins import SAME_TOUCH
from ..body_size import scale_ball
from ..edited_contacts import apply_contact_edits
from ..exertion import compute_exertion
from ..known_body import find_shown_frames, show_bodies
from ..plan import ResolvedPlan
from ..search.edit_list import EditList
from ..search.request import SearchRequest, compute_needed_frames
from ..search.source_frames import SourceFrames, SourceMotion, fetch_overlap
from ..take import KeyResult
from .ball_touch.touch_frames import Touch
from .breathing import breathe, compute_breath_depth
from .edit_blending import OldMotion
from .extra_steps import Steps, add_steps
from .gaze import compute_release, estimate_look, hide_lost_ball, watch_ball
from .place_plant_foot import place_plant_feet
from .settling import SPEEDS, measure_foot_moves, measure_rest, settle_on_track
from .strike import strike_ball
from .track_following import (
    absorb_foot_slide,
    add_sway,
    compute_missing_lean,
    compute_turning_firmness,
    fit_heading,
    lean_into_curves,
    pull_to_track,
)
from .transitions import blend_rotations, blend_values, compute_blend_share
from .turn_to_ball import compute_turn_to_ball

# s on either side of a key moment without a clip, in which the body reaches for the ball and returns
REACH_SECONDS = 0.4
# s around a header in which the head moves as recorded, and s beside touches in which watching begins and ends
HEADER_SECONDS, RELEASE_SECONDS = 0.3, 0.5

FREE_SECONDS, FREE_FADE = 0.4, 0.4
"""Seconds before and after a touch, within the entry and exit of its clip, in which the clip decides how the body
faces, and seconds over which the plan takes over: a run-up that turned as it was recorded spun on sharp turns."""

KICK_SECONDS, KICK_FADE = 0.3, 0.3
"""Seconds beside a touch in which a kick's own balance stays, and seconds over which momentum takes over: a kick stands
on one leg and throws the other, which a plan for runners moves by up to 10 cm."""


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
    source: SourceMotion
    touches: Sequence[Touch] = ()
    heading: np.ndarray | None = None
    old: OldMotion | None = None
    turns_to_ball: bool = True
    is_planned: bool = False

    @cached_property
    def smooth_source(self) -> SourceMotion:
        """The source frames without jumps: each piece is blended into the next over frames that both recordings show.

        The blend lasts half as long as Faustino's window.
        """
        source = self.source
        over = fetch_overlap(self.library, source, 0.25 * self.plan.requested.seam_window * self.plan.fps)
        weight = compute_blend_share(over.through, over.after)
        return replace(
            source,
            pose=blend_rotations(source.pose, over.at, over.pose, over.through, over.after),
            height=blend_values(source.height, over.at, over.height, weight),
            sway=blend_values(source.sway, over.at, over.sway, weight),
        )

    @cached_property
    def _foot_moves(self) -> tuple[np.ndarray, np.ndarray]:
        """How the body has to move and turn so that its feet in contact stay (`measure_foot_moves`)."""
        return measure_foot_moves(self.library.skeleton, self.smooth_source, self.plan.fps)

    def construct_body(self) -> tuple[PlantResult, Steps]:
        """Construct the body on its track with planted feet.

        Returns:
            The planted body (T frames) and the extra steps it takes.
        """
        heading = self.heading if self.is_planned else self._solve_heading()
        pose = apply_heading(self.smooth_source.pose, heading)
        if not self.is_planned and self.track.heading is not None:
            self = replace(self, track=settle_on_track(self.track, self.smooth_source, self._foot_moves[0], heading,
                                                       self._compute_given_root(heading)))
        ground = add_sway(self.track.positions, self.smooth_source.sway, heading)
        if not self.is_planned:
            ground, pose = self._pull_to_track(ground), self._lean_into_curves(pose)
        planted, steps_taken = self._plant_feet(np.column_stack([ground, self.smooth_source.height]), pose)
        planted = self._obey_momentum(self._breathe(self._watch_ball(planted)))
        planted, steps_taken = self._edit_contacts(planted, steps_taken)
        planted = replace(planted, rotations=self._roll_toes(planted.root, planted.rotations))
        return show_bodies(self.library.skeleton, planted, steps_taken, self.plan.requested.bodies,
                           round(float(self.track.times[0]) * self.plan.fps), fps=self.plan.fps, size=self.plan.size)

    def _edit_contacts(self, planted: PlantResult, steps_taken: Steps) -> tuple[PlantResult, Steps]:
        """Apply the plan's contact edits."""
        size = self.plan.size
        edits = [edit if size == 1.0 else replace(edit, offset=(edit.offset[0] / size, edit.offset[1] / size))
                 for edit in self.plan.requested.contact_edits]
        return apply_contact_edits(self.library.skeleton, planted, steps_taken, edits, self.plan.fps,
                                   start=float(self.track.times[0]))

    def _roll_toes(self, root: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        """Bend the toes (T, J, 4) where their tips would be below the ground."""
        return roll_toes(self.library.neutral_stance, root, rotations)

    def _obey_momentum(self, planted: PlantResult) -> PlantResult:
        """Let the centre of mass fly on parabolas and lean as it is pushed, except where a foot meets the ball.

        A planned path keeps its root exactly, so there the body stays as it is.
        """
        if self.is_planned:
            return planted
        at, share = np.arange(len(self.track)), np.ones(len(self.track))
        for touch in self.touches:
            if find_striking_part(touch.words) not in ("foot", "thigh"):
                continue  # headers, dives and throws fly as all bodies do
            away = (np.abs(at - touch.frame) / self.plan.fps - KICK_SECONDS) / KICK_FADE
            share = np.minimum(share, smoothstep(np.clip(away, 0.0, 1.0)))
        # gravity holds in the player's size: a child's flights are shorter in the library's
        size, skeleton, requested = self.plan.size, self.library.skeleton, self.plan.requested
        root, rotations = obey_momentum(skeleton if size == 1.0 else skeleton.scale(size), size * planted.root,
                                        planted.rotations, self.plan.fps, share, strength=requested.strength,
                                        masses=SEGMENT_MASSES[requested.masses])
        return replace(planted, root=root / size, rotations=rotations)

    def _compute_given_root(self, heading: np.ndarray) -> np.ndarray:
        """Compute where the root has to be (T, 2) m, NaN where it is free, for a heading (T,) rad.

        On the track where the heading is given too, and where the old motion stays.
        """
        given = add_sway(self.track.positions, self.smooth_source.sway, heading)
        if self.heading is not None:
            given = np.where(np.isfinite(self.heading)[:, None], given, np.nan)
        if self.old is None:
            return given if self.heading is not None else np.full_like(given, np.nan)
        return np.where(self.old.is_old[:, None], self.old.root[:, :2], np.nan)

    def _watch_ball(self, planted: PlantResult) -> PlantResult:
        """Turn shoulders and head to the ball by the plan's share, except where the body meets it."""
        strength, fps, track = self.plan.requested.watch, self.plan.fps, self.track
        ball = hide_lost_ball(track.ball, track.ball_measured, fps)
        if not strength or not np.isfinite(ball).any():
            return planted
        heads = [(touch.frame - HEADER_SECONDS * fps, touch.frame + HEADER_SECONDS * fps) for touch in self.touches
                 if find_striking_part(touch.words) == "head"]
        head = strength * compute_release(heads, len(track), RELEASE_SECONDS * fps)
        motion = watch_ball(
            Motion(self.library.skeleton, planted.root, planted.rotations, fps),
            ball, look=estimate_look(self.library), speed=track.speed, seed=self.plan.requested.seed,
            start=float(track.times[0]), head_share=head,
            shoulder_share=strength * self._shoulder_release,
        )
        return replace(planted, rotations=motion.rotations)

    def _breathe(self, planted: PlantResult) -> PlantResult:
        """Let chest and shoulders breathe after sprints by the plan's share, except within the clips of touches."""
        requested = self.plan.requested
        if not requested.fatigue:
            return planted
        whole = self.plan.sample_track(self.plan.fps)  # sprints long before a part that is edited count
        speed = whole.speed * self.plan.size
        depth = compute_breath_depth(compute_exertion(speed, whole.fps, requested.exertion), speed, whole.fps)
        depth = requested.fatigue * np.interp(self.track.times, whole.times, depth) * self._shoulder_release
        motion = breathe(Motion(self.library.skeleton, planted.root, planted.rotations, self.plan.fps), depth,
                         self.track.times, requested.seed)
        return replace(planted, rotations=motion.rotations)

    @property
    def _shoulder_release(self) -> np.ndarray:
        """(T,) share in which the upper body is free: none within the clips of touches."""
        bodies = [(touch.frame - touch.entry, touch.frame + touch.leave) for touch in self.touches]
        return compute_release(bodies, len(self.track), RELEASE_SECONDS * self.plan.fps)

    def solve_ball_contact(self, planted: PlantResult, steps_taken: Steps) -> tuple[PlantResult, np.ndarray]:
        """Bring the striking part to the ball at every touch.

        Args:
            planted: the body of `construct_body`.
            steps_taken: its steps.
        Returns:
            The body and the ball's centre (T, 3) m, both in the library's size.
        """
        track, size = self.track, self.plan.size
        samples = self.plan.track
        is_height_known = np.interp(track.times, samples.times, samples.ball_height_known.astype(float)) > 0.5
        skeleton, root, ball = self.library.skeleton, planted.root, track.ball
        if size != 1.0:  # solved in the player's size: the ball is the same for tall and short players
            skeleton, root, ball = skeleton.scale(size), root * size, scale_ball(ball, size)
        contacts, rotations = steps_taken.heel_toe_contacts.any(axis=2), planted.rotations
        meet = partial(strike_ball, skeleton, root, contacts=contacts, ball=ball, touches=self._pin_touches(),
                       fps=self.plan.fps, measured=track.ball_measured, height_known=is_height_known)
        contact = meet(rotations)
        shown = find_shown_frames(self.plan.requested.bodies, track.times)  # seen feet stand where they were seen
        free = [touch for touch in self.touches if not shown[int(np.clip(touch.frame, 0, len(shown) - 1))]]
        placed = place_plant_feet(skeleton, root, rotations, contact, contacts, touches=free, fps=self.plan.fps)
        if placed is not rotations:
            contact = meet(placed)
        root, ball = (contact.root, contact.ball) if size == 1.0 else (contact.root / size, contact.ball / size)
        return replace(planted, root=root, rotations=self._roll_toes(root, contact.rotations)), ball

    def _pin_touches(self) -> list[Touch]:
        """Give the touches at a pin of the ball its place, in the player's size."""
        seconds = [float(self.track.times[0]) + touch.frame / self.plan.fps for touch in self.touches]
        pins = [next((pin for pin in self.plan.ball_pins.values() if abs(pin.time - second) <= SAME_TOUCH), None)
                for second in seconds]
        return [touch if pin is None else replace(touch, place=pin.position) for touch, pin in zip(self.touches, pins)]

    def _solve_heading(self) -> np.ndarray:
        """Solve the heading (T,) rad from given values, track and source, turned to the ball at touches."""
        given = self.heading if self.old is None else self.old.compute_heading(self.smooth_source.pose)
        heading = solve_heading(self.track, self._turning_source, given, self._freedom)
        if self.old is not None:
            track = self.old.match_turning(self.track, heading)
            heading = heading if track is None else solve_heading(track, self._turning_source, given, self._freedom)
        return heading + (1.0 - self._old_share) * self._turn_to_ball(heading) if self.turns_to_ball else heading

    @property
    def _freedom(self) -> np.ndarray:
        """(T,) how far the clip decides how the body faces, not the plan: 1 near a touch, 0 away from it."""
        at, found = np.arange(len(self.track)), np.zeros(len(self.track))
        for touch in self.touches:
            before, after = (min(frames, FREE_SECONDS * self.plan.fps) for frames in (touch.entry, touch.leave))
            away = np.maximum(touch.frame - before - at, at - touch.frame - after) / (FREE_FADE * self.plan.fps)
            found = np.maximum(found, 1.0 - smoothstep(np.clip(away, 0.0, 1.0)))
        return found

    @property
    def _turning_source(self) -> SourceMotion:
        """The source frames with the turning that keeps feet in contact where the body is slow."""
        if self.track.heading is None or len(self.track) < 2:
            return self.smooth_source
        slow = np.interp(self.track.speed, SPEEDS[1:], (1.0, 0.0))[1:]
        turn = self.smooth_source.turn.copy()
        turn[1:] += slow * (self._foot_moves[1] - turn[1:])
        return replace(self.smooth_source, turn=turn)

    @property
    def _old_share(self) -> np.ndarray | float:
        """(T,) share of the old motion in the result, or 0.0 without one."""
        return 0.0 if self.old is None else self.old.share

    def _turn_to_ball(self, heading: np.ndarray) -> np.ndarray:
        """Compute the extra turn (T,) rad to the ball for a heading (T,) rad."""
        ground = add_sway(self.track.positions, self.smooth_source.sway, heading)
        root, pose = np.column_stack([ground, self.smooth_source.height]), apply_heading(self.smooth_source.pose,
                heading)
        return compute_turn_to_ball(self.library.skeleton, root, pose, ball=self.track.ball, touches=self.touches,
                                    fps=self.track.fps)

    def _pull_to_track(self, ground: np.ndarray) -> np.ndarray:
        """Remove the slow drift of the root, ground (T, 2) m, from the track."""
        window = self.plan.requested.root_window
        if self.old is not None:
            return self.old.pull_to_track(ground, self.track, window)
        return pull_to_track(ground, self.track.raw, self.plan.fps, window)

    def _lean_into_curves(self, pose: np.ndarray) -> np.ndarray:
        """Lean the body (T, J, 4) into the track's curves by what its source lacks."""
        track, smooth = self.track, self.smooth_source
        lean = compute_missing_lean(track.speed, track.direction, smooth.velocity, turn=smooth.turn,
                                    transitions=smooth.transitions, fps=self.plan.fps)
        return lean_into_curves(self.library.skeleton, pose, track.direction, lean)

    def _plant_feet(self, root: np.ndarray, pose: np.ndarray) -> tuple[PlantResult, Steps]:
        """Hold the feet or let them step; add no steps where the ball may be met, nor where the old motion stays."""
        skeleton, fps, heel_toe_contacts = self.library.skeleton, self.plan.fps, self.smooth_source.heel_toe_contacts
        share, at = np.broadcast_to(self._old_share, len(root)), np.arange(len(root))
        free = share == 0.0
        # no steps within the entry and exit of a touch
        for touch in self.touches:
            free &= (at < touch.frame - touch.entry) | (at > touch.frame + touch.leave)
        old_steps = None if self.old is None else self.old.select_old_steps()
        steps_taken = add_steps(skeleton, root, pose, heel_toe_contacts=heel_toe_contacts, fps=fps,
                                steps_taken=old_steps, free=free)
        root = root + np.column_stack([(1.0 - share)[:, None] * steps_taken.sway, np.zeros(len(root))])
        root, pose = self._absorb_foot_slide(root, steps_taken, 1.0 - share)
        return plant_feet(skeleton, root, pose, steps_taken.heel_toe_contacts, fps,
                          foot_moves=steps_taken.moves), steps_taken

    def _absorb_foot_slide(self, root: np.ndarray, steps_taken: Steps, free: np.ndarray) -> tuple[np.ndarray,
            np.ndarray]:
        """Move and turn the body a little where its feet would slide.

        Args:
            root: (T, 3) m, world.
            steps_taken: the steps.
            free: (T,) 1 where the body may yield, 0 where it must stay.
        Returns:
            Root (T, 3) m and local rotations (T, J, 4).
        """
        move, turn = absorb_foot_slide(self.library.skeleton, root, steps_taken.rotations,
                                       steps_taken.heel_toe_contacts, self.plan.fps)
        pulled = pull_to_track(root[:, :2] + move, self.track.raw, self.plan.fps, self.plan.requested.root_window)
        ground = root[:, :2] + free[:, None] * (pulled - root[:, :2])
        return np.concatenate([ground, root[:, 2:]], axis=1), apply_heading(steps_taken.rotations, free * turn)


def apply_heading(pose: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Turn poses in the facing frame so that the body faces a heading.

    Args:
        pose: (T, J, 4) local rotations, the root's in the facing frame.
        heading: (T,) rad, world.
    Returns:
        (T, J, 4) local rotations, the root's in the world frame.
    """
    out = pose.copy()
    out[:, 0] = quaternion.multiply(quaternion.from_up_angle(heading), pose[:, 0])
    return out


def solve_heading(
    track: SampledTrack, source: SourceMotion, given: np.ndarray | None = None, freedom: np.ndarray | float = 0.0
) -> np.ndarray:
    """Solve the heading: the compromise between the track's direction and the source's own turning.

    Args:
        track: T frames; a body in place or moving slowly turns to the gaze target of the track.
        source: T source frames without jumps.
        given: (T,) rad that the heading has to be, NaN where it is free.
        freedom: (T,) from 0 to 1, how little the planned heading counts.
    Returns:
        (T,) rad, unwrapped.
    """
    firm = compute_turning_firmness(source.heel_toe_contacts, source.height, source.transitions, track.fps)
    held = 0.0 if track.held is None else track.held * (1.0 - freedom)
    if track.heading is not None:
        firm = firm * measure_rest(source, track.speed)
    return fit_heading(track.direction, track.speed, source.velocity, source.turn, given, plan=track.heading,
                       firm=firm + held * (1.0 - firm), freedom=freedom, held=held)


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
        result = keys[placed.number]
        entry, leave = np.multiply(compute_needed_frames(library, placed.key), fps / library.fps)
        found.append(Touch(result.frame, result.words, float(entry), float(leave), result.requested.misses_ball))
        served.add(placed.number)
    reach = REACH_SECONDS * fps
    for number, result in enumerate(keys):
        requested = result.requested.words
        is_missing = result.used_instead is not None and choose_contact_labels(result.words, requested) == requested
        if is_missing and number not in served and all(abs(result.frame - touch.frame) > reach for touch in found):
            found.append(Touch(result.frame, requested, reach, reach, result.requested.misses_ball))
    return tuple(found)


def build_key_results(library: Library, fps: float, request: SearchRequest, edit: EditList,
                      shown_frames: SourceFrames) -> tuple[KeyResult, ...]:
    """Report the result of every key moment of a request.

    Args:
        library: the clips.
        fps: output frames per second.
        request: the request.
        edit: the edit list, at the library's rate.
        shown_frames: the source frames shown, at `fps`.
    """
    return tuple(_build_key_result(library, fps, request, edit=edit, shown_frames=shown_frames, number=number)
                 for number in range(len(request.keys)))


def _build_key_result(library: Library, fps: float, request: SearchRequest, edit: EditList, shown_frames: SourceFrames,
                      number: int) -> KeyResult:
    """Report one key moment: where its clip's key frame is played, or what is shown in its place."""
    key = request.keys[number]
    at = key.frame * fps / library.fps
    near = int(np.clip(round(at), 0, len(shown_frames.clip) - 1))
    clip, clip_frame = int(shown_frames.clip[near]), float(shown_frames.clip_frame[near])
    placed = next((p for p in edit.keys if p.number == number and p.key.clip == clip), None)
    words = sort_labels(placed.key.labels if placed else library.clips[clip].labels_at(clip_frame))
    if placed is not None:
        inside = np.flatnonzero(shown_frames.piece == shown_frames.piece[near])
        if len(inside) > 1 and np.all(np.diff(shown_frames.clip_frame[inside]) > 0):
            at = float(np.interp(placed.key.frame, shown_frames.clip_frame[inside], inside))
        clip_frame = placed.key.frame
    source = library.clips[clip]
    instead = words if key.used_instead and not key.choices else key.used_instead
    return KeyResult(requested=key.requested, frame=at, clip=source.path, clip_frame=clip_frame,
                     mirrored=source.mirrored, words=words, used_instead=instead)
