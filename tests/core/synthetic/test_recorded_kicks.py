"""Kicks on the run are laid from the library's own best kicker."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation import ClipAnnotation
from beyond_mocap.library.clip import Clip
from beyond_mocap.library.keys import collect_keys
from beyond_mocap.motion.retargeting.adult import build_adult_skeleton
from beyond_mocap.motion.retargeting.neutral import build_neutral_stance
from beyond_mocap.synthetic.gait import build_gait
from beyond_mocap.synthetic.gait_plan import GaitStyle
from beyond_mocap.synthetic.kicks import BEFORE
from beyond_mocap.synthetic.recorded_kicks import choose_swing, iter_running_kicks
from beyond_mocap.synthetic.running_kicks import build_swing, measure_foot_speed

NEUTRAL = build_neutral_stance(build_adult_skeleton())


def clip_of(name: str, kind: str, rate: float, labels: str, first: float = 0.0) -> Clip:
    """A recorded kick, from `first` s before its contact."""
    swing = build_swing(kind, NEUTRAL, rate)
    start = int(round((BEFORE / rate - first) * swing.motion.fps)) if first else 0
    motion = swing.motion.frames(start, len(swing.motion))
    row = ClipAnnotation(0, len(motion) - 1, swing.contact - start, tuple(labels.split()))
    return Clip(path=name, mirrored=False, motion=motion, annotations=(row,),
                heel_toe_contacts=np.zeros((len(motion), 2, 2), bool))


@pytest.fixture(scope="module")
def clips():
    words = "kick right low top standing"
    return [clip_of("soft.bvh", "instep", 0.6, words), clip_of("hard.bvh", "instep", 1.0, words),
            clip_of("cut_short.bvh", "instep", 1.2, words, first=0.2),
            clip_of("pass.bvh", "inside", 0.8, "kick right low inside standing")]


def test_the_hardest_whole_swing_is_chosen(clips):
    keys = [key for key in collect_keys(clips) if "top" in key.labels]
    assert choose_swing(clips, keys, NEUTRAL, "top").motion is clips[1].motion


def test_without_a_whole_swing_one_is_built(clips):
    keys = [key for key in collect_keys(clips) if key.clip == 2]
    swing = choose_swing(clips, keys, NEUTRAL, "top")
    assert swing.motion is not clips[2].motion and measure_foot_speed(swing) > 9.0


@pytest.fixture(scope="module")
def kicks(clips):
    example = build_gait(0.0, 1.0, 30.0, NEUTRAL.skeleton)
    return list(iter_running_kicks(clips, collect_keys(clips), 3.0, example, GaitStyle()))


def test_each_recorded_surface_is_kicked_at_all_speeds_and_into_all_directions(kicks):
    assert {kick.words[:4] for kick in kicks} == {("kick", "right", "low", "inside"), ("kick", "right", "low", "top")}
    assert max(kick.speed for kick in kicks) > 6.0
    assert len({kick.name for kick in kicks}) == len(kicks)
    for surface, count in (("top", 2), ("inside", 4)):  # passes hard and soft
        assert sum(surface in kick.words and kick.speed == 3.0 for kick in kicks) == count


def test_only_soft_passes_are_slower_than_recorded_kicks(kicks):
    slow = [kick for kick in kicks if kick.speed < 3.0]
    assert slow and all("inside" in kick.words and kick.name.startswith("soft") for kick in slow)
    assert {("standing" in kick.words, kick.speed < 2.0) for kick in slow} == {(True, True), (False, False)}


def test_without_a_recorded_kick_there_is_none():
    example = build_gait(0.0, 1.0, 30.0, NEUTRAL.skeleton)
    assert not list(iter_running_kicks([], (), np.inf, example, GaitStyle()))


def test_a_synthetic_clip_is_no_recording(clips):
    from beyond_mocap.library.clip import SYNTHETIC_FOLDER

    made = [replace(clips[1], path=f"{SYNTHETIC_FOLDER}kick.bvh")]
    swing = choose_swing(made, collect_keys(made), NEUTRAL, "top")
    assert swing.motion is not made[0].motion
