"""Labels of a library clip: open it for annotation, propose labels, review and save them, learn from them."""

from pathlib import Path
from typing import NamedTuple

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ...beyond_mocap.base.errors import BeyondMocapError, InputError, format_count
from ...scene.core import preferences, sample, session
from ...scene.core.settings import require_library_folder, to_absolute_path
from ...scene.core.window import clear_status, show_status
from ...scene.library import clips, recordings
from ...scene.timeline import label_tracks as lanes
from ...scene.timeline import proposals
from ..operator_base import BaseOperator
from ..timeline.annotate import SPACES
from .library import ClipOperator, FolderOperator


class OpenClipOperator(BaseOperator):
    """Base of operators about the library clip that the active armature shows."""

    needs = ("Open a clip with Annotate Clip first, and keep its armature active",
             lambda context: bool(recordings.find_shown_clip(context.object)))


class BEYOND_MOCAP_OT_annotate_clip(ClipOperator, bpy.types.Operator):
    """Open this clip of the library for annotation: an armature that plays it, with its labels as strips and markers in
the NLA editor; Save Labels writes them to the library"""

    bl_idname = "beyond_mocap.annotate_clip"
    bl_label = "Annotate Clip"
    presents = True

    def do(self, context):
        """Read clip and labels, then create armature and strips."""
        from ...beyond_mocap.library.folder.label_files import read_labels, read_sources, to_timeline

        settings, path = context.scene.beyond_mocap, self.find_clip(context)
        motion, _ = recordings.read_recording(settings, path)
        folder = recordings.find_library_folder(settings)
        rows = read_labels(folder / path, folder, motion.fps)
        timeline = to_timeline(rows, motion.fps)
        sources = read_sources(folder / path, folder, rows, motion.fps)
        rig = recordings.show_recording(context, motion, path, self.dressed)
        recordings.write_labels(rig, context.scene, motion, timeline)
        for row, (source, confidence) in sources.items():
            proposals.add_proposal(rig, row, source, confidence, "ACCEPTED")
        self.report({"INFO"}, f"{rig.name}: {format_count(len(rows), 'row')} of labels")


class BEYOND_MOCAP_OT_propose_words(OpenClipOperator, bpy.types.Operator):
    """Propose labels for the active clip from its motion: gaits and directions, kicks with foot and key moment, jumps,
headers, turns, getting up, and acts learned from annotated clips"""

    bl_idname = "beyond_mocap.propose_words"
    bl_label = "Propose Labels"
    least: FloatProperty(name="Confidence", default=0.5, min=0.0, max=1.0, subtype="FACTOR",
                         description="Lowest confidence of proposals to keep")
    replace: BoolProperty(
        name="Replace", default=True,
        description="Replace the existing strips; otherwise proposals are added beside them",
    )

    review: BoolProperty(name="One by One", default=False, options={"SKIP_SAVE"},
                         description="List the proposals; each becomes a strip or key moment when you accept it")

    def do(self, context):
        """Read the recording, then write the strips."""
        from ...beyond_mocap.annotation import Timeline
        from ...beyond_mocap.library.classify import classifier
        from ...beyond_mocap.library.folder.label_files import to_timeline
        from ...beyond_mocap.library.proposals import GAITS, list_gaits, propose_labels

        settings, rig = context.scene.beyond_mocap, context.object
        motion, _ = recordings.read_recording(settings, recordings.find_shown_clip(rig), rig[recordings.FOLDER])
        library = session.find_library(to_absolute_path(settings.library_folder), settings.library_unit or None)
        try:
            gaits = list_gaits(library) if library is not None else GAITS
        except InputError:  # a library without locomotion has no gaits
            gaits = GAITS
        known = classifier.read_classifier(to_absolute_path(settings.words_model)) if settings.words_model else None
        found = [one for one in propose_labels(motion, gaits, known) if one.confidence >= self.least]
        if self.review:
            self.list_new_proposals(rig, context.scene, motion, found)
            return
        before = None if self.replace else lanes.read_timeline(rig)
        timeline = to_timeline([one.annotation for one in found], motion.fps)
        if before is not None:
            timeline = Timeline((*before.spans, *timeline.spans), (*before.keys, *timeline.keys))
        recordings.write_labels(rig, context.scene, motion, timeline)
        proposals.store_proposals(rig, found, "ACCEPTED", keep_accepted=not self.replace)
        for one in found:
            row = one.annotation
            if row.key is not None or one.confidence < 0.6:
                when = f"{(row.start if row.key is None else row.key) / motion.fps:.2f} s"
                self.report({"INFO"}, f"{when} {' '.join(row.words)}: {one.why}, confidence {one.confidence:.0%}")
        keys = sum(one.annotation.key is not None for one in found)
        rest = len(found) - keys
        counted = f"{format_count(rest, 'span')} and {format_count(keys, 'key moment')}"
        self.report({"INFO"}, f"{rig.name}: {counted} proposed")

    def list_new_proposals(self, rig, scene, motion, found):
        """List the proposals that are not among the clip's labels already."""
        from ...beyond_mocap.annotation import Timeline

        if not lanes.has_label_tracks(rig):
            recordings.write_labels(rig, scene, motion, Timeline())
        timeline = lanes.read_timeline(rig)
        new = [one for one in found if not proposals.has_labels(timeline, one.annotation, motion.fps)]
        proposals.store_proposals(rig, new)
        self.report({"INFO"}, f"{rig.name}: {format_count(len(new), 'proposal')} to review")


