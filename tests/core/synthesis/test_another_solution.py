"""Another solution of a stretch or of a whole take: other footage, as good on the track, all else bit for bit."""

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resynthesize import BLEND_SECONDS, VariantStretch, list_shown_stretches, resynthesize
from beyond_mocap.synthesis.search.preferences import REUSE_COST, SAME_CLIP_COST, UsedStretch, compute_reuse_cost
from beyond_mocap.synthesis.synthesize import synthesize


def changed(before, after):
    """(T,) bool: frames of which any bit is another."""
    a, b = before.motion, after.motion
    off = np.any(a.root_positions != b.root_positions, axis=1) | np.any(a.rotations != b.rotations, axis=(1, 2))
    return off | (before.clip_frame != after.clip_frame) | np.any(before.contacts != after.contacts, axis=1)


def footage(one, first, end):
    """(clip, mirrored, whole clip frame) of output frames first .. end."""
    return {(one.clips[one.clip[i]], bool(one.mirrored[i]), round(float(one.clip_frame[i]))) for i in range(first, end)}


@pytest.mark.parametrize("start, end", [(8.0, 11.0), (4.0, 6.0), (9.0, 9.2)])
def test_a_stretch_is_another_one_and_the_rest_is_the_same_to_the_last_bit(library, track, asked, take, start, end):
    plan, fps = Plan(track=track, timeline=asked), take.motion.fps
    used = list_shown_stretches(library, take, start, end)
    other = resynthesize(library, plan, take, variant=VariantStretch(start, end, used))
    off = np.flatnonzero(changed(take, other)) / fps
    assert len(off) and off.min() < end and off.max() > start
    reach = BLEND_SECONDS + 0.4 + (1.5 if start == 4.0
                                   else 0.8)  # a kick's own entry and exit; a stretch of some length
    assert start - reach < off.min() and off.max() < end + reach, (off.min(), off.max())
    first, last = int(start * fps), int(end * fps)
    shared = footage(take, first, last) & footage(other, first, last)
    assert len(shared) < 0.5 * len(footage(take, first, last))
    again = resynthesize(library, plan, take, variant=VariantStretch(start, end, used))
    assert not changed(other, again).any()
    root = np.linalg.norm(np.diff(other.motion.root_positions, axis=0), axis=1) * fps
    assert root.max() < 6.0
    assert [key.requested for key in other.keys] == [key.requested for key in take.keys]


def test_a_whole_take_is_another_one(library, track, asked, take):
    plan = Plan(track=track, timeline=asked)
    used = list_shown_stretches(library, take, 0.0, 20.0)
    other = synthesize(library, plan, used=used)
    count = len(take.motion)
    assert len(footage(take, 0, count) & footage(other, 0, count)) < 0.6 * len(footage(take, 0, count))
    off = np.linalg.norm(other.motion.root_positions[:, :2] - take.motion.root_positions[:, :2], axis=1)
    assert off.mean() < 0.1  # both are on the track
    assert not changed(other, synthesize(library, plan, used=used)).any()
    assert not changed(take, synthesize(library, plan)).any()


def test_the_price_of_footage_is_paid_where_it_was_shown(library):
    clip = library.clips[0]
    cost = compute_reuse_cost(library, (UsedStretch(clip.path, clip.mirrored, 20.0, 30.0),
                                        UsedStretch("nowhere.bvh", False, 0.0, 9.0)))
    first = library.frames.first[0]
    assert cost[first + 25] == REUSE_COST and cost[first + 60] == pytest.approx(SAME_CLIP_COST)
    others = [number for number, other in enumerate(library.clips) if other.path != clip.path]
    assert not cost[np.isin(library.frames.clip, others)].any()


@pytest.mark.parametrize("start, end", [(-1.0, 3.0), (3.0, 2.0), (19.0, 40.0)])
def test_a_stretch_that_is_none(library, track, asked, take, start, end):
    with pytest.raises(InputError, match="stretch"):
        resynthesize(library, Plan(track=track, timeline=asked), take, variant=VariantStretch(start, end))


def test_other_methods_have_no_stretches(library, track, asked, take):
    with pytest.raises(InputError, match="method path"):
        resynthesize(library, Plan(track=track, timeline=asked, method="blocks"), take,
                     variant=VariantStretch(3.0, 4.0))
