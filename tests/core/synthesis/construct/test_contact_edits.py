"""Contacts of feet as the user wants them: the foot stands where it is put, nothing slides, the rest stays."""

from dataclasses import replace

import numpy as np
import pytest

from beyond_mocap.base.errors import InputError
from beyond_mocap.base.time_series import find_runs
from beyond_mocap.motion.humanoid import identify_joints
from beyond_mocap.motion.motion import forward_kinematics
from beyond_mocap.synthesis.contact_edit import ContactEdit
from beyond_mocap.synthesis.plan import Plan
from beyond_mocap.synthesis.resynthesize import resynthesize
from beyond_mocap.synthesis.synthesize import synthesize

SIDES = ("left", "right")


@pytest.fixture(scope="module")
def plan(track_of):
    return Plan(track=track_of(), library="")


@pytest.fixture(scope="module")
def plain(library, plan):
    """Eight seconds of walking, without edits."""
    return synthesize(library, plan)


def toes(take):
    """(T, 2, 3) m of both feet's foremost joints."""
    body = identify_joints(take.motion.skeleton)
    return forward_kinematics(take.motion)[0][:, [body.left.toe_or_foot, body.right.toe_or_foot]]


def stances(take, side):
    return find_runs(take.contacts[:, side])


def middle(take, side, number):
    first, end = stances(take, side)[number]
    return take.start_time + 0.5 * (first + end - 1) / take.motion.fps


def measure_slide(take, side, first, end):
    """m that the foremost joint of a foot moves over the ground in frames first .. end."""
    places = toes(take)[first:end, side, :2]
    return float(np.linalg.norm(places - places.mean(axis=0), axis=1).max())


@pytest.mark.parametrize("side", (0, 1))
@pytest.mark.parametrize("way", ("synthesize", "resynthesize"))
def test_a_moved_contact_stands_where_it_is_put_and_the_others_where_they_were(library, plan, plain, side, way):
    first, end = stances(plain, side)[4]
    edit = ContactEdit(middle(plain, side, 4), SIDES[side], offset=(0.03, 0.08))
    wanted = replace(plan, contact_edits=(edit,))
    take = synthesize(library, wanted) if way == "synthesize" else resynthesize(library, wanted, plain)
    before, after = toes(plain), toes(take)
    np.testing.assert_array_equal(take.contacts, plain.contacts)
    np.testing.assert_allclose(after[first:end, side] - before[first:end, side],
                               np.tile([0.03, 0.08, 0.0], (end - first, 1)), atol=1e-3)
    others = take.contacts.copy()
    others[first:end, side] = False
    least = 1e-3 if way == "synthesize" else 2e-3  # an update blends what it constructs into the old take
    assert np.linalg.norm(after - before, axis=-1)[others].max() < least
    away = np.abs(np.arange(len(before)) - 0.5 * (first + end)) > 2.0 * take.motion.fps
    np.testing.assert_array_equal(after[away], before[away])  # the same bits
    steps = np.linalg.norm(np.diff(after, 2, axis=0), axis=-1)
    assert steps.max() < 1.5 * np.linalg.norm(np.diff(before, 2, axis=0), axis=-1).max()  # nothing jumps


def test_a_longer_contact_holds_the_foot_and_a_shorter_one_releases_it(library, plan, plain):
    first, end = stances(plain, 1)[4]
    for by in (0.1, -0.1):
        frames = int(round(by * plain.motion.fps))
        edit = ContactEdit(middle(plain, 1, 4), "right", end=by)
        take = synthesize(library, replace(plan, contact_edits=(edit,)))
        found = [run for run in stances(take, 1) if run[0] <= 0.5 * (first + end) < run[1]]
        assert len(found) == 1 and abs(found[0][1] - (end + frames)) <= 1 and abs(found[0][0] - first) <= 1, (by, found)
        assert measure_slide(take, 1, *found[0]) < measure_slide(plain, 1, first, end) + 2e-3
        assert np.linalg.norm(toes(take)[found[0][0], 1, :2] - toes(plain)[first, 1, :2]) < 2e-3
        np.testing.assert_array_equal(take.contacts[:, 0], plain.contacts[:, 0])


def test_a_contact_is_left_out_and_another_one_added(library, plan, plain):
    first, end = stances(plain, 0)[4]
    take = synthesize(library, replace(plan, contact_edits=(ContactEdit(middle(plain, 0, 4), "left", "delete"),)))
    assert not take.contacts[first:end, 0].any() and toes(take)[first:end, 0, 2].min() > 0.03
    swing = range(stances(plain, 1)[3][1], stances(plain, 1)[4][0])
    at = take.start_time + (swing[0] + 0.5 * len(swing)) / take.motion.fps
    edit = ContactEdit(at, "right", "add", start=0.05, end=-0.05, offset=(0.0, -0.05))
    more = synthesize(library, replace(plan, contact_edits=(edit,)))
    added = more.contacts[:, 1] & ~plain.contacts[:, 1]
    assert added.any() and len(find_runs(added)) == 1
    new = find_runs(added)[0]
    assert measure_slide(more, 1, *new) < 1e-3
    flat = toes(plain)[plain.contacts[:, 1], 1, 2]
    assert abs(toes(more)[new[0]:new[1], 1, 2] - np.median(flat)).max() < 0.01


def test_taking_an_edit_back_gives_the_take_without_it(library, plan, plain):
    edited = resynthesize(library, replace(plan, contact_edits=(ContactEdit(middle(plain, 1, 3), "right",
                                                                            offset=(0.1, 0.0)),)), plain)
    back = resynthesize(library, plan, edited)
    np.testing.assert_array_equal(back.contacts, plain.contacts)
    np.testing.assert_allclose(toes(back)[plain.contacts], toes(plain)[plain.contacts], atol=2e-3)


def test_an_edit_without_a_contact_is_reported(library, plan):
    edit = ContactEdit(1000.0, "left", "delete")
    take = synthesize(library, replace(plan, contact_edits=(edit,)))
    assert any("left foot" in str(line) and "no effect" in str(line) for line in take.warnings), take.warnings


@pytest.mark.parametrize("wrong, part", [
    ({"foot": "tail"}, "'tail'"), ({"kind": "drop"}, "'drop'"), ({"offset": (0.0, float("nan"))}, "finite"),
    ({"end": float("inf")}, "finite"), ({"offset": (1.0,)}, "offset"),
])
def test_wrong_edits_are_refused(wrong, part):
    with pytest.raises(InputError, match="contact edit") as caught:
        ContactEdit(**{"time": 1.0, "foot": "left", **wrong})
    assert part in str(caught.value)
