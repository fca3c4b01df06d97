"""A clip of the library is opened, given words by strips and by rules, and its words are written back."""

import importlib
import shutil
from pathlib import Path

import bpy
import pytest
from undo import assert_one_step, collect_state, press_operator

SAMPLE = Path(__file__).resolve().parents[3] / "sample_blend" / "library"


@pytest.fixture
def rooms(extension):
    names = ("library.recordings", "timeline.label_tracks", "timeline.strip_writing", "timeline.strips",
             "core.settings")
    return {name: importlib.import_module(f"{extension.__name__}.scene.{name}") for name in names}


@pytest.fixture
def library(tmp_path):
    """Two clips of the sample, one with words and one without."""
    folder = tmp_path / "library"
    folder.mkdir()
    for name in ("kick_low_top.bvh", "jogging_2_9.bvh", "jogging_2_9.txt"):
        shutil.copy(SAMPLE / name, folder / name)
    bpy.context.scene.beyond_mocap.library_folder = str(folder)
    bpy.ops.beyond_mocap.list_clips()
    return folder


def rows_of(core, clip):
    annotations = core("library.folder.annotations")
    return annotations.Annotations(clip.parent, [clip]).read_rows(clip, core("files.bvh.bvh").read_bvh(clip).motion.fps)


@pytest.mark.parametrize("fps, base", [(24, 1.001), (25, 1.0), (30, 1.0), (60, 1.0)])
def test_a_clip_is_opened_with_its_words(core, rooms, library, fps, base):
    bpy.context.scene.render.fps, bpy.context.scene.render.fps_base = fps, base
    shutil.copy(SAMPLE / "kick_low_top.txt", library / "kick_low_top.txt")
    assert bpy.ops.beyond_mocap.annotate_clip(path="kick_low_top.bvh") == {"FINISHED"}
    rig = bpy.context.object
    assert rooms["library.recordings"].find_shown_clip(rig) == "kick_low_top.bvh"
    assert rooms["library.recordings"].read_labels(rig) == rows_of(core, library / "kick_low_top.bvh")
    assert rig.animation_data.action is not None, "the strips took the motion's place"
    moment = rooms["timeline.label_tracks"].list_moments(rig)[0]
    assert moment.frame == round(1 + 156 / 60 * fps / base)


def test_words_are_proposed_saved_and_used_by_the_library(core, rooms, library):
    bpy.context.scene.render.fps = 60
    bpy.ops.beyond_mocap.annotate_clip(path="kick_low_top.bvh")
    rig = bpy.context.object
    assert bpy.ops.beyond_mocap.propose_words() == {"FINISHED"}
    said = rooms["library.recordings"].read_labels(rig)
    kick = next(row for row in said if row.key is not None)
    assert {"kick", "right"} <= set(kick.words) and abs(kick.key - 156) <= 2
    assert press_operator(bpy.ops.beyond_mocap.save_words) == {"FINISHED"}
    assert rows_of(core, library / "kick_low_top.bvh") == said
    listing = bpy.context.window_manager.beyond_mocap_clips
    assert next(clip for clip in listing.shown if clip.name == "kick_low_top").words.startswith("kick right")
    bpy.ops.beyond_mocap.build_library()
    assert "Kick: 1 moment" in bpy.context.scene.beyond_mocap.library_holds


def test_a_strip_that_is_moved_says_so_when_saved(core, rooms, library):
    bpy.context.scene.render.fps = 60
    bpy.ops.beyond_mocap.annotate_clip(path="kick_low_top.bvh")
    rig = bpy.context.object
    keys = core("annotation")
    clock = rooms["timeline.label_tracks"].read_clock(rig)
    rooms["timeline.strip_writing"].add_span(rig, keys.Span(0.0, 1.0, ("jogging", "front")), clock)
    rooms["timeline.strip_writing"].add_moment(rig, keys.KeyMoment(2.6, ("kick", "left")), clock)
    bpy.ops.beyond_mocap.save_words()
    rows = rows_of(core, library / "kick_low_top.bvh")
    assert [(row.start, row.end, row.key, row.words) for row in rows] == [
        (0, 60, None, ("jogging", "front")), (156, 156, 156, ("kick", "left"))]


def test_words_that_are_there_stay_until_told(library):
    bpy.ops.beyond_mocap.annotate_clip(path="jogging_2_9.bvh")
    bpy.ops.beyond_mocap.propose_words()
    before = (library / "jogging_2_9.txt").read_text()
    with pytest.raises(RuntimeError, match="already has other labels for this clip"):
        bpy.ops.beyond_mocap.save_words()
    assert (library / "jogging_2_9.txt").read_text() == before
    bpy.ops.beyond_mocap.save_words(overwrite=True)
    assert (library / "jogging_2_9.txt").read_text() == "0f 180f jogging front  # rules 0.95\n"


