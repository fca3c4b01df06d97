"""Every operator of the extension, in every awkward situation: it works, or says what to do and changes nothing.

The operators are found in Blender, not listed by hand; each needs a row in ROWS that says how it is called where all is
well. A new operator without a row fails here.
"""

import importlib
import json
import os
import pathlib
import re
import shutil
import socket
import time
from collections.abc import Callable
from typing import NamedTuple

import bpy
import cached_work
import numpy as np
import pytest
import sample_characters as characters
import sample_rigs as rigs
import worlds
from conftest import EXTENSION, find_free_port
from throw_models import write_model_file
from undo import collect_state, press_operator

SMALL = pathlib.Path(__file__).resolve().parents[2] / "sample_blend" / "match" / "small"
SAYS_NOTHING = re.compile(
    r"Traceback|failed, context is incorrect|\w+Error: '|has no attribute|NoneType|StructRNA|<bpy|^\W*$|Errno|"
    r"object is not"
)

RENDER_ALIKE = "contact_sheet", "preview_movie"


class Row(NamedTuple):
    """How an operator is called.

    begin: the stage of `worlds` that it needs. arguments(places): of the call. prepare(): brings the scene into the
    state that it needs beside that. changes: whether it changes the file, in one step of undo. window: it works by
    pointing and pressing keys only, so that without a window it says so.
    """

    begin: str
    arguments: Callable = lambda places: {}
    prepare: Callable = lambda: None
    changes: bool = True
    window: bool = False


def files(*names):
    return lambda places: {"directory": f"{places.match}/", "files": [{"name": name} for name in names]}


def list_clips():
    """The window's list of clips, which no file keeps."""
    bpy.ops.beyond_mocap.list_clips()


def list_proposals():
    """What is proposed for the clip that is open."""
    bpy.ops.beyond_mocap.propose_words(review=True)


def forget_dots():
    """As in a file of the time before dots."""
    for player in bpy.context.scene.beyond_mocap.players:
        dot, player.dot = player.dot, None
        bpy.data.objects.remove(dot)
    bpy.context.view_layer.update()


def select_character():
    character = next(thing for thing in bpy.context.scene.objects if thing.get("beyond_mocap_character"))
    character.select_set(True)
    bpy.context.view_layer.objects.active = character


def pick_a_moment():
    bpy.ops.beyond_mocap.go_to_moment(strip="Moments", index=0)


def two_spans():
    """A second span, and both selected."""
    bpy.ops.beyond_mocap.add_span(words="jogging", start=2.0, end=3.0)
    for strip in bpy.context.scene.beyond_mocap.players[0].dot.animation_data.nla_tracks["Words"].strips:
        strip.select = True


def lose_a_player():
    """A dot is left, as where one was appended from another file."""
    player = bpy.context.scene.beyond_mocap.players[0]
    worlds.select_objects(player.dot)
    player.dot = None


def two_variants():
    bpy.ops.beyond_mocap.variants(count=2)


def move_a_contact():
    edit = bpy.context.scene.beyond_mocap.players[0].contact_edits.add()
    edit.time, edit.offset = 3.0, (0.1, 0.0)


def key_a_pose():
    body = bpy.context.scene.beyond_mocap.players[0].body
    bpy.context.scene.frame_set(20)
    body.pose.bones[0].location.z += 0.1
    body.pose.bones[0].keyframe_insert("location")


def keep_a_layer():
    key_a_pose()
    bpy.ops.beyond_mocap.keep_as_layer()


def pin_a_hand():
    bpy.ops.beyond_mocap.add_pin(part="right_hand")


def lack_a_label():
    """The library lacks a label, and Synthesize has told so."""
    bpy.context.scene.frame_set(30)
    bpy.ops.beyond_mocap.add_moment(words="scissors left back")
    with pytest.raises(RuntimeError, match="the library has no clip"):
        bpy.ops.beyond_mocap.synthesize()


def allow_nearest_labels():
    """What has failed would work now."""
    lack_a_label()
    bpy.context.scene.beyond_mocap.nearest = True


def two_frames_of_the_stage():
    bpy.ops.beyond_mocap.add_stage()
    scene = bpy.context.scene
    scene.use_preview_range, scene.frame_preview_start, scene.frame_preview_end = True, 5, 6


