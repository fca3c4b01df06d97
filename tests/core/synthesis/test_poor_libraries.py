"""Libraries that lack nearly everything, and tracks that no player walks, still give a sensible body, and a line."""

import numpy as np
import pytest

from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.library.clip import SYNTHETIC_FOLDER, TURN_PREFIX
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, compute_local_rotations, forward_kinematics
from beyond_mocap.motion.retargeting.structure import list_descendants
from beyond_mocap.motion.track import Track, clean_track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.quality import movement
from beyond_mocap.synthesis.quality.playback import playback_from_take
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthetic.gait import build_gait

pytestmark = pytest.mark.usefixtures("few_synthetic_runs")
FASTEST_RUN = 5.5  # a little faster than the tracks
NOISE = np.random.default_rng(5)
TIMES = np.arange(0.0, 10.0, 0.04)
FIGHT = 0.7 + 0.6 * np.sin(2.0 * np.pi * np.arange(240) / 30.0 / 1.5)
LIBRARIES = {
    "a walk": {"walk": (1.3, "walking")},
    "a second of a sprint": {"sprint": (np.full(36, 8.0), "sprinting")},
    "runs": {"run": (3.2, "running"), "fast": (4.6, "running")},
    "fights": {"fight": (FIGHT, "walking"), "push": (FIGHT[::-1] * 0.9, "walking")},
    "boxing": {"box": (0.0, "standing"), "advance": (1.1, "walking"), "after": (1.4, "walking")},
    "no turn": {"walk": (1.3, "walking"), "stand": (0.0, "standing"), "run": (4.0, "running")},
}


def build(folder, name):
    for clip, (speed, words) in LIBRARIES[name].items():
        motion = build_gait(speed, None if np.ndim(speed) else 6.0, 30.0)
        bvh.write_bvh(folder / f"{clip}.bvh", raise_fists(motion) if name == "boxing" else motion)
        (folder / f"{clip}.txt").write_text(f"0 6 {words}\n")
    return build_library(folder)


def raise_fists(motion):
    """Raise the arms of a body that faces +X into a guard: upper arms ahead, fists before the face."""
    body, (_, world) = identify_joints(motion.skeleton), forward_kinematics(motion)
    for joint, angle in ((body.left.upper_arm, 60.0), (body.right.upper_arm, 60.0), (body.left.lower_arm, 70.0),
                         (body.right.lower_arm, 70.0)):
        turn = quaternion.from_axis_angle(np.array([0.0, -1.0, 0.0]), np.radians(angle))
        arm = [joint, *list_descendants(motion.skeleton.parents, joint)]
        world[:, arm] = quaternion.multiply(turn, world[:, arm])
    return Motion(motion.skeleton, motion.root_positions, compute_local_rotations(motion.skeleton, world), motion.fps)


@pytest.fixture(scope="module")
def poor(tmp_path_factory):
    """poor(name): a library of LIBRARIES, built once."""
    built = {}

    def find(name):
        if name not in built:
            built[name] = build(tmp_path_factory.mktemp(name.replace(" ", "_")), name)
        return built[name]

    return find


def straight(speed):
    """A straight path (T, 2) at speeds (T,) m/s."""
    return np.column_stack([np.cumsum(speed) * 0.04, np.zeros(len(TIMES))])


WALK = np.column_stack([1.2 * TIMES, np.sin(0.5 * TIMES)])
TRACKS = {
    "walks, stands and runs": straight(np.interp(TIMES, [2, 3, 5, 6, 8], [1.2, 0.0, 0.0, 1.2, 5.0])),
    "jitters": WALK + NOISE.normal(0.0, 0.2, WALK.shape),
    "jitters where it stands": NOISE.normal(0.0, 0.2, WALK.shape),
    "jumps": WALK + np.where(TIMES > 5.0, 5.0, 0.0)[:, None],
}


