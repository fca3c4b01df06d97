"""Words proposed by rules: planted kicks, gaits, turns and jumps are found where they are, and nothing else."""

from pathlib import Path

import numpy as np
import pytest

from beyond_mocap.annotation import build_clip_annotations, parse_timeline, read_clip_annotations
from beyond_mocap.annotation.text import format_timeline
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.folder.label_files import to_timeline
from beyond_mocap.library.proposals import GAITS, propose_labels
from beyond_mocap.motion.mirror import mirror
from beyond_mocap.motion.motion import place_motion, resample

SAMPLE = Path(__file__).resolve().parents[3] / "sample_blend" / "library"
REAL = Path(__file__).resolve().parents[4] / "shared" / "data" / "mocap"


def clip(name):
    return bvh.read_bvh(SAMPLE / f"{name}.bvh").motion


def written(name, fps):
    return read_clip_annotations(SAMPLE / f"{name}.txt", fps)


def with_word(motion, word):
    return [one for one in propose_labels(motion) if word in one.annotation.words]


def test_a_kick_is_found_with_its_frame_and_side():
    motion = clip("kick_low_top")
    (kick,) = with_word(motion, "kick")
    planted = next(row for row in written("kick_low_top", motion.fps) if row.key is not None)
    assert abs(kick.annotation.key - planted.key) * 120.0 / motion.fps <= 4.0  # it is at 60 fps: two frames
    assert {"kick", "right", "low", "top", "front"} <= set(kick.annotation.words)
    assert kick.annotation.start < kick.annotation.key < kick.annotation.end and 0.0 < kick.confidence <= 1.0
    assert "right foot" in kick.why


def test_mirrored_it_is_the_other_foot():
    (kick,) = with_word(mirror(clip("kick_low_top")), "kick")
    assert "left" in kick.annotation.words and "right" not in kick.annotation.words


def test_where_and_at_which_rate_it_is_recorded_does_not_matter():
    motion = clip("kick_low_top")
    (kick,), (moved,) = with_word(motion, "kick"), with_word(place_motion(motion, 2.0, (30.0, -4.0, 0.5)), "kick")
    assert moved.annotation == kick.annotation
    (slower,) = with_word(resample(motion, 30.0), "kick")
    assert abs(slower.annotation.key - kick.annotation.key / 2.0) <= 1.0


@pytest.mark.parametrize(
    "name", ["sprinting_8_6", "running_4_9", "jog_sprint_jog", "walking_back", "standing_turn_left", "celebration"]
)
def test_fast_strides_are_no_kicks(name):
    assert with_word(clip(name), "kick") == [] and with_word(clip(name), "jump") == []


@pytest.mark.parametrize("name", ["jog_sprint_jog", "run_stop_run", "stand_sprint_stop", "start_stop_walking",
                                  "walk_jog_walk", "walking_back", "walking_left"])
def test_gaits_and_directions_are_those_that_were_written(name):
    motion = clip(name)
    said, meant = np.full(len(motion), "", object), np.full(len(motion), "", object)
    for words, rows in ((said, [one.annotation for one in propose_labels(motion)]), (meant, written(name, motion.fps))):
        for row in rows:
            if row.words[0] in dict(GAITS):
                words[row.start : row.end + 1] = " ".join(row.words)
    assert np.mean(said == meant) > 0.75


def test_turns_on_the_spot_have_their_side():
    for side in ("left", "right"):
        (turn,) = with_word(clip(f"standing_turn_{side}"), "turning")
        assert turn.annotation.words == ("turning", side) and "degrees" in turn.why


def test_a_header_is_a_jump_in_which_the_head_strikes():
    motion = clip("header")
    (found,) = with_word(motion, "jump")
    planted = next(row for row in written("header", motion.fps) if row.key is not None)
    assert "header" in found.annotation.words and abs(found.annotation.key - planted.key) <= 2


def test_who_lies_and_gets_up():
    found = propose_labels(clip("getting_up"))
    assert any(one.annotation.words == ("ground",) for one in found)
    assert any(one.annotation.words == ("getting_up", "back") for one in found)


def test_a_library_says_what_its_gaits_are_called():
    motion = clip("jogging_2_9")
    assert [one.annotation.words for one in propose_labels(motion)] == [("jogging", "front")]
    other = propose_labels(motion, (("still", 0.0), ("walking", 0.4), ("running", 2.0)))
    assert [one.annotation.words for one in other] == [("running", "front")]


def test_they_can_be_edited_as_text():
    motion = clip("kick_low_top")
    found = propose_labels(motion)
    timeline = to_timeline([one.annotation for one in found], motion.fps)
    rows = build_clip_annotations(parse_timeline(format_timeline(timeline)), motion.fps)
    assert sorted((row.start, row.key) for row in rows if row.key) == sorted(
        (one.annotation.start, one.annotation.key) for one in found if one.annotation.key)


def test_short_and_still_clips_bring_no_trouble():
    motion = clip("standing_1")
    for count in (1, 2, 5):
        assert all(one.annotation.end < count for one in propose_labels(motion.frames(0, count)))


@pytest.mark.skipif(not (REAL / "annotations.csv").is_file(), reason="no recordings to measure on beside the clone")
def test_kicks_of_real_recordings():
    """Every labelled kick of one player: found, the side right, the key frame within 3 frames at 120 fps in nine of
    ten."""
    from beyond_mocap.annotation import read_annotation_csv

    near, sides, false, planted = [], 0, 0, 0
    for name, rows in read_annotation_csv(REAL / "annotations.csv").items():
        kicks = [row for row in rows if "kick" in row.words and row.key is not None]
        if not name.startswith(("cmu10/10_", "lmd/Player1/")) or not kicks:
            continue
        found = [one.annotation for one in propose_labels(bvh.read_bvh(REAL / name).motion)
                 if "kick" in one.annotation.words]
        planted += len(kicks)
        for kick in kicks:
            best = min(found, key=lambda one: abs(one.key - kick.key), default=None)
            if best is not None and abs(best.key - kick.key) < 24:
                near.append(abs(best.key - kick.key))
                sides += best.words[1] in kick.words
        false += len(found) - len(kicks)
    assert planted >= 25 and len(near) == planted and sides == planted and false <= 0
    assert np.mean(np.array(near) <= 3) >= 0.9
