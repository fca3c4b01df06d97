"""Side steps, backward walks and turns are made only where recordings lack them, by the library's own people, and told.
"""

import numpy as np
import pytest

from beyond_mocap.files.bvh import bvh
from beyond_mocap.library import coverage
from beyond_mocap.library.build import build_library
from beyond_mocap.library.clip import BACK_PREFIX, SIDE_PREFIX, STEP_PREFIX, SYNTHETIC_FOLDER, TURN_PREFIX
from beyond_mocap.library.missing_steps import iter_missing_steps
from beyond_mocap.library.synthetic_clips import sample_upright_example
from beyond_mocap.motion.humanoid import compute_heading_from_positions, identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.heading_request import HeadingKey
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthetic.gait import build_gait

pytestmark = pytest.mark.usefixtures("few_synthetic_runs")
FASTEST_RUN = 2.4  # none


def build(folder, **gaits):
    """A library of walks: name -> arguments of `build_gait` and labels."""
    for name, (speed, seconds, direction, labels) in gaits.items():
        motion = build_gait(speed, seconds, 30.0, direction=direction, seed=len(name))
        bvh.write_bvh(folder / f"{name}.bvh", motion)
        (folder / f"{name}.txt").write_text(f"0 {seconds:g} {labels}\n")
    return build_library(folder)


@pytest.fixture(scope="module")
def forward(tmp_path_factory):
    """Four walks ahead and a stand."""
    walks = {f"walk{n}": (speed, 7.0, 0.0, "walking") for n, speed in enumerate((0.9, 1.1, 1.3, 1.5))}
    return build(tmp_path_factory.mktemp("forward"), stand=(0.0, 7.0, 0.0, "standing"), **walks)


def list_steps(library):
    example = sample_upright_example(library.clips)
    return list(iter_missing_steps(library.clips, library.frames, library.fps, library.strangeness, library.coverage,
                                   example, 60.0))


@pytest.fixture(scope="module")
def steps(forward):
    """What `forward` lacks."""
    return list_steps(forward)


def made(library, begins):
    return [(i, clip) for i, clip in enumerate(library.clips) if clip.path.startswith(SYNTHETIC_FOLDER + begins)]


def test_a_library_that_only_walks_ahead_lacks_all_of_them(steps):
    names = [name for name, *_ in steps]
    for prefix, count in ((BACK_PREFIX, 2 * len(coverage.BACK_SPEEDS)), (SIDE_PREFIX, len(coverage.SIDE_WALKS)),
                          (TURN_PREFIX, len(coverage.TURNS)), (STEP_PREFIX, len(coverage.MOVES))):
        assert sum(name.startswith(prefix) for name in names) == count
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("direction, recorded, lacking", [(np.pi / 2.0, "side_90_0.8", "back_0.8_1"),
                                                          (np.pi, "back_0.8_1", "side_90_0.8")])
def test_what_is_recorded_is_not_made(tmp_path, direction, recorded, lacking):
    library = build(tmp_path, walk=(1.4, 10.0, 0.0, "walking"), slow=(0.8, 20.0, direction, "walking"))
    names = [name for name, *_ in list_steps(library)]
    assert recorded not in names and lacking in names
    assert not any(name.startswith((TURN_PREFIX, STEP_PREFIX)) for name in names)  # nobody stands


def test_without_a_walk_or_a_stand_nothing_is_made_of_it(tmp_path):
    library = build(tmp_path, run=(4.5, 8.0, 0.0, "running"))
    assert list_steps(library) == []


def test_a_backward_walk_is_the_recorded_one_and_its_feet_stand(forward, steps):
    body = identify_joints(forward.skeleton)
    for name, motion, contacts, speed in steps:
        if not name.startswith(BACK_PREFIX):
            continue
        places, _ = forward_kinematics(motion)
        facing = compute_heading_from_positions(motion.skeleton, places)
        travelled = (places[-1, 0] - places[0, 0])[:2] / motion.duration
        assert np.linalg.norm(travelled) == pytest.approx(speed, rel=0.06)
        assert np.cos(facing - np.arctan2(travelled[1], travelled[0])).max() < -0.9
        toes = places[:, [body.left.toe, body.right.toe], :2]
        slide = np.linalg.norm(np.diff(toes, axis=0), axis=-1)[contacts[1:, :, 1] & contacts[:-1, :, 1]] * motion.fps
        assert slide.mean() < 0.03, name
        heights = places[:, [body.left.toe, body.right.toe], 2]
        assert np.abs(np.diff(heights, axis=0)).max() * motion.fps < 2.5  # the loop closes without a jump


def test_trunk_and_arms_are_those_of_the_recorded_stand(forward, steps):
    stand = next(clip.motion for clip in forward.clips if clip.path == "stand.bvh" and not clip.mirrored)
    body = identify_joints(stand.skeleton)
    chains = [(body.left.upper_arm, body.left.lower_arm), (body.right.lower_arm, body.right.hand),
              (body.hips, body.neck_or_chest)]
    recorded, _ = forward_kinematics(stand)
    for name, motion, _, _ in steps:
        if name.startswith(STEP_PREFIX):
            places, _ = forward_kinematics(motion)
            for upper, lower in chains:
                mean, own = (np.mean(p[:, lower] - p[:, upper], axis=0) for p in (places, recorded))
                angle = np.arccos(mean @ own / np.linalg.norm(mean) / np.linalg.norm(own))
                assert np.degrees(angle) < 5.0, name


def test_the_same_library_gives_the_same_bits(forward, steps):
    for (name, motion, *_), (again, same, *_) in zip(steps, list_steps(forward), strict=True):
        assert name == again and np.array_equal(motion.rotations, same.rotations)


def test_their_frames_go_where_their_labels_say(forward):
    more = forward.with_synthetic_clips
    angle = np.degrees(np.arctan2(more.frames.velocity[:, 1], more.frames.velocity[:, 0]))
    for prefix, label, wanted in ((BACK_PREFIX, "back", 180.0), (SIDE_PREFIX + "90", "left", 90.0)):
        for index, clip in made(more, prefix):
            at = more.frames.clip == index
            side = -1.0 if clip.mirrored else 1.0
            assert {"left": "right"}.get(label, label) if clip.mirrored else label in clip.annotations[0].words
            off = (angle[at] * side - wanted + 180.0) % 360.0 - 180.0
            assert np.percentile(np.abs(off), 90) < 12.0


def test_a_player_who_goes_sideways_is_shown_side_steps_and_it_is_told(forward):
    times = np.arange(0.0, 8.0, 0.1)
    track = Track(times, np.stack([0.8 * times, 0.0 * times], axis=1))
    plan = Plan(track=track, heading_keys=(HeadingKey(0.0, heading=-np.pi / 2.0, hold=8.0),))
    take = synthesize(forward, plan)
    shown = np.array([name.startswith(f"{SYNTHETIC_FOLDER}{SIDE_PREFIX}90") for name in take.clips])
    assert shown.any()
    lack = forward.coverage.lines["sideways"]
    assert "hardly any steps sideways or diagonally at 0.5 to 1.5 m/s" in lack
    assert any(line.endswith(f"s in all): {lack}") for line in take.warnings)
    assert not any("steps sideways" in line for line in synthesize(forward, Plan(track=track)).warnings)
