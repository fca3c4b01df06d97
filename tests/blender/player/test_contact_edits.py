"""Fix Foot: an edited contact is moved in the take, and the functions behind the button do the same."""

import importlib

import bpy
import numpy as np
import pytest
from test_players import match, ready, session  # noqa: F401  (fixtures)
from test_result import one  # noqa: F401  (fixture)


@pytest.fixture
def edits(extension):
    return importlib.import_module(f"{extension.__name__}.scene.player.contact_edits")


@pytest.fixture
def contacts_of(one, session, edits):  # noqa: F811
    """contacts_of(): the contacts of the player's newest take."""
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    return lambda: edits.list_contacts(edits.find_take(one))


def find(contacts, foot, seconds):
    return next(one for one in contacts if one.foot == foot and one.start <= seconds <= one.end)


def test_a_contact_is_moved_again_and_taken_back(one, contacts_of, edits):  # noqa: F811
    before = contacts_of()
    chosen = next(contact for contact in before if contact.foot == "right" and contact.start > 6.0)
    for number in (1, 2):
        assert bpy.ops.beyond_mocap.fix_foot(action="MOVE", foot="right", time=chosen.middle,
                                             offset=(0.04, -0.03)) == {"FINISHED"}
        now = find(contacts_of(), "right", chosen.middle)
        np.testing.assert_allclose(now.toe - chosen.toe, np.multiply(number, (0.04, -0.03)), atol=1.5e-3)
        assert len(one.contact_edits) == 1 and edits.find_edit(one, now) is not None
        assert one.result.state == "PREVIEW"
    others = [(a, b) for a, b in zip(before, contacts_of()) if a.foot != "right" or a.start != chosen.start]
    assert max(np.linalg.norm(a.toe - b.toe) for a, b in others) < 0.015  # an update constructs what is near again
    assert bpy.ops.beyond_mocap.remove_contact_edit() == {"FINISHED"}
    np.testing.assert_allclose(find(contacts_of(), "right", chosen.middle).toe, chosen.toe, atol=2e-3)


def test_longer_shorter_left_out_and_added(one, contacts_of, edits):  # noqa: F811
    chosen = next(contact for contact in contacts_of() if contact.foot == "left" and contact.start > 4.0)
    press = bpy.ops.beyond_mocap.fix_foot
    assert press(action="LONGER", foot="left", time=chosen.middle, seconds=0.14) == {"FINISHED"}
    longer = find(contacts_of(), "left", chosen.middle)
    assert longer.end - longer.start > chosen.end - chosen.start + 0.05
    assert press(action="SHORTER", foot="left", time=chosen.middle, seconds=0.14) == {"FINISHED"}
    assert find(contacts_of(), "left", chosen.middle).end == pytest.approx(chosen.end, abs=0.04)
    assert press(action="DELETE", foot="left", time=chosen.middle) == {"FINISHED"}
    assert not any(one.foot == "left" and one.start <= chosen.middle <= one.end for one in contacts_of())
    assert press(action="ADD", foot="left", time=chosen.middle) == {"FINISHED"}  # it comes back
    assert find(contacts_of(), "left", chosen.middle).start == pytest.approx(chosen.start, abs=1e-6)
    assert not one.contact_edits


def test_edits_are_saved_with_the_file_and_are_part_of_the_plan(one, contacts_of, edits, extension):  # noqa: F811
    chosen = contacts_of()[3]
    bpy.ops.beyond_mocap.fix_foot(action="MOVE", foot=chosen.foot, time=chosen.middle, offset=(0.1, 0.0))
    path = bpy.app.tempdir + "edits.blend"
    bpy.ops.wm.save_as_mainfile(filepath=path)
    kept = edits.read_contact_edits(one)
    bpy.ops.wm.open_mainfile(filepath=path)
    settings = bpy.context.scene.beyond_mocap
    plans = importlib.import_module(f"{extension.__name__}.scene.result.plans")
    assert plans.build_plan(settings, settings.players[0])[0].contact_edits == kept and kept[0].offset == (0.1, 0.0)


def test_a_failed_edit_leaves_the_contacts_as_they_were(one, contacts_of, edits, session):  # noqa: F811
    chosen = contacts_of()[0]
    with pytest.raises(RuntimeError, match="moved by 50.00 m; expected at most 1 m"):
        bpy.ops.beyond_mocap.fix_foot(action="MOVE", foot=chosen.foot, time=chosen.middle, offset=(50.0, 0.0))
    with pytest.raises(RuntimeError, match="stands at|no contact"):
        bpy.ops.beyond_mocap.fix_foot(action="MOVE", foot="left", time=100.0)
    with pytest.raises(RuntimeError, match="a time of the take"):
        bpy.ops.beyond_mocap.fix_foot(action="ADD", foot="left", time=100.0)
    with pytest.raises(RuntimeError, match="delete the contact instead"):
        bpy.ops.beyond_mocap.fix_foot(action="SHORTER", foot=chosen.foot, time=chosen.middle, seconds=100.0)
    assert not one.contact_edits
    session.clear_session()
    with pytest.raises(RuntimeError, match="press Update first"):
        bpy.ops.beyond_mocap.fix_foot(action="MOVE", foot="left", time=3.0)
    assert not one.contact_edits
