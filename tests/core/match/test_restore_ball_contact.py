"""A player who is pushed off the ball while he strikes it is brought back to it."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.annotation.ball_contact import build_surfaces, measure_contact_gap
from beyond_mocap.files.tables import read_ball
from beyond_mocap.library.build import build_library
from beyond_mocap.match.crowd.correction import CURVES, FEET, ROOT, Correction
from beyond_mocap.match.displayed_motion import construct_displayed_player
from beyond_mocap.match.match_ball import MIN_GAP, restore_ball_contact
from beyond_mocap.match.player_file import read_player
from beyond_mocap.motion.motion import compute_pose
from tests.core.match.small_match import LIBRARY, SECONDS


@pytest.fixture(scope="module")
def striker(made, sample_cache):
    """Library, edit list without correction, ball, the key moment and its frame on the match's clock."""
    folder, _ = made
    library = build_library(LIBRARY, cache_dir=sample_cache)
    edit, ball = replace(read_player(folder / "home_7.take.npz"), correction=None), read_ball(folder / "ball.csv")
    (take,) = construct_displayed_player(library, edit, ball, *SECONDS)
    key = next(key for key in take.keys if gap_at(take, key) < MIN_GAP + 1e-6)
    return library, edit, ball, key, round(key.frame + SECONDS[0] * 30.0)


def gap_at(take, key):
    """m between the striking surface and the ball at a key moment."""
    frame = int(np.rint(key.frame))
    posed = compute_pose(take.motion.skeleton, take.motion.root_positions[frame], take.motion.rotations[frame])
    return abs(float(measure_contact_gap(take.motion.skeleton, *posed, key.words, take.ball.positions[frame])))


def pushed_by(metres, frame):
    """A correction that pushes root and feet aside for half a second on either side of a frame of the match's clock."""
    first = frame - 18
    curves = np.zeros((37, CURVES))
    bump = np.hanning(37)[:, None] * metres / np.sqrt(2.0)
    curves[:, ROOT] = bump
    curves[:, FEET] = np.tile(bump, (1, 4))
    return Correction.from_curves(curves, first, 30.0)


def test_a_striker_pushed_aside_by_others_still_meets_the_ball(striker):
    library, edit, ball, key, frame = striker
    (plain,) = construct_displayed_player(library, edit, ball, *SECONDS)
    (take,) = construct_displayed_player(library, replace(edit, correction=pushed_by(0.06, frame)), ball, *SECONDS)
    assert gap_at(take, key) < MIN_GAP
    at = round(key.frame)
    assert np.linalg.norm(take.motion.root_positions[at] - plain.motion.root_positions[at]) > 0.05
    far = np.abs(np.arange(len(take.motion)) - at) > 25  # the push lasts 18 frames, the ball contact 9
    assert np.array_equal(take.motion.rotations[far], plain.motion.rotations[far])


def test_who_is_far_from_the_ball_plays_as_he_does(striker):
    library, edit, ball, *_ = striker
    (take,) = construct_displayed_player(library, edit, ball, *SECONDS)
    assert restore_ball_contact(take, take.ball.positions + [0.0, 0.0, 3.0]) is take
    assert restore_ball_contact(take, np.full_like(take.ball.positions, np.nan)) is take


def test_a_second_touch_soon_after_does_not_take_the_foot_off_the_first(striker):
    library, edit, ball, key, _ = striker
    (take,) = construct_displayed_player(library, edit, ball, *SECONDS)
    soon = replace(key, frame=round(key.frame) + 5.0)
    keys, places = (soon, key), np.array(take.ball.positions)
    skeleton, motion = take.motion.skeleton, take.motion
    for number, one in enumerate(keys):  # a ball 5 cm away from the foot, on its one side, then on its other
        at = round(one.frame)
        posed = compute_pose(skeleton, motion.root_positions[at], motion.rotations[at])
        foot = np.mean(build_surfaces(skeleton, key.words)[0].compute_line(*posed), axis=0)
        places[at] = foot + np.array([(-1.0) ** number * 0.21, 0.0, 0.0])
    both = replace(take, keys=keys, ball=replace(take.ball, positions=places))
    found, alone = (restore_ball_contact(one, places) for one in (both, replace(both, keys=(key,))))
    assert gap_at(found, soon) < MIN_GAP
    # near the ground a foot comes to the ball only within millimetres, with and without the second touch
    assert gap_at(found, key) <= max(gap_at(alone, key), MIN_GAP) < 0.003 < gap_at(both, key)
