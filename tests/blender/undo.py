"""What undo has to bring back: a list of all that a file holds, to be compared before and after."""

import functools
import zlib

import bpy
import numpy as np

KINDS = ("objects", "armatures", "actions", "meshes", "curves", "materials", "cameras", "lights", "collections",
         "worlds", "texts")
SHARED = {"Beyond Mocap Tip"}  # the shape of bones of all characters: in no scene, and not saved without characters
# every group of properties that the extension hangs on Blender's data has a name that begins so
PROPERTY_PREFIX = "beyond_mocap"


def collect_state():
    """All names of data, our properties everywhere, animation and what is chosen, as plain values."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    return {
        **{kind: sorted({item.name for item in getattr(bpy.data, kind)} - SHARED) for kind in KINDS},
        "animated": sorted((o.name, o.animation_data.action.name) for o in bpy.data.objects if o.animation_data
                           and o.animation_data.action),
        "strips": sorted(strip for thing in bpy.data.objects for strip in iter_strips(thing)),
        "markers": sorted((action.name, marker.name, marker.frame, str(collect_own_properties(marker)))
                          for action in bpy.data.actions for marker in action.pose_markers),
        "drawn": {curve.name: [(*point.co, point.radius) for spline in curve.splines
                               for point in (spline.bezier_points or spline.points)] for curve in bpy.data.curves},
        "keys": {action.name: summarize_keys(action) for action in bpy.data.actions},
        "owned": {f"{kind} {item.name}": found for kind in KINDS for item in getattr(bpy.data, kind)
                  if (found := collect_own_properties(item))}, "camera": scene.camera and scene.camera.name,
        "frames": (scene.frame_start, scene.frame_end, scene.render.fps, scene.frame_current),
        "chosen": (layer.objects.active and layer.objects.active.name,
                   sorted(o.name for o in layer.objects if o.select_get()), bpy.context.mode),
        "settings": to_plain(scene.beyond_mocap), "markers of": to_plain(scene.beyond_mocap_markers),
        "passes": to_plain(scene.beyond_mocap_passes), "match": to_plain(scene.beyond_mocap_match),
        "stream": to_plain(scene.beyond_mocap_stream), "constraints": sorted((o.name, c.name, round(c.influence, 6))
                                                                             for o in bpy.data.objects
                                                                             for c in o.constraints),
        "players": [(p.name, p.tracking_file, p.annotation_file, p.take, p.quality, p.body and name_data(p.body))
                    for p in scene.beyond_mocap.players],
    }


def iter_strips(thing):
    """Every strip of an object's NLA: whose, on which track, name, extent, whether it is muted."""
    for track in thing.animation_data.nla_tracks if thing.animation_data else ():
        for strip in track.strips:
            extent = (strip.frame_start, strip.frame_end, strip.scale)
            yield thing.name, track.name, strip.name, extent, strip.mute, strip.action.name if strip.action else ""


def summarize_keys(action):
    """Number of an action's curves and keys, and a sum over the values of all keys."""
    count, points, check = 0, 0, 0
    for layer in action.layers:
        for strip in layer.strips:
            for bag in strip.channelbags:
                for curve in bag.fcurves:
                    values = np.empty(2 * len(curve.keyframe_points), np.float32)
                    curve.keyframe_points.foreach_get("co", values)
                    count, points, check = count + 1, points + len(values) // 2, zlib.crc32(values.tobytes(), check)
    return count, points, check


def collect_own_properties(item):
    """Our groups of properties on one piece of data, as plain values; empty where nothing is set."""
    groups = ((name, getattr(item, name)) for name in list_own_properties(type(item)))
    found = {name: to_plain(group) for name, group in groups if isinstance(group, bpy.types.PropertyGroup)}
    return {name: value for name, value in found.items() if value}


@functools.cache
def list_own_properties(kind):
    """Names of what the extension hangs on a type of Blender's data."""
    return [known.identifier for known in kind.bl_rna.properties if known.identifier.startswith(PROPERTY_PREFIX)]


def to_plain(group):
    """A group of properties as plain values, groups within it too; data as its name."""
    return {name: as_plain(getattr(group, name)) for name, as_plain in list_fields(type(group))}


@functools.cache
def list_fields(kind):
    """(name, what makes a plain value of it) of every property of a group's type."""
    return [(known.identifier, choose_converter(known)) for known in kind.bl_rna.properties
            if known.identifier not in {"rna_type", "bl_rna"}]


def choose_converter(known):
    """What makes a plain value of a property's value."""
    if known.type == "COLLECTION":
        return lambda value: [to_plain(item) for item in value]
    if known.type == "POINTER":
        return lambda value: value and (to_plain if isinstance(value, bpy.types.PropertyGroup) else name_data)(value)
    if getattr(known, "is_array", False):
        return tuple
    return sorted if known.type == "ENUM" and known.is_enum_flag else lambda value: value


def name_data(data):
    """The name of data that a property points to; in Blender 4.5 only that it points to some, since an undo there can
    let it point to other data that has come to lie at the same place in memory.
    """
    return data.name if bpy.app.version >= (5, 0) else True


def press_operator(operator, **arguments):
    """Run an operator as its button does, with a step for undo."""
    return operator("EXEC_DEFAULT", True, **arguments)


def assert_one_step(operator, **arguments):
    """Pressing the button changes the file, one undo brings it back, one redo does it again."""
    bpy.ops.ed.undo_push(message="before")
    before = collect_state()
    assert press_operator(operator, **arguments) == {"FINISHED"}
    after = collect_state()
    assert after != before
    bpy.ops.ed.undo()
    assert not (found := list_differences(collect_state(), before)), found
    bpy.ops.ed.redo()
    assert not (found := list_differences(collect_state(), after)), found


def list_differences(found, expected):
    """What two states differ in, as (found, expected) by path."""
    return dict(iter_differences(found, expected, ()))


def iter_differences(found, expected, path):
    """(path, (found, expected)) of each value in which two states differ."""
    if not isinstance(expected, dict) or not isinstance(found, dict):
        if found != expected:
            yield "/".join(path), (found, expected)
        return
    for name in sorted({*found, *expected}, key=str):
        yield from iter_differences(found.get(name), expected.get(name), (*path, str(name)))
