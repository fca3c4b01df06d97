"""A reference video or image sequence beside the match, at its own rate whatever the scene's.

Blender's movie clip shows one of its frames for each of the scene's. A driver on the clip's start frame turns this into
the right rate: on every frame it starts the clip where the frame wanted there is just due. That is plain data: it plays
in every clip editor and renders nothing, and a file without the extension keeps the picture. (A strip of the video
sequencer would be rendered in the scene's place, and one made by a script plays frame for frame too.)
"""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import FloatProperty, PointerProperty

from ...beyond_mocap.base.errors import InputError
from ..core.live import Watcher, soon
from ..core.measure import frames_per_second

_EARLY = 1e-3  # of a video frame: one that begins just here is shown
_CLOCK = {  # the driver's variables and where they are in a scene
    "fps": "render.fps", "base": "render.fps_base", "first": "beyond_mocap.start_frame",
    "clock": "beyond_mocap.start_time", "begins": "beyond_mocap.video.begins", "rate": "beyond_mocap.video.rate",
}
_mappings: dict[int, tuple] = {}  # what each scene's clip was last read for
_SHOWN = f"floor((clock + (frame - first) * base / fps - begins) * rate + {_EARLY})"


def renew(group: bpy.types.PropertyGroup, _context=None) -> None:
    """Let the driver see a changed setting: Blender does not evaluate a scene anew for a registered property."""
    group.id_data.update_tag()


class BeyondMocapVideo(bpy.types.PropertyGroup):
    """The scene's reference video."""

    clip: PointerProperty(name="Video", type=bpy.types.MovieClip, description="Reference video or image sequence")
    begins: FloatProperty(
        name="Begins At", default=0.0, unit="TIME_ABSOLUTE", precision=3, step=4, update=renew,
        description="Second on the track's clock at which the video begins; drag or type until both show the same",
    )
    rate: FloatProperty(name="Frames per Second", default=25.0, min=0.1, max=1000.0, precision=3, update=renew,
                        description="Of the video; a movie file says it itself, an image sequence does not")


def load(path: str) -> bpy.types.MovieClip:
    """The movie, or the image sequence that a picture belongs to; InputError where it cannot be read."""
    if not path or not Path(path).is_file():
        raise InputError(path or "video", "no such file", "a movie, or the first picture of a sequence")
    known = set(bpy.data.movieclips)
    try:
        clip = bpy.data.movieclips.load(path, check_existing=True)
    except RuntimeError as error:
        raise InputError(path, str(error).strip(), "a movie, or the first picture of a sequence") from None
    if clip.frame_duration < 1 or min(clip.size) < 1:
        if clip not in known:
            bpy.data.movieclips.remove(clip)
        raise InputError(path, "no picture in it", "a movie that Blender can play, or a sequence of pictures")
    return clip


def show(scene: bpy.types.Scene, clip: bpy.types.MovieClip, rate: float | None = None) -> None:
    """Let `clip` be the scene's reference video, driven at its rate; where it begins stays as it is.

    rate: frames per second, None for what a movie says, and for an image sequence the scene's own rate."""
    video = scene.beyond_mocap.video
    release(scene)
    video.clip = clip
    video.rate = rate or clip.fps or frames_per_second(scene)
    scene.active_clip = clip  # what no scene knows is not evaluated
    drive(scene)


def drive(scene: bpy.types.Scene) -> None:
    """Put the driver on the scene's clip, in place of one that is there."""
    clip = scene.beyond_mocap.video.clip
    clip.driver_remove("frame_start")
    driver = clip.driver_add("frame_start").driver
    driver.type = "SCRIPTED"
    for name, path in _CLOCK.items():
        variable = driver.variables.new()
        variable.name = name
        variable.targets[0].id_type = "SCENE"
        variable.targets[0].id = scene
        variable.targets[0].data_path = path
    driver.expression = f"floor(frame) - {_SHOWN}"
    _mappings[scene.session_uid] = _mapping(scene)


def release(scene: bpy.types.Scene) -> None:
    """No reference video any more; the clip stays in the file, undriven."""
    clip = scene.beyond_mocap.video.clip
    if clip is None:
        return
    clip.driver_remove("frame_start")
    clip.frame_start = 1
    scene.beyond_mocap.video.clip = None
    if scene.active_clip == clip:
        scene.active_clip = None


def watch(scene: bpy.types.Scene, _depsgraph=None) -> None:
    """See to it that the clip is read anew where another of its frames now belongs to a scene frame: Blender keeps
    pictures by the scene's frame. A changed scene rate comes by here too."""
    known, mapping = _mappings.get(scene.session_uid), _mapping(scene)
    _mappings[scene.session_uid] = mapping
    if known != mapping and None not in (known, mapping):
        soon(_reread, 0.0)  # what a handler tags is forgotten


def _mapping(scene: bpy.types.Scene) -> tuple | None:
    """All that decides which picture belongs to which frame; None without a video."""
    settings = scene.beyond_mocap
    video, fps = settings.video, frames_per_second(scene)
    if video.clip is None:
        return None
    return video.clip.session_uid, settings.start_frame, settings.start_time, fps, video.begins, video.rate


def _reread() -> None:
    """Let all scenes' clips be read anew; any writing of a clip's path brings that about."""
    for scene in bpy.data.scenes:
        if clip := scene.beyond_mocap.video.clip:
            clip.filepath = clip.filepath


WATCHER = Watcher(name="Reference video", changed=watch, ends=_mappings.clear)