def synthesize_path(library, path):
    """Synthesize a track without a ball; check that the body is one and on its track, and return the take."""
    track, _ = clean_track(Track(np.arange(len(path)) * 0.04, path))
    take = synthesize(library, Plan(track=track))
    played = playback_from_take(take)
    assert np.isfinite(take.motion.root_positions).all() and np.isfinite(take.motion.rotations).all()
    assert played.positions[..., 2].min() > -0.05 and 1.2 < played.positions[..., 2].max() < 2.2
    target = movement.interpolate_track(track, played.times)
    error = movement.measure_root_error(played.pelvis, target, take.motion.fps)
    is_slow = movement.measure_travel_speed(target, take.motion.fps) < 1.0
    is_told = any("off the track" in line for line in take.warnings)
    assert is_told or (error[is_slow].max(initial=0.0) < 0.2 and error[~is_slow].max(initial=0.0) < 0.05)
    assert error.max() < 0.35 and take.ball is None
    return take


@pytest.mark.parametrize("name", LIBRARIES)
def test_a_poor_library_moves_any_player_and_says_what_it_lacks(poor, name):
    take = synthesize_path(poor(name), TRACKS["walks, stands and runs"])
    assert any("add" in line for line in take.warnings) or name == "no turn"
    assert all("\n" not in line for line in take.warnings)
    slides = [line for line in take.warnings if "a planted foot slides" in line]
    assert not slides or float(slides[0].split("up to ")[1].split(" cm")[0]) < 30.0


@pytest.mark.parametrize("path", TRACKS)
def test_no_track_breaks_a_poor_library(poor, path):
    synthesize_path(poor("no turn"), TRACKS[path])


@pytest.mark.parametrize("name, standing", [("a walk", True), ("runs", True), ("no turn", False)])
def test_a_player_who_stands_for_minutes_stands(poor, name, standing):
    take = synthesize_path(poor(name), NOISE.normal(0.0, 0.005, (3000, 2)))
    feet = playback_from_take(take).feet[:, :, 1, :2]
    assert np.linalg.norm(feet - np.median(feet, axis=0), axis=-1).max() < 0.25
    assert any("a synthetic stand is shown" in line for line in take.warnings) == standing


def test_a_turn_that_the_library_lacks_is_told_with_its_seconds(poor):
    angle = np.interp(TIMES, [3.0, 6.0], [0.0, np.pi])
    ball = 5.0 * np.column_stack([np.cos(angle), np.sin(angle), np.full(len(TIMES), 0.02)])
    take = synthesize(poor("no turn"), Plan(track=Track(TIMES, np.zeros((len(TIMES), 2)), ball)))
    line, = [line for line in take.warnings if "hardly any turns in place: add some" in line]
    assert any(first < 6.0 and last > 3.0 for first, last in line.spans)
    is_synthetic = any(name.startswith(SYNTHETIC_FOLDER + TURN_PREFIX) for name in take.clips)
    assert line.endswith("until then synthetic ones are shown" if is_synthetic else "the nearest recording is shown")


@pytest.mark.parametrize("name", ["fights", "boxing"])
def test_a_library_with_fights_alone_says_that_nothing_is_known_to_belong(poor, name):
    lack = poor(name).coverage.lines["belonging"]
    assert lack.startswith("nothing recorded surely belongs to calm standing or walking")
    assert lack.endswith("until then players move as these recordings do")
    take = synthesize_path(poor(name), WALK)
    line, = [line for line in take.warnings if line.endswith(lack)]
    played = playback_from_take(take)
    is_recorded = np.array([not name.startswith(SYNTHETIC_FOLDER) for name in played.clips])[played.clip]
    seconds = np.sum(is_recorded) / take.motion.fps
    assert seconds > 2.0 and sum(last - first for first, last in line.spans) == pytest.approx(seconds, abs=0.1)


def test_a_library_that_walks_belongs_to_walking(poor):
    assert "belonging" not in poor("a walk").coverage.lines
    assert not any("surely belongs" in line for line in synthesize_path(poor("a walk"), WALK).warnings)
