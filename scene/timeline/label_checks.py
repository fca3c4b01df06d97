"""Problems of a timeline's labels, as lines for the panel and the dialog, before anything is synthesized."""

from functools import lru_cache

import bpy

from ...beyond_mocap import annotation
from ...beyond_mocap.base.errors import InputError
from ..core import session
from ..core.settings import to_absolute_path
from . import label_tracks as lanes
from . import strips
from .strip_lines import CACHE_SIZE, read_key_moment, read_span, remove_name_suffix


class BeyondMocapProblem(bpy.types.PropertyGroup):
    """One problem, and where it is."""

    line: bpy.props.StringProperty(name="Line", description="What is wrong, and what to do")
    frame: bpy.props.IntProperty(name="Frame", description="The frame of the problem")
    target: bpy.props.StringProperty(name="Object", description="The object whose strips these are")


class BeyondMocapProblems(bpy.types.PropertyGroup):
    """Problems of labels; on the window manager, since they follow from the strips and are no data."""

    attached_to = ("WindowManager.beyond_mocap_problems",)
    lines: bpy.props.CollectionProperty(name="Problems", type=BeyondMocapProblem,
                                        description="All problems found when the labels last changed")


def find_built_library(scene: bpy.types.Scene):
    """Find the library that this session has built from the scene's folder, or None."""
    settings = scene.beyond_mocap
    folder = to_absolute_path(settings.library_folder)
    return session.find_library(folder, settings.library_unit or None) if folder else None


def describe_problems(scene: bpy.types.Scene, item: "annotation.Span | annotation.KeyMoment",
                      for_player: bool = True) -> list[str]:
    """Describe what is wrong with one span or key moment.

    Words out of the vocabulary, and labels of key moments that the built library lacks, with the nearest that it has.

    Args:
        scene: for the library.
        item: a span or key moment.
        for_player: of a player; the labels of a clip need not be in the library.
    Returns:
        One line for each problem.
    """
    library = find_built_library(scene)
    unknown = _list_unknown_words(item, library.labels if library else frozenset())
    if for_player and library is not None and isinstance(item, annotation.KeyMoment) and not unknown:
        return _describe_missing(scene, annotation.Timeline((), (item,)), library)
    return list(unknown)


def list_problems(scene: bpy.types.Scene, target: bpy.types.Object) -> list[tuple[int, str]]:
    """List (frame, line) for all problems of an object's strips, by time."""
    found, timeline, for_player = [], [], bool(target.beyond_mocap_dot.player)
    clock, where = lanes.read_clock(target), strips.describe_target(target)
    for track, strip in lanes.iter_strips(target):
        if strip.mute or track.mute:
            continue
        if strip.action.beyond_mocap.kind != "moments":
            found += _read_item(timeline, strip.name, strip.frame_start, lambda: read_span(strip, clock, where))
        for marker in strip.action.pose_markers:
            if lanes.is_marker_visible(strip, marker):
                frame = lanes.compute_marker_frame(strip, marker)
                found += _read_item(timeline, marker.name, frame, lambda: read_key_moment(marker, frame, clock, where))
    for frame, item in timeline:
        found += [(frame, line) for line in describe_problems(scene, item, for_player)]
    if for_player:  # labels of a clip may overlap: a kick within a run
        found += _list_conflicts(target, [item for _, item in timeline])
    return sorted(found)


def update_problems(context: bpy.types.Context) -> None:
    """Update the problems of all timelines of the scene for the panel, which only shows them."""
    global _known
    _known = _library_of(context.scene)
    found = [(target.name, *line) for target in context.scene.objects if lanes.has_label_tracks(target)
             for line in list_problems(context.scene, target)]
    stored = context.window_manager.beyond_mocap_problems.lines
    if [(row.target, row.frame, row.line) for row in stored] == found:
        return
    stored.clear()
    for target, frame, line in found:
        row = stored.add()
        row.target, row.frame, row.line = target, frame, line


@lru_cache(maxsize=CACHE_SIZE)
def _list_unknown_words(item: "annotation.Span | annotation.KeyMoment", words: frozenset[str]) -> tuple[str, ...]:
    """List the words that are not in the vocabulary; words: the library's own."""
    timeline = annotation.Timeline((item,)) if isinstance(item, annotation.Span) else annotation.Timeline((), (item,))
    return tuple(str(error).removeprefix(f"{error.where}: ") for error in annotation.find_problems(timeline, words))


def _read_item(timeline: list, name: str, frame: float, read) -> list[tuple[int, str]]:
    """Add the item of a strip or marker to `timeline`; return a line if its name cannot be read."""
    try:
        timeline.append((round(frame), read()))
        return []
    except InputError:
        return [(round(frame), f"'{remove_name_suffix(name)}': labels have no numbers and no '#'; rename it")]


def is_out_of_date(scene: bpy.types.Scene) -> bool:
    """Return whether another library has been chosen or built since the problems were listed."""
    return _known != _library_of(scene)


def _library_of(scene: bpy.types.Scene) -> tuple:
    settings = scene.beyond_mocap
    return settings.library_folder, settings.library_holds, settings.mirror, settings.made


_known: tuple = ()


def _list_conflicts(target: bpy.types.Object, items: list) -> list[tuple[int, str]]:
    """List spans that overlap and key moments at the same time."""
    timeline = annotation.Timeline(tuple(item for item in items if isinstance(item, annotation.Span) and item.words),
                        tuple(item for item in items if isinstance(item, annotation.KeyMoment)))
    clock, found = lanes.read_clock(target), []
    for a, b in zip(timeline.spans, timeline.spans[1:]):
        if b.start < a.end - 1e-6:
            both = f"'{' '.join(a.words)}' and '{' '.join(b.words)}'"
            found.append((clock.to_whole_frame(b.start), f"{both} overlap; shorten one"))
    for a, b in zip(timeline.keys, timeline.keys[1:]):
        if b.time - a.time <= 1e-6:
            found.append((clock.to_whole_frame(b.time),
                          f"'{' '.join(a.words)}' and '{' '.join(b.words)}' are at the same time"))
    return found


def _describe_missing(scene: bpy.types.Scene, timeline: "annotation.Timeline", library) -> list[str]:
    """Find the nearest labels of the library for key moments that it lacks."""
    from ...beyond_mocap.library.missing_actions import list_action_labels

    mirror, has_synthetic = scene.beyond_mocap.mirror, scene.beyond_mocap.made
    choices = [key.labels for key in library.keys if mirror or not library.clips[key.clip].mirrored]
    choices += list_action_labels() if has_synthetic else ()
    lines = []
    for key, nearest in annotation.find_missing_keys(timeline, choices):
        nearest_text = ", ".join(f"'{' '.join(words)}'" for words in nearest)
        lines.append(f"the library has no '{' '.join(key.words)}'; nearest: {nearest_text or 'nothing'}")
    return lines
