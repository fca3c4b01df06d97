"""A small made library with planted truths (speeds, a kick's moment), and made tracks, for the core's tests."""

import gc
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from beyond_mocap.annotation import Timeline, parse_timeline
from beyond_mocap.cli.main import main
from beyond_mocap.files.bvh import bvh
from beyond_mocap.library import synthetic_clips
from beyond_mocap.library.build import build_library
from beyond_mocap.library.library import Library
from beyond_mocap.motion import quaternion
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import Motion, compute_pose
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.motion.track import Track
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.synthesize import synthesize
from beyond_mocap.synthesis.take import Take
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.gestures import build_strike
from beyond_mocap.synthetic.lying import build_lying_pose
from beyond_mocap.synthetic.moves import build_get_up

# clip -> metres per second, words

SPEEDS = {"stand": (0.0, "standing"), "walk": (1.4, "walking"), "jog": (2.8, "jogging"), "run": (5.0, "running")}
KICK = "kick low inside right"
LONGEST = ("synthesis", "markers", "match", "library", "evaluation", "passes", "throws", "synthetic", "test_package.py")
"""The rooms of more than half a minute, the longest first."""
HERE = Path(__file__).resolve().parent
SAMPLE_LIBRARY = HERE.parents[1] / "sample_blend" / "library"
RECORDINGS = HERE.parents[2] / "shared" / "data" / "mocap" / "cmu10"


def pytest_configure(config):
    """Let xdist keep the order of rooms; it would begin with those of many tests."""
    config.option.loadscopereorder = False


@pytest.hookimpl(tryfirst=True)  # xdist reads the groups in the same hook
def pytest_collection_modifyitems(items):
    """The tests of one room run in one process, so that its session fixtures are made once; so do all checks of the
    source, which share its syntax trees. The longest rooms begin, so that both processes end together."""
    for item in items:
        item.add_marker(pytest.mark.xdist_group(find_room(item)))
    items.sort(key=lambda item: LONGEST.index(room) if (room := find_room(item)) in LONGEST else len(LONGEST))


def find_room(item) -> str:
    """The folder of a test, or its file where that is no room."""
    if item.path.parent == HERE:
        return "source"
    return item.path.relative_to(HERE).parts[0] if item.path.is_relative_to(HERE) else item.path.name


gc.disable()  # while tests are collected, of which none is garbage


def pytest_collection_finish():
    """Let the garbage collector pass over what stays to the end: the tests, their code and what they import."""
    gc.freeze()
    gc.enable()


def pytest_sessionfinish():
    """Collect garbage before a worker says that it is done. Pytest does it five times more, and execnet interrupts
    a worker that then takes longer than five seconds; what is left now is not looked at again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def sample_cache(tmp_path_factory) -> Path:
    """The cache of the sample library, with its synthetic clips in it; processes side by side share it."""
    place = find_shared_folder(tmp_path_factory) / "sample_cache"
    assert build_library(SAMPLE_LIBRARY, cache_dir=place).with_synthetic_clips.clips
    return place


@pytest.fixture(scope="session")
def recordings_cache(tmp_path_factory) -> Path:
    """The same of RECORDINGS, whose unit is an inch over 0.45."""
    place = find_shared_folder(tmp_path_factory) / "recordings_cache"
    assert build_library(RECORDINGS, unit=0.05644, cache_dir=place).with_synthetic_clips.clips
    return place


def find_shared_folder(tmp_path_factory) -> Path:
    """Find the folder of all processes of this run, or of all runs of `make test`."""
    if "TESTS_CACHE" in os.environ:
        return Path(os.environ["TESTS_CACHE"])
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


def write_clip(path: Path, motion: Motion, text: str) -> Path:
    """One recording and its words, which stand in a file beside it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    bvh.write_bvh(path, motion)
    path.with_suffix(".txt").write_text(text)
    return path


