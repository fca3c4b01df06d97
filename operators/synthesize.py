"""Synthesize: a take for every chosen player, shown on its armature as a preview."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter

from typing import TYPE_CHECKING

import bpy

from ..beyond_mocap.annotation import validate
from ..beyond_mocap.errors import Cancelled, NotInLibrary
from ..beyond_mocap.plan import Plan
from ..beyond_mocap.take import Take
from ..scene import plans, preferences, preview, session
from ..scene.settings import absolute
from .build_library import summary
from .verb import BackgroundVerb

if TYPE_CHECKING:  # imported by the work itself: scipy and scikit-learn take a second, and switching on has to be quick
    from ..beyond_mocap.library.library import Library

FIGURES = (  # what the panel's table shows: name, path in the report, factor (a negative one counts from 1), form
    ("Off the track, mean", "root_error_m.mean", 100, "{:.1f} cm"),
    ("Off the track, 95 %", "root_error_m.p95", 100, "{:.1f} cm"),
    ("Feet slide", "skate.contact_cm_s", 1, "{:.1f} cm/s"),
    ("... in the recordings", "skate.source_contact_cm_s", 1, "{:.1f} cm/s"),
    ("Jerk at seams", "seam_jerk_ratio.median", 1, "{:.2f} of real"),
    ("Words met", "annotation_similarity.all", -50, "{:.0f} %"),  # -1 is all, +1 none
    ("Clips played at most", "warp_rate.max", 1, "{:.2f} x"),
    ("Time to make", "seconds.total", 1, "{:.1f} s"),
)


@dataclass(frozen=True)
class Order:
    """What a run needs: one plan per player, the library or how to build it.

    plans: (player's name, plan, where its words are written, warnings about its track, the take to start from or None).
    """

    plans: tuple[tuple[str, Plan, str, tuple[str, ...], Take | None], ...]
    folder: str
    unit: float | None
    library: "Library | None"
    preferences: dict = field(default_factory=dict)  # arguments of the core's build


@dataclass(frozen=True)
class Result:
    """What a run brings: the library it used and the unit of its clips.

    made: (player's name, plan, take, report, warnings about the track); asked: how many players there were to make.
    """

    library: "Library"
    unit: float | None
    made: tuple[tuple[str, Plan, Take, dict, tuple[str, ...]], ...]
    asked: int


class SynthesisVerb(BackgroundVerb):
    """A verb that makes takes. `starts_from(player)`: the take that is brought up to date, or None for a new one."""

    kind = "synthesis"
    keeps = True

    @classmethod
    def poll(cls, context):
        """A library and a player."""
        settings = context.scene.beyond_mocap
        if not settings.library_folder:
            cls.poll_message_set("Choose the library's folder in step 1 first")
            return False
        cls.poll_message_set("Import tracking and tick a player in step 2 first")
        return any(player.use for player in settings.players)

    def order(self, context):
        """Tracks and words of all chosen players."""
        settings = context.scene.beyond_mocap
        folder = absolute(settings.library_folder)
        asked = []
        for player in plans.chosen(settings):
            preview.check(player)
            plan, warnings = plans.plan_of(settings, player)
            asked.append((player.name, plan, plans.words_from(player), warnings, self.starts_from(player)))
        unit = settings.library_unit or None
        return Order(tuple(asked), folder, unit, session.library(folder, unit), preferences.for_build(folder))

    @staticmethod
    def work(order, progress, cancelled, hurry):
        """The library, where this session has none yet, then one player after the other. In a hurry the player whose
        turn it is comes to an early end, and those that follow are left as they are."""
        from ..beyond_mocap.evaluation.report import evaluate
        from ..beyond_mocap.library.library import build
        from ..beyond_mocap.resynthesize import resynthesize
        from ..beyond_mocap.synthesize import synthesize

        clips = order.library or build(
            order.folder, unit=order.unit, **order.preferences,
            progress=progress, cancelled=lambda: cancelled() or hurry(),
        )
        made = []
        for number, (name, plan, where, warnings, before) in enumerate(order.plans):
            if made and hurry():
                break

            def report(fraction, text, number=number, name=name):
                progress((number + fraction) / len(order.plans), f"{name}: {text}")

            validate(plan.timeline, clips.words, float(plan.track.times[0]), float(plan.track.times[-1]), where)
            begun = perf_counter()
            try:
                if before is None:
                    take = synthesize(clips, plan, report, cancelled, hurry)
                else:
                    take = resynthesize(clips, plan, before, report, cancelled, hurry)
            except NotInLibrary as error:
                raise NotInLibrary(f"{where}: {error}", error.nearest) from None
            except Cancelled:
                if not made or cancelled():
                    raise
                break
            seconds = perf_counter() - begun
            figures = evaluate(take, plan.track, clips)
            figures["seconds"]["total"] = seconds
            made.append((name, plan, take, figures, warnings))
        return Result(clips, order.unit, tuple(made), len(order.plans))

    def apply(self, scene, result):
        """Keep the takes and show their quality."""
        settings = scene.beyond_mocap
        session.keep_library(result.library, result.unit)
        settings.library_holds = summary(result.library)
        lost = [name for name, *_ in result.made if name not in settings.players]
        for name, plan, take, report, warnings in result.made:
            if name in lost:
                continue
            told = dict.fromkeys((*warnings, *report.get("warnings", ())))
            told = "\n".join(line for line in told if line not in result.library.notes)
            lines = {"quality": quality(report), "moments": moments(report), "warnings": told}
            preview.show(bpy.context, settings.players[name], session.keep_take(plan, take, report), lines)
        if lost:
            self.report({"WARNING"}, f"not in the list any more, so their takes are dropped: {', '.join(lost)}")
        told = f"players synthesized: {len(result.made) - len(lost)}; Accept keeps them"
        if len(result.made) < result.asked:  # in the same line, since the status bar shows the last one
            told = f"ended early, {result.asked - len(result.made)} left as before; {told}"
        self.report({"WARNING" if len(result.made) < result.asked else "INFO"}, told)


class BEYOND_MOCAP_OT_synthesize(SynthesisVerb, bpy.types.Operator):
    """Find clips for every ticked player's track and words, and join them into one motion.
It is shown as a preview, until it is accepted or discarded"""

    bl_idname = "beyond_mocap.synthesize"
    bl_label = "Synthesize"

    def starts_from(self, _player):
        """From nothing."""
        return None


def quality(report: dict) -> str:
    """Lines "name: value" of those figures that the report has."""
    lines = []
    for name, path, factor, form in FIGURES:
        value = report
        for key in path.split("."):
            value = value.get(key) if isinstance(value, dict) else None
        if value is not None:
            lines.append(f"{name}: {form.format(factor * (value if factor > 0 else value - 1.0))}")
    return "\n".join(lines)


def moments(report: dict) -> str:
    """A line for each key moment: its time, what was asked for, and what is shown where that is something else."""
    lines = []
    for key in report.get("keys", ()):
        instead = f", shown as {' '.join(key['used_instead'])}" if key.get("used_instead") else ""
        lines.append(f"{key['time_s']:.1f} s  {' '.join(key['labels'])}{instead}")
    return "\n".join(lines)