REVIEW_ACTIONS = (("ACCEPT", "Accept", "Add this proposal to the clip's labels and go to the next one"),
                  ("REFUSE", "Reject", "Reject this proposal and go to the next one"),
                  ("NEXT", "Next", "Go to the next proposal"),
                  ("PREVIOUS", "Previous", "Go to the previous proposal"),
                  ("ACCEPT_ALL", "Accept All", "Accept all open proposals"),
                  ("REFUSE_ALL", "Reject All", "Reject all open proposals"))
KEYS = {"A": "ACCEPT", "RET": "ACCEPT", "NUMPAD_ENTER": "ACCEPT", "X": "REFUSE", "DEL": "REFUSE", "DOWN_ARROW": "NEXT",
        "RIGHT_ARROW": "NEXT", "UP_ARROW": "PREVIOUS", "LEFT_ARROW": "PREVIOUS"}
STATUS_TEXT = "A, Enter: accept   X: reject   Up, Down: previous, next   Space: play   Esc: finish"


class ProposalOperator(BaseOperator):
    """Base of operators about the proposals for the active clip."""

    needs = ("Open a clip with Annotate Clip first, then press Review",
             lambda context: context.object is not None and len(context.object.beyond_mocap_proposals.listed) > 0)


class BEYOND_MOCAP_OT_judge_proposal(ProposalOperator, bpy.types.Operator):
    """Accept or reject a proposal of the list, or go to another one"""

    bl_idname = "beyond_mocap.judge_proposal"
    bl_label = "Review Proposal"
    what: EnumProperty(name="What", items=REVIEW_ACTIONS, default="ACCEPT", description="Action on the proposal")
    index: IntProperty(name="Proposal", default=-1, min=-1, options={"SKIP_SAVE"},
                       description="Number in the list; -1 uses the chosen one")

    @classmethod
    def description(cls, _context, properties):
        return next(text for name, _, text in REVIEW_ACTIONS if name == properties.what)

    def do(self, context):
        """Carry out the action and report it."""
        self.report({"INFO"}, review_proposal(context.object, self.what, self.index))


