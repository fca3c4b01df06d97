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

from ..base.errors import InputError, told_time
from ..library.library import Library
from ..motion.motion import Motion
from ..motion.track import SampledTrack
from ..motion.track.ball_path import BallPath
from .construct.construction import Construction, find_touches, key_results
from .construct.hand_over import OldMotion, handed_over, old_share
from .construct.transitions import spread_reaches
from .own_size import taken_in_library_size
from .plan import Plan, ResolvedPlan
from .provenance import sources_shown, words_shown
from .resolve_plan import resolve_plan
from .search.edit_list import EditList
from .search.footage import Shown, fetch, output_index, shown
from .search.offer import SLOT
from .search.path_costs import balanced
from .search.path_search import Between, PathSearch
from .search.preferences import Used, used_in
from .search.touched import Stretch, asked_anew, joined, kept_keys, lies_elsewhere, stretches, to_search
from .search.wanted import Wanted, build_order
from .search_library import search_library
from .synthesize import Progress, finished, synthesize
from .take import KeyResult, Take

HAND_OVER = 0.5
"""Seconds before and after an affected stretch in which its motion is blended into the old one."""

CONTEXT = 1.2
"""Seconds further out that are constructed too, so that the ends of windows and solves lie outside what is used."""


@dataclass(frozen=True)
class Anew:
    """A stretch of which another solution is requested.

    Attributes:
        start: s on the track's clock.
        end: s on the track's clock.
        used: source frames to avoid where that is possible (`list_shown_stretches` of what is shown there now).
    """

    start: float
    end: float
    used: tuple[Used, ...] = ()


def resynthesize(
    library: Library,
    plan: Plan,
    before: Take,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    hurry: Callable[[], bool] | None = None,
    anew: Anew | None = None,
) -> Take:
    """Update a take after its plan has changed: search and construct only what the change affects.

    Pins are applied again. It is a whole synthesis where the change is not one of labels, track, ball or pins (another
    method, frame rate, length or choice), where `before` was built from another library or by another method than
    "path", or where all of it is affected. The same library, plan and take give the same bits.

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
    from threadpoolctl import threadpool_limits

    report = progress or (lambda fraction, text: None)
    if anew is not None:
        _check(plan, before, anew)
    asking: dict[str, Any] = {"cancelled": cancelled, "hurry": hurry}
    with threadpool_limits(limits=1):
        comparable = _comparable(plan, before)
        taken = _edited(library, plan, before, report, **asking, anew=anew) if comparable else None
    used = anew.used if anew is not None else ()
    return synthesize(library, plan, progress, **asking, used=used) if taken is None else taken


def shown_footage(library: Library, take: Take, start: float, end: float) -> tuple[Used, ...]:
    """List the source frames that a take of method "path" shows between two seconds, for a `VariantStretch`.

    Nothing where the take was built from another library.
    """
    library = search_library(library, resolve_plan(take.plan, library, course=take.solved))
    if take.edit is None or not _made_from(library, take, len(take.edit)):
        return ()
    first, last = (int(round((second - take.start_time) * library.fps)) for second in (start, end))
    return used_in(library, take.edit, max(0, first), min(len(take.edit), max(last, first + 1)))


def _check(plan: Plan, before: Take, anew: Anew) -> None:
    """Raise InputError for a stretch that cannot be searched again."""
    low, high = before.start_time, before.start_time + before.motion.duration
    if plan.method != "path":
        raise InputError("resynthesize stretch", f"method {plan.method}", "method path", "synthesize the whole take")
    if not low <= anew.start < anew.end <= high + 0.5 / before.motion.fps:
        found = f"{told_time(anew.start)} to {told_time(anew.end)} s"
        expected = f"a stretch within {told_time(low)} to {told_time(high)} s"
        raise InputError("resynthesize stretch", found, expected)


def _comparable(plan: Plan, before: Take) -> bool:
    """Return whether the plans differ only in track, timeline, library folder and pins, over the same time."""
    old = before.plan
    if old is None or plan.method != "path":
        return False
    same_choices = replace(plan, track=old.track, timeline=old.timeline, library=old.library, pins=old.pins) == old
    return same_choices and np.array_equal(plan.track.times[[0, -1]], old.track.times[[0, -1]])


def _edited(
    library: Library, asked: Plan, before: Take, report: Progress, *, cancelled, hurry, anew: Anew | None
) -> Take | None:
    """Update the take in the library's size, and finish it; None where it has to be synthesized as a whole."""
    then = resolve_plan(before.plan, library, course=before.solved)
    same_ball = _same_ball(asked, before.plan)
    plan = resolve_plan(asked, library, course=before.solved if same_ball else None)
    small = taken_in_library_size(before, plan.size)
    found = _updated(library, plan, then, small, report, cancelled=cancelled, hurry=hurry, anew=anew)
    if found is None:
        return None
    take, order, hurried = found
    return finished(take, plan, library, order, hurried=hurried, before=before)


