"""Settings of a character: which of its materials are the kit; and how a player or a team names its character."""

import bpy
from bpy.props import PointerProperty


def is_original(_settings, candidate: bpy.types.Object) -> bool:
    """Return whether an object may be picked as a character: an armature that is no copy of one, and no player's."""
    from .copies import COPY_OF, find_player

    return candidate.type == "ARMATURE" and candidate.get(COPY_OF) is None and find_player(candidate) is None


def is_worn(character: "BeyondMocapCharacter", candidate: bpy.types.Material) -> bool:
    """Return whether a material is on a mesh of the character."""
    from .copies import list_meshes

    return any(slot.material == candidate for mesh in list_meshes(character.id_data) for slot in mesh.material_slots)


def update_kit(character: "BeyondMocapCharacter", _context) -> None:
    """Dress the copies of a character again when another material is chosen."""
    from .kit_materials import dress_copies

    dress_copies(character.id_data)


class BeyondMocapCharacter(bpy.types.PropertyGroup):
    """The kit of a character: one material for each part, found by name where none is chosen"""

    attached_to = ("Object.beyond_mocap_character",)
    shirt: PointerProperty(name="Shirt", type=bpy.types.Material, poll=is_worn, update=update_kit,
                           description="Material that gets the colour of the shirt; empty finds it by its name")
    shorts: PointerProperty(name="Shorts", type=bpy.types.Material, poll=is_worn, update=update_kit,
                            description="Material that gets the colour of the shorts; empty finds it by its name")
    socks: PointerProperty(name="Socks", type=bpy.types.Material, poll=is_worn, update=update_kit,
                           description="Material that gets the colour of the socks; empty finds it by its name")
