"""Windows joined: where they agree nobody sees it, where not they meet at the cheapest place; named edit lists."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beyond_mocap.base.errors import InputError
from beyond_mocap.match.pieces.named_edit import (
    NamedEdit,
    NamedKey,
    cut_named_edit,
    join_named_edits,
    list_clips,
    renumber_clips,
    to_library_edit,
    to_named_edit,
)
from beyond_mocap.match.pieces.units import build_units
from beyond_mocap.match.pieces.windows import join_pieces
from beyond_mocap.synthesis.search.edit_list import find_transitions
from beyond_mocap.synthesis.synthesize import synthesize

from .conftest import KICK_TIME


@pytest.fixture(scope="module")
def take(library, weaving_plan):
    return synthesize(library, weaving_plan)


@st.composite
def edits(draw):
    """Any named edit list of three clips."""
    count = draw(st.integers(1, 12))
    rows = st.tuples(
        st.integers(0, 2), st.integers(-3, 400), st.sampled_from([0.875, 0.9375, 1.0, 1.125]), st.integers(1, 30),
        st.booleans(),
    )  # fmt: skip
    clip, first, rate, length, cut = zip(*draw(st.lists(rows, min_size=count, max_size=count)))
    return NamedEdit(clips=(("a.bvh", False), ("a.bvh", True), ("b.bvh", False)), clip=clip, first=first, rate=rate,
                     length=length, cut=(True, *cut[1:]))


@given(edits(), st.data())
def test_parts_of_an_edit_list_chained_are_the_whole(edit, data):
    at = data.draw(st.integers(1, max(1, len(edit) - 1)))
    if at >= len(edit):
        return
    parts = cut_named_edit(edit, 0, at), cut_named_edit(edit, at, len(edit))
    again = join_named_edits(parts, ())
    assert (len(parts[0]), len(parts[1]), len(again)) == (at, len(edit) - at, len(edit))
    assert all(np.array_equal(a, b) for a, b in zip(again.frames(), edit.frames()))
    assert set(again.seams) - {at} == set(edit.seams) - {at}


@given(edits())
def test_another_table_names_the_same_clips(edit):
    clips = (("b.bvh", False), ("z.bvh", True), ("a.bvh", True), ("a.bvh", False))
    other = renumber_clips(replace(edit, keys=(NamedKey(
        time=1.0, clip=2, frame=3.0, start=1.0, end=5.0, words=("kick",),
    ),)), clips)
    assert [clips[c] for c in other.clip] == [edit.clips[c] for c in edit.clip]
    assert clips[other.keys[0].clip] == edit.clips[2] and list_clips([other, edit])[0] == ("a.bvh", False)


def test_an_edit_list_comes_back_from_its_names(library, take):
    whole = library.with_synthetic_clips
    moments = take.plan.timeline.keys
    again = to_library_edit(whole, to_named_edit(whole, take.edit, moments), moments)
    assert np.array_equal(again.clip, take.edit.clip) and np.allclose(again.frame, take.edit.frame, atol=1e-6)
    assert np.array_equal(again.transitions, take.edit.transitions) and again.keys == take.edit.keys


def test_a_library_in_another_order_shows_the_same(library, take):
    clips, frames = library.with_synthetic_clips.clips, library.with_synthetic_clips.frames
    edit = to_named_edit(library.with_synthetic_clips, take.edit, take.plan.timeline.keys)
    turned = replace(
        library.with_synthetic_clips, clips=clips[::-1],
        frames=replace(frames, first=np.cumsum([0, *frames.count[:0:-1]]), count=frames.count[::-1]),
    )  # fmt: skip
    other = to_library_edit(turned, edit)
    assert all(
        turned.clips[a] is clips[b] and abs((f - turned.frames.first[a]) - (g - frames.first[b])) < 1e-6
        for a, f, b, g in zip(other.clip, other.frame, take.edit.clip, take.edit.frame)
    )


def test_windows_that_agree_are_joined_without_a_seam(library, weaving_plan, weaving_pieces):
    player, joints = join_pieces(library, [weaving_plan], weaving_pieces)
    edit = player.stretches[0].edit
    assert len(joints) == len(weaving_pieces) - 1 and len(edit) == 751
    clip, frame = edit.frames()
    for joint in joints:
        at = joint.frame
        if joint.agreed and at not in weaving_seams(weaving_pieces):
            assert clip[at] == clip[at - 1] and abs(frame[at] - frame[at - 1] - 1.0) < 0.3
    assert [key.time for key in edit.keys] == [KICK_TIME]
    jumps = find_transitions(clip, frame)
    assert set(jumps) <= set(edit.seams)


def weaving_seams(pieces) -> set[int]:
    return {piece.first + int(seam) for piece in pieces for seam in piece.edit.seams}


def test_the_same_search_cut_in_two_agrees_everywhere(library, weaving_plan, weaving_pieces):
    """Planted: both windows are cut out of one, so the joint lies at the edge."""
    whole = max(weaving_pieces, key=lambda piece: len(piece.edit))
    length = len(whole.edit)
    edge = whole.first + length // 2
    first = replace(whole, number=0, edit=cut_named_edit(whole.edit, 0, length // 2 + 40), own=(whole.first, edge))
    second = replace(whole, number=1, first=edge - 40, edit=cut_named_edit(whole.edit, length // 2 - 40, length),
                     own=(edge, whole.first + length))  # fmt: skip
    unit = build_units(weaving_plan, window=8.0, overlap=3.0)[whole.number]
    shifted = [replace(piece, first=piece.first - whole.first, own=tuple(f - whole.first for f in piece.own))
               for piece in (second, first)]  # fmt: skip
    player, joints = join_pieces(library, [unit.plan], shifted)
    assert joints[0].agreed and joints[0].frame == edge - whole.first
    whole = replace(whole, edit=renumber_clips(whole.edit, player.stretches[0].edit.clips))
    assert all(np.allclose(a, b, atol=1e-9) for a, b in zip(player.stretches[0].edit.frames(), whole.edit.frames()))
    assert np.array_equal(player.stretches[0].edit.seams, whole.edit.seams)


def test_windows_that_never_agree_meet_at_the_cheapest_place(library, weaving_plan, weaving_pieces):
    """Planted: the second window shows another clip throughout."""
    pieces = list(weaving_pieces)
    after = pieces[1].edit
    other = next(n for n, clip in enumerate(library.clips) if clip.path == "stand.bvh" and not clip.mirrored)
    standing = NamedEdit(clips=(("stand.bvh", False),), clip=[0], first=[5.0], rate=[1.0], length=[len(after)],
                         cut=[True])
    pieces[1] = replace(pieces[1], edit=standing)
    assert library.frames.count[other] > 100
    player, joints = join_pieces(library, [weaving_plan], pieces)
    assert not joints[0].agreed and joints[0].frame in player.stretches[0].edit.seams
    low, high = pieces[1].first, pieces[0].first + len(pieces[0].edit)
    assert low < joints[0].frame < high


def test_a_window_that_is_missing_is_told(library, weaving_plan, weaving_pieces):
    with pytest.raises(InputError, match="all windows of a stretch"):
        join_pieces(library, [weaving_plan], weaving_pieces[1:])


def test_a_clip_that_is_missing_is_told(library, weaving_player):
    edit = weaving_player.stretches[0].edit
    edit = replace(edit, clips=(("gone.bvh", True), *edit.clips[1:]))
    with pytest.raises(InputError, match=r"no clip gone.bvh \(mirrored\)"):
        to_library_edit(library.with_synthetic_clips, edit)