@pytest.fixture(scope="session")
def clip_file():
    """clip_file(path, speed=1.4, seconds=3.0, words="walking", fps=30, **gait): a made gait and its words."""

    def write_gait(path, speed=1.4, seconds=3.0, words="walking", fps=30.0, **more) -> Path:
        text = f"0 {seconds:g} {words}\n" if words else "# nothing\n"
        return write_clip(Path(path), build_gait(speed, seconds, fps, **more), text)

    return write_gait


@pytest.fixture(scope="session")
def clips_folder(tmp_path_factory) -> Path:
    """stand, walk, jog and run at SPEEDS, a walk that turns left, and a right kick (60 fps); what is built of them is
    kept for processes side by side."""
    folder, cache = tmp_path_factory.mktemp("clips"), find_shared_folder(tmp_path_factory) / "clips_cache"
    cache.mkdir(parents=True, exist_ok=True)
    (folder / ".beyond_mocap").symlink_to(cache, target_is_directory=True)
    for seed, (name, (speed, words)) in enumerate(SPEEDS.items()):
        write_clip(folder / f"{name}.bvh", build_gait(speed, 5.0, 30.0, seed=seed), f"0 5 {words}\n")
    write_clip(folder / "bows" / "turn.bvh", build_gait(1.4, 4.0, 60.0, turn_rate=0.9, seed=7), "0 4 walking left\n")
    kick = build_strike("kick low inside", fps=60.0)
    text = f"0 2 jogging front\n{kick.start:.3f} {kick.end:.3f} {KICK}\n{kick.key:.3f} {KICK}\n"
    write_clip(folder / "kick.bvh", kick.motion, text)
    return folder


@pytest.fixture
def run(capfd):
    """run(*arguments) -> status of the command line, standard output, lines on standard error."""

    def call(*arguments):
        capfd.readouterr()
        status = main([str(argument) for argument in arguments])
        out, error = capfd.readouterr()
        return status, out, error.splitlines()

    return call


@pytest.fixture(scope="session")
def library(clips_folder) -> Library:
    return build_library(clips_folder)


@pytest.fixture(scope="session")
def strikes_library(tmp_path_factory) -> Library:
    """The library of the passing samples."""
    samples = Path(__file__).resolve().parents[2] / "sample_blend" / "passes" / "library"
    return build_library(samples, cache_dir=tmp_path_factory.mktemp("strikes"))


@pytest.fixture(scope="module")
def few_synthetic_runs(request):
    """Synthetic runs, half of the work of completing a library, end at the module's FASTEST_RUN, m/s: test_made.py has
    them up to a sprint."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(synthetic_clips, "MAX_SPEED", request.module.FASTEST_RUN)
        yield


@pytest.fixture(scope="session")
def kick_seconds() -> float:
    """When the ball is kicked in the made clip."""
    return build_strike("kick low inside", fps=60.0).key


class Flight(NamedTuple):
    """A planted flight: its motion, and place (3,) m and speed (3,) m/s of the body's middle at its end."""

    motion: Motion
    place: np.ndarray
    speed: np.ndarray

    def compute_middle(self, seconds: np.ndarray) -> np.ndarray:
        """(T, 3) m, seconds (T,) from the end."""
        return self.place + seconds[:, None] * self.speed + [0.0, 0.0, -0.5 * 9.81] * seconds[:, None] ** 2


@pytest.fixture(scope="session")
def flight() -> Flight:
    """0.3 s at 100 fps of a dive to the left, arms stretched, leaning 50 degrees at its end and more by 1.5 rad/s."""
    skeleton = build_adult_skeleton()
    body = identify_joints(skeleton)
    seconds = np.arange(-30, 1) / 100.0
    local = np.tile(build_lying_pose(build_neutral_stance(skeleton), True, settled=False), (len(seconds), 1, 1))
    upright = build_get_up(skeleton, 100.0).motion.rotations[-1, 0]
    lean = quaternion.from_rotation_vector((-np.radians(50.0) - 1.5 * seconds)[:, None] * [1.0, 0.0, 0.0])
    local[:, 0] = quaternion.multiply(lean, upright)
    places, _ = compute_pose(skeleton, np.zeros((len(seconds), 3)), local)
    away = places[:, body.hips] + 0.25 * (places[:, body.neck] - places[:, body.hips])
    found = Flight(None, np.array([0.0, 0.0, 1.1]), np.array([0.6, 2.5, -0.8]))
    return found._replace(motion=Motion(skeleton, found.compute_middle(seconds) - away, local, 100.0))


