"""Requests: what to synthesize for a player, built on the main thread and processed in any thread from plain values
only.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from ...beyond_mocap.annotation import validate
from ...beyond_mocap.base.errors import InputError, NotInLibrary
from ...beyond_mocap.synthesis.plan import Plan
from ...beyond_mocap.synthesis.take import Take
from ..core import preferences, session
from ..core.settings import BeyondMocapPlayer, BeyondMocapSettings, absolute
from . import freshness, plans, preview

if TYPE_CHECKING:  # imported by the work itself: scipy and scikit-learn take a second, and enabling must be quick
    from ...beyond_mocap.library.library import Library

LIKE = 0.05  # seconds: ranges whose ends differ by less are the same


@dataclass(frozen=True)
class How:
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
class Order:
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
    how: How
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
        start = self.begin if self.how.kind != "whole" else ""
        return freshness.fingerprint((self.plan, self.how, start, self.folder, self.unit))


@dataclass(frozen=True)
class One:
    """A take with its plan, its report, and the steps to reproduce it."""

    plan: Plan
    take: Take
    report: dict
    recipe: dict


@dataclass(frozen=True)
class Result:
    """The result of a request: the library, the fingerprints of the inputs, and the takes (several for variants)."""

    library: "Library"
    made_of: dict
    takes: tuple[One, ...]


def order_of(settings: BeyondMocapSettings, player: BeyondMocapPlayer, how: How, still: bool = False) -> Order:
    """Build the request of one player.

    Args:
        settings: of the scene.
        player: the player.
        mode: what to synthesize.
        still: see `drawn_track.read`.
    Returns:
        The request.
    Raises:
        InputError: if an input is missing.
    """
    if not settings.library_folder:
        raise InputError("library", "no folder is chosen", "a folder of clips", "choose one in step 1")
    preview.check(player)
    plan, warnings = plans.plan_of(settings, player, still)
    made = session.made(player.take)
    if how.kind == "stretch" and made is None:
        found = f"no take of {player.name} in this session"
        raise InputError("resynthesize", found, "a take", "press Update first to compute it again")
    folder, unit = absolute(settings.library_folder), settings.library_unit or None
    return Order(player.name, how, plan, where=plans.words_from(player), warnings=warnings, begin=player.take,
                 before=made.take if made else None, recipe=json.loads(player.result.recipe or "{}"), folder=folder,
                 unit=unit, build=preferences.for_build(folder))


def work(order: Order, library: "Library | None", progress, cancelled, hurry) -> Result:
    """Process a request. Never accesses bpy.

    Args:
        order: the request.
        library: of clips; None: built first.
        progress: called with a share and a text.
        cancelled: returns whether to stop.
        hurry: returns whether to finish quickly.
    Returns:
        The library and the takes.
    """
    from ...beyond_mocap.library.build import build

    clips = library or build(order.folder, unit=order.unit, **order.build, progress=progress,
                             cancelled=lambda: cancelled() or hurry())
    plan = order.plan
    validate(plan.timeline, clips.words, float(plan.track.times[0]), float(plan.track.times[-1]), order.where)
    asked = progress, cancelled, hurry
    try:
        takes = _variants(order, clips, *asked) if order.how.kind == "variants" else (_single(order, clips, *asked),)
    except NotInLibrary as error:
        raise NotInLibrary(f"{order.where}: {error}", error.nearest) from None
    return Result(clips, freshness.parts(plan, order.folder), takes)


def _single(order: Order, clips, progress, cancelled, hurry) -> One:
    """Synthesize one take by the request's mode."""
    from ...beyond_mocap.synthesis.resynthesize import Anew, resynthesize, shown_footage
    from ...beyond_mocap.synthesis.synthesize import synthesize

    begun, plan, how = perf_counter(), order.plan, order.how
    stamp = freshness.fingerprint(plan)
    same, steps = order.recipe.get("plan") == stamp, order.recipe.get("steps")
    asked = progress, cancelled, hurry
    if how.kind == "stretch":
        used = (*_used_before(steps, how), *shown_footage(clips, order.before, how.start, how.end))
        take = resynthesize(clips, plan, order.before, *asked, anew=Anew(how.start, how.end, used))
        step = {"start": how.start, "end": how.end, "used": [asdict(piece) for piece in used]}
        steps = [*steps, step] if same and steps else None
    elif how.kind == "quick" and plan.method == "path" and not _same_span(plan, order.before):
        take, steps = synthesize(clips, plan, progress, cancelled, hurry, narrow=True), None
    elif how.kind in ("update", "quick") and order.before is not None:
        take = resynthesize(clips, plan, order.before, *asked)
        steps = steps if same else None
    elif how.kind == "update" and same and steps:
        take = _again(clips, plan, steps, asked)
    else:
        take, steps = synthesize(clips, plan, *asked), [{}]
    recipe = {"plan": stamp, "steps": steps}
    if how.kind == "quick":  # its figures come with the full take that follows
        seconds = {**take.seconds, "total": perf_counter() - begun}
        return One(plan, take, {"fps": plan.fps, "seconds": seconds, "warnings": list(take.warnings)}, recipe)
    return _judged(clips, plan, take, recipe, perf_counter() - begun)


