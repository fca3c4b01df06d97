"""How a player looks: build, hair, skin and gloves, chosen from the player's id where nothing is said."""

from __future__ import annotations

from dataclasses import dataclass

from ..base.digest import byte_digest

HAIR_STYLES = ("short", "crop", "curly", "tied", "bald")
"""Shapes of hair."""

BUILDS = {  # shares of the athlete's girths
    "slim": {"hips": 0.95, "waist": 0.93, "chest": 0.94, "arm": 0.91, "thigh": 0.93, "calf": 0.94, "neck": 0.95},
    "normal": {"hips": 1.00, "waist": 1.00, "chest": 1.00, "arm": 1.00, "thigh": 1.00, "calf": 1.00, "neck": 1.00},
    "strong": {"hips": 1.03, "waist": 1.05, "chest": 1.06, "arm": 1.12, "thigh": 1.08, "calf": 1.06, "neck": 1.08},
    "woman": {"hips": 1.01, "waist": 0.92, "chest": 0.91, "arm": 0.86, "thigh": 0.97, "calf": 0.94, "neck": 0.86},
}
"""Builds, by girths of the parts of the body; heads and hands keep theirs."""

SKIN_TONES = ((0.62, 0.37, 0.26), (0.52, 0.29, 0.19), (0.40, 0.20, 0.115), (0.245, 0.115, 0.062),
              (0.125, 0.057, 0.032), (0.060, 0.028, 0.017))
"""Linear RGB from light to dark."""

HAIR_COLOURS = ((0.010, 0.007, 0.006), (0.028, 0.015, 0.009), (0.075, 0.036, 0.016), (0.20, 0.105, 0.040),
                (0.33, 0.20, 0.085))
"""Linear RGB from black to fair."""

_NATURAL = ((0, 1, 2, 3, 4), (0, 1, 2, 3, 4), (0, 1, 2), (0, 1), (0,), (0,))  # colours of hair by tone of skin


@dataclass(frozen=True)
class Look:
    """How a player looks.

    Attributes:
        build: a key of BUILDS.
        hair: one of HAIR_STYLES.
        skin: index into SKIN_TONES.
        colour: of the hair, index into HAIR_COLOURS.
        gloves: whether they wear a keeper's gloves.
    """

    build: str = "normal"
    hair: str = "short"
    skin: int = 1
    colour: int = 1
    gloves: bool = False


def choose_look(player: str, gloves: bool = False, women: bool = False) -> Look:
    """Choose a look by a player's id, the same in every session.

    Args:
        player: id.
        gloves: whether they wear a keeper's gloves.
        women: whether it is a women's team.
    """
    draw = byte_digest("look", player, size=8)
    skin = draw[0] % len(SKIN_TONES)
    colours = _NATURAL[skin]
    styles = ("short", "short", "crop", "crop", "curly", "tied", "bald") if not women else ("tied", "tied", "short")
    build = "woman" if women else ("slim", "normal", "normal", "strong")[draw[2] % 4]
    return Look(build=build, hair=styles[draw[1] % len(styles)], skin=skin, colour=colours[draw[3] % len(colours)],
                gloves=gloves)
