"""Files in which every operator can be tried: how far a user has come, and what can then be wrong with the scene."""

import importlib
import os
import pathlib
import shutil
import tempfile
from typing import NamedTuple

import bpy
import numpy as np
import sample_rigs as rigs
from conftest import EXTENSION

SAMPLE = pathlib.Path(__file__).resolve().parents[2] / "sample_blend" / "library"
CLIPS = ("standing_1", "walking_1_2", "walk_jog_walk", "jogging_2_9", "jogging_turn_left", "running_4_2",
         "kick_low_inside",
         "receive_foot", "dribble_jogging")
_markers = tempfile.TemporaryDirectory(prefix="beyond-mocap-markers-")
MARKERS = pathlib.Path(os.environ.get("TESTS_CACHE") or _markers.name, "markers")
CACHE = ".beyond_mocap"
PICTURE = "video_0001.png"
FOREIGN = "foreign.blend"


class Places(NamedTuple):
    """Folders of one round: where the clips are, where the tracks, a folder to write to, and one that cannot exist."""

    clips: pathlib.Path
    match: pathlib.Path
    out: pathlib.Path
    nowhere: pathlib.Path


def make_places(top):
    """The folders, filled."""
    places = Places(*(top / name for name in ("clips", "match", "out")), top / "match" / "player1.csv" / "nowhere")
    for folder in places[:3]:
        folder.mkdir()
    for name in CLIPS:
        for suffix in (".bvh", ".txt"):
            shutil.copy(SAMPLE / f"{name}{suffix}", places.clips)
    time = np.arange(0.0, 4.01, 0.1)
    for number, speed in enumerate((2.0, 1.3), 1):
        x, y = speed * time, 0.3 * number * np.sin(time)
        lines = ["time_s,x_m,y_m,ball_x_m,ball_y_m,ball_z_m"]
        lines += [f"{t:.1f},{a:.3f},{b:.3f},{a + 0.6:.3f},{b:.3f},0.11" for t, a, b in zip(time, x, y)]
        (places.match / f"player{number}.csv").write_text("\n".join(lines) + "\n")
    (places.match / "player1.txt").write_text("0.5 1.5 walking\n2.4 kick right running low inside\n")
    write_synthetic_markers()
    for name in ("walk", "static"):
        shutil.copy(MARKERS / f"{name}.trc", places.match)
    picture = bpy.data.images.new("Picture", 16, 9)
    picture.filepath_raw, picture.file_format = str(places.match / PICTURE), "PNG"
    picture.save()
    return places


def restore_folder(folder, untouched):
    """Give a library's folder its own files again and no others, as in its copy. What the operator before has left
    there would make another library of it, for which all work is done again. Its cache, whose files are in use, stays
    where it is one."""
    cache = folder / CACHE
    if cache.is_dir() and _stamp_files(folder) == _stamp_files(untouched):
        return
    for path in folder.iterdir():
        if path.is_file():
            path.unlink()
        elif path != cache:
            shutil.rmtree(path)
    kept = shutil.ignore_patterns(CACHE) if cache.is_dir() else None
    shutil.copytree(untouched, folder, ignore=kept, dirs_exist_ok=True)


def _stamp_files(folder):
    """Name, size and time of all in a folder but its cache."""
    found = [path for path in folder.iterdir() if path.name != CACHE]
    return {(path.name, path.stat().st_size, path.stat().st_mtime_ns) for path in found}


def write_synthetic_markers():
    """walk.trc, throw.trc and, last, static.trc below MARKERS, which the runs of `make test` share: markers on a made
    walk of half a second, around the release of a throw, and on the walker standing."""
    if (MARKERS / "static.trc").exists():
        return
    MARKERS.mkdir(parents=True, exist_ok=True)
    core = f"{EXTENSION}.beyond_mocap"
    gait = importlib.import_module(f"{core}.synthetic.gait").build_gait(1.4, 0.6, fps=100.0)
    known = importlib.import_module(f"{core}.synthetic.ground_truth.synthetic_markers").build_trial(
        gait, "plug_in_gait", seed=3, occlusion=0.02, swaps=0, jumps=0, unlabeled=1
    )
    write = importlib.import_module(f"{core}.markers.files.trc").write_trc
    write(known.trial, MARKERS / "walk.trc")
    made = importlib.import_module(f"{core}.synthetic.throws").build_throw((12.0, 0.0, 1.0), 20.0, fps=100.0)
    thrown = importlib.import_module(f"{core}.synthetic.ground_truth.synthetic_markers").build_trial(
        made.motion, "plug_in_gait", seed=3, occlusion=0.0, swaps=0, jumps=0, unlabeled=0)
    release = int(100 * made.release)
    write(thrown.trial.select_frames(release - 60, release + 30), MARKERS / "throw.trc")
    write(known.static.select_frames(0, 40), MARKERS / "static.trc")


# How far a user has come; each begins where the one before it ends.


def import_tracking(places):
    """A library's folder is chosen and two players are in the list."""
    bpy.context.scene.beyond_mocap.library_folder = str(places.clips)
    files = [{"name": "player1.csv"}, {"name": "player2.csv"}]
    bpy.ops.beyond_mocap.import_tracking(directory=str(places.match), files=files)


def synthesize_players(places):
    """Both have a take, shown as a preview."""
    bpy.ops.beyond_mocap.build_library()
    bpy.ops.beyond_mocap.synthesize()


def accept_results(places):
    """Both have a body that moves; the first one's is the active object, and another file has it too."""
    bpy.ops.beyond_mocap.accept()
    body = bpy.context.scene.beyond_mocap.players[0].body
    bpy.data.libraries.write(str(places.out / FOREIGN), {body})
    select_objects(body)


