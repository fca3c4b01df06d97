"""Requests: what to synthesize for a player, built on the main thread and processed in any thread from plain values
only.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from ...beyond_mocap.annotation import check_timeline
from ...beyond_mocap.base.errors import InputError, NotInLibraryError
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.synthesis.plan import Plan
from ...beyond_mocap.synthesis.take import Take
from ..core import preferences, session
from ..core.settings import BeyondMocapPlayer, BeyondMocapSettings, require_library_folder
from . import freshness, plans, preview

if TYPE_CHECKING:  # imported by the work itself: scipy and scikit-learn take a second, and enabling must be quick
    from ...beyond_mocap.library.library import Library

SAME_RANGE = 0.05  # seconds: ranges whose ends differ by less are the same
SEARCH_SHARE = 0.6  # of the time of a take; the rest measures its quality


@dataclass(frozen=True)
class SynthesisMode:
    """What to synthesize.

    Attributes:
        kind: "whole" a new take; "update" what has changed since the last; "quick" the same, by a narrow search if the
            whole take is needed, and without figures; "stretch" another solution from `start` to `end`; "variants"
            several takes.
        start: seconds.
        end: seconds.
        count: number of variants.
    """

    kind: str = "whole"
    start: float = 0.0
    end: float = 0.0
    count: int = 1


@dataclass(frozen=True)
class Request:
    """Everything that the work for one player needs.

    Attributes:
        player: name.
        mode: what to synthesize.
        plan: of the core.
        where: source of the labels, for messages.
        warnings: about the track.
        begin: name of the take to start from.
        before: that take; None if the session does not have it.
        recipe: the steps that led to it.
        folder: of the library.
        unit: of the library, metres; None: detected.
        build: further arguments of the core's `build`.
    """

    player: str
    mode: SynthesisMode
    plan: Plan
    where: str
    warnings: tuple[str, ...]
    begin: str
    before: Take | None
    recipe: dict
    folder: str
    unit: float | None
    build: dict = field(default_factory=dict)

    @property
    def fingerprint(self) -> str:
        """Fingerprint of the inputs, without the player's name."""
        start = self.begin if self.mode.kind != "whole" else ""
        return freshness.compute_fingerprint((self.plan, self.mode, start, self.folder, self.unit))


@dataclass(frozen=True)
class TakeResult:
    """A take with its plan, its report, and the steps to reproduce it."""

    plan: Plan
    take: Take
    report: dict
    recipe: dict


@dataclass(frozen=True)
class RequestResult:
    """The result of a request: the library, the fingerprints of the inputs, and the takes (several for variants)."""

    library: "Library"
    made_of: dict
    takes: tuple[TakeResult, ...]


def build_request(settings: BeyondMocapSettings, player: BeyondMocapPlayer, mode: SynthesisMode,
                  still: bool = False) -> Request:
    """Build the request of one player.

    Args:
        settings: of the scene.
        player: the player.
        mode: what to synthesize.
        still: see `drawn_track.read_drawn_track`.
    Returns:
        The request.
    Raises:
        InputError: if an input is missing.
    """
    folder, unit = require_library_folder(settings), settings.library_unit or None
    preview.check_body(player)
    plan, warnings = plans.build_plan(settings, player, still)
    session_take = session.find_take(player.take)
    if mode.kind == "stretch" and session_take is None:
        found = f"no take of {player.name} in this session"
        raise InputError("resynthesize", found, "a take", "press Update first to compute it again",
                         fixes=(Fix("press", "beyond_mocap.update"),))
    return Request(player.name, mode, plan, where=plans.describe_label_source(player), warnings=warnings,
                   begin=player.take, before=session_take.take if session_take else None,
                   recipe=json.loads(player.result.recipe or "{}"), folder=folder, unit=unit,
                   build=preferences.build_library_options(folder))


def process_request(request: Request, library: "Library | None", progress, cancelled, hurry) -> RequestResult:
    """Process a request. Never accesses bpy. A library that it builds is stored at once, whatever comes after.

    Args:
        request: the request.
        library: of clips; None: built first.
        progress: called with a share and a text.
        cancelled: returns whether to stop.
        hurry: returns whether to finish quickly.
    Returns:
        The library and the takes.
    """
    from ...beyond_mocap.library.build import build_library

    clips = library
    if clips is None:
        clips = build_library(request.folder, unit=request.unit, **request.build, progress=progress,
                              cancelled=lambda: cancelled() or hurry())
        session.store_library(clips, request.unit)
    plan = request.plan
    check_timeline(plan.timeline, clips.labels, float(plan.track.times[0]), float(plan.track.times[-1]), request.where)
    callbacks = progress, cancelled, hurry
    try:
        takes = _synthesize_variants(request, clips,
                                     *callbacks) if request.mode.kind == "variants" else (_synthesize_single(request,
                clips, *callbacks),)
    except NotInLibraryError as error:
        raise error.locate(request.where) from None
    return RequestResult(clips, freshness.compute_parts(plan, request.folder), takes)


