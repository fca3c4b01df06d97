"""Build Library: read a folder of clips and their words, once; the next time its cache answers."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
from bpy.props import BoolProperty

from ..beyond_mocap.errors import InputError
from ..scene import clips, foreign, preferences, session, watch
from ..scene.settings import absolute
from .verb import BackgroundVerb

if TYPE_CHECKING:
    from ..beyond_mocap.library.library import Library


@dataclass(frozen=True)
class Order:
    """What a build needs to know."""

    setting: str
    folder: str
    unit: float | None
    rebuild: bool
    preferences: dict  # arguments of the core's build


@dataclass(frozen=True, eq=False)
class Built:
    """What came of it: the library (or what is wrong with it), its clips one by one, and the folder as it was read."""

    setting: str
    library: "Library | None"
    trouble: InputError | None
    listing: tuple
    files: dict


class BEYOND_MOCAP_OT_build_library(BackgroundVerb, bpy.types.Operator):
    """Read all clips of the library folder, their words and foot contacts, and sort them for the search.
The result is kept in a cache, so that the next time takes a moment; when anything in the folder has changed, all of it
is read again. FBX, glTF and USD clips are converted first, each once"""

    bl_idname = "beyond_mocap.build_library"
    bl_label = "Build Library"
    kind = "library"
    queue = None  # foreign.Queue while a window waits for conversions
    job = None
    notes = ()

    rebuild: BoolProperty(
        name="From Scratch", description="Ignore what an earlier build has kept", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        """A folder has to be chosen."""
        cls.poll_message_set("Choose the library's folder first")
        return bool(context.scene.beyond_mocap.library_folder)

    def order(self, context):
        """Folder and unit."""
        settings = context.scene.beyond_mocap
        if not settings.library_folder:
            raise InputError("library", "no folder chosen", "a folder of BVH clips", "choose one in step 1")
        folder = absolute(settings.library_folder)
        unit = settings.library_unit or None
        queue = self.queue or self.waiting(context)
        while queue.todo:  # by a script; in a window `modal` has converted them one by one
            queue.step()
        self.notes = queue.notes
        return Order(settings.library_folder, folder, unit, self.rebuild, preferences.for_build(folder))

    def waiting(self, context):
        """The clips that are to be converted."""
        folder = absolute(context.scene.beyond_mocap.library_folder)
        return foreign.Queue(folder, preferences.cache_folder(folder))

    def start(self, context):
        """Convert first, if there is anything to convert, then hand the build to a thread."""
        self.queue = self.waiting(context)
        self.scene = context.scene.session_uid
        if not self.queue.todo:
            super().start(context)

    def modal(self, context, event):
        """One conversion at each tick, since only the main thread may import; then as every work in the background."""
        if self.job is not None:
            return super().modal(context, event)
        if event.type == "ESC" and event.value == "PRESS":
            self.ended(context)
            self.report({"WARNING"}, f"{self.bl_label}: cancelled, what is converted is kept")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        outcome = self.attempt(lambda: self.convert_next(context))
        if outcome == {"CANCELLED"}:
            self.ended(context)
            return outcome
        self.show(context)
        return {"RUNNING_MODAL"}

    def convert_next(self, context):
        """The next one, or the thread where there is none."""
        if self.queue.todo:
            self.queue.step()
        else:
            super().start(context)

    def show(self, context):
        """The conversions' progress while they run."""
        if self.job is not None:
            return super().show(context)
        running, queue = context.window_manager.beyond_mocap_work, self.queue
        done = queue.total - len(queue.todo)
        text = f"Converting {queue.todo[0].name}" if queue.todo else "Converted"
        running.kind, running.fraction, running.text = self.kind, done / max(queue.total, 1), text
        context.workspace.status_text_set(f"{text}   {done} of {queue.total}   ESC: cancel")
        self.redraw(context)

    def cancel(self, context):
        """Blender takes the operator away."""
        if self.job is not None:
            self.job.cancel()
        self.ended(context)

    @staticmethod
    def work(order, progress, cancelled, _hurry):
        """Build it, and list its clips; where it cannot be built they are listed all the same, to be given words."""
        from ..beyond_mocap.library.build import build
        from ..beyond_mocap.library.listing import listed, scanned

        files = watch.look(order.folder) or {}
        asked = {"rebuild": order.rebuild, "unit": order.unit, **order.preferences}
        try:
            built = build(order.folder, **asked, progress=progress, cancelled=cancelled)
        except InputError as error:
            return Built(order.setting, None, error, scanned(order.folder, asked["cache_dir"]), files)
        return Built(order.setting, built, None, listed(built), files)

    def apply(self, scene, built):
        """Keep it, and say what it holds."""
        clips.keep(bpy.context.window_manager, built.setting, built.listing, built.files)
        for note in self.notes:
            self.report({"WARNING"}, note)
        if built.trouble is not None:
            raise built.trouble
        session.keep_library(built.library, scene.beyond_mocap.library_unit or None)
        scene.beyond_mocap.library_holds = summary(built.library)
        for note in built.library.notes:
            self.report({"INFO"}, note)
        self.report({"INFO"}, scene.beyond_mocap.library_holds.splitlines()[0])


def summary(built: "Library") -> str:
    """Lines for the panel: clips and minutes, then each gait with its speed, then key moments with their number."""
    originals = [clip for clip in built.clips if not clip.mirrored]
    keys = Counter(row.words[0] for clip in originals for row in clip.annotations if row.key is not None and row.words)
    lines = [f"{len(originals)} clips, {built.minutes:.1f} minutes, {len(built.skeleton)} joints"]
    lines += [f"{gait.word}: {gait.speed:.1f} m/s" for gait in built.gaits]
    for word, count in keys.most_common():
        lines.append(f"{word.replace('_', ' ')}: {count} {'moment' if count == 1 else 'moments'}")
    return "\n".join(lines)
