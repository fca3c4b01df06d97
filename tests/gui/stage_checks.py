"""The stage in the window: lines that hold at Blender's own clip start, what is made in view, and the stage's views."""

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Euler
from tab import PICTURES, copy_sample, import_module, output, run_operator, wait_until_settled, window

DISTANCES = (1.5, 10.0, 30.0, 60.0, 90.0, 140.0, 200.0)  # metres
BLENDERS_CLIP_START, NO_FLICKER = 0.01, 0.5


def find_view():
    """The 3D view's area, its view and its region."""
    area = window.find_area("VIEW_3D")
    return area, area.spaces.active.region_3d, next(one for one in area.regions if one.type == "WINDOW")


def count_white(clip_start, name):
    """How many pixels of the 3D view are nearly white."""
    area, _, region = find_view()
    area.spaces.active.clip_start = clip_start
    scene, path = window.window.scene, str(PICTURES.resolve() / f"{name}.png")
    scene.render.resolution_x, scene.render.resolution_y, scene.render.filepath = 640, 360, path
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        bpy.ops.render.opengl(write_still=True, view_context=True)
    picture = bpy.data.images.load(path)
    pixels = np.empty(4 * 640 * 360, np.float32)
    picture.pixels.foreach_get(pixels)
    bpy.data.images.remove(picture)
    rgb = pixels.reshape(-1, 4)[:, :3]
    return int(np.sum(rgb.min(axis=1) > 0.45 * rgb.max()))


def check_lines_hold_from_near_to_far():
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 0.5
    run_operator("beyond_mocap.add_stage", "EXEC_DEFAULT")
    area, view, _ = find_view()
    area.spaces.active.overlay.show_overlays = False
    area.spaces.active.clip_end = 1000.0
    view.view_perspective, view.view_location = "PERSP", (0.0, 0.0, 0.0)
    view.view_rotation = Euler((1.05, 0.0, 0.6)).to_quaternion()
    for distance in DISTANCES:
        view.view_distance = distance
        view.update()
        yield 0.2
        expected = count_white(NO_FLICKER, f"lines-{distance:g}-far-clip")
        found = count_white(BLENDERS_CLIP_START, f"lines-{distance:g}")
        output.write_line(f"     lines at {distance:g} m: {found} white pixels, {expected} without flicker")
        assert expected > 50 and abs(found - expected) <= 0.03 * expected, (distance, found, expected)


def check_another_sport_brings_its_ball_and_undo_takes_it_back():
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 0.5
    run_operator("beyond_mocap.add_stage", "EXEC_DEFAULT")
    scene = window.window.scene
    balls = import_module("scene.stage.ball")
    with bpy.context.temp_override(window=window.window):
        balls.create_ball(bpy.context, "Ball", scene.collection)
    bpy.ops.ed.undo_push(message="a ball")
    yield 0.3
    for sport in ("basketball", "ice_hockey"):
        scene.beyond_mocap_stage.sport = sport
        bpy.ops.ed.undo_push(message="sport")
        yield 0.5
    window.save_picture(PICTURES / "puck.png")
    assert scene.objects["Ball"].data.materials[0].name.endswith("ice_hockey")
    run_operator("ed.undo", "EXEC_DEFAULT")
    yield 0.5
    scene = window.window.scene
    assert scene.beyond_mocap_stage.sport == "basketball" and abs(scene.objects["Ball"].dimensions.x - 0.24) < 0.02
    run_operator("ed.undo", "EXEC_DEFAULT")
    yield 0.5
    scene = window.window.scene
    names = [material.name for material in scene.objects["Ball"].data.materials]
    assert scene.beyond_mocap_stage.sport == "football" and names == ["Ball white", "Ball black"]
    assert abs(scene.objects["Ball"].dimensions.x - 0.22) < 0.02


def measure_height(body):
    """The share of the region's height that a body's bones fill, and whether all of them are in the region."""
    _, view, region = find_view()
    body = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    ends = [body.matrix_world @ bone.head for bone in body.pose.bones]
    places = np.array([location_3d_to_region_2d(region, view, end) for end in ends])
    inside = np.all((places > 0.0) & (places < [region.width, region.height]))
    return float(np.ptp(places[:, 1]) / region.height), bool(inside)


def check_an_imported_clip_is_in_view():
    bpy.ops.wm.read_homefile()
    yield 0.5
    run_operator("beyond_mocap.import_clips", "EXEC_DEFAULT",
                 filepath=str(copy_sample() / "library" / "walking_1_2.bvh"))
    yield 0.5
    share, inside = measure_height(bpy.context.view_layer.objects.active)
    window.save_picture(PICTURES / "framed-clip.png")
    output.write_line(f"     an imported body fills {share:.0%} of the view's height")
    assert inside and 0.35 < share < 0.9, (share, inside)


def check_imported_tracks_are_in_view():
    bpy.ops.wm.read_homefile()
    yield 0.5
    run_operator("beyond_mocap.import_tracking", "EXEC_DEFAULT",
                 filepath=str(copy_sample() / "match" / "player1.csv"))
    yield 0.5
    window.save_picture(PICTURES / "framed-track.png")
    _, view, region = find_view()
    dot = window.window.scene.beyond_mocap.players[0].dot
    place = location_3d_to_region_2d(region, view, dot.matrix_world.translation)
    assert 0.2 * region.width < place.x < 0.8 * region.width and 0.2 * region.height < place.y < 0.8 * region.height


def check_a_view_through_a_camera_stays():
    view = find_view()[1]
    window.window.scene.camera = bpy.data.objects.get("Camera")
    view.view_perspective = "CAMERA"
    place = view.view_location.copy()
    run_operator("beyond_mocap.import_clips", "EXEC_DEFAULT",
                 filepath=str(copy_sample() / "library" / "walking_1_2.bvh"))
    yield from wait_until_settled()
    assert view.view_perspective == "CAMERA" and view.view_location == place


def check_every_view_is_looked_through():
    area, view, _ = find_view()
    area.spaces.active.shading.type = "MATERIAL"
    for name in ("FOLLOW", "BROADCAST", "TACTICAL", "GOAL", "EYES"):
        view.view_perspective = "PERSP"
        run_operator("beyond_mocap.stage_view", "EXEC_DEFAULT", view=name)
        yield 1.5
        window.save_picture(PICTURES / f"view-{name.lower()}.png")
        assert view.view_perspective == "CAMERA"
        assert window.window.scene.camera["beyond_mocap_view"] == name
