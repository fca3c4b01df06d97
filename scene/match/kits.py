"""Kits of players: shirts in the team's colour, other colours for keepers and referees, and readable numbers."""

from __future__ import annotations

import re
from typing import NamedTuple

import bpy
import numpy as np

from ..characters import kit_materials
from ..core import material as materials
from ..stage import body as bodies
from ..stage import body_surfaces
from . import load
from . import match_objects as ours

DEFAULT_COLOURS = {"home": "#C8102E", "away": "#1D4ED8", "referee": "#15171A"}
"""Shirts of teams without a colour in the feed."""

KEEPER_COLOURS = ("#F2C200", "#1FA34A", "#F07A13", "#8A3FB5")
"""Possible shirts of keepers: yellow, green, orange, violet."""

WHITE, DARK = (0.8, 0.8, 0.8), (0.012, 0.016, 0.03)
KIT_PARTS = ("shirt", "shorts", "socks", "trim", "number")
"""Parts that have the kit's colours."""

BRIGHT_LUMINANCE = 0.35  # luminance from which a shirt gets a dark number and dark shorts


class Kit(NamedTuple):
    """The colours of a kit, linear RGB.

    Attributes:
        name: in the names of its materials.
        shirt: colour.
        shorts: colour.
        socks: colour.
        ink: colour of number, name, collar and edges.
    """

    name: str
    shirt: tuple[float, float, float]
    shorts: tuple[float, float, float]
    socks: tuple[float, float, float]
    ink: tuple[float, float, float]


def choose_kit(person: load.Character, colours: dict[str, str]) -> Kit:
    """Choose a person's kit.

    Args:
        person: the player or referee.
        colours: "#RRGGBB" by team, the default colour where a team has none.
    Returns:
        The kit.
    """
    shirts = {team: to_linear(colours.get(team) or DEFAULT_COLOURS[team]) for team in DEFAULT_COLOURS}
    if person.team == "referee":
        return Kit("Referee", shirts["referee"], DARK, DARK, WHITE)
    shirt, name = shirts[person.team], person.team.capitalize()
    if person.keeper:
        shirt, name = _choose_keeper_shirt(shirts, person.team), f"{name} keeper"
    bright = compute_luminance(shirt) > BRIGHT_LUMINANCE
    ink = DARK if bright else WHITE
    return Kit(name, shirt, DARK if person.keeper or bright else WHITE, shirt, ink)


def _choose_keeper_shirt(shirts: dict[str, tuple], team: str) -> tuple[float, float, float]:
    """Choose the keeper's colour that differs most from all shirts; the away keeper's also from the home keeper's."""
    shirts_used, candidates = list(shirts.values()), [to_linear(text) for text in KEEPER_COLOURS]
    first = max(candidates, key=lambda rgb: _measure_contrast(rgb, shirts_used))
    if team == "home":
        return first
    return max((rgb for rgb in candidates if rgb != first), key=lambda rgb: _measure_contrast(rgb, shirts_used))


def _measure_contrast(rgb, others) -> float:
    return min(float(np.linalg.norm(np.sqrt(rgb) - np.sqrt(other))) for other in others)


def to_linear(text: str) -> tuple[float, float, float]:
    """Convert "#RRGGBB" (sRGB) to linear RGB."""
    shares = np.array([int(text.lstrip("#")[i : i + 2], 16) for i in (0, 2, 4)]) / 255.0
    return tuple(np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4).tolist())


def to_hex(rgb) -> str:
    """Convert linear RGB to "#RRGGBB"."""
    shares = np.clip(np.array(rgb[:3]), 0.0, 1.0)
    curved = np.where(shares <= 0.0031308, 12.92 * shares, 1.055 * shares ** (1 / 2.4) - 0.055)
    return "#" + "".join(f"{int(round(255.0 * share)):02X}" for share in curved)


def compute_luminance(rgb) -> float:
    """Compute the luminance of a linear colour, 0 to 1."""
    return float(np.dot(rgb, (0.2126, 0.7152, 0.0722)))


def update_materials(scene: bpy.types.Scene, colours: dict[str, str]) -> None:
    """Update the shirts of the displayed match.

    Args:
        scene: the scene.
        colours: "#RRGGBB" by team.
    """
    used = {cloth for team in load.TEAMS for thing in ours.find_meshes(scene, team) for cloth in thing.data.materials}
    for team in DEFAULT_COLOURS:
        for keeper in (False, True):
            kit = choose_kit(load.Character("", "", -1, team=team, keeper=keeper, motions=()), colours)
            for part, rgb in _build_part_colours(kit).items():
                for material in used & set(_find_materials(kit, part)):
                    _set_colour(material, rgb)
            for body in ours.find_armatures(scene):
                if body.get(kit_materials.WORN, {}).get("kit") == kit.name:
                    dress_in_kit(body, kit)


def dress_in_kit(body: bpy.types.Object, kit: Kit) -> None:
    """Dress a copy of a character of the file in a kit."""
    kit_materials.dress(body, kit.name, {"shirt": kit.shirt, "shorts": kit.shorts, "socks": kit.socks})


def create_kit_material(kit: Kit, part: str) -> bpy.types.Material:
    """Create or reuse a material for one of KIT_PARTS, in the kit's present colour.

    A material used by another match or object is not reused: after the previous one is in use, each call gives another
    material.

    Args:
        kit: the kit.
        part: the part.
    Returns:
        The material.
    """
    colours = _build_part_colours(kit)
    unused = (one for one in _find_materials(kit, part) if one.users == one.use_fake_user)
    material = next(unused, None) or body_surfaces.paint_part(
        materials.create_material(_build_material_name(kit, part), colours[part], bodies.CLOTH), part)
    _set_colour(material, colours[part])
    return material


def _build_part_colours(kit: Kit) -> dict[str, tuple[float, float, float]]:
    return dict(zip(KIT_PARTS, (kit.shirt, kit.shorts, kit.socks, kit.ink, kit.ink)))


def _build_material_name(kit: Kit, part: str) -> str:
    return f"Match {kit.name} {part}"


def _find_materials(kit: Kit, part: str) -> list[bpy.types.Material]:
    """Find the file's own materials for a part of a kit, of all displayed matches, by name."""
    form = re.compile(re.escape(_build_material_name(kit, part)) + r"(\.\d{3,})?")
    return [one for one in bpy.data.materials if one.library is None and form.fullmatch(one.name)]


def _set_colour(material: bpy.types.Material, rgb: tuple[float, float, float]) -> None:
    """Set the colour of a material."""
    nodes = material.node_tree.nodes if material.node_tree is not None else ()
    shader = next((node for node in nodes if node.type == "BSDF_PRINCIPLED"), None)
    if shader is not None:  # otherwise the user has replaced its shader
        shader.inputs["Base Color"].default_value = (*rgb, 1.0)
    material.diffuse_color = (*(channel**0.6 for channel in rgb), 1.0)
