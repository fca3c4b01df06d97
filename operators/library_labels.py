"""Labels of a library clip: open it for annotation, have labels proposed, review and save them, learn from them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..beyond_mocap.base.errors import BeyondMocapError, InputError
from ..scene.core import preferences, session
from ..scene.core.settings import absolute
from ..scene.core.window import clear_status
from ..scene.library import clips, recordings
from ..scene.timeline import lanes, proposals
from .annotate import SPACES
from .library import ClipVerb, FolderVerb
from .verb import Verb


class OpenClipVerb(Verb):
    """A verb about the library clip that the active armature shows."""

    needs = ("Open a clip with Annotate Clip first, and keep its armature active",
             lambda context: bool(recordings.shown_clip(context.object)))


class BEYOND_MOCAP_OT_annotate_clip(ClipVerb, bpy.types.Operator):
    """Open this clip of the library for annotation: an armature that plays it, with its words as strips and markers in
the NLA editor. Change them there, or have words proposed, then press Save Words"""

    bl_idname = "beyond_mocap.annotate_clip"
    bl_label = "Annotate Clip"

    def do(self, context):
        """Read clip and words, then make armature and strips."""
        from ..beyond_mocap.library.keep_words import as_timeline, read_sources, read_words

        settings, path = context.scene.beyond_mocap, self.clip(context)
        motion, _ = recordings.read_recording(settings, path)
        folder = recordings.folder_of(settings)
        rows = read_words(folder / path, folder, motion.fps)
        timeline = as_timeline(rows, motion.fps)
        said = read_sources(folder / path, folder, rows, motion.fps)
        rig = recordings.show_recording(context, motion, path, self.dressed)
        recordings.lay_words(rig, context.scene, motion, timeline)
        for row, (source, confidence) in said.items():
            proposals.add(rig, row, source, confidence, "ACCEPTED")
        self.report({"INFO"}, f"{rig.name}: {len(rows)} {'row' if len(rows) == 1 else 'rows'} of words")


class BEYOND_MOCAP_OT_propose_words(OpenClipVerb, bpy.types.Operator):
    """Propose words for the active clip from its motion: gaits and directions, kicks with foot and key moment, jumps,
headers, turns, getting up; and all that was learned from annotated clips. Look through them; what neither knows is
yours to add"""

    bl_idname = "beyond_mocap.propose_words"
    bl_label = "Propose Words"
    least: FloatProperty(name="At Least", default=0.5, min=0.0, max=1.0, subtype="FACTOR",
                         description="Proposals that are less sure than this are left out")
    replace: BoolProperty(
        name="Replace", default=True,
        description="In place of the strips that are there; else they stay, and proposals are put beside them",
    )

    review: BoolProperty(name="One by One", default=False, options={"SKIP_SAVE"},
                         description="Only list them: each becomes a strip or key moment when it is accepted")

    def do(self, context):
        """Look at the recording itself, then lay the strips."""
        from ..beyond_mocap.annotation import Timeline
        from ..beyond_mocap.library.classify import classifier
        from ..beyond_mocap.library.keep_words import as_timeline
        from ..beyond_mocap.library.proposals import GAITS, gaits_of, propose

        settings, rig = context.scene.beyond_mocap, context.object
        motion, _ = recordings.read_recording(settings, recordings.shown_clip(rig), rig[recordings.FOLDER])
        built = session.library(absolute(settings.library_folder), settings.library_unit or None)
        try:
            gaits = gaits_of(built) if built is not None else GAITS
        except InputError:  # a library without locomotion says nothing of gaits
            gaits = GAITS
        known = classifier.read_classifier(absolute(settings.words_model)) if settings.words_model else None
        found = [one for one in propose(motion, gaits, known) if one.confidence >= self.least]
        if self.review:
            self.list_them(rig, context.scene, motion, found)
            return
        before = None if self.replace else lanes.read(rig)
        told = as_timeline([one.annotation for one in found], motion.fps)
        if before is not None:
            told = Timeline((*before.spans, *told.spans), (*before.keys, *told.keys))
        recordings.lay_words(rig, context.scene, motion, told)
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
            recordings.lay_words(rig, scene, motion, Timeline())
        said = lanes.read(rig)
        new = [one for one in found if not proposals.said_already(said, one.annotation, motion.fps)]
        proposals.keep(rig, new)
        self.report({"INFO"}, f"{rig.name}: {len(new)} proposal{'s' * (len(new) != 1)} to look through")


WHAT = (("ACCEPT", "Accept", "Put it among the clip's words, and go to the next one"),
        ("REFUSE", "Refuse", "Leave it out, and go to the next one"),
        ("NEXT", "Next", "Look at the next one"),
        ("PREVIOUS", "Previous", "Look at the one before"),
        ("ACCEPT_ALL", "Accept All", "Accept all that are still open"),
        ("REFUSE_ALL", "Refuse All", "Refuse all that are still open"))
KEYS = {"A": "ACCEPT", "RET": "ACCEPT", "NUMPAD_ENTER": "ACCEPT", "X": "REFUSE", "DEL": "REFUSE", "DOWN_ARROW": "NEXT",
        "RIGHT_ARROW": "NEXT", "UP_ARROW": "PREVIOUS", "LEFT_ARROW": "PREVIOUS"}
STATUS = "A, Enter: accept   X: refuse   Up, Down: the one before, the next   Space: play   Esc: leave"


class ProposalVerb(Verb):
    """A verb about what was proposed for the active clip."""

    needs = ("Open a clip with Annotate Clip first, and press Look Through",
             lambda context: context.object is not None and len(context.object.beyond_mocap_proposals.listed) > 0)


class BEYOND_MOCAP_OT_judge_proposal(ProposalVerb, bpy.types.Operator):
    """Accept or refuse a proposal of the list, or step to another one"""

    bl_idname = "beyond_mocap.judge_proposal"
    bl_label = "Judge Proposal"
    what: EnumProperty(name="What", items=WHAT, default="ACCEPT", description="What becomes of it")
    index: IntProperty(name="Proposal", default=-1, min=-1, options={"SKIP_SAVE"},
                       description="Its place in the list; -1: the chosen one")

    @classmethod
    def description(cls, _context, properties):
        return next(text for name, _, text in WHAT if name == properties.what)

    def do(self, context):
        """Do it, and say so."""
        self.report({"INFO"}, judged(context.object, self.what, self.index))


class BEYOND_MOCAP_OT_review_proposals(ProposalVerb, bpy.types.Operator):
    """Look through the proposals by keys while the clip plays: A or Enter accepts, X refuses, and the playhead goes to
