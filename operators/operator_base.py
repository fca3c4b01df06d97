"""Base classes of operators: errors become reports with a cause and a next step; long work may run in the background.
"""

from contextlib import nullcontext
from pathlib import Path

import bpy
from bpy.props import CollectionProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ..beyond_mocap.base.errors import BeyondMocapError, InputError
from ..scene.core import background, notices, window
from ..scene.rigs import exporters
from ..scene.stage import presenting

NEEDS_LIBRARY = ("Choose the library's folder first",
                 lambda context: bool(context.scene.beyond_mocap.library_folder))
NEEDS_NO_EDITING = "Leave edit mode first (Tab)", lambda context: context.mode in {"OBJECT", "POSE"}


class BaseOperator:
    """An operator whose `do(context)` does the work; an error in it is reported and leaves the scene unchanged.

    `do` reads and computes first and changes the scene last, so that a failing step leaves the scene as it was.

    Attributes:
        needs: pairs of a message for the user while the operator is disabled, and a function of the context that
            returns whether it is enabled; they are checked in order.
        presents: whether the 3D view moves to the objects that it adds, and the stage's cameras follow them.
        pops_up: whether a pop-up shows a failure that no panel shows.
        resumes: number of the notice that it fixes, 0 for none.
    """

    bl_options = {"REGISTER", "UNDO"}
    needs = ()
    presents = False
    pops_up = True
    resumes = 0

    @classmethod
    def poll(cls, context):
        """Return whether all needs are met."""
        for message, is_met in zip(cls.needs[::2], cls.needs[1::2]):
            if not is_met(context):
                cls.poll_message_set(message)
                return False
        return True

    def execute(self, context):
        """Run the operator now; where it repairs what a notice is about, run what failed again."""
        result = self.attempt(lambda: self.do(context))
        if result == {"FINISHED"} and self.resumes:
            try:
                notices.run_again(context.scene, self.resumes)
            except RuntimeError as error:  # what ran again has failed; this has not
                self.report({"WARNING"}, notices.read_failure(error))
        return result

    def attempt(self, action):
        """Run `action`: FINISHED if it succeeds, else a report and CANCELLED."""
        try:
            with presenting.present_new_objects(bpy.context) if self.presents else nullcontext():
                action()
        except (BeyondMocapError, OSError) as error:
            return self.report_failure(error)
        notices.clear_notices(bpy.context.scene, type(self).bl_idname)
        return {"FINISHED"}

    def report_failure(self, error: BeyondMocapError | OSError):
        """Report an error: to a script as one line, after a button in a pop-up with the error's fixes; both leave a
        notice.
        """
        number = self.post_failure(error)
        if self.is_pressed():
            self.report({"WARNING"}, str(describe_error(error)))  # Blender's own pop-up of errors has no buttons
            if self.pops_up:
                notices.show_notices(number)
        else:
            self.report({"ERROR"}, str(describe_error(error)))
        return {"CANCELLED"}

    def post_failure(self, error: BeyondMocapError | OSError, topic: str = "", player: str = "") -> int:
        """Post a notice of an error.

        Args:
            error: the error.
            topic: that a newer notice replaces; "" for the operator itself.
            player: name of the player that it is about.
        Returns:
            The notice's number.
        """
        subject = notices.Subject(topic=topic or type(self).bl_idname, room=self.find_room(), title=self.bl_label,
                                  player=player, operator=type(self).bl_idname, arguments=self.read_arguments())
        return notices.post_notice(bpy.context.scene, subject, describe_error(error))

    @classmethod
    def find_room(cls) -> str:
        """Return the feature whose panel shows this operator's notices."""
        return cls.__module__.rpartition(".")[2]

    def read_arguments(self) -> dict:
        """Read the arguments that this operator was called with."""
        found = {}
        for name in self.properties.bl_rna.properties.keys():
            if name != "rna_type" and self.properties.is_property_set(name):
                found[name] = _read_argument(getattr(self.properties, name))
        return found

    def is_pressed(self) -> bool:
        """Return whether a button or key in a window has called the operator, not a script."""
        return not bpy.app.background and self.options.is_invoke


def describe_error(error: BeyondMocapError | OSError) -> BeyondMocapError:
    """Describe an error of the system as one of ours; one of ours stays as it is."""
    if isinstance(error, BeyondMocapError):
        return error
    return InputError(error.filename or "file", str(error.strerror or error), "",
                      "check the path and its permissions")


def _read_argument(value):
    """Read the value of an operator's property in a form that JSON can write."""
    if isinstance(value, bpy.types.bpy_prop_collection):
        return [{"name": row.name} for row in value]
    return value if isinstance(value, (str, int, float, bool)) else list(value)