@pytest.fixture(scope="session")
def dive_file(flight):
    """dive_file(path): half a second of standing, a take-off to the left, and the planted flight; its words name the
    dive, its key is where the flight begins."""

    def write_dive(path) -> Path:
        standing = build_get_up(flight.motion.skeleton, 100.0).motion
        away = flight.motion.root_positions[0] - [0.0, 0.4, 0.0]
        count, take_off = 50, np.linspace(0.0, 1.0, 22)[1:-1, None]
        root = np.tile([*away[:2], standing.root_positions[-1, 2]], (count, 1))
        lifted = root[-1] + take_off * (flight.motion.root_positions[0] - root[-1])
        still = np.tile(standing.rotations[-1], (count, 1, 1))
        turned = quaternion.slerp(still[:1], flight.motion.rotations[:1], take_off)
        whole = Motion(
            flight.motion.skeleton,
            np.concatenate([root, lifted, flight.motion.root_positions]),
            np.concatenate([still, turned, flight.motion.rotations]),
            100.0,
        )
        text = f"20f {len(whole) - 1}f dive left high\n{count + 20}f dive left high\n0 0.4 standing\n"
        return write_clip(Path(path), whole, text)

    return write_dive


@pytest.fixture(scope="session")
def track_of():
    """track_of(speed, seconds=8, turn=0, hz=25, start=0, ball=False) -> Track without noise.

    speed: m/s, one or a function of the time since the first sample; turn: radians per second, or a function that gives
    the direction in radians. The ball rolls 1 m ahead."""

    def build_track(speed=1.4, seconds=8.0, turn=0.0, hz=25.0, start=0.0, ball=False) -> Track:
        fine = np.arange(0.0, seconds + 0.5 / hz, 0.001)
        fast = np.broadcast_to(speed(fine) if callable(speed) else speed, fine.shape)
        direction = np.broadcast_to(turn(fine) if callable(turn) else turn * fine, fine.shape)
        velocity = fast[:, None] * np.stack([np.cos(direction), np.sin(direction)], axis=1)
        path = np.concatenate([np.zeros((1, 2)), np.cumsum(velocity[:-1] * 0.001, axis=0)])
        times = np.arange(int(round(seconds * hz)) + 1) / hz
        places = np.stack([np.interp(times, fine, path[:, axis]) for axis in (0, 1)], axis=1)
        rolling = np.column_stack([places + [1.0, 0.0], np.full(len(times), 0.11)]) if ball else None
        return Track(times + start, places, rolling)

    return build_track


@pytest.fixture(scope="session")
def timeline_of():
    """timeline_of((start, end, words) or (time, words), ...) -> Timeline, words as in the text form."""

    def build_timeline(*lines) -> Timeline:
        return parse_timeline("".join(" ".join(map(str, line)) + "\n" for line in lines))

    return build_timeline


@pytest.fixture(scope="session")
def track(track_of) -> Track:
    """Twenty seconds: a walk that becomes a jog, in a wide bow, with the ball ahead."""
    speed, direction = (lambda t: 1.4 + 0.7 * (1 + np.tanh(t - 6.0))), (lambda t: 0.6 * np.sin(0.3 * t))
    return track_of(speed, seconds=20.0, turn=direction, ball=True)


@pytest.fixture(scope="session")
def asked(timeline_of) -> Timeline:
    """Two kicks and a stretch of walking, for `track`."""
    return timeline_of((5.0, "kick right"), (12.0, 14.0, "walking left"), (17.0, "kick"))


@pytest.fixture(scope="session")
def take(library, track, asked) -> Take:
    """What comes of `track` and `asked`."""
    return synthesize(library, Plan(track=track, timeline=asked))