def select_ball():
    """The ball's dot, active."""
    worlds.select_objects(bpy.data.objects["Ball dot"])


def face_ball():
    select_ball()
    bpy.ops.beyond_mocap.add_heading_key(faces="OBJECT")


def draw():
    """A drawn track, active."""
    bpy.ops.beyond_mocap.draw_track()


def edit_points():
    """A drawn curve in edit mode, all of its points selected."""
    draw()
    worlds.select_objects(
        bpy.context.scene.beyond_mocap.players[bpy.context.scene.beyond_mocap.active_player].drawn_track)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.curve.select_all(action="SELECT")


def lay_cameras():
    """Cameras round a path of three metres."""
    cameras = importlib.import_module(f"{EXTENSION}.scene.stage.path_cameras")
    places = np.linspace((0.0, 0.0, 0.0), (3.0, 0.0, 0.0), 20)
    cameras.place_cameras(bpy.context.scene, cameras.CameraTargets(places, np.arange(1.0, 21.0), places, np.zeros(20)))


def ride():
    """The active body's motion rides a curve, which is active."""
    bpy.ops.beyond_mocap.edit_path()


def ride_elsewhere():
    """The same, the curve pulled aside, and nothing has followed."""
    ride()
    bpy.context.object.location.y += 1.0


def ride_asked():
    """The same, and it has been asked to wait, though nobody is in the way."""
    ride()
    rider = next(
        thing for thing in bpy.data.objects if thing.type == "ARMATURE" and thing.beyond_mocap_ride.on
    ).beyond_mocap_ride
    rider.delay = rider.added = 1.0


def fill_scene():
    """A passing scene in the lists."""
    bpy.ops.beyond_mocap.passes_sample(sample="three")


def one_pass():
    """The same, of two players and one pass, so that it is quickly made."""
    fill_scene()
    settings = bpy.context.scene.beyond_mocap_passes
    settings.active_player, settings.repeat, settings.live = 2, 1, False
    bpy.ops.beyond_mocap.passes_list(rows="players", what="REMOVE")


def make_scene():
    one_pass()
    bpy.ops.beyond_mocap.passes_make()


def a_touch():
    """A touch in the list, as a solved ball leaves it."""
    touch = bpy.context.scene.beyond_mocap_passes.touches.add()
    touch.name, touch.time, touch.kind, touch.words = "player1", 1.2, "kick", "kick"


def scene_file(places):
    """A scene in a file."""
    fill_scene()
    bpy.ops.beyond_mocap.passes_to_json(filepath=f"{places.out}/scene.json")
    bpy.ops.beyond_mocap.passes_sample(sample="six")
    return places.out / "scene.json"


def a_ball(carried=False):
    """A ball beside the active body, which carries it already or not."""
    body = bpy.context.object
    ball = bpy.data.objects.new("Ball of mine", bpy.data.meshes.new("Ball of mine"))
    bpy.context.scene.collection.objects.link(ball)
    worlds.select_objects(ball, body)
    if carried:
        bpy.ops.beyond_mocap.take_ball(first=5, last=9)


def carry():
    a_ball(carried=True)


def aim_a_ball():
    """The active body kicks a ball, which is active now."""
    bpy.ops.beyond_mocap.aim_ball(found=False, first=5, last=6)
    worlds.select_objects(next(thing for thing in bpy.data.objects if thing.beyond_mocap_aim.on))


def hand_the_ball_over():
    aim_a_ball()
    bpy.ops.beyond_mocap.ball_to_physics(frame=15)


def analyse():
    bpy.ops.beyond_mocap.hit_analysis()


def play_live():
    """Three players stand, the first one has the ball."""
    fill_scene()
    bpy.context.scene.beyond_mocap_passes.library_folder = str(worlds.SAMPLE)
    bpy.ops.beyond_mocap.stream_play()


def show_how():
    """The same, and an armature that kicks is active."""
    play_live()
    bpy.ops.beyond_mocap.import_clips(filepath=str(worlds.SAMPLE / "kick_low_inside.bvh"))


