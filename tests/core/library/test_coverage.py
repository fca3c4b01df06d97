"""What a library lacks is told: planted standing, turns and steps are found, and each one's absence is, too."""

import numpy as np
import pytest

from beyond_mocap.files.bvh import bvh
from beyond_mocap.library.build import build_library
from beyond_mocap.library.synthetic_clips import STILL_PREFIX, SYNTHETIC_FOLDER, WALK_PREFIX
from beyond_mocap.synthetic.gait import build_gait

MOTIONS = {
    "stands": ("standing", {"speed": 0.0}),
    "turns": ("standing turning left", {"speed": 0.0, "turn_rate": 1.2}),
    "slow": ("walking", {"speed": 1.0}),
    "sideways": ("walking left", {"speed": 0.9, "direction": np.pi / 2.0}),
    "backward": ("walking back", {"speed": 0.9, "direction": np.pi}),
}


def build(folder, kinds, speed=1.3):
    """A library of two steady gaits of a speed and of the motions in `kinds`."""
    for name, (words, gait) in {"one": ("walking", {"speed": speed}), "two": ("walking", {"speed": 1.04 * speed}),
                                **{kind: MOTIONS[kind] for kind in kinds}}.items():
        bvh.write_bvh(folder / f"{name}.bvh", build_gait(duration=6.0, fps=30.0, **gait))
        (folder / f"{name}.txt").write_text(f"0 6 {words}\n")
    return build_library(folder)


def test_a_library_with_all_of_it_lacks_nothing(tmp_path):
    assert build(tmp_path, MOTIONS).missing_motion == {}


@pytest.mark.parametrize("missing", MOTIONS)
def test_what_is_not_recorded_is_missing(tmp_path, missing):
    slow = {"slow", "sideways", "backward"} if missing == "slow" else {missing, "slow"}
    library = build(tmp_path, set(MOTIONS) - slow, speed=3.0 if missing == "slow" else 1.1)
    assert missing in library.missing_motion
    if missing != "slow":
        assert set(library.missing_motion) == {missing}
    assert all("add" in line and "\n" not in line for line in library.missing_motion.values())


def test_the_slowest_speed_is_named(tmp_path):
    assert build(tmp_path, ["stands"], speed=3.0).missing_motion["slow"].startswith("nothing slower than 3.0 m/s")


def test_without_steady_travel_nothing_is_known_to_belong(tmp_path):
    speed = 0.7 + 0.6 * np.sin(2.0 * np.pi * np.arange(240) / 30.0 / 1.5)
    bvh.write_bvh(tmp_path / "fight.bvh", build_gait(speed, None, 30.0))
    (tmp_path / "fight.txt").write_text("0 8 walking\n")
    assert "no locomotion that surely belongs" in build_library(tmp_path).missing_motion["belonging"]


def test_a_library_of_runs_gets_synthetic_walks_and_a_stand(tmp_path):
    library = build(tmp_path, [], speed=3.0)
    made = {clip.path.removeprefix(SYNTHETIC_FOLDER): clip for clip in library.with_synthetic_clips.clips
            if clip.is_synthetic}
    assert any(name.startswith(WALK_PREFIX) for name in made) and any(name.startswith(STILL_PREFIX) for name in made)
    assert [gait.label for gait in library.with_synthetic_clips.gaits][:2] == ["standing", "walking"]


def test_a_library_that_stands_and_walks_gets_neither(tmp_path):
    library = build(tmp_path, ["stands", "slow"])
    made = [clip for clip in library.with_synthetic_clips.clips if clip.is_synthetic]
    assert made and not any(clip.path.startswith(SYNTHETIC_FOLDER + STILL_PREFIX) for clip in made)
    slowest = min(library.with_synthetic_clips.frames.speed[library.with_synthetic_clips.frames.clip == number].mean()
                  for number, clip in enumerate(library.with_synthetic_clips.clips)
                  if clip.path.startswith(SYNTHETIC_FOLDER + WALK_PREFIX))
    assert slowest > 1.4