def _same_ball(plan: Plan, old: Plan) -> bool:
    """Return whether the ball's trajectory is solved from the same samples."""
    names = ("times", "positions", "ball", "ball_height_known")
    pairs = [(getattr(plan.track, name), getattr(old.track, name)) for name in names]
    return all(np.array_equal(new, before, equal_nan=True) for new, before in pairs)


def _updated(
    library: Library, plan: ResolvedPlan, then: ResolvedPlan, before: Take, report: Progress, *, cancelled, hurry,
    anew: Anew | None,
):
    """Search and construct the affected stretches.

    Returns:
        The take without pins, its request, and the frame from which on it was searched in a hurry; None where it has to
        be synthesized as a whole.
    """
    clock = [time.perf_counter()]
    library = _library_of_both(library, (plan, then), report)
    old, new = build_order(library, then), build_order(library, plan)
    if not _made_from(library, before, len(old)):
        return None
    again = to_search(library, before.edit, old, new, SLOT)
    if anew is not None:
        frames = [int(round((second - before.start_time) * library.fps)) for second in (anew.start, anew.end)]
        again = joined([*again, asked_anew(library, before.edit, new, *frames)], int(round(HAND_OVER * library.fps)))
    used = anew.used if anew is not None else ()
    if again == [(0, len(new))]:
        return None
    edit = replace(before.edit, keys=_outside(kept_keys(before.edit, old, new), new, again))
    hurried = []
    for number, (first, end) in enumerate(again):
        def tell(fraction, text, number=number):
            report(0.8 * (number + fraction) / len(again), text)

        search = PathSearch(
            library, new, balanced(plan.asked.alpha), tell, cancelled, hurry=hurry, between=Between(edit, first, end),
            used=used,
        )
        edit = search.run()
        hurried += [search.hurried] if search.hurried is not None else []
    clock.append(time.perf_counter())
    report(0.8, "Constructing")
    track = new.track if plan.fps == library.fps else plan.sampled(plan.fps)
    update = _Update(library, plan, before, track=track, edit=edit, order=new)
    moved = np.interp(update.index, np.arange(len(new)), lies_elsewhere(old, new).astype(float)) > 0.0
    for stretch in update.stretches(again, moved):
        update.make(stretch)
    clock.append(time.perf_counter())
    report(1.0, "Done")
    seconds = dict(zip(("search", "polish"), np.diff(clock).tolist()))
    return replace(update.take(), seconds=seconds), new, min(hurried, default=None)


def _library_of_both(library: Library, plans: Iterable[ResolvedPlan], report: Progress) -> Library:
    """Return the library, with synthetic clips where the first plan or else the second needs them."""
    for which in plans:
        suited = search_library(library, which, report)
        if len(suited.clips) > len(library.clips):
            break
    return suited


def _made_from(library: Library, before: Take, count: int) -> bool:
    """Return whether the take's edit list, read in this library, shows what the take shows."""
    edit, fps = before.edit, before.plan.fps
    if edit is None or len(edit) != count or edit.clip.max() >= len(library.clips):
        return False
    what = shown(library, edit, output_index(len(before.motion), library, fps, count))
    paths = np.array(sources_shown(library, what)) == np.array(before.clips)[before.clip]
    return bool(np.all(paths) and np.allclose(what.clip_frame, before.clip_frame, rtol=0.0, atol=1e-6))


def _outside(keys, order: Wanted, again: list[Stretch]):
    """Select the placed keys that no stretch searches again."""
    frames = {key.wanted: order.keys[key.wanted].frame for key in keys}
    return tuple(key for key in keys if not any(first <= round(frames[key.wanted]) < end for first, end in again))


