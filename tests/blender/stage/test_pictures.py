"""A preview movie and a contact sheet: complete or absent, and the scene as it was."""

import importlib
import threading
import time

import bpy
import numpy as np
import pytest
import worlds
from conftest import EXTENSION
from undo import collect_state


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    return worlds.make_places(tmp_path_factory.mktemp("pictures"))


@pytest.fixture
def scene(places):
    """A clip that moves before the stage's camera."""
    bpy.context.scene.beyond_mocap.library_folder = str(places.clips)
    bpy.ops.beyond_mocap.list_clips()
    bpy.ops.beyond_mocap.import_clip(path="walking_1_2.bvh")
    bpy.ops.beyond_mocap.add_stage()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 6
    camera, body = scene.camera, bpy.context.view_layer.objects["walking_1_2"]
    camera.constraints.clear()
    camera.location = body.location.x + 1.0, body.location.y - 6.0, 1.2
    camera.rotation_euler = 1.5, 0.0, 0.0
    return scene


def load_pixels(path):
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels).reshape(image.size[1], image.size[0], image.channels)
    bpy.data.images.remove(image)
    return pixels


def test_a_contact_sheet_has_its_pictures_side_by_side(scene, tmp_path):
    before = collect_state()
    bpy.ops.beyond_mocap.contact_sheet(filepath=str(tmp_path / "sheet.png"), height=64, count=3, columns=2, samples=1)
    assert collect_state() == before
    pixels = load_pixels(tmp_path / "sheet.png")
    width = 2 * round(64 * scene.render.resolution_x / scene.render.resolution_y / 2)
    assert pixels.shape[:2] == (128, 2 * width)
    first, second, third, empty = (pixels[rows, columns, :3] for rows in (slice(64, 128), slice(0, 64))
                                   for columns in (slice(0, width), slice(width, None)))
    assert (empty == 1.0).all() and all(np.ptp(tile) > 0.2 for tile in (first, second, third))
    assert np.abs(first - second).max() > 0.1  # the body has moved, and the time in the corner is another
    assert [path.name for path in tmp_path.iterdir()] == ["sheet.png"]


def test_a_movie_has_the_frames_of_the_preview_range(scene, tmp_path):
    scene.use_preview_range, scene.frame_preview_start, scene.frame_preview_end = True, 2, 4
    bpy.ops.beyond_mocap.preview_movie(filepath=str(tmp_path / "preview"), height=64, samples=1)
    clip = bpy.data.movieclips.load(str(tmp_path / "preview.mp4"))
    assert clip.frame_duration == 3 and clip.size[1] == 64
    bpy.data.movieclips.remove(clip)
    assert [path.name for path in tmp_path.iterdir()] == ["preview.mp4"]


@pytest.mark.parametrize("name", ["contact_sheet", "preview_movie"])
def test_what_is_missing_is_told_with_a_way_out(scene, tmp_path, name):
    render = getattr(bpy.ops.beyond_mocap, name)
    with pytest.raises(RuntimeError, match="cannot be written"):
        render(filepath=str(tmp_path / "nowhere" / "out"))
    bpy.data.objects.remove(scene.camera)
    with pytest.raises(RuntimeError, match="no camera"):
        render(filepath=str(tmp_path / "out"))
    assert bpy.context.window_manager.beyond_mocap_notices.rows[-1].fixes[0].name == "Add Pitch, Light and Camera"
    bpy.ops.wm.read_homefile(use_empty=True)
    with pytest.raises(RuntimeError, match="nothing moves"):
        render(filepath=str(tmp_path / "out"))
    assert list(tmp_path.iterdir()) == []


def test_cancelled_or_failed_nothing_is_written(scene, tmp_path):
    pictures = importlib.import_module(f"{EXTENSION}.scene.stage.pictures")
    errors = importlib.import_module(f"{EXTENSION}.beyond_mocap.base.errors")
    look = pictures.PictureLook(engine="CYCLES", height=400, samples=4000)
    order = pictures.order_movie(scene, tmp_path / "out.mp4", look)
    stop, seen = threading.Event(), []
    threading.Timer(3.0, stop.set).start()
    started = time.monotonic()
    with pytest.raises(errors.UserCancelledError):
        pictures.render_pictures(order, lambda *told: seen.append(told), stop.is_set)
    assert time.monotonic() - started < 60.0 and list(tmp_path.iterdir()) == [] and not order.folder.exists()
    order = pictures.order_movie(scene, tmp_path / "out.mp4", look)
    order.order["scene"] = "gone"
    with pytest.raises(errors.BeyondMocapError, match="gone"):
        pictures.render_pictures(order, lambda *told: None, lambda: False)
    assert list(tmp_path.iterdir()) == []


def test_what_the_compositor_writes_to_files_is_left_alone(scene, tmp_path):
    """A preview must not replace the passes of a final rendering."""
    passes = tmp_path / "passes"
    passes.mkdir()
    if bpy.app.version >= (5, 0, 0):
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Passes", "CompositorNodeTree")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
    layers, file = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeOutputFile")
    if bpy.app.version >= (5, 0, 0):
        file.directory = str(passes)
        file.file_output_items.new("RGBA", "Image")
    else:
        file.base_path = str(passes)
    tree.links.new(layers.outputs["Image"], file.inputs[0])
    out = tmp_path / "take.v2"
    assert bpy.ops.beyond_mocap.contact_sheet(filepath=str(out), engine="CYCLES", samples=1, height=32, count=1,
                                              columns=1) == {"FINISHED"}
    assert (tmp_path / "take.v2.png").is_file() and not list(passes.iterdir())
