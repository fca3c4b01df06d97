"""What a library lacks is told, and exactly that is made: one definition for lines and for synthetic clips."""

from functools import cache

import numpy as np
import pytest

from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.library.clip import (
    BACK_PREFIX,
    SIDE_PREFIX,
    STEP_PREFIX,
    STILL_PREFIX,
    SYNTHETIC_FOLDER,
    TURN_PREFIX,
    WALK_PREFIX,
)
from beyond_mocap.library.coverage import BACK_SPEEDS, MIN_MOVES, MOVES, SIDE_WALKS
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.motion.retargeting.posture import to_motion
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.steps import build_steps_in_place

pytestmark = pytest.mark.usefixtures("few_synthetic_runs")
FASTEST_RUN = 2.4  # none
SECONDS = 17.0  # a little more than is enough
STAND_SECONDS = 4.0  # as the line asks for
KINDS = {"stands": STILL_PREFIX, "turns": TURN_PREFIX, "moves": STEP_PREFIX, "sideways": SIDE_PREFIX,
         "backward": BACK_PREFIX}
"""Kind -> how the clips begin that stand in."""


def list_motions(kind):
    """The motions of a kind that are enough: name -> (labels, motion)."""
    example = build_gait(0.0, STAND_SECONDS, 30.0)
    if kind == "stands":
        return {"stand": ("standing", example)}
    if kind == "turns":
        return {"turn": ("standing turning left", build_gait(0.0, SECONDS, 30.0, turn_rate=1.2))}
    if kind == "moves":
        neutral = build_neutral_stance(example.skeleton, example)
        return {f"move{i}_{n}": ("standing", to_motion(build_steps_in_place(move, 0.0, 30.0, neutral).posture, neutral))
                for i, move in enumerate(MOVES) for n in range(MIN_MOVES)}
    walks = [(speed, 180) for speed in BACK_SPEEDS] if kind == "backward" else [walk[:2] for walk in SIDE_WALKS]
    words = "walking back" if kind == "backward" else "walking left"
    # the speed of slow synthetic steps swings out of the range around it for half of the time
    seconds = [SECONDS if speed > 0.5 else 2.0 * SECONDS for speed, _ in walks]
    return {f"{kind}{i}": (words, build_gait(speed, seconds[i], 30.0, direction=np.radians(degrees)))
            for i, (speed, degrees) in enumerate(walks)}


@pytest.fixture(scope="module")
def build(tmp_path_factory):
    """build(kinds, speed=1.1): a library of two steady gaits of a speed and of the motions in `kinds`, built once."""
    return cache(lambda kinds, speed=1.1: build_gaits(tmp_path_factory.mktemp("gaits"), kinds, speed))


def build_gaits(folder, kinds, speed):
    motions = {name: ("walking", build_gait(pace, 6.0, 30.0)) for name, pace in (("one", speed), ("two", 1.04 * speed))}
    for kind in kinds:
        motions |= list_motions(kind)
    for name, (words, motion) in motions.items():
        bvh.write_bvh(folder / f"{name}.bvh", motion)
        (folder / f"{name}.txt").write_text(f"0 {motion.duration:.3f} {words}\n")
    return build_library(folder)


def list_made(library):
    """The kinds for which synthetic clips are made."""
    names = [clip.path.removeprefix(SYNTHETIC_FOLDER) for clip in library.with_synthetic_clips.clips
             if clip.is_synthetic]
    return {kind for kind, prefix in KINDS.items() if any(name.startswith(prefix) for name in names)}


def test_a_library_with_all_of_it_lacks_nothing_and_nothing_of_it_is_made(build):
    library = build(tuple(KINDS))
    assert not set(library.coverage.lines) & {*KINDS, "belonging"}
    assert list_made(library) == set()


@pytest.mark.parametrize("recorded, speed", [((), 3.0), (("stands", "turns"), 1.3),
                                             (("stands", "moves", "sideways", "backward"), 1.1)])
def test_what_is_not_recorded_is_told_and_made(build, recorded, speed):
    """Each kind is recorded in one of these libraries and lacks in another; moves begin and end with stands."""
    library = build(recorded, speed)
    lines = library.coverage.lines
    assert set(KINDS) & set(lines) == set(KINDS) - set(recorded)
    assert list_made(library) == {kind for kind in KINDS if "synthetic" in lines.get(kind, "")
                                  or "played backward" in lines.get(kind, "")}
    assert all("; until then " in line and "\n" not in line for line in lines.values())


def test_too_little_of_it_counts_as_none(tmp_path):
    motion = build_gait(0.8, 10.0, 30.0, direction=np.pi)
    bvh.write_bvh(tmp_path / "back.bvh", motion)
    (tmp_path / "back.txt").write_text("0 10 walking back\n")
    library = build_library(tmp_path)
    assert 0.8 in library.coverage.back_speeds and "backward" in library.coverage.lines


def test_the_speeds_that_are_not_reached_are_named(build):
    line = build((), 3.0).coverage.lines["speeds"]
    assert line.startswith("hardly any locomotion at 0.6 to 2.6 and 3.5 to 9.4 m/s: add some")


def test_without_steady_travel_nothing_is_known_to_belong(tmp_path):
    speed = 0.7 + 0.6 * np.sin(2.0 * np.pi * np.arange(240) / 30.0 / 1.5)
    bvh.write_bvh(tmp_path / "fight.bvh", build_gait(speed, None, 30.0))
    (tmp_path / "fight.txt").write_text("0 8 walking\n")
    assert "nothing recorded surely belongs" in build_library(tmp_path).coverage.lines["belonging"]


def test_a_library_of_runs_gets_synthetic_walks_and_a_stand(build):
    library = build((), 3.0)
    made = {clip.path.removeprefix(SYNTHETIC_FOLDER): clip for clip in library.with_synthetic_clips.clips
            if clip.is_synthetic}
    assert any(name.startswith(WALK_PREFIX) for name in made) and any(name.startswith(STILL_PREFIX) for name in made)
    assert [gait.label for gait in library.with_synthetic_clips.gaits][:2] == ["standing", "walking"]


def test_a_library_that_stands_and_walks_gets_neither(build):
    library = build(("stands", "turns"), 1.3)
    made = [clip for clip in library.with_synthetic_clips.clips if clip.is_synthetic]
    assert made and not any(clip.path.startswith(SYNTHETIC_FOLDER + STILL_PREFIX) for clip in made)
    slowest = min(library.with_synthetic_clips.frames.speed[library.with_synthetic_clips.frames.clip == number].mean()
                  for number, clip in enumerate(library.with_synthetic_clips.clips)
                  if clip.path.startswith(SYNTHETIC_FOLDER + WALK_PREFIX))
    assert slowest > 1.4
