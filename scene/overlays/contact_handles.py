"""Footprints that can be picked and dragged while Fix Foot runs: all contacts of a take, the edited ones outlined, the
chosen one bright. Independent of gpu.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Matrix

from ...beyond_mocap.synthesis import contact_edit
from ..player.contact_edits import Contact
from . import colours, shapes
from .path_overlays import DrawItem
from .prepare import SOLE, SOLE_EDGE, Mesh

_REACH = 0.25  # metres of the pointer from a footprint's middle within which it is picked
_LIFT = 0.012  # metres above the other footprints


@dataclass(eq=False)
class Handles:
    """What is drawn.

    Attributes:
        scene: the scene's name.
        take: name of the take.
        world: from the take's metres to the scene.
        contacts: all contacts.
        edited: for each whether it is edited.
        chosen: number of the chosen one; None for none.
        offset: (2,) m by which the chosen one is dragged.
    """

    scene: str
    take: str
    world: Matrix
    contacts: list[Contact]
    edited: list[bool]
    chosen: int | None = None
    offset: np.ndarray = field(default_factory=lambda: np.zeros(2))

    def find_nearest(self, place: np.ndarray, seconds: float) -> int | None:
        """Find the footprint under a place (2,) m on the ground; of several the one nearest to a time."""
        middles = np.array([0.5 * (contact.heel + contact.toe) for contact in self.contacts]).reshape(-1, 2)
        near = np.flatnonzero(np.linalg.norm(middles - place, axis=1) < _REACH)
        if not len(near):
            return None
        away = [np.linalg.norm(middles[number] - place) + 0.02 * abs(self.contacts[number].middle - seconds)
                for number in near]
        return int(near[int(np.argmin(away))])


_shown: list[Handles] = []  # one while the operator runs


def show_handles(handles: Handles | None) -> None:
    """Show these footprints, or none."""
    _shown[:] = [] if handles is None else [handles]


def list_items(scene: bpy.types.Scene) -> list[DrawItem]:
    """List what to draw in a scene."""
    found = []
    for handles in _shown:
        if handles.scene != scene.name or not handles.contacts:
            continue
        key = ("contact handles", handles.take, tuple(handles.edited))
        found.append(DrawItem((handles, *key), lambda handles=handles: _build_all(handles), handles.world))
        if handles.chosen is not None:
            offset = tuple(handles.offset.tolist())
            found.append(DrawItem((handles, "chosen", handles.chosen, offset),
                                  lambda handles=handles: _build_chosen(handles), handles.world, in_front=True))
    return found


def _build_all(handles: Handles) -> list[Mesh]:
    """Build all footprints, coloured by foot; edited ones have a yellow edge."""
    fill, edge = _build_soles(handles.contacts, np.zeros(2), 0.0)
    side = [contact_edit.FEET.index(contact.foot) for contact in handles.contacts]
    colour = np.array([(*colours.LEFT, 0.55), (*colours.RIGHT, 0.55)], np.float32)[side]
    edges = np.array([(*colours.YELLOW, 1.0) if edited else (*colours.BLACK, 0.8) for edited in handles.edited],
                     np.float32)
    return [Mesh("TRIS", fill, colour.repeat(len(fill) // len(side), axis=0)),
            Mesh("LINES", edge, edges.repeat(len(edge) // len(side), axis=0), 2.0)]


def _build_chosen(handles: Handles) -> list[Mesh]:
    """Build the chosen footprint where it is dragged to, and a line from where it is."""
    contact = handles.contacts[handles.chosen]
    fill, edge = _build_soles([contact], handles.offset, _LIFT)
    meshes = [Mesh("TRIS", fill, colours.repeat_colour(colours.YELLOW, len(fill), 0.75)),
              Mesh("LINES", edge, colours.repeat_colour(colours.WHITE, len(edge)), 3.0)]
    if handles.offset.any():
        middle = 0.5 * (contact.heel + contact.toe)
        line = np.array([(*middle, SOLE_EDGE), (*(middle + handles.offset), SOLE_EDGE)], np.float32)
        meshes.append(Mesh("LINES", line, colours.repeat_colour(colours.WHITE, 2), 2.0))
    return meshes


def _build_soles(contacts: list[Contact], offset: np.ndarray, lift: float) -> tuple[np.ndarray, np.ndarray]:
    heel, toe = (np.array([getattr(contact, name) for contact in contacts]) + offset for name in ("heel", "toe"))
    along = toe - heel
    side = np.array([contact_edit.FEET.index(contact.foot) for contact in contacts])
    fill, edge = shapes.build_soles(heel, toe, np.arctan2(along[:, 1], along[:, 0]), side, SOLE + lift)
    edge[:, 2] = SOLE_EDGE + lift
    return fill, edge
