"""Resynthesize: a take after a change of its plan, regenerated only where the change affects it.

    take = synthesize(library, plan)
    plan = replace(plan, timeline=with_the_kick_a_little_later)
    take = resynthesize(library, plan, take)

`synthesis.search.affected_frames` says what counts as affected. Affected stretches are searched between frames that
stay (`synthesis.search.path_search`, `SearchStretch`), constructed with the heading given at both ends, planted, and
blended into the old motion on both sides (`synthesis.construct.edit_blending`). All other frames come back bit for bit;
only where the body turns a full turn more or less than before, the quaternions behind may have the other sign, since a
motion's signs are continuous.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..base.errors import InputError, format_seconds
from ..library.library import Library
from ..motion.motion import Motion
from ..motion.track import SampledTrack
from .body_size import to_library_size
from .construct.ball_touch.carry_ball import build_ball_path
from .construct.construction import Construction, build_key_results, find_touches
from .construct.edit_blending import OldMotion, blend_with_old, compute_old_share
from .construct.transitions import compute_spread_reaches
from .edited_contacts import find_edited_frames
from .one_thread import limit_to_one_thread
from .plan import Plan, ResolvedPlan
from .provenance import list_labels_shown, list_sources
from .resolve_plan import resolve_plan
from .search.affected_frames import (
    Stretch,
    find_moved_frames,
    find_stretches_to_search,
    find_variant_stretch,
    list_stretches,
    list_unchanged_keys,
    merge_stretches,
)
from .search.candidate_index import SLOT
from .search.cost_weights import balance_weights
from .search.edit_list import EditList, SearchStretch
from .search.path_search import PathSearch
from .search.preferences import UsedStretch, list_used_stretches
from .search.request import SearchRequest, build_request
from .search.source_frames import SourceFrames, fetch_motion, look_up_frames, output_index
from .search_library import extend_library, find_plan_actions
from .synthesize import Progress, finish_take, synthesize
from .take import KeyResult, Take

BLEND_SECONDS = 0.5
"""Seconds before and after an affected stretch in which its motion is blended into the old one."""

CONTEXT_SECONDS = 1.2
"""Seconds further out that are constructed too, so that the ends of windows and solves lie outside what is used."""


@dataclass(frozen=True)
class VariantStretch:
    """A stretch of which another solution is requested.

    Attributes:
        start: s on the track's clock.
        end: s on the track's clock.
        used: source frames to avoid where that is possible (`list_shown_stretches` of what is shown there now).
    """

    start: float
    end: float
    used: tuple[UsedStretch, ...] = ()


def resynthesize(
    library: Library,
    plan: Plan,
    before: Take,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    hurry: Callable[[], bool] | None = None,
    variant: VariantStretch | None = None,
) -> Take:
    """Update a take after its plan has changed: search and construct only what the change affects.

    Pins are applied again. It is a whole synthesis where the change is not one of labels, track, ball, pins, headings
    or contacts (another method, frame rate, length or choice), where `before` was built from another library or by
    another method than "path", or where all of it is affected. The same library, plan and take give the same bits.

    Args:
        library: the recordings.
        plan: the changed plan.
        before: the take before the change.
        progress, cancelled, hurry: as for `synthesize`.
        variant: a stretch of which another solution is requested, whether or not its plan has changed.
    Raises:
        InputError: where that stretch lies outside the take, or for another method than "path".
        NotInLibraryError, UserCancelledError: as for `synthesize`.
    """
    report = progress or (lambda fraction, text: None)
    if variant is not None:
        _check_stretch(plan, before, variant)
    options: dict[str, Any] = {"cancelled": cancelled, "hurry": hurry}
    with limit_to_one_thread():
        is_comparable = _is_comparable(plan, before)
        updated = _update_take(library, plan, before, report, **options, variant=variant) if is_comparable else None
    used = variant.used if variant is not None else ()
    return synthesize(library, plan, progress, **options, used=used) if updated is None else updated


def list_shown_stretches(library: Library, take: Take, start: float, end: float) -> tuple[UsedStretch, ...]:
    """List the source frames that a take of method "path" shows between two seconds, for a `VariantStretch`.

    Nothing where the take was built from another library.
    """
    library = extend_library(library, resolve_plan(take.plan, library, trajectory=take.solved))
    if take.edit is None or not _is_built_from(library, take, len(take.edit)):
        return ()
    first, last = (int(round((second - take.start_time) * library.fps)) for second in (start, end))
    return list_used_stretches(library, take.edit, max(0, first), min(len(take.edit), max(last, first + 1)))


def _check_stretch(plan: Plan, before: Take, variant: VariantStretch) -> None:
    """Raise InputError for a stretch that cannot be searched again."""
    low, high = before.start_time, before.start_time + before.motion.duration
    if plan.method != "path":
        raise InputError("resynthesize stretch", f"method {plan.method}", "method path", "synthesize the whole take")
    if not low <= variant.start < variant.end <= high + 0.5 / before.motion.fps:
        found = f"{format_seconds(variant.start)} to {format_seconds(variant.end)} s"
        expected = f"a stretch within {format_seconds(low)} to {format_seconds(high)} s"
        raise InputError("resynthesize stretch", found, expected)


def _is_comparable(plan: Plan, before: Take) -> bool:
    """Return whether the plans differ only in track, timeline, library, pins, headings and contacts, at one time."""
    old = before.plan
    if old is None or plan.method != "path":
        return False
    same_choices = replace(plan, track=old.track, timeline=old.timeline, library=old.library, pins=old.pins,
                           heading_keys=old.heading_keys, contact_edits=old.contact_edits) == old
    return same_choices and np.array_equal(plan.track.times[[0, -1]], old.track.times[[0, -1]])


def _update_take(
    library: Library, requested: Plan, before: Take, report: Progress, *, cancelled, hurry, variant: VariantStretch
    | None
) -> Take | None:
    """Update the take in the library's size, and finish it; None where it has to be synthesized as a whole."""
    old_plan = resolve_plan(before.plan, library, trajectory=before.solved)
    same_ball = _has_same_ball(requested, before.plan)
    old_plan = replace(old_plan, known_path=before.heading_path)
    plan = resolve_plan(requested, library, trajectory=before.solved if same_ball else None).update_heading(old_plan)
    library_take = to_library_size(before, plan.size)
    found = _update_stretches(library, plan, old_plan, library_take, report, cancelled=cancelled, hurry=hurry,
                              variant=variant)
    if found is None:
        return None
    take, request, hurried_from = found
    return finish_take(take, plan, library, request, hurried_from=hurried_from, before=before)


