"""Words are learned from a library, proposed for another clip, judged one by one, and saved with who said them."""

import importlib
import shutil
from pathlib import Path

import bpy
import pytest
from undo import assert_one_step, press_operator

SAMPLE = Path(__file__).resolve().parents[3] / "sample_blend" / "library"
TAUGHT = ("kick_low_inside", "kick_low_inside_slow", "kick_low_top", "jogging_2_9", "walking_1_2")


@pytest.fixture
def rooms(extension):
    names = ("library.recordings", "timeline.label_tracks", "timeline.strip_writing", "timeline.proposals")
    return {name: importlib.import_module(f"{extension.__name__}.scene.{name}") for name in names}


@pytest.fixture
def library(tmp_path):
    """Five clips with words, and a kick without."""
    folder = tmp_path / "library"
    folder.mkdir()
    for name in TAUGHT:
        for ending in (".bvh", ".txt"):
            shutil.copy(SAMPLE / (name + ending), folder / (name + ending))
    shutil.copy(SAMPLE / "kick_low_top.bvh", folder / "new.bvh")
    bpy.context.scene.beyond_mocap.library_folder = str(folder)
    bpy.context.scene.render.fps = 60
    bpy.ops.beyond_mocap.list_clips()
    return folder


@pytest.fixture
def listed(library):
    """The new clip is open, and its proposals are listed."""
    bpy.ops.beyond_mocap.annotate_clip(path="new.bvh")
    bpy.ops.beyond_mocap.propose_words(review=True)
    return bpy.context.object.beyond_mocap_proposals


def place_of(listed, word):
    return next(index for index, one in enumerate(listed.listed) if word in one.name.split())


def test_words_are_learned_and_proposed_for_a_new_clip(core, rooms, library):
    assert bpy.ops.beyond_mocap.learn_words() == {"FINISHED"}
    kept = Path(bpy.context.scene.beyond_mocap.words_model)
    assert kept == library / ".beyond_mocap" / "learned_words.npz" and kept.is_file()
    bpy.ops.beyond_mocap.annotate_clip(path="new.bvh")
    bpy.ops.beyond_mocap.propose_words(review=True)
    listed = bpy.context.object.beyond_mocap_proposals
    kick = listed.listed[place_of(listed, "kick")]
    assert kick.source == "learned" and abs(kick.key - 156) <= 2 and kick.confidence > 0.5
    read = core("library.classify.classifier").read_classifier(kept)
    recording = core("files.bvh.bvh").read_bvh(library / "new.bvh").motion
    same = [one.annotation for one in core("library.proposals").propose_labels(recording, classifier=read)
            if one.confidence >= 0.5]
    assert [rooms["timeline.proposals"].to_row(one) for one in listed.listed] == same


def test_nothing_is_said_until_it_is_accepted(core, rooms, listed):
    rig = bpy.context.object
    assert rooms["timeline.label_tracks"].read_timeline(rig).keys == ()
    number = place_of(listed, "kick")
    assert bpy.ops.beyond_mocap.judge_proposal(what="ACCEPT", index=number) == {"FINISHED"}
    (key,) = rooms["timeline.label_tracks"].read_timeline(rig).keys
    assert key.words == tuple(listed.listed[number].name.split())
    assert listed.listed[number].state == "ACCEPTED"
    bpy.ops.beyond_mocap.judge_proposal(what="ACCEPT", index=number)
    assert len(rooms["timeline.label_tracks"].read_timeline(rig).keys) == 1, "accepted twice it is said once"
    bpy.ops.beyond_mocap.judge_proposal(what="REFUSE", index=number)
    timeline = rooms["timeline.label_tracks"].read_timeline(rig)
    assert timeline.keys == timeline.spans == ()


def test_the_playhead_goes_to_what_is_looked_at(listed):
    number = place_of(listed, "kick")
    listed.active = number
    assert bpy.context.scene.frame_current == 1 + listed.listed[number].key
    bpy.ops.beyond_mocap.judge_proposal(what="PREVIOUS")
    assert listed.active == number - 1
    assert bpy.context.scene.frame_current == 1 + listed.listed[number - 1].start
    bpy.ops.beyond_mocap.judge_proposal(what="NEXT")
    assert listed.active == number


