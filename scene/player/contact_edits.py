"""Edits of a player's foot contacts: contacts that are moved, longer, shorter, left out or added, and which contacts of
the newest take they belong to.
"""

from typing import NamedTuple

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty

from ...beyond_mocap.base import time_series
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.synthesis import contact_edit
from ..core import session

FEET = (("left", "Left", "Left foot"), ("right", "Right", "Right foot"))
KINDS = (("change", "Changed", "The contact is moved, longer or shorter"),
         ("delete", "Left Out", "The foot does not touch the ground there"),
         ("add", "Added", "The foot touches the ground there"))
MOST_OFFSET = 1.0  # m from its place that a contact may be moved: about what a leg reaches
_NEAR = 0.1  # s by which an edit may lie beside the contact it belongs to: contacts begin and end on frames


class BeyondMocapContactEdit(bpy.types.PropertyGroup):
    """One edited contact of a player's foot"""

    foot: EnumProperty(name="Foot", items=FEET, description="Foot of the contact")
    kind: EnumProperty(name="Kind", items=KINDS, description="How the contact is edited")
    time: FloatProperty(name="Time", unit="TIME_ABSOLUTE", precision=2,
                        description="Time on the track's clock at which the unedited contact is")
    start: FloatProperty(name="Start", unit="TIME_ABSOLUTE", precision=3, soft_min=-0.5, soft_max=0.5,
                         description="Seconds by which the contact begins later; negative for earlier")
    end: FloatProperty(name="End", unit="TIME_ABSOLUTE", precision=3, soft_min=-0.5, soft_max=0.5,
                       description="Seconds by which the contact ends later; negative for earlier")
    offset: FloatVectorProperty(name="Offset", size=2, precision=3, subtype="XYZ", soft_min=-1.0, soft_max=1.0,
                                description="Metres by which the contact is moved on the ground")


class Contact(NamedTuple):
    """A contact of a take's foot.

    Attributes:
        foot: "left" or "right".
        start, end: s, of its first and last frame.
        heel, toe: (2,) m, their mean places on the ground.
    """

    foot: str
    start: float
    end: float
    heel: np.ndarray
    toe: np.ndarray

    @property
    def middle(self) -> float:
        """Its middle, s."""
        return 0.5 * (self.start + self.end)


def read_contact_edits(player) -> "tuple[contact_edit.ContactEdit, ...]":
    """Read a player's contact edits."""
    return tuple(contact_edit.ContactEdit(round(edit.time, 6), edit.foot, edit.kind, round(edit.start, 6),
                                          end=round(edit.end, 6),
                                          offset=tuple(round(value, 6) for value in edit.offset))
                 for edit in player.contact_edits)


def write_contact_edits(player, edits: "tuple[contact_edit.ContactEdit, ...]") -> None:
    """Replace a player's contact edits."""
    player.contact_edits.clear()
    for edit in edits:
        row = player.contact_edits.add()
        row.foot, row.kind, row.time = edit.foot, edit.kind, edit.time
        row.start, row.end, row.offset = edit.start, edit.end, edit.offset


def find_take(player):
    """Find the player's newest take. Raises InputError where this session has none."""
    stored = session.find_take(player.take) if player is not None and player.take else None
    if stored is None:
        raise InputError("fix foot", "this session has no take of the player", "a take whose contacts are known",
                         "press Update first", fixes=(Fix("press", "beyond_mocap.update"),))
    return stored.take


def check_time(take, seconds: float) -> None:
    """Check that a time is within a take (InputError)."""
    end = take.start_time + (len(take.motion) - 1) / take.motion.fps
    if not take.start_time <= seconds <= end:
        raise InputError("fix foot", f"{seconds:.2f} s", f"a time of the take, {take.start_time:.2f} to {end:.2f} s",
                         "go to a frame of the take")