class BEYOND_MOCAP_OT_review_proposals(ProposalOperator, bpy.types.Operator):
    """Review the proposals with keys while the clip plays: A or Enter accepts, X rejects and goes to the next one, Up
and Down step, Esc finishes"""

    bl_idname = "beyond_mocap.review_proposals"
    bl_label = "Review Proposals"

    def do(self, _context):
        raise InputError("Review Proposals", "no window", "a 3D view", "in scripts use Review Proposal")

    def invoke(self, context, _event):
        """Start handling keys; the first open proposal is shown."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        self.target = context.object.name
        _show_open_proposal(context.object)
        context.window_manager.modal_handler_add(self)
        self.show_status(context, "")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Handle our keys while the pointer is over an editor of time or space; pass on all other events."""
        target = context.object
        listed = target is not None and target.name == self.target and len(target.beyond_mocap_proposals.listed) > 0
        if not listed:
            return self.finish(context)
        held = event.ctrl or event.alt or event.oskey or event.shift
        if event.value != "PRESS" or held or not _is_over_editor(context, event):
            return {"PASS_THROUGH"}
        if event.type == "ESC":
            return self.finish(context)
        if event.type not in KEYS:
            return {"PASS_THROUGH"}
        self.handle_key(context, target, KEYS[event.type])
        return {"RUNNING_MODAL"} if proposals.count_open(target) else self.finish(context)

    def handle_key(self, context, target, what: str):
        """Handle one key, with an undo step where labels change."""
        try:
            message = review_proposal(target, what)
        except BeyondMocapError as error:
            self.report({"WARNING"}, str(error))
            return
        self.show_status(context, message)
        if what in ("ACCEPT", "REFUSE"):
            bpy.ops.ed.undo_push(message=message[:60])

    def show_status(self, context, message: str):
        """Show the last result, the current proposal and the keys in the status bar."""
        one = proposals.find_active(context.object)
        now = f"{one.name}, confidence {one.confidence:.0%}" if one is not None else ""
        show_status("   |   ".join(part for part in (message, now, STATUS_TEXT) if part))
        for area in context.window.screen.areas:
            area.tag_redraw()

    def finish(self, context):
        """Finish the operator."""
        self.cancel(context)
        return {"FINISHED"}

    def cancel(self, _context):
        """Clear the status bar when the operator ends."""
        clear_status()


def review_proposal(target: bpy.types.Object, what: str, index: int = -1) -> str:
    """Carry out one of REVIEW_ACTIONS; returns a line for the user. InputError for a number that is not in the list."""
    group = target.beyond_mocap_proposals
    if what in ("NEXT", "PREVIOUS"):
        group.active = min(group.active, len(group.listed) - 1)
        proposals.go_to_next(target, 1 if what == "NEXT" else -1)
        return proposals.find_active(target).name
    action = proposals.accept_proposal if what.startswith("ACCEPT") else proposals.reject_proposal
    if what.endswith("_ALL"):
        judged_now = [number for number, one in enumerate(group.listed) if one.state == "OPEN"]
        for number in judged_now:
            action(target, number)
        return f"{len(judged_now)} {'accepted' if what == 'ACCEPT_ALL' else 'rejected'}"
    message = action(target, group.active if index < 0 else index)
    proposals.go_to_next(target, 1, open_only=True)
    count = proposals.count_open(target)
    return f"{message}; {count} left"


def _show_open_proposal(target: bpy.types.Object) -> None:
    """Show the chosen proposal if it is open, else the next open one; the playhead goes there."""
    group = target.beyond_mocap_proposals
    one = proposals.find_active(target)
    if one is None or one.state != "OPEN":
        proposals.go_to_next(target, 1, open_only=True)
    group.active = group.active


def _is_over_editor(context, event) -> bool:
    """Whether the pointer is over an editor for annotation."""
    inside = (area for area in context.window.screen.areas
              if 0 <= event.mouse_x - area.x < area.width and 0 <= event.mouse_y - area.y < area.height)
    return any(area.type in SPACES for area in inside)