def test_undo_and_removal_leave_nothing_behind(library):
    bpy.ops.ed.undo_push(message="before")
    before = collect_state()
    assert_one_step(bpy.ops.beyond_mocap.annotate_clip, path="kick_low_top.bvh")
    assert_one_step(bpy.ops.beyond_mocap.propose_words)
    assert_one_step(bpy.ops.beyond_mocap.remove_clip)
    after = collect_state()
    for kind in ("objects", "armatures", "meshes", "actions"):
        assert after[kind] == before[kind], kind


def test_what_hangs_on_a_clip_stays_when_it_goes(library):
    bpy.ops.beyond_mocap.annotate_clip(path="kick_low_top.bvh")
    lamp = bpy.data.objects.new("Lamp", None)
    bpy.context.scene.collection.objects.link(lamp)
    lamp.parent = bpy.context.object
    bpy.ops.beyond_mocap.remove_clip()
    assert lamp.name in bpy.context.scene.objects and len(bpy.context.scene.objects) == 1


def test_proposals_beside_what_is_there(rooms, library):
    bpy.ops.beyond_mocap.annotate_clip(path="kick_low_top.bvh")
    bpy.ops.beyond_mocap.propose_words(least=0.99)
    with pytest.raises(Exception, match="no labels in the strips"):
        rooms["library.recordings"].read_labels(bpy.context.object)
    with pytest.raises(RuntimeError, match="no labels in the strips"):
        bpy.ops.beyond_mocap.save_words()
    bpy.ops.beyond_mocap.propose_words()
    count = len(rooms["library.recordings"].read_labels(bpy.context.object))
    bpy.ops.beyond_mocap.propose_words(replace=False)
    assert len(rooms["library.recordings"].read_labels(bpy.context.object)) > count


def test_nothing_chosen_or_something_else():
    bpy.ops.object.armature_add()
    for operator in (bpy.ops.beyond_mocap.propose_words, bpy.ops.beyond_mocap.save_words,
                     bpy.ops.beyond_mocap.remove_clip):
        with pytest.raises(RuntimeError, match="clip"):
            operator()
    with pytest.raises(RuntimeError, match="No clips listed"):
        bpy.ops.beyond_mocap.annotate_clip()


def test_a_text_of_words_is_dropped_on_a_clip_and_on_a_player(core, rooms, library, tmp_path):
    with pytest.raises(RuntimeError, match="labels belong to a player"):
        bpy.ops.beyond_mocap.import_words(filepath=str(library / "jogging_2_9.txt"))
    bpy.context.scene.render.fps = 30
    bpy.ops.beyond_mocap.annotate_clip(path="kick_low_top.bvh")
    words = tmp_path / "words.txt"
    words.write_text("0 1 walking front\n0.5 kick left\n")
    assert_one_step(bpy.ops.beyond_mocap.import_words, directory=str(tmp_path), files=[{"name": "words.txt"}])
    assert [row.words for row in rooms["library.recordings"].read_labels(bpy.context.object)] == [("walking", "front"),
                                                                                        ("kick", "left")]
    bpy.ops.beyond_mocap.remove_clip()
    track = tmp_path / "player.csv"
    track.write_text("time_s,x_m,y_m\n" + "".join(f"{i / 10},{i / 10},0\n" for i in range(40)))
    bpy.ops.beyond_mocap.import_tracking(filepath=str(track))
    assert_one_step(bpy.ops.beyond_mocap.import_words, filepath=str(words))
    settings = bpy.context.scene.beyond_mocap
    timeline = rooms["timeline.strips"].read_player_timeline(rooms["core.settings"].find_active_player(settings),
                                                             bpy.context.scene)
    assert [key.words for key in timeline.keys] == [("kick", "left")]
    (tmp_path / "words.txt").write_text("nonsense\n")
    before = collect_state()
    with pytest.raises(RuntimeError, match="words.txt:1"):
        bpy.ops.beyond_mocap.import_words(filepath=str(words))
    assert collect_state() == before


def test_a_clip_of_another_file_is_left_alone(rooms, library, tmp_path):
    bpy.ops.beyond_mocap.annotate_clip(path="kick_low_top.bvh")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.context.scene.beyond_mocap.library_folder = str(library)
    with bpy.data.libraries.load(str(tmp_path / "other.blend"), link=True) as (there, here):
        here.objects = ["kick_low_top"]
    rig = bpy.data.objects["kick_low_top"]
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    before = collect_state()
    for operator in (bpy.ops.beyond_mocap.propose_words, bpy.ops.beyond_mocap.remove_clip):
        with pytest.raises(RuntimeError, match="file"):
            operator()
    assert collect_state() == before
