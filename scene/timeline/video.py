"""A reference video or image sequence beside the match, at its own frame rate in any scene.

Blender's movie clip shows one of its frames for each scene frame. A driver on the clip's start frame converts this to
the right rate: at every scene frame it starts the clip so that the required frame is displayed. That is plain data: it
plays in every clip editor, is not rendered, and works in a file without the extension. (A strip of the video sequencer
would be rendered in the scene's place, and one created by a script also plays frame for frame.)
"""

from pathlib import Path

import bpy
from bpy.props import FloatProperty, PointerProperty

from ...beyond_mocap.base.errors import InputError
from ..core.live import Watcher, call_soon
from ..core.measure import frames_per_second

_FRAME_TOLERANCE = 1e-3  # of a video frame: tolerance for a frame that starts exactly here
_CLOCK = {  # the driver's variables and their data paths in a scene
    "fps": "render.fps", "base": "render.fps_base", "first": "beyond_mocap.start_frame",
    "clock": "beyond_mocap.start_time", "begins": "beyond_mocap.video.begins", "rate": "beyond_mocap.video.rate",
}
_mappings: dict[int, tuple] = {}  # the frame mapping for which each scene's clip was last read
_SHOWN = f"floor((clock + (frame - first) * base / fps - begins) * rate + {_FRAME_TOLERANCE})"


def tag_update(group: bpy.types.PropertyGroup, _context=None) -> None:
    """Tag the scene after a changed setting: Blender does not re-evaluate drivers for registered properties."""
    group.id_data.update_tag()


class BeyondMocapVideo(bpy.types.PropertyGroup):
    """The scene's reference video."""

    clip: PointerProperty(name="Video", type=bpy.types.MovieClip, description="Reference video or image sequence")
    begins: FloatProperty(
        name="Begins At", default=0.0, unit="TIME_ABSOLUTE", precision=3, step=4, update=tag_update,
        description="Time on the track's clock at which the video starts; adjust until both show the same moment",
    )
    rate: FloatProperty(name="Frames per Second", default=25.0, min=0.1, max=1000.0, precision=3, update=tag_update,
                        description="Frame rate of the video; known for movie files, not for image sequences")


def load_clip(path: str) -> bpy.types.MovieClip:
    """Load a movie, or the image sequence of a picture.

    Args:
        path: of the movie or the first picture.
    Returns:
        The movie clip.
    Raises:
        InputError: if it cannot be read.
    """
    if not path or not Path(path).is_file():
        raise InputError(path or "video", "no such file", "a movie, or the first image of a sequence")
    known = set(bpy.data.movieclips)
    try:
        clip = bpy.data.movieclips.load(path, check_existing=True)
    except RuntimeError as error:
        raise InputError(path, str(error).strip(), "a movie, or the first image of a sequence") from None
    if clip.frame_duration < 1 or min(clip.size) < 1:
        if clip not in known:
            bpy.data.movieclips.remove(clip)
        raise InputError(path, "contains no image", "a movie that Blender can play, or an image sequence")
    return clip


def show_clip(scene: bpy.types.Scene, clip: bpy.types.MovieClip, rate: float | None = None) -> None:
    """Make a clip the scene's reference video at its own rate; its start stays.

    Args:
        scene: for the video.
        clip: the movie clip.
        rate: frames per second; None: as the movie says, or the scene's rate for an image sequence.
    """
    video = scene.beyond_mocap.video
    remove_video(scene)
    video.clip = clip
    video.rate = rate or clip.fps or frames_per_second(scene)
    scene.active_clip = clip  # Blender evaluates only clips that a scene uses
    add_driver(scene)


def add_driver(scene: bpy.types.Scene) -> None:
    """Create the driver on the scene's clip, in place of an existing one."""
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
    _mappings[scene.session_uid] = _build_mapping(scene)


def remove_video(scene: bpy.types.Scene) -> None:
    """Remove the reference video; the clip stays in the file without driver."""
    clip = scene.beyond_mocap.video.clip
    if clip is None:
        return
    clip.driver_remove("frame_start")
    clip.frame_start = 1
    scene.beyond_mocap.video.clip = None
    if scene.active_clip == clip:
        scene.active_clip = None


def check_mapping(scene: bpy.types.Scene, _depsgraph=None) -> None:
    """Re-read the clip if other frames now belong to the scene frames, since Blender caches images by scene frame.

    A changed frame rate of the scene is detected here too.
    """
    known, mapping = _mappings.get(scene.session_uid), _build_mapping(scene)
    _mappings[scene.session_uid] = mapping
    if known != mapping and None not in (known, mapping):
        call_soon(_reload_clips, 0.0)  # tags set by a handler are lost


def _build_mapping(scene: bpy.types.Scene) -> tuple | None:
    """Collect everything that determines which image belongs to which frame; None without a video."""
    settings = scene.beyond_mocap
    video, fps = settings.video, frames_per_second(scene)
    if video.clip is None:
        return None
    return video.clip.session_uid, settings.start_frame, settings.start_time, fps, video.begins, video.rate


def _reload_clips() -> None:
    """Re-read the clips of all scenes; any write to a clip's path causes that."""
    for scene in bpy.data.scenes:
        if clip := scene.beyond_mocap.video.clip:
            clip.filepath = clip.filepath


WATCHER = Watcher(name="Reference video", changed=check_mapping, ends=_mappings.clear)