class ImportOperator(BaseOperator, ImportHelper):
    """An operator that reads files: chosen in the file browser, dropped into a view, or set by a script."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}
    directory: StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"})
    resumes: IntProperty(options={"SKIP_SAVE", "HIDDEN"}, description="Number of the notice that it fixes")

    def invoke(self, context, event):
        """Import dropped files at once; otherwise open the file browser."""
        if self.directory and self.files:
            return self.execute(context)
        return ImportHelper.invoke(self, context, event)

    def list_chosen_files(self) -> list[Path]:
        """List the chosen files; without any, the path in the file browser's name field, if there is one."""
        names = [file.name for file in self.files if file.name]
        if names:
            return [Path(self.directory or Path(self.filepath).parent, name) for name in names]
        return [Path(bpy.path.abspath(self.filepath))] if self.filepath else []

    def find_chosen_file(self, expected: str) -> Path:
        """Return the one chosen file; InputError if there are none or several."""
        chosen = self.list_chosen_files()
        if len(chosen) != 1:
            raise InputError("import", f"{len(chosen)} files" if chosen else "no file given", expected)
        return chosen[0]


class ViewDropHandler:
    """Mix-in of a file handler whose files are dropped into a 3D view."""

    @classmethod
    def poll_drop(cls, context):
        """Return whether a 3D view is under the pointer."""
        return context.area is not None and context.area.type == "VIEW_3D"


class ExportOperator(BaseOperator, ExportHelper):
    """An operator that writes a file in the format of its property `format`."""

    bl_options = {"REGISTER"}
    filename_ext = ""
    check_extension = None

    def invoke(self, context, event):
        """Open the file browser."""
        self.filename_ext = exporters.SUFFIXES[self.format]
        return ExportHelper.invoke(self, context, event)

    def check(self, _context):
        """Give the name in the file browser the file's suffix, so that Blender warns of an existing file."""
        path = Path(self.filepath)
        if not path.name:
            return False
        previous, self.filepath = self.filepath, str(exporters.replace_ending(path, exporters.SUFFIXES[self.format]))
        return self.filepath != previous

    def output_path(self) -> Path:
        """Return the file to write; InputError if none is chosen."""
        if not self.filepath:
            raise InputError("export", "no file given", "a file to write", "choose a file")
        return exporters.replace_ending(Path(bpy.path.abspath(self.filepath)), exporters.SUFFIXES[self.format])


class BackgroundOperator(BaseOperator):
    """An operator in three parts, so that the middle one can run in a thread while the window stays responsive.

    Attributes:
        kind: name of the work.
        left: message after ESC.

    `order(context)` collects plain values from the scene. `run_job(order, progress, cancelled, hurry)`, a static
    function that never uses bpy, computes. `apply(scene, result)` writes the result. Called from a script (`execute`),
    all three run at once; started by a button (`invoke`), the job runs in a thread and ESC cancels it.
    """

    kind = ""
    left = "cancelled, nothing has changed"  # message after ESC

    def do(self, context):
        """Collect the order, work and apply the result in one call."""
        manager = context.window_manager
        manager.progress_begin(0, 100)
        try:
            order = self.order(context)
            callbacks = (lambda done, text: manager.progress_update(int(100 * done)), lambda: False, lambda: False)
            result = self.run_job(order, *callbacks)
        finally:
            manager.progress_end()
        self.apply(context.scene, result)

    def invoke(self, context, _event):
        """Start the thread and poll for its result."""
        if bpy.app.background:
            return self.execute(context)
        return self.start_polling(context) if self.attempt(lambda: self.start(context)) == {"FINISHED"} else {
            "CANCELLED"}

    def start(self, context):
        """Collect the order and start the thread."""
        order, run_job = self.order(context), self.run_job
        self.scene = context.scene.session_uid
        self.job = background.Job(self.kind, lambda *asking: run_job(order, *asking))

    def start_polling(self, context):
        """Start polling."""
        self.clock = window.start_timer(context)
        context.window_manager.modal_handler_add(self)
        self.show(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Poll, pass on all other events, and apply the result when it is ready."""
        if event.type == "ESC" and event.value == "PRESS":
            self.job.cancel()
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        is_done = self.job.poll()
        if not is_done and not self.job.is_stale:
            self.show(context)
            return {"RUNNING_MODAL"}
        self.stop_polling(context)
        scene = next((scene for scene in bpy.data.scenes if scene.session_uid == self.scene), None)
        if background.is_cancelled(self.job) or scene is None:
            self.report({"WARNING"}, f"{self.bl_label}: {self.left}")
            return {"CANCELLED"}
        return self.attempt(lambda: self.finish(scene))

    def finish(self, scene):
        """Raise the thread's error, or apply its result."""
        if self.job.error is not None:
            raise self.job.error
        self.apply(scene, self.job.result)

    def cancel(self, context):
        """Cancel the thread when Blender ends the operator (a file is loaded, the window closes); its result is
        discarded. From an open file browser nothing has begun."""
        if hasattr(self, "job"):
            self.job.cancel()
            self.stop_polling(context)

    def show(self, context):
        """Show the progress in the status bar, at the pointer and in the panel."""
        running = context.window_manager.beyond_mocap_work
        text = self.job.describe_progress()
        running.kind, running.fraction, running.text = self.kind, self.job.fraction, text
        context.window_manager.progress_update(int(100 * self.job.fraction))
        window.show_status(f"{text}   ESC: cancel")
        window.redraw_editors()

    def stop_polling(self, context):
        """Remove the progress display and the timer."""
        context.window_manager.beyond_mocap_work.kind = ""
        window.stop_timer(context, self.clock)
        window.redraw_editors()
