"""Render Study Clips: render every clip of a naturalness study under its neutral name."""

import shutil
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ..beyond_mocap.base.errors import InputError, format_count
from ..beyond_mocap.files import atomic, tables
from ..beyond_mocap.files.bvh import bvh
from ..beyond_mocap.study import form, order
from ..scene import study as filming
from .operator_base import BaseOperator

CLIPS = "clips"


class BEYOND_MOCAP_OT_study_render(BaseOperator, bpy.types.Operator):
    """Render every clip of a naturalness study with the same body, floor, light and camera, under its neutral name"""

    bl_idname = "beyond_mocap.study_render"
    bl_label = "Render Study Clips"
    bl_options = {"REGISTER"}
    directory: StringProperty(name="Study", subtype="DIR_PATH", description="Folder with study.json")
    engine: EnumProperty(
        name="Engine", default="AUTO", description="Render engine",
        items=(("AUTO", "EEVEE or Cycles", "EEVEE in a window, Cycles if Blender runs without one"),
               ("EEVEE", "EEVEE", "Fast with a graphics card, very slow without"),
               ("CYCLES", "Cycles", "Slow, works everywhere"), ("WORKBENCH", "Workbench", "Fast and plain")),
    )  # fmt: skip
    width: IntProperty(name="Width", default=960, min=16, max=7680, description="Width of the picture in pixels")
    height: IntProperty(name="Height", default=540, min=16, max=4320, description="Height of the picture in pixels")
    fps: IntProperty(name="Frame Rate", default=30, min=1, max=240, description="Frames per second of all clips")
    samples: IntProperty(name="Samples", default=16, min=1, max=4096, description="Render samples per pixel")
    pictures: BoolProperty(name="Pictures", description="Write numbered PNGs in a folder per clip instead of a movie")
    again: BoolProperty(name="Render Again", description="Render existing clips again")

    def invoke(self, context, _event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def do(self, context):
        """Read all clips, then render those that are missing."""
        if not self.directory:
            raise InputError("study", "no folder given", "the folder with study.json", "choose the folder")
        folder = Path(bpy.path.abspath(self.directory))
        study = order.read_study(folder)
        out = folder / CLIPS
        missing = [clip for clip in study.clips if self.again or not _is_rendered(out, clip.name)]
        sources = [(clip, _read_clip(folder, clip)) for clip in missing]
        size = self.width // 2 * 2, self.height // 2 * 2  # H.264 needs even sizes
        look = filming.RenderLook(filming.find_engine(self.engine), size, self.fps, self.samples, not self.pictures)
        if self.engine == "CYCLES" != look.engine:
            self.report({"WARNING"}, "The Cycles add-on is disabled: EEVEE renders instead")
        out.mkdir(exist_ok=True)
        windows = context.window_manager
        windows.progress_begin(0, max(len(sources), 1))
        try:
            for done, (clip, source) in enumerate(sources):
                windows.progress_update(done)
                self.render_clip(out, clip, source, look)
        finally:
            windows.progress_end()
        rendered = format_count(len(sources), "clip")
        self.report({"INFO"}, f"{out}: {rendered} rendered, {len(study.clips) - len(sources)} existed")

    def render_clip(self, out: Path, clip, source, look) -> None:
        """Render or copy one clip."""
        if isinstance(source, Path):
            with atomic.atomic_path(out / f"{clip.name}{source.suffix.lower()}") as temporary:
                shutil.copyfile(source, temporary)
            return
        target = out / (f"{clip.name}.mp4" if look.movie else clip.name)
        if look.movie or not target.is_dir():
            filming.render_motion(target, *source, look)
            return
        replacement = target.with_name(f".{target.name}.new")
        shutil.rmtree(replacement, ignore_errors=True)  # left by an interrupted run
        filming.render_motion(replacement, *source, look)
        shutil.rmtree(target)
        replacement.rename(target)


def _is_rendered(out: Path, name: str) -> bool:
    """Return whether a clip is rendered, as a movie or as pictures."""
    return form.find_movie(out, name) is not None or any((out / name).glob("*.png"))


def _read_clip(folder: Path, clip):
    """Read a clip: a movie's path, or motion and ball; InputError for other files."""
    path = folder / clip.file
    if path.suffix.lower() in form.MOVIES:
        if not path.is_file():
            raise InputError(path, "no such file", "a movie", "correct the table and create the study again")
        return path
    if path.suffix.lower() != ".bvh":
        raise InputError(path, f"file type {path.suffix}", f"a .bvh file or a movie ({', '.join(form.MOVIES)})",
                         "convert it, or render it yourself")  # fmt: skip
    ball_file = path.with_suffix(".ball.csv")
    return bvh.read_bvh(path).motion, tables.read_ball(ball_file) if ball_file.is_file() else None
