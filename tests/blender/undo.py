"""What undo has to bring back: a list of all that a file holds, to be compared before and after."""

import zlib

import bpy
import numpy as np

KINDS = ("objects", "armatures", "actions", "meshes", "curves", "materials", "cameras", "lights", "collections",
         "worlds", "texts")
OURS = "beyond_mocap"  # every group of properties that the extension hangs on Blender's data has a name that begins so


def state():
    """All names of data, our properties everywhere, animation and what is chosen, as plain values."""
    scene, layer = bpy.context.scene, bpy.context.view_layer
    return {
        **{kind: sorted(item.name for item in getattr(bpy.data, kind)) for kind in KINDS},
        "animated": sorted((o.name, o.animation_data.action.name) for o in bpy.data.objects
                           if o.animation_data and o.animation_data.action),
        "strips": sorted(strip for thing in bpy.data.objects for strip in strips(thing)),
        "markers": sorted((action.name, marker.name, marker.frame, str(ours(marker)))
                          for action in bpy.data.actions for marker in action.pose_markers),
        "drawn": {curve.name: [(*point.co, point.radius) for spline in curve.splines
                               for point in (spline.bezier_points or spline.points)] for curve in bpy.data.curves},
        "keys": {action.name: keys(action) for action in bpy.data.actions},
        "owned": {
            f"{kind} {item.name}": found for kind in KINDS for item in getattr(bpy.data, kind) if (found := ours(item))
        },
        "camera": scene.camera and scene.camera.name,
        "frames": (scene.frame_start, scene.frame_end, scene.render.fps, scene.frame_current),
        "chosen": (layer.objects.active and layer.objects.active.name,
                   sorted(o.name for o in layer.objects if o.select_get()),
                   bpy.context.mode),
        "settings": plain(scene.beyond_mocap),
        "markers of": plain(scene.beyond_mocap_markers),
        "passes": plain(scene.beyond_mocap_passes),
        "stream": plain(scene.beyond_mocap_stream),
        "constraints": sorted((o.name, c.name, round(c.influence, 6)) for o in bpy.data.objects for c in o.constraints),
        "players": [(p.name, p.tracking_file, p.annotation_file, p.take, p.quality, p.body.name if p.body else None)
                    for p in scene.beyond_mocap.players],
    }


def strips(thing):
    """Every strip of an object's NLA: whose, on which track, name, extent, whether it is muted."""
    for track in thing.animation_data.nla_tracks if thing.animation_data else ():
        for strip in track.strips:
            extent = (strip.frame_start, strip.frame_end, strip.scale)
            yield thing.name, track.name, strip.name, extent, strip.mute, strip.action.name if strip.action else ""


def keys(action):
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


def ours(item):
    """Our groups of properties on one piece of data, as plain values; empty where nothing is set."""
    found = {name: plain(getattr(item, name)) for name in dir(item) if name.startswith(OURS)
             and isinstance(getattr(item, name), bpy.types.PropertyGroup)}
    return {name: value for name, value in found.items() if value}


def plain(group):
    """A group of properties as plain values, groups within it too; data as its name."""
    found = {}
    for known in group.bl_rna.properties:
        if known.identifier in {"rna_type", "bl_rna"}:
            continue
        value = getattr(group, known.identifier)
        if known.type == "COLLECTION":
            value = [plain(item) for item in value]
        elif known.type == "POINTER":
            value = value and (plain(value) if isinstance(value, bpy.types.PropertyGroup) else value.name)
        elif getattr(known, "is_array", False):
            value = tuple(value)
        elif known.type == "ENUM" and known.is_enum_flag:
            value = sorted(value)
        found[known.identifier] = value
    return found


def press(operator, **arguments):
    """Run an operator as its button does, with a step for undo."""
    return operator("EXEC_DEFAULT", True, **arguments)


def assert_one_step(operator, **arguments):
    """Pressing the button changes the file, one undo brings it back, one redo does it again."""
    bpy.ops.ed.undo_push(message="before")
    before = state()
    assert press(operator, **arguments) == {"FINISHED"}
    after = state()
    assert after != before
    bpy.ops.ed.undo()
    assert state() == before
    bpy.ops.ed.redo()
    assert state() == after
