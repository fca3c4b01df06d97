"""What a cloud of markers keeps. Saved with the file, and known to undo."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty, CollectionProperty, FloatProperty, IntProperty, PointerProperty, StringProperty,
)


def segment_changed(label, _context) -> None:
    """Draw lines and colours by the new segments."""
    from . import lines

    lines.draw(label.id_data)


class BeyondMocapMarker(bpy.types.PropertyGroup):
    """One marker of a cloud: its label, and the body segment that carries it."""

    name: StringProperty(name="Label", description="The marker's name")
    segment: StringProperty(
        name="Segment", update=segment_changed, description="The segment of the body that carries it; empty: none",
    )
    seen: FloatProperty(name="Seen", subtype="PERCENTAGE", max=100.0, description="Share of the samples with it")


class BeyondMocapMarkerEvent(bpy.types.PropertyGroup):
    """Something that the recording's file marks."""

    name: StringProperty(name="Event", description="What happened")
    side: StringProperty(name="Side", description="Left, right, or neither")
    seconds: FloatProperty(name="Time", description="Seconds on the recording's clock")


class BeyondMocapCloud(bpy.types.PropertyGroup):
    """A trial that stands in the scene as a cloud of markers."""

    on: BoolProperty(name="Markers", description="Whether this object is a cloud of markers")
    labels: CollectionProperty(type=BeyondMocapMarker, description="The markers, in the order of the recording")
    active_label: IntProperty(name="Marker", description="The marker chosen in the list")
    events: CollectionProperty(type=BeyondMocapMarkerEvent, description="Events of the recording")
    fps: FloatProperty(name="Rate", description="Samples a second")
    start: FloatProperty(name="Start", description="Seconds on the recording's clock at the first sample")
    subject: StringProperty(name="Subject", description="Who was recorded")
    file: StringProperty(name="File", subtype="FILE_PATH", description="The recording's file")
    set_name: StringProperty(name="Marker Set", description="The marker set that the labels belong to")


def is_cloud(thing: bpy.types.Object | None) -> bool:
    """Whether an object is a cloud of markers."""
    return thing is not None and thing.type == "MESH" and thing.beyond_mocap_cloud.on


def clouds(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The clouds of a scene."""
    return [thing for thing in scene.objects if is_cloud(thing)]


def cloud_meant(context: bpy.types.Context) -> bpy.types.Object | None:
    """The cloud that is meant: the active object, one that is selected, or the only one."""
    if is_cloud(context.view_layer.objects.active):
        return context.view_layer.objects.active
    chosen = [thing for thing in context.selected_objects if is_cloud(thing)]
    found = chosen or clouds(context.scene)
    return found[0] if chosen or len(found) == 1 else None


CLASSES = (BeyondMocapMarker, BeyondMocapMarkerEvent, BeyondMocapCloud)
