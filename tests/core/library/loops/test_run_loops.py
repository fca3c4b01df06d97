"""Steady strides are repeated at an even tempo: the loop has the run's speed and stride, and no seam."""

import numpy as np
import pytest

from beyond_mocap.base.time_series import find_runs
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.library.coverage import select_locomotion
from beyond_mocap.library.loops.run_loops import LOOP_SECONDS, iter_run_loops
from beyond_mocap.motion.contacts import detect_heel_toe_contacts
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.phase_blend import find_strides, repeat_strides
from beyond_mocap.synthetic.gait import build_gait

SPEED = 3.4


@pytest.fixture(scope="module")
def runner(tmp_path_factory):
    """A short even run, a walk, and a run that speeds up throughout."""
    folder = tmp_path_factory.mktemp("runner")
    clips = {"run": (build_gait(SPEED, 2.6, 60.0, seed=1), "running"), "walk": (build_gait(1.2, 4.0, 60.0), "walking"),
             "start": (build_gait(np.linspace(2.3, 7.5, 80), None, 60.0, seed=2), "running")}
    for name, (motion, word) in clips.items():
        bvh.write_bvh(folder / f"{name}.bvh", motion)
        (folder / f"{name}.txt").write_text(f"0 {motion.duration:.2f} {word}\n")
    return build_library(folder)


def list_loops(library):
    is_run = select_locomotion(library.frames, library.clips)
    return list(iter_run_loops(library.clips, library.frames, library.fps, is_run, 60.0))


def test_only_the_steady_run_becomes_a_long_one(runner):
    loops = list_loops(runner)
    assert loops and all(speed == pytest.approx(SPEED, rel=0.08) for speed, _, _ in loops)
    for speed, motion, contacts in loops:
        assert motion.duration == pytest.approx(LOOP_SECONDS, abs=0.1) and contacts.shape == (len(motion), 2, 2)
        travelled = np.linalg.norm(motion.root_positions[-1, :2] - motion.root_positions[0, :2])
        assert travelled / motion.duration == pytest.approx(speed, rel=0.03)


def test_the_tempo_is_even_and_the_seams_are_smooth(runner):
    _, motion, contacts = list_loops(runner)[0]
    for side in (0, 1):
        landings = [first for first, _ in find_runs(contacts[:, side].any(axis=1))][1:]
        assert len(landings) > 6 and np.std(np.diff(landings)) / 60.0 <= 0.015
    recorded = next(clip.motion for clip in runner.clips if clip.path == "run.bvh")
    assert largest_jerk(motion) < 1.3 * largest_jerk(recorded)


def largest_jerk(motion) -> float:
    places, _ = forward_kinematics(motion)
    local = places - places[:, [identify_joints(motion.skeleton).hips]]
    return float(np.linalg.norm(np.diff(local, n=3, axis=0), axis=-1).max() * motion.fps**3)


def test_a_repeated_run_goes_straight_on():
    run = build_gait(SPEED, 3.0, 60.0, seed=1)
    strides = find_strides(run, detect_heel_toe_contacts(run)).select_steps(0, 3)
    motion, _ = repeat_strides(strides, 6.0, 60.0)
    assert abs(motion.root_positions[-1, 1]) < 0.05 * motion.root_positions[-1, 0]