def add_rig(places):
    """Somebody's own rig stands beside, chosen and mapped."""
    settings = bpy.context.scene.beyond_mocap
    body = settings.players[0].body
    settings.rig.target = rigs.create_mixamo()
    bpy.ops.beyond_mocap.map_bones()
    select_objects(body)


def add_video(places):
    """A reference video runs beside."""
    bpy.ops.beyond_mocap.load_video(filepath=str(places.match / PICTURE))


def open_clip(places):
    """A clip of the library is open for annotation."""
    bpy.ops.beyond_mocap.list_clips()
    bpy.ops.beyond_mocap.annotate_clip()


STAGES = {"imported": import_tracking, "synthesized": synthesize_players, "accepted": accept_results, "rig": add_rig,
          "video": add_video, "clip": open_clip}


def select_objects(*things):
    """Select these and nothing else; the last one is active."""
    for thing in bpy.context.view_layer.objects:
        thing.select_set(False)
    for thing in things:
        thing.select_set(True)
    bpy.context.view_layer.objects.active = things[-1] if things else None


# What can be wrong. Each changes the scene, or the arguments of the call, which it gets and gives back.


def nothing_selected(places, arguments):
    select_objects()
    return arguments


def a_camera_selected(places, arguments):
    camera = bpy.data.objects.new("Wrong", bpy.data.cameras.new("Wrong"))
    bpy.context.scene.collection.objects.link(camera)
    select_objects(camera)
    return arguments


def _link_foreign(places):
    """A player's body, linked from another file."""
    with bpy.data.libraries.load(str(places.out / FOREIGN), link=True) as (there, wanted):
        wanted.objects = [name for name in there.objects if name == "player1"]
    linked, = wanted.objects
    bpy.context.scene.collection.objects.link(linked)
    return linked


def add_bones(body, bones):
    """Bones with these names and parents, one above the other, and a key so that the armature moves."""
    select_objects(body)
    bpy.ops.object.mode_set(mode="EDIT")
    for height, (name, parent) in enumerate(bones.items()):
        bone = body.data.edit_bones.new(name)
        bone.head, bone.tail = (0, 0, height), (0, 0, height + 1)
        bone.parent = body.data.edit_bones[parent] if parent else None
    bpy.ops.object.mode_set(mode="OBJECT")
    body.pose.bones[0].keyframe_insert("location", frame=1)


def _set_player_body(body):
    """Make it the active object and the active player's body."""
    select_objects(body)
    settings = bpy.context.scene.beyond_mocap
    if len(settings.players):
        settings.players[settings.active_player].body = body


def a_linked_armature(places, arguments):
    _set_player_body(_link_foreign(places))
    return arguments


def a_library_override(places, arguments):
    _set_player_body(_link_foreign(places).override_create(remap_local_usages=True))
    return arguments


def a_rig_without_legs(places, arguments):
    body = bpy.data.objects.new("Legless", bpy.data.armatures.new("Legless"))
    bpy.context.scene.collection.objects.link(body)
    add_bones(body, {"Hips": None, "Spine": "Hips", "Head": "Spine"})
    _set_player_body(body)
    return arguments


def missing_files(places, arguments):
    """Every path of the settings and of the call leads nowhere."""
    settings = bpy.context.scene.beyond_mocap
    settings.library_folder = str(places.out / "no such folder")
    for player in settings.players:
        player.tracking_file = str(places.out / "no such file.csv")
    return {name: _move_path(value, places.out / "no such folder") for name, value in arguments.items()}


def nothing_can_be_written(places, arguments):
    """Every path of the call lies below a file, and so does the library's cache."""
    cache = places.clips / CACHE
    shutil.rmtree(cache, ignore_errors=True)
    cache.write_text("not a folder")
    return {name: _move_path(value, places.nowhere) for name, value in arguments.items()}


def _move_path(value, folder):
    """A path moved to a folder; anything else as it is."""
    return str(folder / pathlib.Path(value).name) if isinstance(value, str) and "/" in value else value


def a_film_s_frame_rate_and_centimetres(places, arguments):
    """Both at once, because neither keeps an operator from its work."""
    bpy.context.scene.render.fps, bpy.context.scene.render.fps_base = 24, 1.001
    bpy.context.scene.unit_settings.scale_length = 0.01
    return arguments


def edit_mode(places, arguments):
    return _enter_mode("EDIT", arguments)


def pose_mode(places, arguments):
    return _enter_mode("POSE", arguments)


def _enter_mode(mode, arguments):
    if bpy.context.object is None or bpy.context.object.type != "ARMATURE":
        body = bpy.data.objects.new("Spare", bpy.data.armatures.new("Spare"))
        bpy.context.scene.collection.objects.link(body)
        add_bones(body, {"Hips": None})
    bpy.ops.object.mode_set(mode=mode)
    return arguments


def everything_hidden(places, arguments):
    for thing in bpy.context.view_layer.objects:
        thing.hide_viewport = True
        thing.hide_set(True)
    return arguments


def an_excluded_collection(places, arguments):
    """The active collection, and that of the results, are excluded from the view layer."""
    excluded = bpy.data.collections.new("Excluded")
    bpy.context.scene.collection.children.link(excluded)
    layers = bpy.context.view_layer.layer_collection.children
    bpy.context.view_layer.active_layer_collection = layers["Excluded"]
    for layer in layers:
        layer.exclude = True
    return arguments


def bodies_deleted(places, arguments):
    """What was made is deleted by hand, and the list still names it."""
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    return arguments


FAULTS = (nothing_selected, a_camera_selected, a_linked_armature, a_library_override, a_rig_without_legs, missing_files,
          nothing_can_be_written, a_film_s_frame_rate_and_centimetres, edit_mode, pose_mode, everything_hidden,
          an_excluded_collection, bodies_deleted)
