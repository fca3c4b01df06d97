"""What players wear: shirts in their team's colour, keepers and referees in others, numbers that can be
read on them."""

from __future__ import annotations

import re
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.material import colour, made
from ..stage.body import LOOKS
from . import ours
from .load import TEAMS, Person

USUAL = {"home": "#C8102E", "away": "#1D4ED8", "referee": "#15171A"}
"""Shirts of teams whose feed tells no colour."""

KEEPERS = ("#F2C200", "#1FA34A", "#F07A13", "#8A3FB5")
"""Shirts to choose a keeper's from: yellow, green, orange, violet."""

WHITE, DARK = (0.8, 0.8, 0.8), (0.012, 0.016, 0.03)
OWN = ("shirt", "shorts", "socks", "number")
"""Parts whose colour is the kit's."""

BRIGHT = 0.35  # luminance from which a shirt takes a dark number and dark shorts


@dataclass(frozen=True)
class Kit:
    """Linear RGB of shirt, shorts, socks, and of the number on the shirt. name: of its materials."""

    name: str
    shirt: tuple[float, float, float]
    shorts: tuple[float, float, float]
    socks: tuple[float, float, float]
    ink: tuple[float, float, float]


def kit_of(person: Person, colours: dict[str, str]) -> Kit:
    """What a person wears; colours: team -> "#RRGGBB", USUAL where a team has none."""
    shirts = {team: linear(colours.get(team) or USUAL[team]) for team in USUAL}
    if person.team == "referee":
        return Kit("Referee", shirts["referee"], DARK, DARK, WHITE)
    shirt, name = shirts[person.team], person.team.capitalize()
    if person.keeper:
        shirt, name = _keepers(shirts, person.team), f"{name} keeper"
    bright = luminance(shirt) > BRIGHT
    ink = DARK if bright else WHITE
    return Kit(name, shirt, DARK if person.keeper or bright else WHITE, shirt, ink)


def _keepers(shirts: dict[str, tuple], team: str) -> tuple[float, float, float]:
    """The keeper's colour that differs most from all shirts on the pitch; the away keeper's from the other's too."""
    worn, offered = list(shirts.values()), [linear(text) for text in KEEPERS]
    first = max(offered, key=lambda rgb: _nearest(rgb, worn))
    if team == "home":
        return first
    return max((rgb for rgb in offered if rgb != first), key=lambda rgb: _nearest(rgb, worn))


def _nearest(rgb, others) -> float:
    return min(float(np.linalg.norm(np.sqrt(rgb) - np.sqrt(other))) for other in others)


def linear(text: str) -> tuple[float, float, float]:
    """"#RRGGBB" (sRGB) as linear RGB."""
    shares = np.array([int(text.lstrip("#")[i : i + 2], 16) for i in (0, 2, 4)]) / 255.0
    return tuple(np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4).tolist())


def written(rgb) -> str:
    """Linear RGB as "#RRGGBB"."""
    shares = np.clip(np.array(rgb[:3]), 0.0, 1.0)
    curved = np.where(shares <= 0.0031308, 12.92 * shares, 1.055 * shares ** (1 / 2.4) - 0.055)
    return "#" + "".join(f"{int(round(255.0 * share)):02X}" for share in curved)


def luminance(rgb) -> float:
    """How bright a linear colour is, 0 to 1."""
    return float(np.dot(rgb, (0.2126, 0.7152, 0.0722)))


def repaint(scene: bpy.types.Scene, colours: dict[str, str]) -> None:
    """Let whoever is dressed already in the scene's match wear these colours of shirts: team -> "#RRGGBB"."""
    worn = {cloth for team in TEAMS for thing in ours.meshes(scene, team) for cloth in thing.data.materials}
    for team in USUAL:
        for keeper in (False, True):
            kit = kit_of(Person("", "", -1, team=team, keeper=keeper, motions=()), colours)
            for part, rgb in _own(kit).items():
                for material in worn & set(_all_of(kit, part)):
                    _paint(material, rgb)


def cloth(kit: Kit, part: str) -> bpy.types.Material:
    """A material for one part of a kit ("shirt", "number", or one of the body's), in the kit's present colour.

    What another match or anybody else wears is not taken: each call for a part of the kit's own gives another material
    as soon as the one before is worn. Skin, hair and boots are everybody's."""
    own = _own(kit)
    if part not in own:
        return colour(part.capitalize(), LOOKS[part])
    free = (one for one in _all_of(kit, part) if one.users == one.use_fake_user)
    material = next(free, None) or made(_name(kit, part), own[part])
    _paint(material, own[part])
    return material


def _own(kit: Kit) -> dict[str, tuple[float, float, float]]:
    return dict(zip(OWN, (kit.shirt, kit.shorts, kit.socks, kit.ink)))


def _name(kit: Kit, part: str) -> str:
    return f"Match {kit.name} {part}"


def _all_of(kit: Kit, part: str) -> list[bpy.types.Material]:
    """The file's own materials for a part of a kit, of all matches that are shown in it, by name."""
    form = re.compile(re.escape(_name(kit, part)) + r"(\.\d{3,})?")
    return [one for one in bpy.data.materials if one.library is None and form.fullmatch(one.name)]


def _paint(material: bpy.types.Material, rgb: tuple[float, float, float]) -> None:
    nodes = material.node_tree.nodes if material.node_tree is not None else ()
    shader = next((node for node in nodes if node.type == "BSDF_PRINCIPLED"), None)
    if shader is not None:  # or the user has made another material of it
        shader.inputs["Base Color"].default_value = (*rgb, 1.0)
    material.diffuse_color = (*(channel**0.6 for channel in rgb), 1.0)
