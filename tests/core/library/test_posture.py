"""What belongs to a library's locomotion is learned from the library: a guard among walks stands out, by no name."""

import re
from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.library.left_out import describe_left_out, find_left_out, measure_speed_classes
from beyond_mocap.library.loops.standing_loops import LOOP_SECONDS, find_stands, iter_standing_loops
from beyond_mocap.library.posture import PARTS, NormalPostures
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, compute_pose, forward_kinematics
from beyond_mocap.synthetic.gait import build_gait


def with_guard(motion: Motion) -> Motion:
    """The same walk with both forearms up before the face."""
    body, rotations = identify_joints(motion.skeleton), motion.rotations.copy()
    _, world = compute_pose(motion.skeleton, motion.root_positions, rotations)
    for limb in (body.left, body.right):
        left = quaternion.rotate(quaternion.inverse(world[:, limb.lower_arm]), np.broadcast_to([0, 1.0, 0],
                                                                                               (len(motion), 3)))
        bend = quaternion.from_axis_angle(left, np.full(len(motion), -2.0))
        rotations[:, limb.lower_arm] = quaternion.multiply(rotations[:, limb.lower_arm], bend)
    return Motion(motion.skeleton, motion.root_positions, rotations, motion.fps)


def write_clip(path, motion: Motion, text: str) -> None:
    bvh.write_bvh(path, motion)
    path.with_suffix(".txt").write_text(text)


@pytest.fixture(scope="module")
def guarded(tmp_path_factory):
    """Four walks, one of them again with a guard, and a stand."""
    folder = tmp_path_factory.mktemp("guarded")
    for number, speed in enumerate((0.9, 1.0, 1.1, 0.95)):
        write_clip(folder / f"walk{number}.bvh", build_gait(speed, 6.0, 30.0, seed=number), "0 6 walking\n")
    write_clip(folder / "guard.bvh", with_guard(build_gait(1.0, 6.0, 30.0, seed=9)), "0 6 walking\n")
    write_clip(folder / "stand.bvh", build_gait(0.0, 6.0, 30.0, seed=3), "0 6 standing\n")
    return build_library(folder)


@pytest.fixture(scope="module")
def outnumbered(tmp_path_factory):
    """Two steady walks and a stand among six fights: guards that step to and fro, labelled walking by their speed."""
    folder = tmp_path_factory.mktemp("outnumbered")
    for number, speed in enumerate((0.95, 1.1)):
        write_clip(folder / f"walk{number}.bvh", build_gait(speed, 8.0, 30.0, seed=number), "0 8 walking\n")
    write_clip(folder / "stand.bvh", build_gait(0.0, 6.0, 30.0, seed=3), "0 6 standing\n")
    seconds = np.arange(240) / 30.0
    for number in range(6):
        speed = 0.6 + 0.4 * np.sin(2.0 * np.pi * seconds / (1.6 + 0.1 * number))
        write_clip(folder / f"fight{number}.bvh", with_guard(build_gait(speed, None, 30.0, seed=10 + number)),
                   "0 8 walking\n")
    return build_library(folder)


def strangeness_of(library, path):
    clip = next(i for i, clip in enumerate(library.clips) if clip.path == path and not clip.mirrored)
    first = library.frames.first[clip]
    return library.strangeness[first : first + library.frames.count[clip]]


def test_a_guard_is_no_walk_and_walks_are(guarded):
    assert np.mean(strangeness_of(guarded, "guard.bvh") > 1.5) > 0.9
    assert all(np.mean(strangeness_of(guarded, f"walk{number}.bvh") > 1.0) < 0.05 for number in range(4))


def test_a_mirrored_posture_is_as_usual(guarded):
    half = len(guarded.frames) // 2
    by_clip = {(clip.path, clip.mirrored): guarded.strangeness[guarded.frames.clip == i].mean()
               for i, clip in enumerate(guarded.clips)}
    for clip in guarded.clips:
        assert by_clip[clip.path, False] == pytest.approx(by_clip[clip.path, True], rel=0.1)
    assert half * 2 == len(guarded.frames)


def test_a_stand_is_played_forth_and_back(guarded):
    (path, loop), *_ = iter_standing_loops(guarded.clips, guarded.frames, guarded.fps, guarded.strangeness, 60.0)
    assert path == "stand.bvh" and loop.duration == pytest.approx(LOOP_SECONDS, abs=0.1)
    body = identify_joints(loop.skeleton)
    places, _ = forward_kinematics(loop)
    feet = places[:, [body.left.foot, body.right.foot], :2]
    assert np.ptp(feet, axis=0).max() < 0.03
    recorded = next(clip.motion for clip in guarded.clips if clip.path == path and not clip.mirrored)
    fastest = np.abs(np.diff(recorded.root_positions, axis=0)).max() * recorded.fps
    assert np.abs(np.diff(loop.root_positions, axis=0)).max() * loop.fps <= 1.05 * fastest


def test_who_gets_ready_to_jump_does_not_stand(guarded):
    """Played forward and backward, that would be squats."""
    frames = guarded.frames
    hips = frames.posture[:, PARTS["hips"]]
    lower = 0.2 * np.clip((frames.source[:, None] - 60.0) / 60.0, 0.0, 1.0)
    sinking = replace(frames, posture=np.concatenate([hips - lower, frames.posture[:, PARTS["hips"].stop :]], axis=1))
    calm, most = np.zeros(len(frames)), {}
    for name, one in (("stands", frames), ("sinks", sinking)):
        stands = find_stands(guarded.clips, one, guarded.fps, calm)
        most[name] = max(end - first for _, first, end in stands)
        assert all(np.ptp(one.posture[first:end, 0]) < 0.1 for _, first, end in stands)
    assert most["sinks"] < 0.6 * most["stands"]


