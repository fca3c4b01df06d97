"""Cycles added or removed until the travelled distance fits."""

import numpy as np
import pytest

from beyond_mocap.synthesis.search.blocks import FINEST_LENGTH, BlockCandidates, BlockSearch
from beyond_mocap.synthesis.search.distance import build_warped_edit
from beyond_mocap.synthesis.search.locomotion import (
    _read_chain,
    compute_block_distances,
    compute_travelled_distance,
    match_distance,
    split_sections,
)


def blocks_of(library, path, count):
    """`count` blocks one after the other of a clip, from its second on."""
    clip = next(i for i, c in enumerate(library.clips) if c.path == path and not c.mirrored)
    start = library.frames.first[clip] + FINEST_LENGTH * (1 + np.arange(count) % 12)
    return BlockCandidates(np.full(count, clip), start)


def total(library, asked, sections):
    """Metres of the sections that are played: the last slots may lie beyond the track's end."""
    played = [section for section in sections if section.first * FINEST_LENGTH < len(asked)]
    return sum(compute_block_distances(library, section.blocks).sum() for section in played)


def test_blocks_travel_what_their_clip_does(library):
    for path, speed in (("run.bvh", 5.0), ("walk.bvh", 1.4), ("stand.bvh", 0.0)):
        assert np.allclose(compute_block_distances(library, blocks_of(library, path, 9)), speed * FINEST_LENGTH / 30.0,
                           atol=0.03)


def test_a_block_beyond_its_clip_travels_to_the_clip_s_end_only(library):
    clip = blocks_of(library, "run.bvh", 1).clip
    last = library.frames.first[clip] + library.frames.count[clip] - 1
    assert compute_block_distances(library, BlockCandidates(clip, last - 3))[0] == pytest.approx(3 * 5.0 / 30.0,
            abs=0.03)
    assert compute_block_distances(library, BlockCandidates(clip, last + 30))[0] == 0.0


def test_travelled_distance_of_the_track(order, track_of):
    asked = compute_travelled_distance(order(track=track_of(2.0, turn=0.5)).track)
    assert asked[0] == 0.0 and asked[-1] == pytest.approx(16.0, abs=0.1) and np.all(np.diff(asked) >= 0)


def test_sections_of_locomotion_and_of_everything_else(library, order):
    asked = order((4.0, "kick"), (6.0, 7.0, "celebration"))
    blocks = BlockSearch(library, asked, 0.2).run()
    sections = split_sections(asked, blocks)
    assert [s.is_locomotion for s in sections] == [True, False, True, False, True, False][: len(sections)]
    assert sections[0].first == 0 and sections[-1].end == len(blocks)
    assert [a.end for a in sections[:-1]] == [b.first for b in sections[1:]]
    assert sum(len(s.blocks) for s in sections) == len(blocks)
    inside = sections[1]
    assert inside.first * FINEST_LENGTH <= 120 < inside.end * FINEST_LENGTH


@pytest.mark.parametrize("delta", [0.1, 0.5, 1.0])
@pytest.mark.parametrize(
    "found, asked_for", [("run.bvh", 1.4), ("walk.bvh", 2.8), ("stand.bvh", 5.0), ("run.bvh", 0.8), ("walk.bvh", 1.4)]
)
def test_the_section_travels_what_the_track_does(library, order, track_of, found, asked_for, delta):
    asked = order(track=track_of(asked_for, 8.0))
    search = BlockSearch(library, asked, 0.2)
    sections = match_distance(search, blocks_of(library, found, search.count_slots(FINEST_LENGTH)), delta)
    goal = compute_travelled_distance(asked.track)[-1]
    assert abs(total(library, asked, sections) - goal) <= delta + 0.1