the next one; Up and Down step, Esc leaves"""

    bl_idname = "beyond_mocap.review_proposals"
    bl_label = "Judge by Keys"

    def do(self, _context):
        raise InputError("Judge by Keys", "no window", "a 3D view", "in scripts use Judge Proposal")

    def invoke(self, context, _event):
        """Take keys from now on; the first open proposal is shown."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        self.target = context.object.name
        _show_open(context.object)
        context.window_manager.modal_handler_add(self)
        self.tell(context, "")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Our keys where an editor of time or space is under the pointer; all else is Blender's."""
        target = context.object
        listed = target is not None and target.name == self.target and len(target.beyond_mocap_proposals.listed) > 0
        if not listed:
            return self.left(context)
        held = event.ctrl or event.alt or event.oskey or event.shift
        if event.value != "PRESS" or held or not _over_editor(context, event):
            return {"PASS_THROUGH"}
        if event.type == "ESC":
            return self.left(context)
        if event.type not in KEYS:
            return {"PASS_THROUGH"}
        self.press(context, target, KEYS[event.type])
        return {"RUNNING_MODAL"} if proposals.left(target) else self.left(context)

    def press(self, context, target, what: str):
        """One key; a step for undo where words change."""
        try:
            told = judged(target, what)
        except BeyondMocapError as error:
            self.report({"WARNING"}, str(error))
            return
        self.tell(context, told)
        if what in ("ACCEPT", "REFUSE"):
            bpy.ops.ed.undo_push(message=told[:60])

    def tell(self, context, told: str):
        """What was done and what the keys do, in the status bar."""
        one = proposals.chosen(context.object)
        now = f"{one.name}, {one.confidence:.0%} sure" if one is not None else ""
        context.workspace.status_text_set("   |   ".join(part for part in (told, now, STATUS) if part))
        for area in context.window.screen.areas:
            area.tag_redraw()

    def left(self, context):
        """End."""
        self.cancel(context)
        return {"FINISHED"}

    def cancel(self, _context):
        """Blender takes the operator away, or it has ended."""
        clear_status()


def judged(target: bpy.types.Object, what: str, index: int = -1) -> str:
    """Carry out one of WHAT; returns a line for the user. InputError for a place that is not in the list."""
    group = target.beyond_mocap_proposals
    if what in ("NEXT", "PREVIOUS"):
        group.active = min(group.active, len(group.listed) - 1)
        proposals.go_on(target, 1 if what == "NEXT" else -1)
        return proposals.chosen(target).name
    how = proposals.accept if what.startswith("ACCEPT") else proposals.refuse
    if what.endswith("_ALL"):
        judged_now = [number for number, one in enumerate(group.listed) if one.state == "OPEN"]
        for number in judged_now:
            how(target, number)
        return f"{len(judged_now)} {'accepted' if what == 'ACCEPT_ALL' else 'refused'}"
    told = how(target, group.active if index < 0 else index)
    proposals.go_on(target, 1, only_open=True)
    count = proposals.left(target)
    return f"{told}; {count} left"