def test_fights_that_outnumber_walks_are_still_no_locomotion(outnumbered):
    assert all(np.mean(strangeness_of(outnumbered, f"fight{number}.bvh") > 1.0) > 0.9 for number in range(6))
    assert all(np.mean(strangeness_of(outnumbered, name) > 1.0) < 0.05 for name in ("walk0.bvh", "walk1.bvh",
                                                                                   "stand.bvh"))


def test_a_few_seconds_of_runs_are_not_judged_by_walks(tmp_path):
    """Nor by stands, nor sprints by jogs: only the next faster class of the same gait judges."""
    for number, (speed, seconds) in enumerate(((0.9, 8.0), (1.6, 8.0), (2.7, 1.4), (3.5, 1.4), (6.0, 1.4))):
        gait = "walking" if speed < 2.0 else "running"
        motion = build_gait(speed, seconds, 30.0, seed=number)
        write_clip(tmp_path / f"{gait}{number}.bvh", motion, f"0 {seconds} {gait}\n")
    library = build_library(tmp_path)
    assert set(library.normal_postures.regions) == {1, 2} and find_left_out(library) == ()
    assert not any(strangeness_of(library, f"running{number}.bvh").any() for number in (2, 3, 4))


@pytest.mark.parametrize("known, judged", [({1, 2}, (0, 1, 2)), ({0}, (0,)), ({2, 4}, (0, 1, 2, 3, 4)),
                                           ({5}, (3, 4, 5)), (set(), ())])
def test_a_class_without_a_region_is_judged_by_the_next_faster_of_its_gait(known, judged):
    speeds = np.array([0.2, 0.8, 1.6, 2.5, 4.0, 6.0])
    region = np.zeros(18), np.eye(18), 1.0
    postures = NormalPostures({kind: region for kind in known})
    assert tuple(np.flatnonzero(postures.measure_strangeness(np.full((6, 18), 9.0), speeds))) == judged
    assert bool(postures.measure_parts(np.full((2, 18), 9.0), speeds[[0, 5]])) == bool({0, 5} & set(judged))


def test_hops_are_no_walk(tmp_path):
    for number, speed in enumerate((0.9, 1.0, 1.1)):
        write_clip(tmp_path / f"walk{number}.bvh", build_gait(speed, 8.0, 30.0, seed=number), "0 8 walking\n")
    walk = build_gait(1.0, 8.0, 30.0, seed=7)
    since = np.arange(len(walk))[:, None] / walk.fps - [3.5, 4.0, 4.5]
    hop = np.maximum(0.19 - 0.5 * 9.81 * since**2, 0.0).sum(axis=1)[:, None] * [0.0, 0.0, 1.0]  # 19 cm high
    write_clip(tmp_path / "hop.bvh", replace(walk, root_positions=walk.root_positions + hop), "0 8 walking\n")
    library = build_library(tmp_path)
    strange = np.flatnonzero(strangeness_of(library, "hop.bvh") > 1.0) / library.fps
    assert 3.3 < strange.min() < 3.6 and 4.6 < strange.max() < 4.9
    assert [one.reason.split(" unlike")[0] for one in find_left_out(library)] == ["hips (falling)"]


def test_side_steps_belong(tmp_path):
    for number, speed in enumerate((0.9, 1.0, 1.1)):
        write_clip(tmp_path / f"walk{number}.bvh", build_gait(speed, 8.0, 30.0, seed=number), "0 8 walking\n")
    write_clip(tmp_path / "aside.bvh", build_gait(0.8, 8.0, 30.0, direction=np.pi / 2.0), "0 8 walking left\n")
    assert np.mean(strangeness_of(build_library(tmp_path), "aside.bvh") > 1.0) < 0.1


def test_what_is_left_out_is_listed_with_seconds_and_the_part_of_the_body(outnumbered):
    found = find_left_out(outnumbered)
    assert {one.clip for one in found} == {f"fight{number}.bvh" for number in range(6)}
    longest = max(found, key=lambda one: one.end - one.start)
    assert longest.part == "arms" and longest.end - longest.start > 7.0
    assert re.fullmatch(r"arms \((hands|elbows) up\) unlike walking at 0\.\d m/s", longest.reason)
    heading, *lines = describe_left_out(outnumbered, 2)
    assert re.match(r"4\d s left out of locomotion: ", heading) and len(lines) == 3
    assert re.match(r"fight\d\.bvh \d\.\d to \d\.\d s: arms", lines[0])


def test_seconds_are_counted_by_speed(outnumbered):
    classes = measure_speed_classes(outnumbered)
    assert sum(one.seconds for one in classes) == pytest.approx(8 * 8.0 + 6.0, abs=1.0)
    assert sum(one.left_out for one in classes) == pytest.approx(6 * 8.0, rel=0.1)
    assert classes[0].low == 0.0 and classes[-1].high == np.inf


def test_where_all_belongs_nothing_is_left_out(tmp_path):
    for number, speed in enumerate((0.9, 1.1)):
        write_clip(tmp_path / f"walk{number}.bvh", build_gait(speed, 8.0, 30.0, seed=number), "0 8 walking\n")
    assert describe_left_out(build_library(tmp_path), 5) == []
