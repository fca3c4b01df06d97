"""The ball of a recording: read with the clip, where it was planted, and its contact as the key moment."""

import numpy as np
import pytest

from beyond_mocap.annotation import ClipAnnotation
from beyond_mocap.annotation.ball_contact import build_surfaces
from beyond_mocap.annotation.striking import trace_fastest_surface
from beyond_mocap.base.errors import InputError
from beyond_mocap.files.bvh import bvh
from beyond_mocap.files.tables import write_ball
from beyond_mocap.library.build import build_library
from beyond_mocap.library.recorded_ball import contact_keys
from beyond_mocap.library.recorded_ball.body_ball import read_recorded_ball
from beyond_mocap.motion.ball_names import is_ball_name
from beyond_mocap.motion.motion import Motion, compute_pose, sample_frames
from beyond_mocap.motion.track import BALL_RADIUS
from beyond_mocap.motion.track.ball_path import BallPath
from beyond_mocap.synthesis.search.key_fit import measure_strikes
from beyond_mocap.synthetic.gestures import build_strike

WORDS = "kick low inside right"
SPEED = 16.0  # m/s of the kicked ball


@pytest.fixture(scope="module")
def kick():
    return build_strike("kick low inside", fps=60.0)


def plant_ball(gesture, shift=(0.0, 0.0, 0.0)):
    """A ball (T, 3) m that lies at the striking foot and leaves along +X, and the frame in which it is struck."""
    motion, frame = gesture.motion, gesture.key * 60.0
    root, pose = sample_frames(motion, np.array([frame - 1.0, frame]))
    places, turns = compute_pose(motion.skeleton, root, pose)
    foot = trace_fastest_surface(build_surfaces(motion.skeleton, WORDS.split()), places, turns)[1]
    rest = np.array([foot[0] + 0.16, foot[1], BALL_RADIUS])
    after = np.maximum(np.arange(len(motion)) - frame, 0.0) / 60.0
    return rest + after[:, None] * [SPEED, 0.0, 0.0] + shift, frame


def write_table(path, ball, fps=60.0):
    write_ball(path, BallPath(np.arange(len(ball)) / fps, ball, np.ones(len(ball), bool)))


def write_bvh_with_balls(path, motion, **balls):
    """The motion below a still root, and beside it joints with places (T, 3) m."""
    bvh.write_bvh(path, motion)
    head, rows = path.read_text().split("MOTION\n")
    inside = "OFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\nEnd Site\n{\nOFFSET 0 10 0\n}\n"
    joints = "".join(f"JOINT {name}\n{{\n{inside}}}\n" for name in balls)
    body = head.removeprefix("HIERARCHY\n").replace("ROOT", "JOINT", 1)
    top, frames = f"HIERARCHY\nROOT World\n{{\nOFFSET 0 0 0\n{joints}{body}}}\n", rows.splitlines()
    places = np.concatenate([100.0 * ball[:, (0, 2, 1)] * (1, 1, -1) for ball in balls.values()], axis=1)
    lines = [" ".join(map(str, place)) + " " + row for place, row in zip(places, frames[2:])]
    path.write_text(top + "MOTION\n" + "\n".join([*frames[:2], *lines]) + "\n")


@pytest.fixture
def folder(tmp_path, clip_file, kick):
    """A library of a walk and a kick whose key moment was labelled 0.1 s late."""
    clip_file(tmp_path / "walk.bvh")
    bvh.write_bvh(tmp_path / "kick.bvh", kick.motion)
    late = kick.key + 0.1
    (tmp_path / "kick.txt").write_text(f"{kick.start:.3f} {kick.end:.3f} {WORDS}\n{late:.3f} {WORDS}\n")
    return tmp_path


def find_clip(library, mirrored=False):
    return next(clip for clip in library.clips if (clip.path, clip.mirrored) == ("kick.bvh", mirrored))


def find_key(clip):
    return next(row.key for row in clip.annotations if row.key is not None)


@pytest.mark.parametrize("form", ["table", "joint"])
def test_the_planted_ball_and_its_contact_come_back(folder, kick, form):
    ball, frame = plant_ball(kick)
    if form == "table":
        write_table(folder / "kick.ball.csv", ball)
    else:
        write_bvh_with_balls(folder / "kick.bvh", kick.motion, Ball=ball)
    for library in (build_library(folder, unit=0.01), build_library(folder, unit=0.01)):  # the second from its cache
        clip, twin = find_clip(library), find_clip(library, True)
        away, planted = clip.ball - clip.motion.root_positions, ball - kick.motion.root_positions
        assert np.abs(away - planted)[:, :2].max() < 1e-3 and np.abs(away - planted).max() < 0.02
        assert np.allclose(twin.ball, clip.ball * [1, -1, 1])
        assert abs(find_key(clip) - frame) < 0.6 and find_key(twin) == find_key(clip)
        found = measure_strikes(library, [key for key in library.keys if key.clip == library.clips.index(clip)])
        at = round(frame)
        assert np.abs(found.place[0] - (ball[at] - kick.motion.root_positions[at])[:2]).max() < 0.15
        assert found.height[0] == pytest.approx(ball[at, 2], abs=0.02)


def test_a_library_without_a_ball_keeps_its_key_moments(folder, kick):
    clip = find_clip(build_library(folder, unit=0.01))
    assert clip.ball is None and find_key(clip) == round((kick.key + 0.1) * 60.0)