def _show_open(target: bpy.types.Object) -> None:
    """The chosen proposal, if nobody has judged it, else the next one that is open; the playhead goes there."""
    group = target.beyond_mocap_proposals
    one = proposals.chosen(target)
    if one is None or one.state != "OPEN":
        proposals.go_on(target, 1, only_open=True)
    group.active = group.active


def _over_editor(context, event) -> bool:
    """Whether the pointer is over an editor in which one annotates."""
    inside = (area for area in context.window.screen.areas
              if 0 <= event.mouse_x - area.x < area.width and 0 <= event.mouse_y - area.y < area.height)
    return any(area.type in SPACES for area in inside)


class BEYOND_MOCAP_OT_save_words(OpenClipVerb, bpy.types.Operator):
    """Write the words of the active clip's strips to NAME.txt beside the clip, or into the annotations.csv that speaks
of it. What is written there already is overwritten only when you say so"""

    bl_idname = "beyond_mocap.save_words"
    bl_label = "Save Words"
    bl_options = {"REGISTER"}
    overwrite: BoolProperty(name="Overwrite", description="Replace what is written about this clip",
                            options={"SKIP_SAVE"})

    def invoke(self, context, event):
        """Ask before words are overwritten."""
        from ..beyond_mocap.base.errors import InputError
        from ..beyond_mocap.library.keep_words import has_words, place

        rig = context.object
        clip, folder = recordings.clip_file(rig)
        try:
            there = has_words(clip, folder, rig.get(recordings.RATE, 30.0))
            form, target = place(clip, folder)
        except (InputError, OSError):
            return self.execute(context)
        if not there:
            return self.execute(context)
        self.overwrite = True
        what = (
            f"Replace the words in {target.name}?" if form == "TEXT" else f"Replace this clip's rows in {target.name}?"
        )
        return context.window_manager.invoke_confirm(self, event, title=what, confirm_text="Replace", icon="WARNING")

    def do(self, context):
        """Read the strips, write the file, and show the words in the list."""
        from ..beyond_mocap.library.keep_words import keep

        rig = context.object
        rows = recordings.read_words(rig)
        clip, folder = recordings.clip_file(rig)
        target = keep(clip, folder, rows, fps=rig[recordings.RATE], overwrite=self.overwrite,
                      sources=proposals.sources(rig))
        clips.say(context.window_manager, recordings.shown_clip(rig), rows)
        self.report({"INFO"}, f"{len(rows)} rows of words written to {target}; Build Library takes them in")


@dataclass(frozen=True)
class Order:
    """What learning needs to know. out: where it is kept; empty: beside the library's cache."""

    folder: str
    unit: float | None
    cache: str | None
    out: str


class BEYOND_MOCAP_OT_learn_words(FolderVerb, bpy.types.Operator):
    """Learn from the library's clips that have words, ten are enough to begin with, so that Propose Words finds the
same acts in others. What is learned is kept in a file, which serves any library"""

    bl_idname = "beyond_mocap.learn_words"
    bl_label = "Learn from Words"
    kind = "learning"
    out: StringProperty(name="File", subtype="FILE_PATH", options={"SKIP_SAVE"},
                        description="Where it is kept; empty: in the cache")

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
        from ..beyond_mocap.library.classify import classifier
        from ..beyond_mocap.library.classify.examples import examples_of
        from ..beyond_mocap.library.classify.train import trained

        out = Path(order.out) if order.out else cache.place(Path(order.folder), order.cache)[0] / classifier.FILE_NAME
        looked = lambda done, text: progress(0.7 * done, text)  # noqa: E731
        notes = []
        examples = examples_of(order.folder, order.unit, looked, cache_dir=order.cache, cancelled=cancelled,
                               note=notes.append)
        known = trained(examples, lambda done, text: progress(0.7 + 0.3 * done, text), cancelled)
        if not order.out:
            out.parent.mkdir(parents=True, exist_ok=True)
        classifier.write_classifier(out, known)
        return str(out), (*known.told(), *notes)

    def apply(self, scene, result):
        """Propose Words uses it from now on."""
        scene.beyond_mocap.words_model, told = result
        for line in told[1:]:
            self.report({"INFO"}, line)
        self.report({"INFO"}, f"{told[0]}: {', '.join(told[1:])}")
