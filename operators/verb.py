"""What all verbs share: trouble becomes a report with a cause and a next step; long work may run in the background."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import CollectionProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ..beyond_mocap.base.errors import BeyondMocapError, InputError
from ..scene.core import background, window
from ..scene.rigs import export

NEEDS_LIBRARY = ("Choose the library's folder in step 1 first",
                 lambda context: bool(context.scene.beyond_mocap.library_folder))
NEEDS_NO_EDITING = "Leave edit mode first (Tab)", lambda context: context.mode in {"OBJECT", "POSE"}


class Verb:
    """An operator whose `do(context)` does the work; where it raises, the trouble is reported and nothing has changed.

    `do` reads and computes first and touches the scene last, so that a step that fails leaves the scene as it was.
    needs: what the user is told where the operator is greyed, and a function of the context that is true where it can
    be called; as many pairs of these as there are, asked in turn.
    """

    bl_options = {"REGISTER", "UNDO"}
    needs = ()

    @classmethod
    def poll(cls, context):
        """Whether what it needs is there."""
        for message, is_met in zip(cls.needs[::2], cls.needs[1::2]):
            if not is_met(context):
                cls.poll_message_set(message)
                return False
        return True

    def execute(self, context):
        """Do it now."""
        return self.attempt(lambda: self.do(context))

    def attempt(self, action):
        """FINISHED where `action` runs through, else a report and CANCELLED."""
        try:
            action()
        except BeyondMocapError as error:
            return self.failed(str(error))
        except OSError as error:
            found = f"{error.filename or 'file'}: {error.strerror or error}"
            return self.failed(f"{found}; check the path and its permissions")
        return {"FINISHED"}

    def failed(self, message: str):
        """Report an error."""
        self.report({"ERROR"}, message)
        return {"CANCELLED"}


class ImportVerb(Verb, ImportHelper):
    """A verb that reads files: chosen in the file browser, dropped into a view, or named by a script."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}
    directory: StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"})

    def invoke(self, context, event):
        """Dropped files are imported at once; else the file browser opens."""
        if self.directory and self.files:
            return self.execute(context)
        return ImportHelper.invoke(self, context, event)

    def chosen(self) -> list[Path]:
        """The chosen files; where none is, the path of the file browser's name field, if there is one."""
        names = [file.name for file in self.files if file.name]
        if names:
            return [Path(self.directory or Path(self.filepath).parent, name) for name in names]
        return [Path(bpy.path.abspath(self.filepath))] if self.filepath else []

    def chosen_one(self, expected: str) -> Path:
        """The one chosen file; InputError where there are none or several."""
        chosen = self.chosen()
        if len(chosen) != 1:
            raise InputError("import", f"{len(chosen)} files" if chosen else "no file given", expected)
        return chosen[0]


class DroppedIntoView:
    """To be mixed into a file handler: its files are dropped into a 3D view."""

    @classmethod
    def poll_drop(cls, context):
        """A 3D view is under the pointer."""
        return context.area is not None and context.area.type == "VIEW_3D"


class ExportVerb(Verb, ExportHelper):
    """A verb that writes a file in the form that its property `format` names."""

    bl_options = {"REGISTER"}
    filename_ext = ""
    check_extension = None

    def invoke(self, context, event):
        """The file browser."""
        self.filename_ext = export.SUFFIXES[self.format]
        return ExportHelper.invoke(self, context, event)

    def check(self, _context):
        """The name in the file browser ends as the file will, so that Blender warns of one that is there."""
        named = Path(self.filepath)
        if not named.name:
            return False
        before, self.filepath = self.filepath, str(export.with_ending(named, export.SUFFIXES[self.format]))
        return self.filepath != before

    def out(self) -> Path:
        """Where to write; InputError where nothing is chosen."""
        if not self.filepath:
            raise InputError("export", "no file given", "where to write it", "choose a place")
        return export.with_ending(Path(bpy.path.abspath(self.filepath)), export.SUFFIXES[self.format])


class BackgroundVerb(Verb):
    """A verb in three parts, so that the middle one can run in a thread while the window stays alive.

    `kind`: name of the work. `order(context)` collects plain values from the scene; `work(order, progress, cancelled,
    hurry)`, a static function that never touches bpy, computes; `apply(scene, result)` writes what came out. Called
    from a script (`execute`) all three run at once; pressed as a button (`invoke`) the work goes to a thread. ESC
    cancels it.
    """

    kind = ""
    left = "cancelled, nothing has changed"  # what is told after ESC

    def do(self, context):
        """Order, work and apply in one go."""
        manager = context.window_manager
        manager.progress_begin(0, 100)
        try:
            order = self.order(context)
            asking = (lambda done, text: manager.progress_update(int(100 * done)), lambda: False, lambda: False)
            result = self.work(order, *asking)
        finally:
            manager.progress_end()
        self.apply(context.scene, result)

    def invoke(self, context, _event):
        """Start the thread and come back later."""
        if bpy.app.background:
            return self.execute(context)
        return self.started(context) if self.attempt(lambda: self.start(context)) == {"FINISHED"} else {"CANCELLED"}

    def start(self, context):
        """Collect the order and hand it to a thread."""
        order, work = self.order(context), self.work
        self.scene = context.scene.session_uid
        self.job = background.Job(self.kind, lambda *asking: work(order, *asking))

    def started(self, context):
        """Begin to poll."""
        self.clock = window.start_clock(context)
        context.window_manager.modal_handler_add(self)
        self.show(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Poll, pass on all other events, and write the result once it is there."""
        if event.type == "ESC" and event.value == "PRESS":
            self.job.cancel()
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        ended = self.job.poll()
        if not ended and not self.job.stale:
            self.show(context)
            return {"RUNNING_MODAL"}
        self.ended(context)
        scene = next((scene for scene in bpy.data.scenes if scene.session_uid == self.scene), None)
        if background.cancelled(self.job) or scene is None:
            self.report({"WARNING"}, f"{self.bl_label}: {self.left}")
            return {"CANCELLED"}
        return self.attempt(lambda: self.finish(scene))

    def finish(self, scene):
        """Raise what the thread raised, or apply its result."""
        if self.job.error is not None:
            raise self.job.error
        self.apply(scene, self.job.result)

    def cancel(self, context):
        """Blender takes the operator away (a file is loaded, the window closes): let the thread end unheard."""
        self.job.cancel()
        self.ended(context)

    def show(self, context):
        """Progress in the status bar, at the pointer and for the panel."""
        running = context.window_manager.beyond_mocap_work
        text = self.job.text or f"{self.bl_label} ..."
        running.kind, running.fraction, running.text = self.kind, self.job.fraction, text
        context.window_manager.progress_update(int(100 * self.job.fraction))
        context.workspace.status_text_set(f"{text}   {self.job.fraction:.0%}   ESC: cancel")
        window.redraw()

    def ended(self, context):
        """Take progress display and clock away."""
        context.window_manager.beyond_mocap_work.kind = ""
        window.stop_clock(context, self.clock)
        window.redraw()
