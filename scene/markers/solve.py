"""From a cloud to a body: what the recipe gets, and what its result becomes in the scene."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix

from ...beyond_mocap.base.errors import InputError
from ..core import action, channels, linked
from ..core.measure import frames_per_second
from ..core.properties import property_values
from ..core.settings import absolute
from ..result import bake
from ..rigs import armature
from ..stage import body
from . import cloud as clouds
from . import kept as store
from . import models, sets, thrown
from .settings import is_alone, is_cloud

if TYPE_CHECKING:
    from ...beyond_mocap.markers.model.model import MarkerModel
    from ...beyond_mocap.markers.reconstruct import Reconstruction, ReconstructSettings
    from ...beyond_mocap.markers.trial import MarkerTrial

MADE = "beyond_mocap_reconstructed"  # custom property of actions made here; no group has its name
SKIN = (0.55, 0.55, 0.60)


@dataclass(frozen=True)
class Order:
    """All that the recipe needs of a cloud, without bpy. cloud: its name; add: the clip to write, with `words`."""

    cloud: str
    trial: "MarkerTrial"
    static: "MarkerTrial | None"
    model: "MarkerModel | None"
    settings: "ReconstructSettings"
    add: Path | None = None
    words: tuple[str, ...] = ()


def order_of(scene: bpy.types.Scene, cloud: bpy.types.Object) -> Order:
    """What is asked of a cloud by its own settings and the scene's. InputError where something is missing."""
    linked.refuse(cloud, cloud.data)
    kept, chosen = cloud.beyond_mocap_cloud, scene.beyond_mocap_markers
    trial = clouds.read(cloud, scene)
    clouds.played_rate(cloud, scene)
    static = _static_of(cloud, scene)
    words = tuple(chosen.words.split()) if chosen.add else ()
    return Order(
        cloud.name, trial, static and clouds.read(static, scene),
        model=models.of_cloud(cloud) if kept.use_model else None, settings=settings_of(cloud, chosen, words),
        add=clip_place(scene, cloud.name) if chosen.add else None, words=words,
    )


def _static_of(cloud: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The cloud that stands for its model. InputError where it was deleted: the field keeps what is in no scene."""
    kept = cloud.beyond_mocap_cloud
    if kept.use_model or not is_cloud(kept.static) or kept.static == cloud:
        return None
    if scene.objects.get(kept.static.name) != kept.static:
        found, step = (
            f"its static trial {kept.static.name} is gone from the scene",
            "choose another, or clear the field",
        )
        raise InputError(cloud.name, found, "a cloud that is there", step)
    return kept.static


def settings_of(cloud: bpy.types.Object, chosen, words: tuple[str, ...] = ()) -> "ReconstructSettings":
    """The recipe's settings; the marker set is the cloud's own where its markers have segments."""
    from ...beyond_mocap.markers.reconstruct import ReconstructSettings

    assigned = any(row.segment for row in cloud.beyond_mocap_cloud.labels)
    throw = any(word.startswith("throw") for word in words)
    return ReconstructSettings(
        marker_set=sets.of_cloud(cloud) if assigned else None, release="yes" if throw else "auto",
        **property_values(ReconstructSettings, chosen, "markers"),
    )


def clip_place(scene: bpy.types.Scene, name: str) -> Path:
    """Where the clip goes in the library's folder. InputError where there is none, or where the name is taken."""
    from ...beyond_mocap.library.keep_words import free_place

    folder = scene.beyond_mocap.library_folder
    if not folder:
        raise InputError("library", "no folder is chosen", "one", "choose it in the panel Library")
    return free_place(Path(absolute(folder)), bpy.path.clean_name(name))


def show(context: bpy.types.Context, cloud: bpy.types.Object, made: "Reconstruction") -> bpy.types.Object:
    """The result beside the cloud: an armature that moves with it, and what is told in the panel; returns it."""
    scene, kept = context.scene, cloud.beyond_mocap_cloud
    thing = kept.body
    if thing is None or not is_alone(cloud, scene, "body") or not fits(thing, made, scene):
        room = cloud.users_collection[0] if cloud.users_collection else context.collection
        thing = kept.body = armature.create(context, made.motion.skeleton, f"{cloud.name} body", room)
    if scene.beyond_mocap_markers.dressed and not any(child.type == "MESH" for child in thing.children):
        body.create(thing, thing.name, SKIN, collection=thing.users_collection[0], scene=scene, example=made.motion)
    thing.matrix_world = Matrix()
    context.view_layer.update()
    slowed = clouds.played_rate(cloud, scene) / kept.fps
    played = replace(made.motion, fps=made.motion.fps * slowed)
    channels.discard(thing, MADE)
    action.write(thing, played, scene, clouds.start_frame(cloud), cloud.name, generated=True)[MADE] = True
    thing.matrix_world = cloud.matrix_world
    bake.lengthen(scene, clouds.start_frame(cloud) + played.duration * frames_per_second(scene))
    kept.made, kept.figures, kept.told = store.keep(made), "\n".join(figures(made)), "\n".join(made.warnings)
    models.onto(cloud, made.model)
    kept.release = ""
    if made.release is not None:
        thrown.show(context, cloud, made.release)
    return thing


def fits(thing: bpy.types.Object, made: "Reconstruction", scene: bpy.types.Scene) -> bool:
    """Whether a body from before has the same bones and may be written to."""
    if thing.type != "ARMATURE" or thing.library is not None or thing.name not in scene.objects:
        return False
    return armature.skeleton_of(thing, scene).same_bones(made.motion.skeleton, 1e-4)


def figures(made: "Reconstruction") -> list[str]:
    """Lines "name: value" for the panel."""
    residual = made.solved.residual
    away = 1000.0 * residual[np.isfinite(residual)]
    lines = [f"Frames: {len(made.motion)} at {made.motion.fps:g}/s", f"Joints: {len(made.motion.skeleton)}"]
    lines.append(f"Markers: {len(made.model.markers)}")
    if len(away):
        lines += [f"Markers off: {away.mean():.1f} mm", f"95 % of them: below {np.percentile(away, 95.0):.1f} mm"]
    spent = sum(value for name, value in made.seconds.items() if name != "total")
    lines.append(f"Took: {spent:.1f} s")
    return lines


def add(order: Order, made: "Reconstruction") -> list[str]:
    """Write the clip and its words into the library, where that was asked for; lines about it."""
    if order.add is None:
        return []
    from ...beyond_mocap.library.keep_words import add_clip

    throw = made.release is not None and any(word.startswith("throw") for word in order.words)
    key = made.release.time if throw else None
    return add_clip(order.add.parent, order.add.stem, made.on_floor(), order.words, key)