def _same_span(plan: Plan, before: Take | None) -> bool:
    """Return whether a take can be updated in part: a drawn track with another duration needs a whole take."""
    old = before.plan.track if before is not None and before.plan is not None else None
    return old is not None and np.array_equal(plan.track.times[[0, -1]], old.times[[0, -1]])


def _variants(order: Order, clips, progress, cancelled, hurry) -> tuple[One, ...]:
    """Synthesize the best take and others: each without the source frames of those before, or with another seed."""
    from ...beyond_mocap.base.errors import Cancelled
    from ...beyond_mocap.synthesis.resynthesize import shown_footage
    from ...beyond_mocap.synthesis.synthesize import synthesize

    found, used, count = [], (), order.how.count
    for number in range(count):
        def tell(fraction, text, number=number):
            progress((number + fraction) / count, f"variant {number + 1} of {count}: {text}")

        begun = perf_counter()
        plan = replace(order.plan, seed=order.plan.seed + (0 if order.plan.method == "path" else number))
        if number and hurry():
            break
        try:
            take = synthesize(clips, plan, tell, cancelled=cancelled, hurry=hurry, used=used)
        except Cancelled:
            if cancelled() or not found:
                raise
            break
        recipe = {"plan": freshness.fingerprint(plan), "steps": [{"used": [asdict(piece) for piece in used]}]}
        found.append(_judged(clips, plan, take, recipe, perf_counter() - begun))
        used = (*used, *shown_footage(clips, take, take.start_time, take.start_time + take.motion.duration))
    return tuple(found)


def _again(clips, plan: Plan, steps: list[dict], asked) -> Take:
    """Reproduce a take from its steps: the same bits."""
    from ...beyond_mocap.synthesis.resynthesize import Anew, resynthesize
    from ...beyond_mocap.synthesis.synthesize import synthesize

    first, *edits = steps
    take = synthesize(clips, plan, *asked, _pieces(first))
    for edit in edits:
        take = resynthesize(clips, plan, take, *asked, anew=Anew(edit["start"], edit["end"], _pieces(edit)))
    return take


def _pieces(step: dict) -> tuple:
    from ...beyond_mocap.synthesis.search.preferences import Used

    return tuple(Used(**piece) for piece in step.get("used", ()))


def _used_before(steps: list[dict] | None, how: How) -> tuple:
    """List the source frames that earlier solutions of the same range excluded, so that each press leads to a new
    one.
    """
    same = [step for step in steps or () if "start" in step
            and abs(step["start"] - how.start) < LIKE and abs(step["end"] - how.end) < LIKE]
    return tuple(dict.fromkeys(piece for step in same for piece in _pieces(step)))


def _judged(clips, plan: Plan, take: Take, recipe: dict, seconds: float) -> One:
    from ...beyond_mocap.evaluation.report import evaluate

    report: dict[str, Any] = evaluate(take, plan.track, clips)
    report["seconds"]["total"] = seconds
    return One(plan, take, report, recipe)
