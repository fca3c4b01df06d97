"""Learn Words: from the clips of the library that have words to a classifier that proposes them for others."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
from bpy.props import StringProperty

from ..beyond_mocap.errors import InputError
from ..scene import preferences
from ..scene.settings import absolute
from .verb import BackgroundVerb


@dataclass(frozen=True)
class Order:
    """What learning needs to know. out: where it is kept; empty: beside the library's cache."""

    folder: str
    unit: float | None
    cache: str | None
    out: str


class BEYOND_MOCAP_OT_learn_words(BackgroundVerb, bpy.types.Operator):
    """Learn from the library's clips that have words, ten are enough to begin with, so that Propose Words finds the
same acts in others. What is learned is kept in a file, which serves any library"""

    bl_idname = "beyond_mocap.learn_words"
    bl_label = "Learn from Words"
    kind = "learning"

    out: StringProperty(
        name="File", subtype="FILE_PATH", options={"SKIP_SAVE"}, description="Where it is kept; empty: in the cache"
    )

    @classmethod
    def poll(cls, context):
        """A folder has to be chosen."""
        cls.poll_message_set("Choose the library's folder first")
        return bool(context.scene.beyond_mocap.library_folder)

    def order(self, context):
        """Folder, unit and where to."""
        settings = context.scene.beyond_mocap
        if not settings.library_folder:
            raise InputError("library", "no folder chosen", "a folder of BVH clips", "choose one in step 1")
        folder = absolute(settings.library_folder)
        return Order(folder, settings.library_unit or None, preferences.cache_folder(folder), absolute(self.out))

    @staticmethod
    def work(order, progress, cancelled, _hurry):
        """Look at the clips, learn, and keep it; returns the file and what was learned, as lines."""
        from ..beyond_mocap.library import cache
        from ..beyond_mocap.library.classify import keep
        from ..beyond_mocap.library.classify.examples import examples_of
        from ..beyond_mocap.library.classify.train import trained

        out = Path(order.out) if order.out else cache.place(Path(order.folder), order.cache)[0] / keep.NAME
        looked = lambda done, text: progress(0.7 * done, text)  # noqa: E731
        notes = []
        examples = examples_of(order.folder, order.unit, looked, order.cache, cancelled, notes.append)
        known = trained(examples, lambda done, text: progress(0.7 + 0.3 * done, text), cancelled)
        if not order.out:
            out.parent.mkdir(parents=True, exist_ok=True)
        keep.write(out, known)
        return str(out), (*known.told(), *notes)

    def apply(self, scene, result):
        """Propose Words uses it from now on."""
        scene.beyond_mocap.words_model, told = result
        for line in told[1:]:
            self.report({"INFO"}, line)
        self.report({"INFO"}, f"{told[0]}: {', '.join(told[1:])}")