class _Update:
    """An update in progress: the old take's arrays, with one stretch after the other replaced."""

    def __init__(
        self, library: Library, plan: ResolvedPlan, before: Take, *, track: SampledTrack, edit: EditList, order: Wanted
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
        self.track, self.edit, self.order = track, edit, order
        self.index = output_index(len(track), library, plan.fps, len(edit))
        self.shown = shown(library, edit, self.index)
        self.root, self.rotations = before.motion.root_positions.copy(), before.motion.rotations.copy()
        kept = before.contacts, before.correction, before.ik_miss
        self.contacts, self.correction, self.miss = (values.copy() for values in kept)
        none = np.zeros_like(self.contacts)
        self.stepped = none if before.stepped is None else before.stepped.copy()
        self.ball = track.ball.copy() if before.ball is None else before.ball.positions.copy()
        self.anew = np.zeros(len(track), bool)
        self.keys = key_results(library, plan.fps, order, edit, self.shown)
        self.touches = find_touches(library, plan.fps, edit, self.keys)

    def stretches(self, again: list[Stretch], moved: np.ndarray) -> list[Stretch]:
        """List the output frames (first, end) that are constructed again.

        These are what was searched, where the track moved (T,), and the frames over which transitions are spread
        otherwise than before.
        """
        touched = moved.copy()
        old, new = (self._spread(seams) for seams in (self.before.seams, self.shown.seams))
        spread = old ^ new
        for first, end in again:
            inside = (self.index > first - 1) & (self.index < end)
            touched |= inside
            # a transition at either end stays where it was, but the clips that it joins differ
            low, high = np.flatnonzero(inside)[[0, -1]]
            spread |= {(seam, reach) for seam, reach in old | new if low <= seam <= high + 1}
        for seam, reach in spread:
            touched[max(0, int(np.ceil(seam - reach))) : int(np.floor(seam + reach)) + 1] = True
        return stretches(touched, int(round((2 * HAND_OVER + 0.3) * self.plan.fps)))

    def _spread(self, seams: np.ndarray) -> set[tuple[int, float]]:
        """Return (transition, reach) of each transition as it is spread."""
        longest = 0.5 * self.plan.asked.seam_window * self.plan.fps
        return set(zip(seams.tolist(), spread_reaches(seams, len(self.index), longest).tolist()))

    def make(self, stretch: Stretch) -> None:
        """Construct the output frames of a stretch again, and blend them into the old ones around them."""
        hand, context = (int(round(seconds * self.plan.fps)) for seconds in (HAND_OVER, HAND_OVER + CONTEXT))
        low, high = max(0, stretch[0] - context), min(len(self.index), stretch[1] + context)
        inner = stretch[0] - low, stretch[1] - low
        construction = self._construction(low, high, inner, old_share(high - low, inner, hand))
        planted, taken = construction.lay_out()
        planted, ball = construction.meet_ball(planted, taken)
        # frames within the constructed window that are used, and the same frames in the take
        made = slice(max(0, stretch[0] - hand - low), min(high, stretch[1] + hand) - low)
        at, share = slice(made.start + low, made.stop + low), construction.old.share[made]
        new, old = (planted.root[made], planted.rotations[made]), (self.root[at], self.rotations[at])
        self.root[at], self.rotations[at] = handed_over(
            self.library.skeleton, new, old, share=share, standing=taken.standing[made], fps=self.plan.fps
        )
        self.ball[at] = _ball_between(ball[made], self.ball[at], share)
        self.contacts[at], self.stepped[at] = taken.contacts[made], taken.stepped[made]
        inside = np.arange(*stretch)
        self.correction[inside], self.miss[inside] = planted.correction[inside - low], planted.miss[inside - low]
        self.anew[at] = True

    def _construction(self, low: int, high: int, stretch: Stretch, share: np.ndarray) -> Construction:
        """Build the construction of frames low .. high.

        Those within `stretch` (counted from low) are free, the others are given by the old motion; share (W,) of it in
        the result.
        """
        window = slice(low, high)
        old = OldMotion(
            root=self.root[window], rotation=self.rotations[window, 0], stepped=self.stepped[window], share=share,
            stretch=stretch,
        )
        source = fetch(self.library, self.edit, self.index[window], self.plan.fps)
        touches = [replace(t, frame=t.frame - low) for t in self.touches if low <= round(t.frame) < high]
        return Construction(
            library=self.library, plan=self.plan, track=self.track.frames(low, high), source=source, touches=touches,
            old=old,
        )

    def take(self) -> Take:
        """Build the take as it is now."""
        made = self.anew
        mirrored = np.array([clip.mirrored for clip in self.library.clips])
        what = self.shown
        part = Shown(what.clip[made], what.frame[made], what.clip_frame[made], what.piece[made])
        new, sources = iter(words_shown(self.library, part)), sources_shown(self.library, part)
        names = tuple(dict.fromkeys((*self.before.clips, *sources)))
        clip = np.array(self.before.clip)
        clip[made] = [names.index(source) for source in sources]
        return replace(
            self.before,
            motion=Motion(self.library.skeleton, self.root, self.rotations, self.plan.fps),
            clips=names,
            clip=clip,
            clip_frame=np.where(made, self.shown.clip_frame, self.before.clip_frame),
            mirrored=np.where(made, mirrored[self.shown.clip], self.before.mirrored),
            words=tuple(next(new) if fresh else old for fresh, old in zip(made, self.before.words)),
            contacts=self.contacts,
            seams=self.shown.seams,
            timeline=self.order.timeline,
            keys=self._keys_as_before(),
            ball=self._ball_path(),
            correction=self.correction,
            ik_miss=self.miss,
            stepped=self.stepped,
            plan=self.plan.asked,
            edit=self.edit,
        )

    def _ball_path(self) -> BallPath | None:
        """Return the ball's path, None where it is nowhere known."""
        if not np.isfinite(self.ball[:, :2]).any():
            return None
        return BallPath(self.track.times, self.ball, self.track.ball_measured)

    def _keys_as_before(self) -> tuple[KeyResult, ...]:
        """Return the results; where a key moment's frame was not affected, the old one for the new request."""
        out, left = [], list(self.before.keys)
        for key in self.keys:
            near = int(np.clip(round(key.frame), 0, len(self.anew) - 1))
            old = next((result for result in left if result.asked == key.asked), None)
            if old is not None:
                left.remove(old)
            out.append(key if old is None or self.anew[near] else replace(old, asked=key.asked))
        return tuple(out)


def _ball_between(new: np.ndarray, old: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Blend the new path of the ball (W, 3) m into the old one."""
    return np.where(np.isfinite(old) & (share > 0.0)[:, None], new + share[:, None] * (old - new), new)