def test_distance_is_removed_as_well_as_added(library, order, track_of):
    """As printed, step 7 can only add (its absolute value); running blocks on a walker's track have to lose some."""
    asked = order(track=track_of(1.4, 8.0))
    search = BlockSearch(library, asked, 0.2)
    blocks = blocks_of(library, "run.bvh", search.count_slots(FINEST_LENGTH))
    before = compute_block_distances(library, blocks).sum()
    sections = match_distance(search, blocks, 0.5)
    assert before > 35.0
    assert total(library, asked, sections) == pytest.approx(1.4 * 8, abs=0.6)


@pytest.mark.parametrize("slots, blocks", [(10, 8), (20, 18), (40, 18)])
def test_chains_played_at_recorded_speed_go_before_cheaper_ones(slots, blocks):
    errors, costs = np.full((18, 1), 5.0), np.full((18, 1), 1.0)
    errors[[7, 17]], costs[[7, 17], 0] = 0.05, (0.2, 0.1)
    layers, back = list(zip(errors, costs)), [np.zeros(1, int)] * 17
    assert len(_read_chain(layers, back, slots)) == blocks


def test_entry_and_exit_stay(library, order, track_of):
    asked = order(track=track_of(2.8, 8.0))
    search = BlockSearch(library, asked, 0.2)
    blocks = blocks_of(library, "walk.bvh", search.count_slots(FINEST_LENGTH))
    section = match_distance(search, blocks, 0.5)[0]
    for mine, theirs in ((0, section.first), (-1, section.end - 1)):
        assert (section.blocks.clip[mine], section.blocks.start[mine]) == (blocks.clip[theirs], blocks.start[theirs])


def test_what_fits_is_left_alone(library, order, track_of):
    asked = order(track=track_of(1.4, 8.0))
    search = BlockSearch(library, asked, 0.2)
    blocks = blocks_of(library, "walk.bvh", search.count_slots(FINEST_LENGTH))
    sections = match_distance(search, blocks, 1.0)
    assert np.array_equal(np.concatenate([s.blocks.start for s in sections]), blocks.start)


def test_errors_do_not_add_up_over_sections(library, order, track_of):
    asked = order((2.0, "kick"), (4.0, "kick"), (6.0, "kick"), track=track_of(2.0, 8.0))
    search = BlockSearch(library, asked, 0.2)
    sections = match_distance(search, search.run(), 0.3)
    way, travelled = compute_travelled_distance(asked.track), 0.0
    for section in sections:
        travelled += compute_block_distances(library, section.blocks).sum()
        if section.is_locomotion and len(section.blocks) > 3:
            assert abs(travelled - way[min(section.end * FINEST_LENGTH, len(way) - 1)]) < 0.5


@pytest.mark.parametrize("catching_up", [True, False])
@pytest.mark.parametrize("speed", [0.0, 0.9, 1.4, 3.5, 5.0])
def test_the_warped_motion_has_the_order_s_length_and_never_goes_back(library, order, track_of, speed, catching_up):
    asked = order((4.0, "kick right"), track=track_of(speed, 8.0))
    search = BlockSearch(library, asked, 0.2)
    edit, travelled = build_warped_edit(search, match_distance(search, search.run(), 0.5), catching_up)
    assert len(edit) == len(travelled) == len(asked) == 241
    assert np.all(np.diff(travelled) >= -1e-9)
    for low, high in edit.pieces:
        assert len(set(edit.clip[low:high])) == 1 and np.all(np.diff(edit.frame[low:high]) >= -1e-6)
    if catching_up and speed:
        assert abs(travelled[-1] - compute_travelled_distance(asked.track)[-1]) < 0.1


def test_the_key_moment_stays_at_its_frame_when_the_rest_is_warped(library, order, track_of):
    asked = order((4.0, "kick right"), track=track_of(2.2, 8.0))
    search = BlockSearch(library, asked, 0.2)
    edit, _ = build_warped_edit(search, match_distance(search, search.run(), 0.5), True)
    assert edit.clip[120] == edit.keys[0].key.clip
    assert np.interp(edit.frame[120], np.arange(len(library.frames)), library.frames.source) == pytest.approx(
        edit.keys[0].key.frame, abs=1e-6
    )
