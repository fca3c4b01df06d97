"""Operators that render a preview movie or a contact sheet in the background."""

from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..beyond_mocap.base.errors import InputError
from ..scene import study as filming
from ..scene.core import notices
from ..scene.stage import pictures
from .operator_base import BackgroundOperator

ENGINES = (("AUTO", "Automatic", "EEVEE, or Cycles where Blender has no window"),
           ("EEVEE", "EEVEE", "Quick with a graphics card"),
           ("WORKBENCH", "Workbench", "Quickest, with plain shading"),
           ("CYCLES", "Cycles", "Slow, without a graphics card too"))


class PictureOperator(BackgroundOperator, ExportHelper):
    """Base of operators that render the scene to a file which the user chooses."""

    bl_options = {"REGISTER"}
    kind = "pictures"
    left = "cancelled, nothing is written"
    engine: EnumProperty(name="Engine", items=ENGINES, description="Engine that renders")
    samples: IntProperty(name="Samples", default=16, min=1, max=4096, description="Samples per pixel, except Workbench")
    is_chosen: BoolProperty(options={"HIDDEN", "SKIP_SAVE"}, description="Whether the file is chosen already")

    def invoke(self, context, event):
        """Open the file browser; with the file chosen, start the process."""
        if self.is_chosen and self.filepath:
            return super().invoke(context, event)
        if self.attempt(lambda: pictures.check_scene(context.scene)) == {"CANCELLED"}:
            return {"CANCELLED"}
        return ExportHelper.invoke(self, context, event)

    def execute(self, context):
        """Start the process when a file was chosen in the browser; in a script, wait for it."""
        if not self.is_pressed() or self.is_chosen:
            return super().execute(context)
        arguments = self.read_arguments() | {"filepath": self.filepath, "is_chosen": True}
        notices.find_operator(type(self).bl_idname)("INVOKE_DEFAULT", **arguments)
        return {"FINISHED"}

    def find_output(self) -> Path:
        """Return the file to write; InputError if none is chosen."""
        if not self.filepath:
            raise InputError(self.bl_label, "no file given", f"a {self.filename_ext} file", "choose where to write it")
        return Path(bpy.path.ensure_ext(bpy.path.abspath(self.filepath), self.filename_ext)).absolute()

    def read_look(self) -> "pictures.PictureLook":
        """Read how to render."""
        return pictures.PictureLook(engine=filming.find_engine(self.engine), height=self.height, samples=self.samples)

    @staticmethod
    def run_job(order, progress, cancelled, _hurry):
        """Render in a process of its own."""
        return pictures.render_pictures(order, progress, cancelled)

    def apply(self, _scene, path):
        """Report the file."""
        self.report({"INFO"}, f"Written: {path}")


class BEYOND_MOCAP_OT_preview_movie(PictureOperator, bpy.types.Operator):
    """Render the scene's frames, or its preview range, through the scene's camera to a small MP4; Blender stays free
meanwhile"""

    bl_idname = "beyond_mocap.preview_movie"
    bl_label = "Preview Movie"
    filename_ext = ".mp4"
    filter_glob: StringProperty(default="*.mp4", options={"HIDDEN"})
    height: IntProperty(name="Height", default=540, min=16, max=4320, subtype="PIXEL", description="Height of a frame")

    def order(self, context):
        """Write a copy of the file, and the settings."""
        return pictures.order_movie(context.scene, self.find_output(), self.read_look())


class BEYOND_MOCAP_OT_contact_sheet(PictureOperator, bpy.types.Operator):
    """Render pictures at even times, through the scene's camera, side by side to one PNG; Blender stays free
meanwhile"""

    bl_idname = "beyond_mocap.contact_sheet"
    bl_label = "Contact Sheet"
    filename_ext = ".png"
    filter_glob: StringProperty(default="*.png", options={"HIDDEN"})
    height: IntProperty(name="Height", default=270, min=16, max=2160, subtype="PIXEL",
                        description="Height of a picture")
    count: IntProperty(name="Pictures", default=12, min=1, max=100, description="Number of pictures")
    columns: IntProperty(name="Columns", default=4, min=1, max=20, description="Pictures in a row")

    def order(self, context):
        """Write a copy of the file, the settings and the times."""
        return pictures.order_sheet(context.scene, self.find_output(), self.read_look(), self.count, self.columns)
