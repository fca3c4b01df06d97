"""Propose Words: what the active clip may show, by rules and by what was learned, as strips or to be judged one by
one."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, FloatProperty

from ..beyond_mocap.errors import InputError
from ..scene import clip_annotation, lanes, proposals, recordings, session
from ..scene.settings import absolute
from .verb import Verb


class BEYOND_MOCAP_OT_propose_words(Verb, bpy.types.Operator):
    """Propose words for the active clip from its motion: gaits and directions, kicks with foot and key moment, jumps,
headers, turns, getting up; and all that was learned from annotated clips. Look through them; what neither knows is
yours to add"""

    bl_idname = "beyond_mocap.propose_words"
    bl_label = "Propose Words"

    least: FloatProperty(
        name="At Least", default=0.5, min=0.0, max=1.0, subtype="FACTOR",
        description="Proposals that are less sure than this are left out",
    )
    replace: BoolProperty(
        name="Replace", default=True,
        description="In place of the strips that are there; else they stay, and proposals are put beside them",
    )

    review: BoolProperty(
        name="One by One", default=False, options={"SKIP_SAVE"},
        description="Only list them: each becomes a strip or key moment when it is accepted",
    )

    @classmethod
    def poll(cls, context):
        """An armature that shows a clip."""
        cls.poll_message_set("Open a clip with Annotate Clip first, and keep its armature active")
        return bool(clip_annotation.shown(context.object))

    def do(self, context):
        """Look at the recording itself, then lay the strips."""
        from ..beyond_mocap.annotation import Timeline
        from ..beyond_mocap.library.classify import keep
        from ..beyond_mocap.library.keep_words import as_timeline
        from ..beyond_mocap.library.proposals import GAITS, gaits_of, propose

        settings, rig = context.scene.beyond_mocap, context.object
        motion, _ = recordings.read(settings, clip_annotation.shown(rig), rig[recordings.FOLDER])
        built = session.library(absolute(settings.library_folder), settings.library_unit or None)
        try:
            gaits = gaits_of(built) if built is not None else GAITS
        except InputError:  # a library without locomotion says nothing of gaits
            gaits = GAITS
        known = keep.read(absolute(settings.words_model)) if settings.words_model else None
        found = [one for one in propose(motion, gaits, known) if one.confidence >= self.least]
        if self.review:
            self.list_them(rig, context.scene, motion, found)
            return
        before = None if self.replace else lanes.read(rig)
        told = as_timeline([one.annotation for one in found], motion.fps)
        if before is not None:
            told = Timeline((*before.spans, *told.spans), (*before.keys, *told.keys))
        clip_annotation.lay(rig, context.scene, motion, told)
        proposals.keep(rig, found, "ACCEPTED", beside=not self.replace)
        for one in found:
            row = one.annotation
            if row.key is not None or one.confidence < 0.6:
                when = f"{(row.start if row.key is None else row.key) / motion.fps:.2f} s"
                self.report({"INFO"}, f"{when} {' '.join(row.words)}: {one.why}, {one.confidence:.0%} sure")
        keys = sum(one.annotation.key is not None for one in found)
        rest = len(found) - keys
        counted = f"{rest} stretch{'es' * (rest != 1)} and {keys} key moment{'s' * (keys != 1)}"
        self.report({"INFO"}, f"{rig.name}: {counted} proposed")

    def list_them(self, rig, scene, motion, found):
        """List what is not among the clip's words already."""
        from ..beyond_mocap.annotation import Timeline

        if not lanes.has(rig):
            clip_annotation.lay(rig, scene, motion, Timeline())
        said = lanes.read(rig)
        new = [one for one in found if not proposals.said_already(said, one.annotation, motion.fps)]
        proposals.keep(rig, new)
        self.report({"INFO"}, f"{rig.name}: {len(new)} proposal{'s' * (len(new) != 1)} to look through")