@pytest.mark.parametrize("words, met", [("kick low inside right", 0), ("dribble right", -14)])
def test_a_touch_of_the_run_up_is_no_kick(kick, monkeypatch, words, met):
    monkeypatch.setattr(contact_keys, "measure_contact_gap", lambda *given: np.zeros(len(given[-1])))
    frame = 40
    ahead = np.maximum(np.arange(len(kick.motion)) - frame + 14, 0) * 1.5 / 60.0
    ahead += np.maximum(np.arange(len(kick.motion)) - frame, 0) * SPEED / 60.0
    ball = np.column_stack([ahead, 0.0 * ahead, np.full(len(ahead), BALL_RADIUS)])
    row = ClipAnnotation(start=0.0, end=len(ball) - 1.0, key=frame - 12.0, words=tuple(words.split()))
    assert contact_keys.find_contact_frame(kick.motion, ball, row) == pytest.approx(frame + met, abs=0.6)


def test_a_ball_that_only_bounces_beside_the_foot_is_no_contact(folder, kick):
    ball, frame = plant_ball(kick)
    ball[:] = ball[0]
    seconds = np.abs(np.arange(len(ball)) - frame - 8) / 60.0
    ball[:, 2] += 3.0 * seconds
    write_table(folder / "kick.ball.csv", ball)
    assert find_key(find_clip(build_library(folder, unit=0.01))) == round((kick.key + 0.1) * 60.0)


def test_a_ball_on_another_body_stays_at_its_foot(folder, kick):
    ball, frame = plant_ball(kick)
    child = Motion(kick.motion.skeleton.scale(0.7), kick.motion.root_positions * 0.7, kick.motion.rotations, 60.0)
    bvh.write_bvh(folder / "kick.bvh", child)
    small = ball * 0.7
    small[:, 2] = BALL_RADIUS
    write_table(folder / "kick.ball.csv", small)
    clip = find_clip(build_library(folder, unit=0.01, skeleton=folder / "walk.bvh"))
    assert clip.ball[:, 2].min() == pytest.approx(BALL_RADIUS, abs=0.02)
    away = clip.ball[round(frame)] - clip.motion.root_positions[round(frame)]
    assert np.abs(away - (ball - kick.motion.root_positions)[round(frame)])[:2].max() < 0.05


def test_a_ball_of_a_conversion_is_in_the_unit_of_its_body(tmp_path, kick):
    """A file in centimetres that was taken for metres: its body is a hundred times as large, and so is its ball."""
    ball, _ = plant_ball(kick)
    giant = Motion(kick.motion.skeleton.scale(100.0), kick.motion.root_positions * 100.0, kick.motion.rotations, 60.0)
    converted = tmp_path / "converted" / "kick.fbx.bvh"
    converted.parent.mkdir()
    bvh.write_bvh(converted, giant)
    write_table(converted.parent / "kick.fbx.ball.csv", ball * 100.0)
    source = bvh.read_bvh(converted)
    found, notes = read_recorded_ball(tmp_path / "kick.fbx", converted, source)
    away, size = found.place(source.motion) - source.motion.root_positions, source.form.unit / 1e-4  # it is estimated
    assert notes == () and size == pytest.approx(1.0, abs=0.05)
    assert np.abs(away - size * (ball - kick.motion.root_positions)).max() < 0.01


def test_bad_balls_are_named_in_a_line(folder, kick):
    ball, frame = plant_ball(kick)
    table = folder / "kick.ball.csv"

    def read_notes():
        library = build_library(folder, unit=0.01)
        return find_clip(library), [note for note in library.notes if "ball" in note]

    write_table(table, np.full_like(ball, np.nan))
    clip, notes = read_notes()
    assert clip.ball is None and "is not known at any time" in notes[0]
    write_table(table, ball + [5000.0, 0.0, 0.0])
    clip, notes = read_notes()
    assert clip.ball is None and "m from the body at its nearest" in notes[0]
    write_table(table, ball[: round(frame) + 20])
    clip, notes = read_notes()
    assert np.isnan(clip.ball[-1]).all() and "is not known for" in notes[0]
    assert abs(find_key(clip) - frame) < 0.6
    table.write_text("time_s,x_m\n0,0\n")
    with pytest.raises(InputError, match="kick.ball.csv:1: no column"):
        build_library(folder, unit=0.01)


def test_of_two_balls_the_nearer_one_counts(folder, kick):
    ball, _ = plant_ball(kick)
    write_bvh_with_balls(folder / "kick.bvh", kick.motion, ball1=ball + [20.0, 0.0, 0.0], ball2=ball)
    library = build_library(folder, unit=0.01)
    assert np.abs((find_clip(library).ball - find_clip(library).motion.root_positions)
                  - (ball - kick.motion.root_positions)).max() < 0.02
    assert any("2 balls (ball1, ball2): ball2 is used" in note for note in library.notes)


def test_balls_of_the_feet_are_no_balls():
    assert all(map(is_ball_name, ("Ball", "actor:ball", "Soccer_Ball", "football", "ball.001", "Prop", "basketball 2")))
    assert not any(map(is_ball_name, ("ball_l", "LeftFootBall", "Ball_R", "RightHandProp", "head", "balls_mesh")))