def listen():
    """A stream is listened to, and a few frames have arrived."""
    scene = importlib.import_module(f"{EXTENSION}.scene.stream.follow")
    bpy.ops.beyond_mocap.stream_start()
    listener, text = scene.find_listener(bpy.context.scene), (worlds.SAMPLE / "walking_1_2.bvh").read_text()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for piece in (text.split("MOTION")[0], *text.strip().split("\n")[-40:]):
            out.sendto(piece.encode(), ("127.0.0.1", listener.port))
            time.sleep(0.01)
    end = time.monotonic() + 120.0
    while listener.measure_status().frames < 20:
        assert time.monotonic() < end, f"{listener.measure_status()}"
        time.sleep(0.01)


def bake_it():
    bpy.ops.beyond_mocap.bake_to_rig()


def a_still_character():
    """The first player's body is a character that has lost its keys."""
    rig, player = rigs.create_mixamo(), bpy.context.scene.beyond_mocap.players[0]
    characters.add_mesh(rig, EXTENSION)
    player.character = rig
    player.character_body.animation_data.action = None
    worlds.select_objects(player.body)


def a_target(act="throw"):
    """Something far away to aim at: the 3D cursor; and a model that is quickly read."""
    bpy.context.scene.cursor.location = (20.0, 1.0, 1.0)
    setattr(bpy.context.object.beyond_mocap_throw, f"{act}_model", write_model_file(act))


def throw():
    """The active body throws."""
    a_target()
    bpy.ops.beyond_mocap.throw_at_target()


def unmapped():
    """The rig's map is empty."""
    bpy.context.scene.beyond_mocap.rig.bones.clear()


def another_rig():
    """A second rig is active; the panel still has the first."""
    worlds.select_objects(rigs.create_unreal())


def a_cloud(name="walk.trc"):
    """A recording of markers, as a cloud that is active."""
    bpy.ops.beyond_mocap.import_markers(filepath=str(worlds.MARKERS / name))


def two_clouds():
    """The same, and its static trial, which is active."""
    a_cloud()
    a_cloud("static.trc")


def a_body_of_markers(name="walk.trc"):
    """The same, reconstructed."""
    a_cloud(name)
    bpy.ops.beyond_mocap.reconstruct_markers()


def marker_set_file(places):
    """A marker set in a file."""
    a_cloud()
    bpy.ops.beyond_mocap.save_marker_set(filepath=f"{places.out}/set.txt")
    bpy.context.object.beyond_mocap_cloud.labels[0].segment = ""
    return places.out / "set.txt"


def marker_model_file(places):
    """A model in a file."""
    a_body_of_markers()
    bpy.ops.beyond_mocap.save_marker_model(filepath=f"{places.out}/model.json")
    return places.out / "model.json"


def saved_map(places):
    """A map in a file: of the rig before its map was taken away."""
    bpy.ops.beyond_mocap.map_bones()
    bpy.ops.beyond_mocap.save_bone_map(filepath=f"{places.out}/map.json")
    unmapped()
    return places.out / "map.json"


def a_match():
    """Three seconds of two players of the sample's match are chosen."""
    scene = bpy.context.scene
    match, top = scene.beyond_mocap_match, pathlib.Path(scene.beyond_mocap.library_folder).parent
    for name in ("small.dat", "small_meta.xml"):
        shutil.copy(SMALL / name, top / "match")
    bpy.ops.beyond_mocap.read_match(filepath=str(top / "match" / "small.dat"))
    match.start, match.end, match.workers, match.folder = 2.0, 5.0, 1, str(top / "out" / "match")
    for player in match.players:
        player.use = player.feed_id in ("home_4", "home_7")


def a_made_match():
    """The same, made: once, then it is there. A part of it is to be shown."""
    a_match()
    match = bpy.context.scene.beyond_mocap_match
    if not pathlib.Path(match.folder, "match.json").exists():
        bpy.ops.beyond_mocap.make_match()
    match.end = 4.0


def a_shown_match():
    """The same, shown."""
    a_made_match()
    bpy.ops.beyond_mocap.show_match()


def a_study(places):
    """A study of four movies, none of them at its place yet."""
    folder = places.out / "study"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    clips = [{"name": name, "file": "../still.mp4", "system": system, "scenario": "s"}
             for name, system in (("bcdf", "training"), ("ghjk", "training"), ("mnpq", "ours"), ("rstv", "theirs"))]
    (places.out / "still.mp4").write_bytes(b"a movie")
    told = {"version": 1, "study": "12345678", "seed": 0, "pairs": False, "clips": clips, "orders": {"R01": [["bcdf"]]}}
    (folder / "study.json").write_text(json.dumps(told), "utf-8")
    return {"directory": f"{folder}/"}


