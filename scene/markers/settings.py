"""What a cloud of markers keeps, and what the panel shows. Saved with the file, and known to undo."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..core.properties import with_settings

ROLES = (("NEEDED", "Needed", "It is in every recording of this marker set", "BLANK1", 0),
         ("OPTIONAL", "Optional", "It may be missing", "CHECKBOX_DEHLT", 1),
         ("STATIC", "Static Only", "It may be missing in all but the static trial", "ARMATURE_DATA", 2),
         ("BALL", "Ball", "It is on a ball", "MESH_UVSPHERE", 3),
         ("OTHER", "Other", "It is neither on the body nor on a ball", "CANCEL", 4))


def redraw(label, _context) -> None:
    """Draw lines and colours by the new segments."""
    from . import nodes

    nodes.draw_lines(label.id_data)


def shown(kept, _context) -> None:
    """Lines and the size of the spheres as they were chosen."""
    from . import nodes

    modifier = nodes.modifier_of(kept.id_data)
    if modifier is not None:
        nodes.put(modifier, "Lines", kept.lines)
        nodes.put(modifier, "Radius", kept.size)


def segments(_label, _context, typed: str) -> list[str]:
    """The segments that can carry a marker."""
    from ...beyond_mocap.markers.model.template import JOINTS

    return [name for name in JOINTS if typed.lower() in name.lower()]


def landmarks(_label, _context, typed: str) -> list[str]:
    """The anatomical points that a marker can lie on."""
    from ...beyond_mocap.markers.model.template import LANDMARKS

    return [name for name in sorted(LANDMARKS) if typed.lower() in name]


class BeyondMocapMarker(bpy.types.PropertyGroup):
    """One marker of a cloud: its label, and what carries it."""

    name: StringProperty(name="Label", description="The marker's name")
    segment: StringProperty(name="Segment", update=redraw, search=segments,
                            description="The segment of the body that carries it")
    landmark: StringProperty(
        name="Lies on", search=landmarks,
        description="The anatomical point that it lies on, by which joints are found; several with commas between",
    )
    role: EnumProperty(name="Role", items=ROLES, default="NEEDED", update=redraw,
                       description="Whether it may be missing")
    seen: FloatProperty(name="Seen", subtype="PERCENTAGE", max=100.0, description="Share of the samples with it")


class BeyondMocapMarkerEvent(bpy.types.PropertyGroup):
    """Something that the recording's file marks."""

    name: StringProperty(name="Event", description="What happened")
    side: StringProperty(name="Side", description="Left, right, or neither")
    seconds: FloatProperty(name="Time", description="Seconds on the recording's clock")


@with_settings("markers.cloud", update=shown)
@with_settings("markers.model")
class BeyondMocapCloud(bpy.types.PropertyGroup):
    """A trial that stands in the scene as a cloud of markers."""

    attached_to = ("Object.beyond_mocap_cloud",)

    on: BoolProperty(name="Markers", description="Whether this object is a cloud of markers")
    labels: CollectionProperty(type=BeyondMocapMarker, description="The markers, in the order of the recording")
    active_label: IntProperty(name="Marker", description="The marker chosen in the list")
    events: CollectionProperty(type=BeyondMocapMarkerEvent, description="Events of the recording")
    fps: FloatProperty(name="Rate", description="Samples a second")
    start: FloatProperty(name="Start", description="Seconds on the recording's clock at the first sample")
    subject: StringProperty(name="Subject", description="Who was recorded")
    file: StringProperty(name="File", subtype="FILE_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
                         description="The recording's file")
    set_name: StringProperty(name="Marker Set", description="The marker set that the labels belong to")
    set_text: StringProperty(name="Applied Set", options={"HIDDEN"},
                             description="The marker set that was applied last, as text")
    static: PointerProperty(
        name="Static Trial", type=bpy.types.Object, poll=lambda _, thing: is_cloud(thing),
        description="A recording of the same body standing still, from which its joints are found; none: from the "
        "motion itself",
    )
    model: PointerProperty(
        name="Model", type=bpy.types.Text,
        description="The body's joints and where the markers lie on it, as the last reconstruction left it or as read "
        "from a file",
    )
    made: StringProperty(name="Made", options={"HIDDEN"}, description="The reconstruction in this session's memory")
    body: PointerProperty(name="Body", type=bpy.types.Object, description="The armature that was reconstructed from it")
    ball: PointerProperty(name="Ball", type=bpy.types.Object, description="The ball that was thrown")
    told: StringProperty(name="Told", options={"HIDDEN"}, description="What was decided or is wrong, line by line")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Lines about the body that came out")
    cleaned: StringProperty(name="Cleaned", options={"HIDDEN"}, description="Lines about what was cleaned up")
    release: StringProperty(name="Release", options={"HIDDEN"}, description="Lines about the ball's release")


@with_settings("markers", "release")
class BeyondMocapMarkers(bpy.types.PropertyGroup):
    """How recordings of markers are read and worked on, per scene."""

    attached_to = ("Scene.beyond_mocap_markers",)


def is_cloud(thing: bpy.types.Object | None) -> bool:
    """Whether an object is a cloud of markers."""
    return thing is not None and thing.type == "MESH" and thing.beyond_mocap_cloud.on


def clouds(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The clouds of a scene."""
    return [thing for thing in scene.objects if is_cloud(thing)]


def cloud_meant(context: bpy.types.Context) -> bpy.types.Object | None:
    """The cloud that is meant: the active object or the one whose body it is, one that is selected, or the only one."""
    active = context.view_layer.objects.active
    if is_cloud(active):
        return active
    found = clouds(context.scene)
    meant = [thing for thing in found if active is not None and thing.beyond_mocap_cloud.body == active]
    meant += [thing for thing in found if thing.select_get()]
    meant += found if len(found) == 1 else []
    return meant[0] if meant else None


def is_alone(cloud: bpy.types.Object, scene: bpy.types.Scene, name: str) -> bool:
    """Whether a cloud's `body` or `ball` is its own; a copy of a cloud points to those of the first."""
    thing = getattr(cloud.beyond_mocap_cloud, name)
    return all(getattr(other.beyond_mocap_cloud, name) != thing for other in clouds(scene) if other != cloud)


def active_label(cloud: bpy.types.Object) -> BeyondMocapMarker | None:
    """The marker chosen in the list."""
    kept = cloud.beyond_mocap_cloud
    return kept.labels[kept.active_label] if 0 <= kept.active_label < len(kept.labels) else None