class BEYOND_MOCAP_OT_save_words(OpenClipOperator, bpy.types.Operator):
    """Write the labels of the active clip's strips to a text file beside the clip, or to the library's annotation
table; existing labels are replaced only after you confirm"""

    bl_idname = "beyond_mocap.save_words"
    bl_label = "Save Labels"
    bl_options = {"REGISTER"}
    overwrite: BoolProperty(name="Overwrite", description="Replace the existing labels of this clip",
                            options={"SKIP_SAVE"})

    def invoke(self, context, event):
        """Ask before existing labels are replaced."""
        from ...beyond_mocap.base.errors import InputError
        from ...beyond_mocap.library.folder.label_files import find_label_file, has_labels

        rig = context.object
        clip, folder = recordings.find_source_file(rig)
        try:
            has_labels_already = has_labels(clip, folder, rig.get(recordings.RATE, 30.0))
            form, target = find_label_file(clip, folder)
        except (InputError, OSError):
            return self.execute(context)
        if not has_labels_already:
            return self.execute(context)
        self.overwrite = True
        what = (
            f"Replace the labels in {target.name}?" if form == "TEXT" else f"Replace this clip's rows in {target.name}?"
        )
        return context.window_manager.invoke_confirm(self, event, title=what, confirm_text="Replace", icon="WARNING")

    def do(self, context):
        """Read the strips, write the file, and update the list."""
        from ...beyond_mocap.library.folder.label_files import write_labels

        rig = context.object
        rows = recordings.read_labels(rig)
        clip, folder = recordings.find_source_file(rig)
        sample.check_not_sample(clip)
        target = write_labels(clip, folder, rows, fps=rig[recordings.RATE], overwrite=self.overwrite,
                              sources=proposals.collect_sources(rig))
        clips.update_labels(context.window_manager, recordings.find_shown_clip(rig), rows)
        self.report({"INFO"}, f"{format_count(len(rows), 'row')} of labels written to {target}; press Build "
                    "Library to use the labels")


class LearnOrder(NamedTuple):
    """The input of learning.

    Attributes:
        folder: the library's.
        unit: metres per unit of its files; None guesses it.
        cache: the cache folder.
        out: file to write; empty: beside the library's cache.
    """

    folder: str
    unit: float | None
    cache: str | None
    out: str


class BEYOND_MOCAP_OT_learn_words(FolderOperator, bpy.types.Operator):
    """Learn from the library's labelled clips, about ten are enough, so that Propose Labels finds the same acts in
others; the result is a file that works with any library"""

    bl_idname = "beyond_mocap.learn_words"
    bl_label = "Learn from Labels"
    kind = "learning"
    out: StringProperty(name="File", subtype="FILE_PATH", options={"SKIP_SAVE"},
                        description="File to write; empty uses the cache folder")

    def order(self, context):
        """Collect folder, unit and target file."""
        settings = context.scene.beyond_mocap
        folder = require_library_folder(settings)
        return LearnOrder(folder, settings.library_unit or None, preferences.find_cache_folder(folder),
                          to_absolute_path(self.out))

    @staticmethod
    def run_job(order, progress, cancelled, _hurry):
        """Read the clips, train and write the classifier; returns the file and lines about what was learned."""
        from ...beyond_mocap.library import cache
        from ...beyond_mocap.library.classify import classifier
        from ...beyond_mocap.library.classify.examples import read_examples
        from ...beyond_mocap.library.classify.train import train_classifier

        out = Path(order.out) if order.out else cache.find_cache_folder(Path(order.folder),
                                                                        order.cache)[0] / cache.CLASSIFIER_FILE
        on_progress = lambda done, text: progress(0.7 * done, text)  # noqa: E731
        notes = []
        examples = read_examples(order.folder, order.unit, on_progress, cache_dir=order.cache, cancelled=cancelled,
                                 on_note=notes.append)
        known = train_classifier(examples, lambda done, text: progress(0.7 + 0.3 * done, text), cancelled)
        if not order.out:
            out.parent.mkdir(parents=True, exist_ok=True)
        classifier.write_classifier(out, known)
        return str(out), (*known.describe(), *notes)

    def apply(self, scene, result):
        """Set the file that Propose Labels uses."""
        scene.beyond_mocap.words_model, lines = result
        for line in lines[1:]:
            self.report({"INFO"}, line)
        self.report({"INFO"}, f"{lines[0]}: {', '.join(lines[1:])}")
