"""The properties of a marker cloud and the scene's marker settings, saved with the file and known to undo."""

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

ROLES = (("NEEDED", "Needed", "The marker is in every recording of this marker set", "BLANK1", 0),
         ("OPTIONAL", "Optional", "The marker may be missing", "CHECKBOX_DEHLT", 1),
         ("STATIC", "Static Only", "The marker may be missing in all but the static trial", "ARMATURE_DATA", 2),
         ("BALL", "Ball", "The marker is on a ball", "MESH_UVSPHERE", 3),
         ("OTHER", "Other", "The marker is neither on the body nor on a ball", "CANCEL", 4))


def update_lines(label, _context) -> None:
    """Update edges and colours by the new segments."""
    from . import nodes

    nodes.draw_lines(label.id_data)


def update_display(properties, _context) -> None:
    """Apply the chosen edges and sphere size."""
    from . import nodes

    modifier = nodes.find_modifier(properties.id_data)
    if modifier is not None:
        nodes.set_input(modifier, "Lines", properties.lines)
        nodes.set_input(modifier, "Radius", properties.size)


def search_segments(_label, _context, typed: str) -> list[str]:
    """List the segments that can carry a marker."""
    from ...beyond_mocap.markers.model.template import JOINTS

    return [name for name in JOINTS if typed.lower() in name.lower()]


def search_landmarks(_label, _context, typed: str) -> list[str]:
    """List the anatomical points on which a marker can lie."""
    from ...beyond_mocap.markers.model.template import LANDMARKS

    return [name for name in sorted(LANDMARKS) if typed.lower() in name]


def show_name(identifier: str) -> str:
    """Show an identifier in plain words: "left_temple" as "Left Temple"."""
    plain = identifier.replace("_", " ")
    return plain.title() if plain.islower() else plain


def search_landmark_words(label, context, typed: str) -> list[str]:
    """List the anatomical points in plain words."""
    return [show_name(name) for name in search_landmarks(label, context, typed.replace(" ", "_"))]


def get_landmark_words(label) -> str:
    """Return a marker's landmarks in plain words."""
    return ", ".join(show_name(name.strip()) for name in label.landmark.split(",") if name.strip())


def set_landmark_words(label, words: str) -> None:
    """Set a marker's landmarks from plain words."""
    label.landmark = ", ".join("_".join(name.split()).lower() for name in words.split(",") if name.strip())


class BeyondMocapMarker(bpy.types.PropertyGroup):
    """One marker of a cloud: its label, and what it lies on."""

    name: StringProperty(name="Label", description="Name of the marker")
    segment: StringProperty(name="Segment", update=update_lines, search=search_segments,
                            description="Body segment that the marker lies on")
    landmark: StringProperty(
        name="Landmark", search=search_landmarks,
        description="Anatomical point that the marker lies on, used to place joints; separate several by commas",
    )
    landmark_words: StringProperty(
        name="Landmark", search=search_landmark_words, get=get_landmark_words, set=set_landmark_words,
        description="Anatomical point that the marker lies on, used to place joints; separate several by commas",
    )
    role: EnumProperty(name="Role", items=ROLES, default="NEEDED", update=update_lines,
                       description="Whether the marker may be missing")
    seen: FloatProperty(name="Visible", subtype="PERCENTAGE", max=100.0, description="Share of the samples with it")


class BeyondMocapMarkerEvent(bpy.types.PropertyGroup):
    """An event of the recording's file."""

    name: StringProperty(name="Event", description="Name of the event")
    side: StringProperty(name="Side", description="Left, right, or neither")
    seconds: FloatProperty(name="Time", description="Seconds on the recording's clock")


@with_settings("markers.cloud", update=update_display)
@with_settings("markers.model")
class BeyondMocapCloud(bpy.types.PropertyGroup):
    """A trial in the scene, as a cloud of markers."""

    attached_to = ("Object.beyond_mocap_cloud",)

    on: BoolProperty(name="Markers", description="Whether this object is a cloud of markers")
    labels: CollectionProperty(type=BeyondMocapMarker, description="The markers, in the order of the recording")
    active_label: IntProperty(name="Marker", description="The active marker of the list")
    events: CollectionProperty(type=BeyondMocapMarkerEvent, description="Events of the recording")
    fps: FloatProperty(name="Rate", description="Samples per second")
    start: FloatProperty(name="Start", description="Seconds on the recording's clock at the first sample")
    subject: StringProperty(name="Subject", description="Person who was recorded")
    file: StringProperty(name="File", subtype="FILE_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"},
                         description="File of the recording")
    set_name: StringProperty(name="Marker Set", description="Marker set of the labels")
    set_text: StringProperty(name="Applied Set", options={"HIDDEN"},
                             description="Marker set that was applied last, as text")
    static: PointerProperty(
        name="Static Trial", type=bpy.types.Object, poll=lambda _, thing: is_cloud(thing),
        description="Recording of the same body standing still, used to place its joints; without it the motion is "
        "used",
    )
    model: PointerProperty(
        name="Model", type=bpy.types.Text,
        description="Joints of the body and places of its markers, from the last reconstruction or read from a "
        "file",
    )
    made: StringProperty(name="Reconstruction", options={"HIDDEN"}, description="Its name in this session")
    body: PointerProperty(name="Body", type=bpy.types.Object, description="Armature reconstructed from the markers")
    ball: PointerProperty(name="Ball", type=bpy.types.Object, description="Ball that was thrown")
    messages: StringProperty(name="Messages", options={"HIDDEN"}, description="Status and warnings, line by line")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Figures of the body, line by line")
    cleaned: StringProperty(name="Cleaned", options={"HIDDEN"}, description="Report of the clean-up, line by line")
    release: StringProperty(name="Release", options={"HIDDEN"}, description="Figures of the release, line by line")


@with_settings("markers", "release")
class BeyondMocapMarkers(bpy.types.PropertyGroup):
    """Settings for reading and processing marker recordings, for each scene."""

    attached_to = ("Scene.beyond_mocap_markers",)


def is_cloud(thing: bpy.types.Object | None) -> bool:
    """Return whether an object is a cloud of markers."""
    return thing is not None and thing.type == "MESH" and thing.beyond_mocap_cloud.on


def list_clouds(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """List the clouds of a scene."""
    return [thing for thing in scene.objects if is_cloud(thing)]


def find_target_cloud(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the target cloud: the active object, the cloud of the active body, a selected cloud, or the only one;
    else None.
    """
    active = context.view_layer.objects.active
    if is_cloud(active):
        return active
    found = list_clouds(context.scene)
    candidates = [thing for thing in found if active is not None and thing.beyond_mocap_cloud.body == active]
    candidates += [thing for thing in found if thing.select_get()]
    candidates += found if len(found) == 1 else []
    return candidates[0] if candidates else None


def has_own_object(cloud: bpy.types.Object, scene: bpy.types.Scene, name: str) -> bool:
    """Return whether a cloud's `body` or `ball` is its own; a copied cloud points to those of the original."""
    thing = getattr(cloud.beyond_mocap_cloud, name)
    return all(getattr(other.beyond_mocap_cloud, name) != thing for other in list_clouds(scene) if other != cloud)


def find_active_label(cloud: bpy.types.Object) -> BeyondMocapMarker | None:
    """Return the active marker of the list; None without one."""
    properties = cloud.beyond_mocap_cloud
    return properties.labels[properties.active_label] if 0 <= properties.active_label < len(properties.labels) else None
