"""Motions as assets: actions with a catalog, tags, a description and a picture of their key pose.

Works without a window: pictures are rendered by the core. Catalogs are in Blender's own text file beside the .blend;
each has an identity that follows from its name, so that the same catalog is the same everywhere.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.annotation import DISCRETE, LOCOMOTION
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.files.atomic import atomic_write
from ..core import action
from ..rigs import armature, exporters

if TYPE_CHECKING:
    from ...beyond_mocap.motion.motion import Motion

CATALOGS = "blender_assets.cats.txt"
ROOT_CATALOG = "Beyond Mocap"
_CATALOG_HEADER = "# This is an Asset Catalog Definition file for Blender.\n\nVERSION 1\n\n"
_CATALOG_NAMESPACE = uuid.UUID("6a8b2d0e-6f0f-5f0c-9d7b-0f3f5b3d7a11")


@dataclass(frozen=True, eq=False)
class AssetDraft:
    """A motion that will become an asset.

    Attributes:
        name: of the asset.
        motion: its frames.
        labels: its labels, used as tags.
        frame: the pose that its picture shows.
        description: description of the asset.
        action: name of the action that plays it already, "" to create one.
    """

    name: str
    motion: "Motion"
    labels: tuple[str, ...]
    frame: int
    description: str
    action: str = ""


def build_draft(name: str, motion: "Motion", rows, description: str = "", action: str = "") -> AssetDraft:
    """Build a draft from a motion and its annotation rows.

    The picture shows the first key moment, else the middle of the longest row.
    """
    from ...beyond_mocap.library.listing import collect_labels

    keys = [row.key for row in rows if row.key is not None]
    longest = max(rows, key=lambda row: row.end - row.start, default=None)
    middle = (longest.start + longest.end) // 2 if longest is not None else len(motion) // 2
    frame = min(keys[0] if keys else middle, len(motion) - 1)
    return AssetDraft(name, motion, collect_labels(rows)[0], frame=frame, description=description, action=action)


def render_picture(draft: AssetDraft) -> np.ndarray | None:
    """Render the picture (256, 256, 4) of a draft; None for a skeleton that cannot carry a body."""
    from ...beyond_mocap.appearance.picture import render_pose

    try:
        return render_pose(draft.motion, draft.frame)
    except InputError:
        return None


def choose_catalog(words: Iterable[str]) -> str:
    """Choose the catalog of a motion with these labels: its action, else its gait, else "Other"."""
    words = tuple(words)
    known = [word for word in words if word in DISCRETE] or [word for word in words if word in LOCOMOTION]
    return f"{ROOT_CATALOG}/{(known or ['other'])[0].replace('_', ' ').capitalize()}"


def compute_catalog_id(catalog: str) -> str:
    """Compute a catalog's identity, the same in every file."""
    return str(uuid.uuid5(_CATALOG_NAMESPACE, catalog))


def create_assets(context: bpy.types.Context, drafts: list[AssetDraft], pictures: list,
                  copy_actions: bool = False) -> list[bpy.types.Action]:
    """Create assets from drafts: their own actions are marked, or new ones created.

    Args:
        context: of Blender.
        drafts: the motions.
        pictures: (H, W, 4) arrays or None.
        copy_actions: leave own actions as they are, and mark copies of them.
    Returns:
        The actions.
    """
    actions, rigs = [], []
    try:
        for one, pixels in zip(drafts, pictures):
            own_action = bpy.data.actions.get(one.action) if one.action else None
            if own_action is not None and copy_actions:
                own_action = own_action.copy()
            if own_action is None:
                rig = next((rig for rig, skeleton in rigs if skeleton.has_same_bones(one.motion.skeleton)), None)
                if rig is None:
                    rig = armature.create_armature(context, one.motion.skeleton, "Player")
                    rigs.append((rig, one.motion.skeleton))
                own_action = action.write_motion(rig, one.motion, context.scene, name=one.name)
            mark_asset(own_action, one, pixels)
            actions.append(own_action)
    finally:
        data = [rig.data for rig, _ in rigs]
        bpy.data.batch_remove([rig for rig, _ in rigs])
        bpy.data.batch_remove(data)
    return actions


def mark_asset(item: bpy.types.Action, draft: AssetDraft, pixels: np.ndarray | None) -> None:
    """Mark an action as an asset with catalog, tags, description and picture."""
    item.asset_mark()
    about = item.asset_data
    about.catalog_id = compute_catalog_id(choose_catalog(draft.labels))
    about.description = draft.description
    for tag in list(about.tags):
        about.tags.remove(tag)
    for word in draft.labels:
        about.tags.new(word)
    if pixels is not None:
        preview = item.preview_ensure()
        preview.image_size = pixels.shape[1], pixels.shape[0]
        preview.image_pixels_float.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())


def define_catalogs(folder: str | Path, catalogs: Iterable[str]) -> Path:
    """Add catalogs to the definitions for files in `folder`: the nearest file above it, else a new one in it.

    Returns:
        The file; it is written under another name and renamed.
    Raises:
        InputError: if it cannot be read or written.
    """
    folder = Path(folder)
    target = next((place / CATALOGS for place in (folder, *folder.parents) if (place / CATALOGS).is_file()),
                  folder / CATALOGS)
    try:
        text = target.read_text("utf-8") if target.is_file() else _CATALOG_HEADER
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(target, f"cannot be read ({error})", "Blender's catalogs", "remove the file") from None
    new = [name for name in sorted({ROOT_CATALOG, *catalogs}) if compute_catalog_id(name) not in text]
    if not new:
        return target
    text = text.rstrip("\n") + "\n" + "".join(f"{compute_catalog_id(name)}:{name}:{name.replace('/', '-')}\n"
                                              for name in new)
    atomic_write(target, text)
    return target


def write_library(path: Path, actions: list[bpy.types.Action]) -> None:
    """Write actions to a .blend of their own, completely or not at all; InputError where that fails."""
    exporters.write_whole_file(path, lambda part: bpy.data.libraries.write(part, set(actions), fake_user=True,
                                                                        compress=True))
