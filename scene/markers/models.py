"""The model of a body with its markers, as a text of the file: seen, saved, and handed from cloud to cloud."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.base.errors import InputError

if TYPE_CHECKING:
    from ...beyond_mocap.markers.model.model import MarkerModel


def onto(cloud: bpy.types.Object, model: "MarkerModel") -> None:
    """Keep a model with a cloud; a text that other clouds use too stays as it is."""
    from ...beyond_mocap.markers.files.model_json import model_text

    kept = cloud.beyond_mocap_cloud
    if kept.model is None or kept.model.users > 1 or kept.model.library is not None:
        kept.model = bpy.data.texts.new(f"{cloud.name} model")
        kept.model.use_fake_user = False
    kept.model.clear()
    kept.model.write(model_text(model))


def of_cloud(cloud: bpy.types.Object) -> "MarkerModel":
    """The model of a cloud. InputError where there is none, or none that can be read."""
    from ...beyond_mocap.markers.files.model_json import parse_model

    text = cloud.beyond_mocap_cloud.model
    if text is None:
        raise InputError(cloud.name, "no model", "one", "press Reconstruct without Use Model, or load a model")
    return parse_model(text.as_string(), text.name)