def _has_same_ball(plan: Plan, old: Plan) -> bool:
    """Return whether the ball's trajectory is solved from the same samples."""
    names = ("times", "positions", "ball", "ball_height_known")
    pairs = [(getattr(plan.track, name), getattr(old.track, name)) for name in names]
    return all(np.array_equal(new, before, equal_nan=True) for new, before in pairs)


def _update_stretches(
    library: Library, plan: ResolvedPlan, old_plan: ResolvedPlan, before: Take, report: Progress, *, cancelled, hurry,
    variant: VariantStretch | None,
):
    """Search and construct the affected stretches.

    Returns:
        The take without pins, its request, and the frame from which on it was searched in a hurry; None where it has to
        be synthesized as a whole.
    """
    clock = [time.perf_counter()]
    if find_plan_actions(library, plan) != find_plan_actions(library, old_plan):
        return None  # the clips of an edit list are numbered, and these have other ones
    library = _extend_for_both(library, (plan, old_plan), report)
    old_request, request = build_request(library, old_plan), build_request(library, plan)
    if not _is_built_from(library, before, len(old_request)):
        return None
    stretches_found = find_stretches_to_search(library, before.edit, old_request, request, SLOT)
    if variant is not None:
        frames = [int(round((second - before.start_time) * library.fps)) for second in (variant.start, variant.end)]
        stretches_found = merge_stretches([*stretches_found, find_variant_stretch(library, before.edit, request,
                                                                                  *frames)],
                                          int(round(BLEND_SECONDS * library.fps)))
    used = variant.used if variant is not None else ()
    if stretches_found == [(0, len(request))]:
        return None
    edit = replace(before.edit, keys=_select_keys_outside(list_unchanged_keys(before.edit, old_request, request),
                                                          request, stretches_found))
    hurried_frames = []
    for number, (first, end) in enumerate(stretches_found):
        def report_progress(fraction, text, number=number):
            report(0.8 * (number + fraction) / len(stretches_found), text)

        search = PathSearch(
            library, request, balance_weights(plan.requested.alpha), report_progress, cancelled, hurry=hurry,
            stretch=SearchStretch(edit, first, end), used=used,
        )
        edit = search.run()
        hurried_frames += [search.hurried_from] if search.hurried_from is not None else []
    clock.append(time.perf_counter())
    report(0.8, "Constructing")
    track = request.track if plan.fps == library.fps else plan.sample_track(plan.fps)
    update = _TakeUpdate(library, plan, before, track=track, edit=edit, request=request)
    moved = np.interp(update.index, np.arange(len(request)),
                      find_moved_frames(old_request, request).astype(float)) > 0.0
    moved |= find_edited_frames(track.times, old_plan.requested.contact_edits, plan.requested.contact_edits)
    for stretch in update.list_stretches(stretches_found, moved):
        update.construct_stretch(stretch)
    clock.append(time.perf_counter())
    report(1.0, "Done")
    seconds = dict(zip(("search", "polish"), np.diff(clock).tolist()))
    return replace(update.build_take(), seconds=seconds), request, min(hurried_frames, default=None)


