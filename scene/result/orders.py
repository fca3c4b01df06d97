"""What is to be made for a player: written down on the main thread, worked off in any thread, by plain values only."""

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

if TYPE_CHECKING:  # imported by the work itself: scipy and scikit-learn take a second, and switching on has to be quick
    from ...beyond_mocap.library.library import Library

LIKE = 0.05  # seconds: ends of stretches nearer than that are the same


@dataclass(frozen=True)
class How:
    """What is wanted. kind: "whole" a new take; "update" what has changed since the last; "quick" the same, by a narrow
    search where it has to be made as a whole, and without figures; "stretch" another solution from second start to end;
    "variants" as many takes as `count` says, each another solution."""

    kind: str = "whole"
    start: float = 0.0
    end: float = 0.0
    count: int = 1


@dataclass(frozen=True)
class Order:
    """All that the work for one player needs.

    where: the place of its words, for messages. warnings: about its track. begin: the name of the take to start from,
    before: that take, None where this session has not made it. recipe: the steps that led to it, see `recipe`. build:
    more arguments of the core's `build`."""

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
        """Of what is asked for; the player's name is no part of it."""
        start = self.begin if self.how.kind != "whole" else ""
        return freshness.fingerprint((self.plan, self.how, start, self.folder, self.unit))


@dataclass(frozen=True)
class One:
    """A take that was made: its plan, how good it is, and the steps that make it again."""

    plan: Plan
    take: Take
    report: dict
    recipe: dict


@dataclass(frozen=True)
class Result:
    """What the work brings: the library, the parts of the plan that the takes are made of, and the takes (more than one
    where variants were wanted)."""

    library: "Library"
    made_of: dict
    takes: tuple[One, ...]


def order_of(settings: BeyondMocapSettings, player: BeyondMocapPlayer, how: How, still: bool = False) -> Order:
    """The order of one player; InputError where something is missing. still: see `drawn_track.read`."""
    if not settings.library_folder:
        raise InputError("library", "no folder chosen", "a folder of clips", "choose one in step 1")
    preview.check(player)
    plan, warnings = plans.plan_of(settings, player, still)
    made = session.made(player.take)
    if how.kind == "stretch" and made is None:
        found = f"no take of {player.name} in this session"
        raise InputError("a stretch made anew", found, "a take", "press Update first, which makes it again")
    folder, unit = absolute(settings.library_folder), settings.library_unit or None
    return Order(player.name, how, plan, where=plans.words_from(player), warnings=warnings, begin=player.take,
                 before=made.take if made else None, recipe=json.loads(player.result.recipe or "{}"), folder=folder,
                 unit=unit, build=preferences.for_build(folder))


def work(order: Order, library: "Library | None", progress, cancelled, hurry) -> Result:
    """Make what is ordered, out of the library, which is built where it is None. Never touches bpy."""
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
    if how.kind == "quick":  # its figures come with the take that follows
        seconds = {**take.seconds, "total": perf_counter() - begun}
        return One(plan, take, {"fps": plan.fps, "seconds": seconds, "warnings": list(take.warnings)}, recipe)
    return _judged(clips, plan, take, recipe, perf_counter() - begun)


def _same_span(plan: Plan, before: Take | None) -> bool:
    """Whether an edit of the take may be made in part: a drawn track that has become longer has to be made as a
    whole."""
    old = before.plan.track if before is not None and before.plan is not None else None
    return old is not None and np.array_equal(plan.track.times[[0, -1]], old.times[[0, -1]])


def _variants(order: Order, clips, progress, cancelled, hurry) -> tuple[One, ...]:
    """The best take and others, each without the footage of those before, or, by the other methods, by another seed."""
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
    """The take that these steps have made before, from nothing: the same bits."""
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
    """What earlier solutions of the same stretch did without, so that pressing again leads on and not back."""
    same = [step for step in steps or () if "start" in step
            and abs(step["start"] - how.start) < LIKE and abs(step["end"] - how.end) < LIKE]
    return tuple(dict.fromkeys(piece for step in same for piece in _pieces(step)))


def _judged(clips, plan: Plan, take: Take, recipe: dict, seconds: float) -> One:
    from ...beyond_mocap.evaluation.report import evaluate

    report: dict[str, Any] = evaluate(take, plan.track, clips)
    report["seconds"]["total"] = seconds
    return One(plan, take, report, recipe)