def _synthesize_single(request: Request, clips, progress, cancelled, hurry) -> TakeResult:
    """Synthesize one take by the request's mode."""
    from ...beyond_mocap.synthesis.resynthesize import VariantStretch, list_shown_stretches, resynthesize
    from ...beyond_mocap.synthesis.synthesize import synthesize

    start, plan, mode, report_progress = perf_counter(), request.plan, request.mode, progress

    def progress(share, text):
        report_progress((1.0 if mode.kind == "quick" else SEARCH_SHARE) * share, text)

    stamp = freshness.compute_fingerprint(plan)
    is_same_plan, steps = request.recipe.get("plan") == stamp, request.recipe.get("steps")
    callbacks = progress, cancelled, hurry
    if mode.kind == "stretch":
        used = (*_list_used_pieces(steps, mode), *list_shown_stretches(clips, request.before, mode.start, mode.end))
        take = resynthesize(clips, plan, request.before, *callbacks, variant=VariantStretch(mode.start, mode.end, used))
        step = {"start": mode.start, "end": mode.end, "used": [asdict(piece) for piece in used]}
        steps = [*steps, step] if is_same_plan and steps else None
    elif mode.kind == "quick" and plan.method == "path" and not _has_same_duration(plan, request.before):
        take, steps = synthesize(clips, plan, progress, cancelled, hurry, narrow=True), None
    elif mode.kind in ("update", "quick") and request.before is not None:
        take = resynthesize(clips, plan, request.before, *callbacks)
        steps = steps if is_same_plan else None
    elif mode.kind == "update" and is_same_plan and steps:
        take = _reproduce_take(clips, plan, steps, callbacks)
    else:
        take, steps = synthesize(clips, plan, *callbacks), [{}]
    recipe = {"plan": stamp, "steps": steps}
    if mode.kind == "quick":  # its figures come with the full take that follows
        seconds = {**take.seconds, "total": perf_counter() - start}
        return TakeResult(plan, take, {"fps": plan.fps, "seconds": seconds, "warnings": list(take.warnings)}, recipe)
    progress(1.0, "Measuring")
    return _evaluate_take(clips, plan, take, recipe, perf_counter() - start)


def _has_same_duration(plan: Plan, before: Take | None) -> bool:
    """Return whether a take can be updated in part: a drawn track with another duration needs a whole take."""
    old = before.plan.track if before is not None and before.plan is not None else None
    return old is not None and np.array_equal(plan.track.times[[0, -1]], old.times[[0, -1]])


def _synthesize_variants(request: Request, clips, progress, cancelled, hurry) -> tuple[TakeResult, ...]:
    """Synthesize the best take and others: each without the source frames of those before, or with another seed."""
    from ...beyond_mocap.base.errors import UserCancelledError
    from ...beyond_mocap.synthesis.resynthesize import list_shown_stretches
    from ...beyond_mocap.synthesis.synthesize import synthesize

    found, used, count = [], (), request.mode.count
    for number in range(count):
        def report_progress(fraction, text, number=number):
            progress((number + SEARCH_SHARE * fraction) / count, f"Variant {number + 1} of {count}: {text}")

        start = perf_counter()
        plan = replace(request.plan, seed=request.plan.seed + (0 if request.plan.method == "path" else number))
        if number and hurry():
            break
        try:
            take = synthesize(clips, plan, report_progress, cancelled=cancelled, hurry=hurry, used=used)
        except UserCancelledError:
            if cancelled() or not found:
                raise
            break
        recipe = {"plan": freshness.compute_fingerprint(plan), "steps": [{"used": [asdict(piece) for piece in used]}]}
        report_progress(1.0, "Measuring")
        found.append(_evaluate_take(clips, plan, take, recipe, perf_counter() - start))
        used = (*used, *list_shown_stretches(clips, take, take.start_time, take.start_time + take.motion.duration))
    return tuple(found)


def _reproduce_take(clips, plan: Plan, steps: list[dict], callbacks) -> Take:
    """Reproduce a take from its steps: the same bits."""
    from ...beyond_mocap.synthesis.resynthesize import VariantStretch, resynthesize
    from ...beyond_mocap.synthesis.synthesize import synthesize

    first, *edits = steps
    take = synthesize(clips, plan, *callbacks, _parse_pieces(first))
    for edit in edits:
        take = resynthesize(clips, plan, take, *callbacks, variant=VariantStretch(edit["start"], edit["end"],
                                                                                  _parse_pieces(edit)))
    return take


def _parse_pieces(step: dict) -> tuple:
    from ...beyond_mocap.synthesis.search.preferences import UsedStretch

    return tuple(UsedStretch(**piece) for piece in step.get("used", ()))


def _list_used_pieces(steps: list[dict] | None, mode: SynthesisMode) -> tuple:
    """List the source frames that earlier solutions of the same range excluded, so that each press leads to a new
    one.
    """
    same = [step for step in steps or () if "start" in step
            and abs(step["start"] - mode.start) < SAME_RANGE and abs(step["end"] - mode.end) < SAME_RANGE]
    return tuple(dict.fromkeys(piece for step in same for piece in _parse_pieces(step)))


def _evaluate_take(clips, plan: Plan, take: Take, recipe: dict, seconds: float) -> TakeResult:
    from ...beyond_mocap.evaluation.report import evaluate

    report: dict[str, Any] = evaluate(take, plan.track, clips)
    report["seconds"]["total"] = seconds
    return TakeResult(plan, take, report, recipe)
