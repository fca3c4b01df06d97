"""Four cameras on a path: everything is in their frames, what somebody has moved stays, and keys flick through them."""

from importlib import import_module

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from conftest import EXTENSION, SOURCE
from mathutils import Vector
from undo import assert_one_step


@pytest.fixture
def cameras():
    return import_module(f"{EXTENSION}.scene.stage.path_cameras")


def route(cameras, places, frames=None):
    """A body that goes along places (T, 3) m, a frame each."""
    step = np.diff(places, axis=0, append=places[-1:] + (places[-1:] - places[-2:-1]))
    frames = np.arange(1.0, len(places) + 1.0) if frames is None else frames
    return cameras.CameraTargets(places, frames, places, np.unwrap(np.arctan2(step[:, 1], step[:, 0])))


def circle(count=240, radius=4.0, centre=(10.0, -3.0, 0.0)):
    turn = np.linspace(0.0, 2.0 * np.pi, count)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.0 * turn], axis=1) + centre


def hill(count=240):
    x = np.linspace(-9.0, 9.0, count)
    return np.stack([0.6 * x, x, 2.0 - 0.02 * x**2], axis=1)


def seen(camera, places):
    """Where points (N, 3) in Blender's units are in a camera's picture, 0 to 1 from its lower left corner, and how
    far."""
    bpy.context.view_layer.update()
    return np.array([world_to_camera_view(bpy.context.scene, camera, Vector(place)) for place in places.tolist()])


@pytest.mark.parametrize("way", [circle, hill], ids=lambda way: way.__name__)
@pytest.mark.parametrize("scale, size", [(1.0, (1920, 1080)), (0.01, (1080, 1920))])
def test_all_of_the_path_is_in_the_frame_and_fills_it(cameras, way, scale, size):
    scene, places = bpy.context.scene, way()
    scene.unit_settings.scale_length = scale
    scene.render.resolution_x, scene.render.resolution_y = size
    cameras.place_cameras(scene, route(cameras, places))
    for kind in cameras.KINDS[:3]:
        camera = cameras.find_camera(scene, kind)
        picture = seen(camera, np.concatenate([places, places + [0.0, 0.0, 1.9]]) / scale)
        assert (picture[:, :2] > 0.0).all() and (picture[:, :2] < 1.0).all(), kind
        assert np.ptp(picture[:, :2], axis=0).max() > 0.7, (kind, np.ptp(picture, axis=0))
        assert (picture[:, 2] > 0.0).all() and picture[:, 2].max() < camera.data.clip_end


def test_above_is_a_map_and_the_side_shows_the_length(cameras):
    scene = bpy.context.scene
    line = np.stack([np.zeros(50), np.linspace(0.0, 10.0, 50), np.zeros(50)], axis=1)
    cameras.place_cameras(scene, route(cameras, line))
    above, side = (seen(cameras.find_camera(scene, kind), line) for kind in ("ABOVE", "SIDE"))
    assert np.ptp(above[:, 0]) < 1e-4 and above[-1, 1] > above[0, 1]
    assert side[-1, 0] - side[0, 0] > 0.7 and np.ptp(side[:, 1]) < 0.02


def test_the_last_one_follows_and_looks_along_the_way(cameras):
    scene, places = bpy.context.scene, circle()
    cameras.place_cameras(scene, route(cameras, places))
    camera = cameras.find_camera(scene, "BEHIND")
    for frame in (60, 120, 180):
        scene.frame_set(frame)
        place = places[frame - 1]
        picture = seen(camera, np.array([place, place + [0.0, 0.0, 1.8]]))
        assert (
            (np.abs(picture[:, 0] - 0.5) < 0.2).all() and (picture[:, 1] > 0.02).all() and (picture[:, 1] < 0.98).all()
        )
        ahead = np.array(places[frame] - place) / np.linalg.norm(places[frame] - place)
        assert np.dot(place - np.array(camera.matrix_world.translation), ahead) > 3.0


def test_the_focus_is_smooth_but_goes_along_where_a_motion_starts_again(cameras):
    corner = np.concatenate([np.linspace((0, 0, 0), (5, 0, 0), 100), np.linspace((5, 0, 0), (5, 5, 0), 100)[1:]])
    twice = np.concatenate([corner, corner])
    place, turn = cameras.smooth_focus(route(cameras, twice), 25.0)
    once, turned = cameras.smooth_focus(route(cameras, corner), 25.0)
    assert np.abs(np.diff(turned)).max() < 0.1 and abs(turned[-1] - np.pi / 2) < 0.05
    assert np.allclose(place, np.concatenate([once, once])) and np.abs(once - corner).max() < 0.2


def test_again_only_those_are_laid_that_nobody_has_touched(cameras):
    scene = bpy.context.scene
    cameras.place_cameras(scene, route(cameras, circle()))
    names = {kind: cameras.find_camera(scene, kind).name for kind in cameras.KINDS}
    cameras.find_camera(scene, "SIDE").location.x += 0.5
    cameras.find_camera(scene, "BEHIND").data.lens = 80.0
    bpy.data.objects.remove(cameras.find_camera(scene, "QUARTER"))
    before = {kind: cameras.find_camera(scene, kind).matrix_basis.copy() for kind in ("ABOVE", "SIDE", "BEHIND")}
    kept = cameras.place_cameras(scene, route(cameras, circle(centre=(-20.0, 0.0, 0.0))))
    assert kept == [names["SIDE"], names["BEHIND"]]
    assert {kind: cameras.find_camera(scene, kind).matrix_basis == before[kind] for kind in before} == {
        "ABOVE": False, "SIDE": True, "BEHIND": True}
    assert cameras.find_camera(scene, "QUARTER") is not None
    scene.frame_set(30)
    bpy.context.view_layer.update()
    assert (
        cameras.find_camera(scene, "BEHIND").matrix_world.translation.x < -10.0
    ), "the focus runs along the new path all the same"
    assert len([c for c in bpy.data.collections if c.get(cameras.MARK)]) == 1 and len(scene.objects) == 5


