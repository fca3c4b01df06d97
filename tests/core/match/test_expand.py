"""A player searched in windows, joined and laid out: what every span of him has to be."""

import numpy as np
import pytest

from beyond_mocap.annotation import parse_timeline
from beyond_mocap.errors import InputError
from beyond_mocap.match.expand import expanded
from beyond_mocap.match.player_edit import PlayerEdit
from beyond_mocap.match.searched import searched
from beyond_mocap.match.splice import spliced
from beyond_mocap.match.units import units_of
from beyond_mocap.motion.track import Track
from beyond_mocap.plan import Plan

WINDOW = 8.0


def weaving(start: float, end: float) -> Track:
    """Samples at 25 Hz of a player who walks and jogs on a bent line, from second `start` to `end`."""
    times = np.arange(start, end + 1e-9, 0.04)
    way = 2.0 * (times - start) + 2.0 * np.sin(0.6 * times)
    return Track(times, np.column_stack([way, 4.0 * np.sin(0.08 * way)]), name="home_7")


def made(library, fps=30.0, **settings) -> PlayerEdit:
    timeline = parse_timeline("20.5 kick right\n", fps=fps)
    plan = Plan(track=weaving(5.0, 30.0), timeline=timeline, nearest=True, fps=fps, **settings)
    pieces = [searched(library, unit) for unit in units_of(plan, window=WINDOW, overlap=2.0)]
    return spliced(library, [plan], pieces[::-1], WINDOW)[0]


@pytest.fixture(scope="module")
def player(library) -> PlayerEdit:
    return made(library)


def same_frames(whole, part) -> bool:
    """Whether a take shows, bit for bit but for the signs of quaternions, what another one shows at that time."""
    first = int(round((part.start_time - whole.start_time) * whole.motion.fps))
    here = slice(first, first + len(part.motion))
    turned, other = whole.motion.rotations[here], part.motion.rotations
    signs = np.where(np.sum(turned * other, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    return np.array_equal(turned * signs, other) and all(
        np.array_equal(a, b) for a, b in [
            (whole.motion.root_positions[here], part.motion.root_positions), (whole.contacts[here], part.contacts),
            (whole.clip_frame[here], part.clip_frame), (whole.mirrored[here], part.mirrored),
            (np.array(whole.clips)[whole.clip[here]], np.array(part.clips)[part.clip]),
        ]
    )  # fmt: skip


@pytest.mark.parametrize("fps", [30.0, 25.0, 24000 / 1001])
def test_any_span_shows_the_same_frames(library, fps):
    player = made(library, fps)
    (whole,) = expanded(library, player, 0.0, 100.0)
    assert len(whole.motion) == int(np.floor(25.0 * fps + 1e-6)) + 1
    for start, end in [(5.0, 30.0), (15.9, 17.3), (16.1, 24.0), (23.0, 29.0)]:
        (part,) = expanded(library, player, start, end)
        assert start <= part.start_time < start + 1.0 / fps + 1e-6 and len(part.motion) > (end - start) * fps - 2
        assert same_frames(whole, part)
        assert len(part.keys) == (start <= 20.5 <= end)


def test_two_windows_meet_without_a_jump(library, player):
    (take,) = expanded(library, player, 5.0, 30.0)
    step = np.linalg.norm(np.diff(take.motion.root_positions, 2, axis=0), axis=1)
    edges = [int(round((edge - take.start_time) * 30.0)) for edge in (8.0, 16.0, 24.0)]
    near = np.array([abs(frame - edge) < 20 for edge in edges for frame in range(len(step))]).reshape(3, -1).any(axis=0)
    assert step[near].max() <= 1.5 * step[~near].max()


def test_nothing_of_a_player_who_is_not_there(library, player):
    assert expanded(library, player, 40.0, 50.0) == ()


def test_a_span_that_ends_before_it_starts_is_told(library, player):
    with pytest.raises(InputError, match="an end behind the start"):
        expanded(library, player, 20.0, 10.0)
