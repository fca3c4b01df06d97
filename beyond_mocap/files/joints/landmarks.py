"""The points of a body that skeletal tracking delivers, and their names in the feeds."""

from __future__ import annotations

import re

SIDED = ("eye", "ear", "shoulder", "elbow", "wrist", "index", "pinky", "thumb", "hip", "knee", "ankle", "heel", "foot",
         "big_toe", "small_toe")
CENTRE = ("nose", "head", "neck", "pelvis")
LANDMARKS = (*CENTRE, *(f"{side}_{part}" for side in ("left", "right") for part in SIDED))
"""All points that are known. `pelvis` is the middle between the hip joints, `neck` that between the shoulders, `foot`
the front of a foot of which no single toe is seen."""
_SIDES = {"l": "left", "left": "left", "r": "right", "right": "right"}
_PARTS = {
    "bigtoe": "big_toe", "1sttoe": "big_toe", "smalltoe": "small_toe", "5thtoe": "small_toe", "toe": "foot",
    "calc": "heel", "calcaneus": "heel", "1stfinger": "index", "5thfinger": "pinky",
    "midhip": "pelvis", "hips": "pelvis", "root": "pelvis",
}  # fmt: skip
_WORD = re.compile(r"[0-9]+[a-z]+|[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[0-9]+[A-Z]+")


def identify_landmark(name: str) -> str | None:
    """Return the landmark that a feed's name stands for; None for one that is not known.

    Sides stand before or behind, as words or letters: lBigToe, R_1STTOE, elbow_right, leftHip.
    """
    words = [word.lower() for word in _WORD.findall(name)]
    side = next((_SIDES[word] for word in words if word in _SIDES), None)
    part = "".join(word for word in words if word not in _SIDES)
    part = _PARTS.get(part, part)
    found = part if side is None else f"{side}_{part}"
    return found if found in LANDMARKS else None
