"""Several takes of one player to choose from: kept in the session, named on the player, one of them shown."""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ..core import session
from ..core.settings import BeyondMocapPlayer
from . import preview

LINES = ("quality", "moments", "warnings", "recipe")


def keep(player: BeyondMocapPlayer, found: list[tuple[str, dict[str, str], dict]]) -> None:
    """Name the takes of (name, lines, report) on the player, if there are several; what was named before goes."""
    variants = player.result.variants
    variants.clear()
    if len(found) < 2:
        return
    first = session.made(found[0][0]).take
    for name, lines, report in found:
        variant = variants.add()
        variant.name = name
        for line in LINES:
            setattr(variant, line, lines[line])
        variant.summary = _summary(report, _apart(first, session.made(name).take))


def show(context: bpy.types.Context, player: BeyondMocapPlayer, number: int) -> None:
    """Show variant `number`, from 0; InputError where the session does not have it any more."""
    variants = player.result.variants
    if not 0 <= number < len(variants):
        raise InputError("variant", f"number {number + 1}", f"1 to {len(variants)}", "make variants first")
    variant = variants[number]
    if session.made(variant.name) is None:
        found = "not in this session: it was made before the file was opened"
        raise InputError("variant", found, "variants of this session", "make variants again")
    preview.show(context, player, variant.name, {line: getattr(variant, line) for line in LINES})


def _summary(report: dict, apart: float) -> str:
    """A take's figures in a few words."""
    root, slide = report["root_error_m"]["mean"], report["skate"]["contact_cm_s"]
    words = f"slide {slide:.1f} cm/s" if slide is not None else f"off {100 * root:.1f} cm"
    jerk = report.get("seam_jerk_ratio", {}).get("median")
    words += f", seams {jerk:.2f}" if jerk is not None else ""
    return f"{words}, {apart:.0%} other" if apart else words


def _apart(first, other) -> float:
    """The share of frames at which two takes of one plan show different footage."""
    same_clip = np.array(first.clips)[first.clip] == np.array(other.clips)[other.clip]
    same = same_clip & (first.mirrored == other.mirrored) & (np.abs(first.clip_frame - other.clip_frame) < 3.0)
    return float(1.0 - same.mean())