def moved(folder):
    """A second copy of a folder, beside it."""
    other = folder.with_name(f"{folder.name} moved")
    if not other.exists():
        shutil.copytree(folder, other)
    return other


ROWS = {
    "accept": Row("synthesized"),
    "accept_touches": Row("imported", prepare=a_touch),
    "add_heading_key": Row("imported", lambda places: {"faces": "OBJECT"}, select_ball),
    "add_moment": Row("imported", lambda places: {"words": "header"}),
    "add_pin": Row("synthesized", lambda places: {"part": "right_hand"}),
    "add_preset": Row("imported", lambda places: {"name": "Tried"}, changes=False),
    "add_span": Row("imported", lambda places: {"words": "walking"}),
    "add_stage": Row("imported"),
    "aim_ball": Row("accepted", lambda places: {"found": False, "first": 5, "last": 6}),
    "annotate": Row("imported", lambda places: {"keys": "2 2 3 5 ENTER"}),
    "annotate_clip": Row("imported", prepare=list_clips),
    "assign_markers": Row("imported", lambda places: {"segment": "Head"}, a_cloud),
    "bake_path": Row("accepted", prepare=ride),
    "bake_to_rig": Row("rig"),
    "ball_from_physics": Row("accepted", prepare=hand_the_ball_over),
    "ball_to_physics": Row("accepted", lambda places: {"frame": 15}, aim_a_ball),
    "build_library": Row("imported", lambda places: {"rebuild": True}),
    "cancel": Row("imported", changes=False),
    "change_look": Row("accepted", lambda places: {"hair": "bald"}, select_character),
    "choose_player": Row("imported", lambda places: {"player": "player2"}),
    "clean_markers": Row("imported", prepare=a_cloud),
    "clear_hits": Row("accepted", prepare=analyse),
    "delete_moment": Row("imported", prepare=pick_a_moment),
    "discard": Row("synthesized"),
    "draw_track": Row("imported"),
    "edit_path": Row("accepted"),
    "edit_words": Row("imported", lambda places: {"words": "header"}, pick_a_moment),
    "deliver": Row("accepted", lambda places: {"directory": f"{places.out}/", "preset": "GODOT"}, changes=False),
    "error_curves": Row("synthesized"),
    "export_bvh": Row("accepted", lambda places: {"filepath": f"{places.out}/out.bvh"}, changes=False),
    "export_motion": Row(
        "accepted", lambda places: {"filepath": f"{places.out}/out.glb", "format": "GLB"}, changes=False
    ),
    "export_words": Row("imported", lambda places: {"filepath": f"{places.out}/out.txt"}, changes=False),
    "fix_foot": Row("synthesized", lambda places: {"time": 3.0, "offset": (0.05, 0.0)}),
    "find_release": Row("imported", prepare=lambda: a_body_of_markers("throw.trc")),
    "free_ball": Row("accepted", prepare=carry),
    "go_to_strike": Row("accepted", lambda places: {"frame": 7}, analyse),
    "go_to_moment": Row("imported", lambda places: {"strip": "Moments", "index": 0}),
    "hit_analysis": Row("accepted"),
    "import_clip": Row("imported", prepare=list_clips),
    "import_clips": Row("imported", lambda places: {"filepath": f"{places.clips}/walking_1_2.bvh"}),
    "import_markers": Row("imported", lambda places: {"filepath": f"{places.match}/walk.trc"}),
    "import_tracking": Row("imported", lambda places: {"filepath": f"{places.match}/player1.csv"}),
    "import_words": Row("imported", lambda places: {"filepath": f"{places.match}/player1.txt"}),
    "apply_fix": Row("imported", prepare=lack_a_label),
    "contact_sheet": Row("synthesized", lambda places: {"filepath": f"{places.out}/sheet.png", "height": 16, "count": 1,
                                                        "samples": 1}, two_frames_of_the_stage, changes=False),
    "dismiss_notice": Row("imported", prepare=lack_a_label, changes=False),
    "preview_movie": Row("synthesized", lambda places: {"filepath": f"{places.out}/film.mp4", "height": 16,
                                                        "samples": 1}, two_frames_of_the_stage, changes=False),
    "try_again": Row("imported", prepare=allow_nearest_labels),
    "judge_proposal": Row("clip", prepare=list_proposals),
    "join_spans": Row("imported", prepare=two_spans),
    "jump_to": Row("synthesized", lambda places: {"seconds": 2.0}),
    "keep_throw": Row("accepted", prepare=throw),
    "kick_at_target": Row("accepted", prepare=lambda: a_target("kick")),
    "keep_bone_map": Row("rig", changes=False),
    "learn_words": Row("clip"),
    "leave_aim": Row("accepted", prepare=aim_a_ball),
    "leave_throw": Row("accepted", prepare=throw),
    "leave_path": Row("accepted", prepare=ride),
    "list_clips": Row("imported", changes=False),
    "load_bone_map": Row("rig", lambda places: {"filepath": f"{saved_map(places)}"}, unmapped),
    "load_marker_model": Row("imported", lambda places: {"filepath": f"{marker_model_file(places)}"}),
    "load_marker_set": Row("imported", lambda places: {"filepath": f"{marker_set_file(places)}"}),
    "load_sample": Row("imported", lambda places: {"which": "PATH"}),
    "load_video": Row("imported", lambda places: {"filepath": f"{places.match}/{worlds.PICTURE}"}),
    "make_assets": Row("imported", prepare=list_clips),
    "make_match": Row("imported", prepare=a_match),
    "map_bones": Row("rig", prepare=unmapped),
    "match_camera": Row("imported", lambda places: {"which": "EYES", "player": "home_7"}, a_shown_match),
    "match_export": Row(
        "imported", lambda places: {"filepath": f"{places.out}/match.fbx", "format": "FBX"}, a_shown_match,
        changes=False
    ),
    "match_second": Row("imported", lambda places: {"seconds": 3.0, "player": "home_7"}, a_shown_match),
    "mirror": Row("accepted"),
    "mirror_side": Row("imported", prepare=pick_a_moment),
    "move_moment": Row("imported", lambda places: {"frames": 5}, pick_a_moment),
    "move_video": Row("video", lambda places: {"frames": 3}),
    "nudge_points": Row("imported", lambda places: {"direction": "UP", "step": 0.3}, edit_points),
    "passes_from_json": Row("imported", lambda places: {"filepath": f"{scene_file(places)}"}),
    "passes_list": Row("imported", lambda places: {"rows": "passes", "what": "ADD"}, fill_scene),
    "passes_clear": Row("imported", prepare=make_scene),
    "passes_make": Row("imported", prepare=one_pass),
    "passes_sample": Row("imported", lambda places: {"sample": "three"}),
    "passes_to_json": Row(
        "imported", lambda places: {"filepath": f"{places.out}/scene.json"}, fill_scene, changes=False
    ),
    "path_apart": Row("accepted", prepare=ride_asked),
    "path_camera": Row("imported", lambda places: {"which": "SIDE"}, lay_cameras),
    "path_cameras": Row("accepted", prepare=ride),
    "path_curve": Row("accepted", lambda places: {"count": 7}, ride),
    "hover_timeline": Row("imported", changes=False, window=True),
    "pick_moment": Row("imported", changes=False, window=True),
    "place_players": Row("imported", prepare=forget_dots),
    "player_from_dot": Row("imported", prepare=lose_a_player),
    "preview": Row("synthesized", lambda places: {"number": 2}, two_variants),
    "propose_words": Row("clip"),
    "read_match": Row("imported", lambda places: {"filepath": str(SMALL / "small_Home.csv")}, a_match),
    "read_words": Row("imported", prepare=forget_dots),
    "reconstruct_markers": Row("imported", prepare=a_cloud),
    "reduce_keys": Row("rig", prepare=bake_it),
    "relink_library": Row("imported", lambda places: {"directory": f"{moved(places.clips)}/"}),
    "remove_clip": Row("clip"),
    "remove_heading_key": Row("imported", prepare=face_ball),
    "keep_as_layer": Row("accepted", prepare=key_a_pose),
    "remove_layer": Row("accepted", prepare=keep_a_layer),
    "remove_contact_edit": Row("synthesized", prepare=move_a_contact),
    "remove_pin": Row("synthesized", prepare=pin_a_hand),
    "remove_player": Row("imported"),
    "remove_video": Row("video"),
    "resynthesize_stretch": Row("synthesized", lambda places: {"player": "player1", "start": 1.0, "end": 2.0}),
    "review_proposals": Row("clip", prepare=list_proposals, window=True),
    "save_bone_map": Row("rig", lambda places: {"filepath": f"{places.out}/saved.json"}, changes=False),
    "save_marker_model": Row(
        "imported", lambda places: {"filepath": f"{places.out}/model.json"}, a_body_of_markers, changes=False
    ),
    "save_marker_set": Row(
        "imported", lambda places: {"filepath": f"{places.out}/set.txt"}, a_cloud, changes=False
    ),
    "save_words": Row("clip", lambda places: {"overwrite": True}, changes=False),
    "set_automatic": Row("imported", lambda places: {"path": "beyond_mocap.omega", "value": 3.0}),
    "set_static": Row("imported", prepare=two_clouds),
    "set_speed": Row("imported", lambda places: {"speed": 2.0}, draw),
    "show_match": Row("imported", prepare=a_made_match),
    "show_momentum": Row("accepted"),
    "show_timeline": Row("imported", changes=False),
    "show_video": Row("video", changes=False),
    "solve_ball": Row("imported"),
    "split_span": Row("imported", prepare=lambda: bpy.context.scene.frame_set(25)),
    "stream_act": Row("imported", prepare=show_how),
    "stream_end": Row("imported", prepare=play_live, changes=False),
    "stream_list": Row("imported", lambda places: {"what": "ADD"}),
    "stream_keep": Row("imported", prepare=listen),
    "stream_play": Row("imported", prepare=fill_scene),
    "stage_view": Row("accepted", lambda places: {"view": "BROADCAST"}),
    "stream_start": Row("imported", changes=False),
    "stream_stop": Row("imported", prepare=lambda: bpy.ops.beyond_mocap.stream_start(), changes=False),
    "stream_target": Row("imported", lambda places: {"number": 2}, play_live),
    "study_render": Row("imported", a_study, changes=False),
    "synthesize": Row("imported"),
    "take_ball": Row("accepted", lambda places: {"first": 3, "last": 8}, a_ball),
    "throw_at_target": Row("accepted", prepare=a_target),
    "tick_match": Row("imported", lambda places: {"whom": "home"}, a_match),
    "track_object": Row("imported", prepare=draw),
    "unbake": Row("rig", prepare=bake_it),
    "update": Row("synthesized"),
    "update_path": Row("accepted", prepare=ride_elsewhere),
    "update_live": Row("synthesized", lambda places: {"player": "player1", "kind": "quick"}),
    "use_marker_set": Row("imported", lambda places: {"which": "plug_in_gait_legs"}, a_cloud),
    "update_character": Row("accepted", prepare=a_still_character),
    "use_selected_rig": Row("rig", prepare=another_rig),
    "variants": Row("synthesized", lambda places: {"count": 2}),
    "words_to_text": Row("imported"),
}