def test_judging_goes_on_to_the_next_open_one(listed):
    count = len(listed.listed)
    assert count >= 3
    bpy.ops.beyond_mocap.judge_proposal(what="REFUSE")
    assert listed.listed[0].state == "REFUSED" and listed.active == 1
    bpy.ops.beyond_mocap.judge_proposal(what="ACCEPT", index=count - 1)
    assert {one.state for one in listed.listed[1:-1]} == {"OPEN"}
    bpy.ops.beyond_mocap.judge_proposal(what="REFUSE_ALL")
    assert [one.state for one in listed.listed] == ["REFUSED"] * (count - 1) + ["ACCEPTED"]


def test_judging_is_one_step_of_undo(listed):
    assert_one_step(bpy.ops.beyond_mocap.judge_proposal, what="ACCEPT")
    assert_one_step(bpy.ops.beyond_mocap.judge_proposal, what="ACCEPT_ALL")


def test_words_are_saved_with_who_said_them(core, rooms, library, listed):
    rig = bpy.context.object
    bpy.ops.beyond_mocap.judge_proposal(what="ACCEPT", index=place_of(listed, "kick"))
    clock = rooms["timeline.label_tracks"].read_clock(rig)
    rooms["timeline.strip_writing"].add_span(rig, core("annotation").Span(0.0, 1.0, ("jogging", "front")), clock)
    press_operator(bpy.ops.beyond_mocap.save_words)
    lines = (library / "new.txt").read_text().splitlines()
    assert all("# rules 0." in line for line in lines if "kick" in line)
    assert [line for line in lines if "jogging" in line] == ["0f 60f jogging front"]
    bpy.ops.beyond_mocap.remove_clip()
    bpy.ops.beyond_mocap.annotate_clip(path="new.bvh")
    bpy.ops.beyond_mocap.save_words(overwrite=True)
    assert (library / "new.txt").read_text().splitlines() == lines


def test_a_row_that_is_changed_is_the_users_own(rooms, library, listed):
    rig = bpy.context.object
    bpy.ops.beyond_mocap.judge_proposal(what="ACCEPT", index=place_of(listed, "kick"))
    moment = rooms["timeline.label_tracks"].list_moments(rig)[0]
    bpy.ops.beyond_mocap.go_to_moment(strip=moment.strip, index=moment.index)
    bpy.ops.beyond_mocap.move_moment(frames=3)
    press_operator(bpy.ops.beyond_mocap.save_words)
    assert "#" not in (library / "new.txt").read_text()


def test_a_place_behind_the_list_is_its_end(listed):
    for what in ("PREVIOUS", "NEXT"):
        listed.active = 99
        assert bpy.ops.beyond_mocap.judge_proposal(what=what) == {"FINISHED"}
        assert 0 <= listed.active < len(listed.listed)


def test_what_cannot_be_done_is_told(library, listed):
    with pytest.raises(RuntimeError, match="no proposal 99"):
        bpy.ops.beyond_mocap.judge_proposal(index=99)
    bpy.context.scene.beyond_mocap.words_model = str(library / "none.npz")
    with pytest.raises(RuntimeError, match="learn from annotated clips again"):
        bpy.ops.beyond_mocap.propose_words(review=True)
    with pytest.raises(RuntimeError, match="no window"):
        bpy.ops.beyond_mocap.review_proposals()
    for name in TAUGHT:
        (library / f"{name}.txt").unlink()
    with pytest.raises(RuntimeError, match="no clip with labels"):
        bpy.ops.beyond_mocap.learn_words()


def test_what_is_said_already_is_not_proposed_again(rooms, library):
    bpy.ops.beyond_mocap.annotate_clip(path="new.bvh")
    bpy.ops.beyond_mocap.propose_words()
    before = rooms["timeline.proposals"].collect_sources(bpy.context.object)
    bpy.ops.beyond_mocap.propose_words(review=True)
    assert {one.state for one in bpy.context.object.beyond_mocap_proposals.listed} == {"ACCEPTED"}
    assert rooms["timeline.proposals"].collect_sources(bpy.context.object) == before != {}