def test_keys_of_somebody_else_on_the_focus_stay(cameras):
    scene = bpy.context.scene
    cameras.place_cameras(scene, route(cameras, circle()))
    focus = cameras.find_camera(scene, "BEHIND").parent
    focus.animation_data.action = None
    focus.keyframe_insert("location", frame=1)
    own = focus.animation_data.action
    cameras.place_cameras(scene, route(cameras, hill()))
    assert focus.animation_data.action == own


def test_laid_twice_leaves_one_action(cameras):
    for _ in range(3):
        cameras.place_cameras(bpy.context.scene, route(cameras, circle()))
    assert len(bpy.data.actions) == 1 and len(bpy.data.cameras) == 4


def test_a_way_that_is_one_point_and_one_that_is_vertical_have_their_cameras(cameras):
    for places in (np.zeros((3, 3)), np.stack([np.zeros(9), np.zeros(9), np.linspace(0.0, 3.0, 9)], axis=1)):
        cameras.place_cameras(
            bpy.context.scene, cameras.CameraTargets(places, np.arange(len(places)) + 1.0, places,
                                                     np.zeros(len(places)))
        )
        for kind in cameras.KINDS:
            assert np.isfinite(cameras.find_camera(bpy.context.scene, kind).matrix_world).all()


def test_flicking_goes_through_all_four(cameras):
    scene = bpy.context.scene
    with pytest.raises(RuntimeError, match="Path Cameras"):
        bpy.ops.beyond_mocap.path_camera()
    cameras.place_cameras(scene, route(cameras, circle()))
    looked = []
    for _ in range(5):
        assert bpy.ops.beyond_mocap.path_camera() == {"FINISHED"}
        looked.append(scene.camera.get(cameras.MARK))
    assert looked == [*cameras.KINDS, "ABOVE"]
    bpy.ops.beyond_mocap.path_camera(which="QUARTER")
    assert scene.camera == cameras.find_camera(scene, "QUARTER")
    bpy.data.objects.remove(cameras.find_camera(scene, "SIDE"))
    with pytest.raises(RuntimeError, match="no camera Path Side"):
        bpy.ops.beyond_mocap.path_camera(which="SIDE")


def test_the_scene_s_own_camera_comes_back(cameras):
    scene, own = bpy.context.scene, bpy.data.objects.new("Own", bpy.data.cameras.new("Own"))
    scene.collection.objects.link(own)
    cameras.place_cameras(scene, route(cameras, circle()))
    bpy.ops.beyond_mocap.path_camera(which="FREE")
    assert scene.camera is None
    scene.camera = own
    for which in ("ABOVE", "SIDE"):
        bpy.ops.beyond_mocap.path_camera(which=which)
    bpy.ops.beyond_mocap.path_camera(which="FREE")
    assert scene.camera == own
    bpy.ops.beyond_mocap.path_camera(which="SIDE")
    bpy.data.objects.remove(own)
    bpy.ops.beyond_mocap.path_camera(which="FREE")
    assert scene.camera == cameras.find_camera(scene, "SIDE")


def test_all_riders_are_in_view_and_the_active_one_is_followed(cameras):
    """Two walks, on curves of their own, ten metres apart."""
    scene, clip = bpy.context.scene, str(SOURCE / "sample_blend" / "library" / "walking_1_2.bvh")
    bodies = []
    for number in range(2):
        bpy.ops.beyond_mocap.import_clips(filepath=clip)
        bodies.append(bpy.context.object)
        bpy.ops.beyond_mocap.edit_path()
        bpy.context.object.location.y = 10.0 * number
        bpy.ops.beyond_mocap.update_path()
    bpy.context.view_layer.objects.active = bodies[1]
    bodies[1].select_set(True)
    assert_one_step(bpy.ops.beyond_mocap.path_cameras)
    scene = bpy.context.scene
    ends = np.array([(0.0, 0.0, 0.0), (6.0, 0.0, 0.0), (0.0, 10.0, 0.0), (6.0, 10.0, 1.8)])
    for kind in cameras.KINDS[:3]:
        picture = seen(cameras.find_camera(scene, kind), ends)
        assert (picture[:, :2] > 0.0).all() and (picture[:, :2] < 1.0).all(), kind
    scene.frame_set(scene.frame_start + 60)
    assert abs(cameras.find_camera(scene, "BEHIND").matrix_world.translation.y - 10.0) < 1.0


def test_looking_from_behind_goes_along_with_a_path_that_was_bent(cameras):
    clip = str(SOURCE / "sample_blend" / "library" / "walking_1_2.bvh")
    bpy.ops.beyond_mocap.import_clips(filepath=clip)
    bpy.ops.beyond_mocap.edit_path()
    bpy.ops.beyond_mocap.path_cameras()
    bpy.context.object.location.y += 5.0
    bpy.ops.beyond_mocap.update_path()
    bpy.ops.beyond_mocap.path_camera(which="BEHIND")
    bpy.context.scene.frame_set(40)
    assert abs(bpy.context.scene.camera.matrix_world.translation.y - 5.0) < 1.0