def operators():
    """Names of all operators of the extension, from Blender itself."""
    return sorted(name for name in dir(bpy.ops.beyond_mocap) if not name.startswith("_"))


@pytest.fixture(scope="module")
def session(extension):
    module = importlib.import_module(f"{extension.__name__}.scene.core.session")
    yield module
    module.clear_session()


@pytest.fixture(scope="module")
def work_once(work_cache):
    """Operators work once for the same order."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        cached_work.cache_operators(monkeypatch, work_cache)
        yield


@pytest.fixture(scope="module")
def stages(session, work_once, library_folder, tmp_path_factory):
    """The folders, and a file for each stage."""
    top = tmp_path_factory.mktemp("worlds")
    places = worlds.make_places(top)
    shutil.copytree(library_folder / ".beyond_mocap", places.clips / ".beyond_mocap")
    bpy.ops.wm.read_homefile(use_empty=True)
    for name, go_on in worlds.STAGES.items():
        go_on(places)
        bpy.ops.wm.save_as_mainfile(filepath=str(top / f"{name}.blend"))
    shutil.copytree(places.clips, top / "untouched")
    return top, places


@pytest.fixture
def begin(stages):
    """begin(name) opens the file in which this operator can be called; returns folders and arguments."""
    top, places = stages

    def opened(name):
        worlds.restore_folder(places.clips, top / "untouched")
        row = ROWS[name]
        bpy.ops.wm.open_mainfile(filepath=str(top / f"{row.begin}.blend"))
        bpy.context.scene.beyond_mocap_stream.port = find_free_port()
        row.prepare()
        return places, row.arguments(places)

    return opened


def call(name, arguments):
    """Call it as its button would; returns "" where it worked, else what it said."""
    try:
        result = press_operator(getattr(bpy.ops.beyond_mocap, name), **arguments)
    except RuntimeError as error:
        return str(error)
    return "" if result == {"FINISHED"} else f"{result} without a word"


def linked_motions():
    """What every linked object plays."""
    return {thing.name: thing.animation_data and thing.animation_data.action and thing.animation_data.action.name
            for thing in bpy.data.objects if thing.library}


def test_every_operator_has_a_row():
    assert sorted(ROWS) == operators()


@pytest.mark.parametrize("name", sorted(ROWS))
def test_where_all_is_well_it_works_and_is_one_step_of_undo(name, begin, capfd):
    _, arguments = begin(name)
    bpy.ops.ed.undo_push(message="before")
    before = collect_state()
    said = call(name, arguments)
    if ROWS[name].window:
        assert said and not SAYS_NOTHING.search(said), said
        assert collect_state() == before
        return
    assert said == ""
    after = collect_state()
    if not ROWS[name].changes:
        assert after == before
        return
    assert after != before
    bpy.ops.ed.undo()
    assert collect_state() == before
    bpy.ops.ed.redo()
    assert collect_state() == after
    assert "Traceback" not in capfd.readouterr().err


def mine(wrong) -> list[str]:
    """The operators that this Blender tries in a situation: all, but where `make test` runs two Blenders side by side,
    which has each of them try every other one, and all of them half of the situations. Two that render alike, in a
    process of its own, take the situations in turn."""
    situation, is_older = worlds.FAULTS.index(wrong), bpy.app.version < (5, 0)
    names = [name for number, name in enumerate(sorted(ROWS)) if not os.environ.get("BLENDERS_IN_TURN")
             or (number + situation + is_older) % 2 == 0]
    return [name for name in names if name != RENDER_ALIKE[situation % 2]]


@pytest.mark.parametrize("wrong", worlds.FAULTS, ids=lambda wrong: wrong.__name__)
def test_in_an_awkward_situation_it_works_or_says_what_to_do(wrong, begin, capfd):
    complaints = []
    for name in mine(wrong):
        places, arguments = begin(name)
        arguments = wrong(places, arguments)
        bpy.ops.ed.undo_push(message="before")
        before, linked = collect_state(), linked_motions()
        capfd.readouterr()
        said = call(name, arguments)
        printed = "".join(capfd.readouterr())
        if said and SAYS_NOTHING.search(said):
            complaints.append(f"{name}: says {said!r}")
        if said and collect_state() != before:
            now = collect_state()
            complaints.append(
                f"{name}: failed and changed {[key for key in now if now[key] != before[key]]}; said {said!r}"
            )
        if linked_motions() != linked:
            complaints.append(f"{name}: wrote to what is linked from another file, which is lost with the next load")
        if "Traceback" in printed and not said:
            complaints.append(f"{name}: printed {printed}")
    assert not complaints, "\n".join(complaints)


@pytest.mark.parametrize("name", sorted(ROWS))
def test_it_says_what_it_is(name):
    operator = getattr(bpy.ops.beyond_mocap, name).get_rna_type()
    cls = getattr(bpy.types, f"BEYOND_MOCAP_OT_{name}")
    assert operator.name and operator.description and not operator.description.endswith(".")
    assert cls.bl_options & {"REGISTER", "INTERNAL"}
    assert not ROWS[name].changes or "UNDO" in cls.bl_options
    unnamed = [known.identifier for known in operator.properties
               if known.identifier != "rna_type" and not known.is_hidden and not (known.name and known.description)]
    assert not unnamed


def test_every_setting_says_what_it_is():
    groups = [cls for base in (bpy.types.PropertyGroup, bpy.types.AddonPreferences) for cls in base.__subclasses__()
              if cls.__module__.startswith("bl_ext.user_default.beyond_mocap") and cls.is_registered]
    assert groups
    silent = [f"{cls.__name__}.{known.identifier}" for cls in groups for known in cls.bl_rna.properties
              if known.identifier not in {"rna_type", "name", "bl_idname"}
              and not known.is_hidden and not known.description]
    assert not silent