def _extend_for_both(library: Library, plans: Iterable[ResolvedPlan], report: Progress) -> Library:
    """Return the library, with synthetic clips where the first plan or else the second needs them."""
    for which in plans:
        suited = extend_library(library, which, report)
        if len(suited.clips) > len(library.clips):
            break
    return suited


def _is_built_from(library: Library, before: Take, count: int) -> bool:
    """Return whether the take's edit list, read in this library, shows what the take shows."""
    edit, fps = before.edit, before.plan.fps
    if edit is None or len(edit) != count or edit.clip.max() >= len(library.clips):
        return False
    what = look_up_frames(library, edit, output_index(len(before.motion), library, fps, count))
    paths = np.array(list_sources(library, what)) == np.array(before.clips)[before.clip]
    return bool(np.all(paths) and np.allclose(what.clip_frame, before.clip_frame, rtol=0.0, atol=1e-6))


def _select_keys_outside(keys, request: SearchRequest, again: list[Stretch]):
    """Select the placed keys that no stretch searches again."""
    frames = {key.number: request.keys[key.number].frame for key in keys}
    return tuple(key for key in keys if not any(first <= round(frames[key.number]) < end for first, end in again))


class _TakeUpdate:
    """An update in progress: the old take's arrays, with one stretch after the other replaced."""

    def __init__(
        self, library: Library, plan: ResolvedPlan, before: Take, *, track: SampledTrack, edit: EditList,
        request: SearchRequest
    ):
        """Copy what the old take has, and prepare what the new one shows.

        Args:
            library: the clips.
            plan: the resolved plan.
            before: the old take, in the library's size.
            track: the track at the output's rate.
            edit: the new edit list.
            request: the new request.
        """
        self.library, self.plan, self.before = library, plan, before
        self.track, self.edit, self.request = track, edit, request
        self.index = output_index(len(track), library, plan.fps, len(edit))
        self.frames_shown = look_up_frames(library, edit, self.index)
        self.root, self.rotations = before.motion.root_positions.copy(), before.motion.rotations.copy()
        old_arrays = before.contacts, before.correction, before.ik_miss
        self.contacts, self.correction, self.miss = (values.copy() for values in old_arrays)
        none = np.zeros_like(self.contacts)
        self.stepped = none if before.stepped is None else before.stepped.copy()
        self.ball = track.ball.copy() if before.ball is None else before.ball.positions.copy()
        self.is_new = np.zeros(len(track), bool)
        self.keys = build_key_results(library, plan.fps, request, edit, self.frames_shown)
        self.touches = find_touches(library, plan.fps, edit, self.keys)

    def list_stretches(self, again: list[Stretch], moved: np.ndarray) -> list[Stretch]:
        """List the output frames (first, end) that are constructed again.

        These are what was searched, where the track moved (T,), and the frames over which transitions are spread
        otherwise than before.
        """
        affected = moved.copy()
        old, new = (self._list_spreads(seams) for seams in (self.before.seams, self.frames_shown.transitions))
        spread = old ^ new
        for first, end in again:
            inside = (self.index > first - 1) & (self.index < end)
            affected |= inside
            # a transition at either end stays where it was, but the clips that it joins differ
            low, high = np.flatnonzero(inside)[[0, -1]]
            spread |= {(transition, reach) for transition, reach in old | new if low <= transition <= high + 1}
        for transition, reach in spread:
            affected[max(0, int(np.ceil(transition - reach))) : int(np.floor(transition + reach)) + 1] = True
        return list_stretches(affected, int(round((2 * BLEND_SECONDS + 0.3) * self.plan.fps)))

    def _list_spreads(self, transitions: np.ndarray) -> set[tuple[int, float]]:
        """Return (transition, reach) of each transition as it is spread."""
        longest = 0.5 * self.plan.requested.seam_window * self.plan.fps
        return set(zip(transitions.tolist(), compute_spread_reaches(transitions, len(self.index), longest).tolist()))

    def construct_stretch(self, stretch: Stretch) -> None:
        """Construct the output frames of a stretch again, and blend them into the old ones around them."""
        hand, context = (int(round(seconds * self.plan.fps))
                         for seconds in (BLEND_SECONDS, BLEND_SECONDS + CONTEXT_SECONDS))
        low, high = max(0, stretch[0] - context), min(len(self.index), stretch[1] + context)
        inner = stretch[0] - low, stretch[1] - low
        construction = self._build_construction(low, high, inner, compute_old_share(high - low, inner, hand))
        planted, steps = construction.construct_body()
        planted, ball = construction.solve_ball_contact(planted, steps)
        # frames within the constructed window that are used, and the same frames in the take
        used = slice(max(0, stretch[0] - hand - low), min(high, stretch[1] + hand) - low)
        at, share = slice(used.start + low, used.stop + low), construction.old.share[used]
        new, old = (planted.root[used], planted.rotations[used]), (self.root[at], self.rotations[at])
        self.root[at], self.rotations[at] = blend_with_old(
            self.library.skeleton, new, old, share=share, heel_toe_contacts=steps.heel_toe_contacts[used],
            fps=self.plan.fps
        )
        self.ball[at] = _blend_ball(ball[used], self.ball[at], share)
        self.contacts[at], self.stepped[at] = steps.contacts[used], steps.stepped[used]
        inside = np.arange(*stretch)
        self.correction[inside], self.miss[inside] = planted.correction[inside - low], planted.miss[inside - low]
        self.is_new[at] = True

    def _build_construction(self, low: int, high: int, stretch: Stretch, share: np.ndarray) -> Construction:
        """Build the construction of frames low .. high.

        Those within `stretch` (counted from low) are free, the others are given by the old motion; share (W,) of it in
        the result.
        """
        window = slice(low, high)
        old = OldMotion(
            root=self.root[window], rotation=self.rotations[window, 0], stepped=self.stepped[window], share=share,
            stretch=stretch,
        )
        source = fetch_motion(self.library, self.edit, self.index[window], self.plan.fps)
        touches = [replace(t, frame=t.frame - low) for t in self.touches if low <= round(t.frame) < high]
        return Construction(
            library=self.library, plan=self.plan, track=self.track.frames(low, high), source=source, touches=touches,
            old=old,
        )

    def build_take(self) -> Take:
        """Build the take as it is now."""
        is_new = self.is_new
        mirrored = np.array([clip.mirrored for clip in self.library.clips])
        frames, motion = self.frames_shown, Motion(self.library.skeleton, self.root, self.rotations, self.plan.fps)
        part = SourceFrames(frames.clip[is_new], frames.frame[is_new], frames.clip_frame[is_new], frames.piece[is_new])
        new, sources = iter(list_labels_shown(self.library, part)), list_sources(self.library, part)
        names = tuple(dict.fromkeys((*self.before.clips, *sources)))
        clip = np.array(self.before.clip)
        clip[is_new] = [names.index(source) for source in sources]
        return replace(
            self.before,
            motion=motion,
            clips=names,
            clip=clip,
            clip_frame=np.where(is_new, self.frames_shown.clip_frame, self.before.clip_frame),
            mirrored=np.where(is_new, mirrored[self.frames_shown.clip], self.before.mirrored),
            words=tuple(next(new) if fresh else old for fresh, old in zip(is_new, self.before.words)),
            contacts=self.contacts,
            seams=self.frames_shown.transitions,
            timeline=self.request.timeline,
            keys=self._build_keys(),
            ball=build_ball_path(self.library, self.plan.requested, self.track, source=frames, motion=motion,
                                 ball=self.ball),
            correction=self.correction,
            ik_miss=self.miss,
            stepped=self.stepped,
            planned_heading=self.track.heading,
            heading_path=self.plan.heading_path,
            plan=self.plan.requested,
            edit=self.edit,
        )

    def _build_keys(self) -> tuple[KeyResult, ...]:
        """Return the results; where a key moment's frame was not affected, the old one for the new request."""
        out, left = [], list(self.before.keys)
        for key in self.keys:
            near = int(np.clip(round(key.frame), 0, len(self.is_new) - 1))
            old = next((result for result in left if result.requested == key.requested), None)
            if old is not None:
                left.remove(old)
            out.append(key if old is None or self.is_new[near] else replace(old, requested=key.requested))
        return tuple(out)


def _blend_ball(new: np.ndarray, old: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Blend the new path of the ball (W, 3) m into the old one."""
    return np.where(np.isfinite(old) & (share > 0.0)[:, None], new + share[:, None] * (old - new), new)