def list_contacts(take) -> list[Contact]:
    """List the contacts of a take, of both feet."""
    from ...beyond_mocap.motion.humanoid import identify_joints
    from ...beyond_mocap.motion.motion import forward_kinematics

    body, places = identify_joints(take.motion.skeleton), forward_kinematics(take.motion)[0]
    times, found = take.start_time + np.arange(len(take.motion)) / take.motion.fps, []
    for side, limb in enumerate((body.left, body.right)):
        for first, end in time_series.find_runs(take.contacts[:, side]):
            heel, toe = (places[first:end, joint, :2].mean(axis=0) for joint in (limb.foot, limb.toe_or_foot))
            found.append(Contact(contact_edit.FEET[side], float(times[first]), float(times[end - 1]), heel, toe))
    return found


def find_contact(contacts: list[Contact], foot: str, seconds: float) -> Contact:
    """Find the contact of a foot nearest to a time. Raises InputError where there is none within half a second."""
    own = [contact for contact in contacts if contact.foot == foot]
    away = [max(contact.start - seconds, seconds - contact.end, 0.0) for contact in own]
    if not own or min(away) > 0.5:
        raise InputError("fix foot", f"no contact of the {foot} foot at {seconds:.2f} s", "a contact",
                         "go to a frame on which the foot stands, or add a contact")
    return own[int(np.argmin(away))]


def find_edit(player, contact: Contact):
    """Find the edit that a contact of the take comes from; None where it is as constructed."""
    for edit in player.contact_edits:
        if edit.foot != contact.foot or edit.kind == "delete":
            continue
        if contact.start - edit.start - _NEAR <= edit.time <= contact.end - edit.end + _NEAR:
            return edit
    return None


def change_contact(player, contact: Contact, offset=(0.0, 0.0), start: float = 0.0, end: float = 0.0):
    """Move a contact by `offset` (2,) m, and let it begin and end later by seconds; returns its edit.

    Raises InputError for a contact that is then farther than MOST_OFFSET from its place, or has no length.
    """
    edit = find_edit(player, contact)
    lasts = contact.end + end > contact.start + start
    is_undone = edit is not None and edit.start + start <= 0.0 <= edit.end + end  # at least as long as it was found
    if not (lasts or is_undone):
        raise InputError("fix foot", f"a contact of {contact.end - contact.start:.2f} s made shorter by "
                         f"{start - end:.2f} s", "some of it left", "delete the contact instead")
    length = float(np.hypot(*(np.array(offset, dtype=float) + (list(edit.offset) if edit is not None else 0.0))))
    if length > MOST_OFFSET:
        raise InputError("fix foot", f"a contact moved by {length:.2f} m", f"at most {MOST_OFFSET:g} m",
                         "move it less, or bend the track")
    if edit is None:
        edit = _add_edit(player, contact.foot, "change", contact.middle)
    edit.offset = [float(before) + float(by) for before, by in zip(edit.offset, offset)]
    edit.start, edit.end = edit.start + start, edit.end + end
    return edit


def delete_contact(player, contact: Contact) -> None:
    """Leave a contact out; one that was added is removed again."""
    edit = find_edit(player, contact)
    if edit is None:
        _add_edit(player, contact.foot, "delete", contact.middle)
    elif edit.kind == "add":
        remove_edit(player, list(player.contact_edits).index(edit))
    else:
        edit.kind = "delete"


def add_contact(player, contacts: list[Contact], foot: str, seconds: float):
    """Add a contact of a foot at a time; one that was left out there comes back instead. Raises InputError in one."""
    if any(one.foot == foot and one.start <= seconds <= one.end for one in contacts):
        raise InputError("fix foot", f"the {foot} foot stands at {seconds:.2f} s already", "a frame on which it does "
                         "not", "go to another frame")
    for number, edit in enumerate(player.contact_edits):
        if edit.foot == foot and edit.kind == "delete" and abs(edit.time - seconds) < 2.0 * _NEAR:
            return remove_edit(player, number)
    return _add_edit(player, foot, "add", seconds)


def remove_edit(player, number: int) -> None:
    """Remove an edit: its contact is again as constructed."""
    player.contact_edits.remove(number)
    player.active_contact_edit = max(0, min(player.active_contact_edit, len(player.contact_edits) - 1))


def _add_edit(player, foot: str, kind: str, seconds: float):
    edit = player.contact_edits.add()
    edit.foot, edit.kind, edit.time = foot, kind, seconds
    player.active_contact_edit = len(player.contact_edits) - 1
    return edit
