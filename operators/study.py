"""Render Study Clips: every clip of a naturalness study by itself, under its neutral name."""

from __future__ import annotations

import shutil
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.files.bvh import bvh
from ..beyond_mocap.files.tables import read_ball
from ..beyond_mocap.files.whole import beside
from ..beyond_mocap.study.form import MOVIES, clip_source
from ..beyond_mocap.study.order import read_study
from ..scene import study as filming
from .verb import Verb

CLIPS = "clips"


class BEYOND_MOCAP_OT_study_render(Verb, bpy.types.Operator):
    """Render every clip of a naturalness study by itself: the same grey body, floor, light and distance of the camera,
under the neutral names of study.json. Movies are copied. Clips that are there already are left"""

    bl_idname = "beyond_mocap.study_render"
    bl_label = "Render Study Clips"
    bl_options = {"REGISTER"}
    directory: StringProperty(name="Study", subtype="DIR_PATH", description="Folder with study.json")
    engine: EnumProperty(
        name="Engine", default="AUTO", description="What renders",
        items=(("AUTO", "EEVEE or Cycles", "EEVEE in a window, Cycles where Blender runs without one"),
               ("EEVEE", "EEVEE", "Fast with a graphics card, very slow without"),
               ("CYCLES", "Cycles", "Works everywhere, slowly"), ("WORKBENCH", "Workbench", "Fast and plain")),
    )  # fmt: skip
    width: IntProperty(name="Width", default=960, min=16, max=7680, description="Pixels of the picture")
    height: IntProperty(name="Height", default=540, min=16, max=4320, description="Pixels of the picture")
    fps: IntProperty(name="Frame Rate", default=30, min=1, max=240, description="Frames a second, of all clips")
    samples: IntProperty(name="Samples", default=16, min=1, max=4096, description="Of a pixel")
    pictures: BoolProperty(name="Pictures", description="A folder of numbered PNGs for each clip instead of a movie")
    again: BoolProperty(name="Again", description="Also clips that are there already")

    def invoke(self, context, _event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def do(self, context):
        """All clips, read before the first is rendered."""
        if not self.directory:
            raise InputError("study", "no folder given", "the folder with study.json", "choose it")
        folder = Path(bpy.path.abspath(self.directory))
        study = read_study(folder)
        out = folder / CLIPS
        wanted = [clip for clip in study.clips if self.again or not _there(out, clip.name)]
        sources = [(clip, _read(folder, clip)) for clip in wanted]
        size = self.width // 2 * 2, self.height // 2 * 2  # of pixels in H.264
        look = filming.Look(filming.engine_here(self.engine), size, self.fps, self.samples, not self.pictures)
        if self.engine == "CYCLES" != look.engine:
            self.report({"WARNING"}, "The Cycles add-on is off: EEVEE renders instead")
        out.mkdir(exist_ok=True)
        windows = context.window_manager
        windows.progress_begin(0, max(len(sources), 1))
        try:
            for done, (clip, source) in enumerate(sources):
                windows.progress_update(done)
                self.one(out, clip, source, look)
        finally:
            windows.progress_end()
        self.report({"INFO"}, f"{out}: {len(sources)} clips rendered, {len(study.clips) - len(sources)} were there")

    def one(self, out: Path, clip, source, look) -> None:
        """One clip, rendered or copied."""
        if isinstance(source, Path):
            with beside(out / f"{clip.name}{source.suffix.lower()}") as part:
                shutil.copyfile(source, part)
            return
        target = out / (f"{clip.name}.mp4" if look.movie else clip.name)
        if look.movie or not target.is_dir():
            filming.film(target, *source, look)
            return
        anew = target.with_name(f".{target.name}.anew")
        shutil.rmtree(anew, ignore_errors=True)  # of a run that was killed
        filming.film(anew, *source, look)
        shutil.rmtree(target)
        anew.rename(target)


def _there(out: Path, name: str) -> bool:
    """Whether a clip has been rendered, as a movie or as pictures."""
    return clip_source(out, name) is not None or any((out / name).glob("*.png"))


def _read(folder: Path, clip):
    """A movie's path, or the motion and ball of a clip; InputError where it is neither."""
    path = folder / clip.file
    if path.suffix.lower() in MOVIES:
        if not path.is_file():
            raise InputError(path, "no such file", "a movie", "correct the table and make the study again")
        return path
    if path.suffix.lower() != ".bvh":
        raise InputError(path, f"a file ending in {path.suffix}", f"a .bvh file or a movie ({', '.join(MOVIES)})",
                         "convert it, or render it yourself")  # fmt: skip
    beside_it = path.with_suffix(".ball.csv")
    return bvh.read(path).motion, read_ball(beside_it) if beside_it.is_file() else None
