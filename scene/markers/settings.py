"""What a cloud of markers keeps, and what the panel shows. Saved with the file, and known to undo."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty,
)

ROLES = (
    ("NEEDED", "Needed", "It is in every recording of this marker set", "BLANK1", 0),
    ("OPTIONAL", "Optional", "It may be missing", "CHECKBOX_DEHLT", 1),
    ("STATIC", "Static Only", "It may be missing in all but the static trial", "ARMATURE_DATA", 2),
    ("BALL", "Ball", "It is on a ball", "MESH_UVSPHERE", 3),
    ("OTHER", "Other", "It is neither on the body nor on a ball", "CANCEL", 4),
)
FILTERS = (
    ("butterworth", "Butterworth", "Zero-phase low-pass filter of fourth order"),
    ("kalman", "Kalman", "Smoothing by how a body moves, forwards and backwards"),
    ("none", "None", "As it was solved"),
)
_THROWN = ("baseball", "tennis", "handball", "volleyball", "football")
THROWN = tuple((name, name.capitalize(), f"A {name}") for name in _THROWN)
HANDS = (
    ("AUTO", "Found", "The hand that throws"), ("left", "Left", "The left hand"), ("right", "Right", "The right hand"),
)  # fmt: skip


def redraw(label, _context) -> None:
    """Draw lines and colours by the new segments."""
    from . import lines

    lines.draw(label.id_data)


def shown(kept, _context) -> None:
    """Lines and the size of the spheres as they were chosen."""
    from . import nodes

    modifier = nodes.modifier_of(kept.id_data)
    if modifier is not None:
        nodes.put(modifier, "Lines", kept.lines)
        nodes.put(modifier, "Radius", kept.size)


def segments(_label, _context, typed: str) -> list[str]:
    """The segments that can carry a marker."""
    from ...beyond_mocap.markers.template import JOINTS

    return [name for name in JOINTS if typed.lower() in name.lower()]


def landmarks(_label, _context, typed: str) -> list[str]:
    """The anatomical points that a marker can lie on."""
    from ...beyond_mocap.markers.landmarks import LANDMARKS

    return [name for name in sorted(LANDMARKS) if typed.lower() in name]


class BeyondMocapMarker(bpy.types.PropertyGroup):
    """One marker of a cloud: its label, and what carries it."""

    name: StringProperty(name="Label", description="The marker's name")
    segment: StringProperty(
        name="Segment", update=redraw, search=segments, description="The segment of the body that carries it",
    )
    landmark: StringProperty(
        name="Lies on", search=landmarks,
        description="The anatomical point that it lies on, by which joints are found; several with commas between",
    )
    role: EnumProperty(
        name="Role", items=ROLES, default="NEEDED", update=redraw, description="Whether it may be missing"
    )
    seen: FloatProperty(name="Seen", subtype="PERCENTAGE", max=100.0, description="Share of the samples with it")


class BeyondMocapMarkerEvent(bpy.types.PropertyGroup):
    """Something that the recording's file marks."""

    name: StringProperty(name="Event", description="What happened")
    side: StringProperty(name="Side", description="Left, right, or neither")
    seconds: FloatProperty(name="Time", description="Seconds on the recording's clock")


def a_cloud(_own, thing) -> bool:
    """Whether an object can be chosen as a trial."""
    return is_cloud(thing)


class BeyondMocapCloud(bpy.types.PropertyGroup):
    """A trial that stands in the scene as a cloud of markers."""

    attached_to = ("Object.beyond_mocap_cloud",)

    on: BoolProperty(name="Markers", description="Whether this object is a cloud of markers")
    labels: CollectionProperty(type=BeyondMocapMarker, description="The markers, in the order of the recording")
    active_label: IntProperty(name="Marker", description="The marker chosen in the list")
    lines: BoolProperty(
        name="Lines", default=True, update=shown, description="Draw lines between the markers of a segment"
    )
    size: FloatProperty(
        name="Size", default=0.007, min=0.0, soft_max=0.05, unit="LENGTH", update=shown,
        description="Radius of the spheres at the markers",
    )
    events: CollectionProperty(type=BeyondMocapMarkerEvent, description="Events of the recording")
    fps: FloatProperty(name="Rate", description="Samples a second")
    start: FloatProperty(name="Start", description="Seconds on the recording's clock at the first sample")
    subject: StringProperty(name="Subject", description="Who was recorded")
    file: StringProperty(
        name="File", subtype="FILE_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"}, description="The recording's file"
    )
    set_name: StringProperty(name="Marker Set", description="The marker set that the labels belong to")
    set_text: StringProperty(
        name="Applied Set", options={"HIDDEN"}, description="The marker set that was applied last, as text"
    )
    static: PointerProperty(
        name="Static Trial", type=bpy.types.Object, poll=a_cloud,
        description="A recording of the same body standing still, from which its joints are found; none: from the "
        "motion itself",
    )
    model: PointerProperty(
        name="Model", type=bpy.types.Text,
        description="The body's joints and where the markers lie on it, as the last reconstruction left it or as read "
        "from a file",
    )
    use_model: BoolProperty(
        name="Use Model", description="Take joints and markers from the model instead of finding them anew"
    )
    made: StringProperty(name="Made", options={"HIDDEN"}, description="The reconstruction in this session's memory")
    body: PointerProperty(name="Body", type=bpy.types.Object, description="The armature that was reconstructed from it")
    ball: PointerProperty(name="Ball", type=bpy.types.Object, description="The ball that was thrown")
    told: StringProperty(name="Told", options={"HIDDEN"}, description="What was decided or is wrong, line by line")
    figures: StringProperty(name="Figures", options={"HIDDEN"}, description="Lines about the body that came out")
    cleaned: StringProperty(name="Cleaned", options={"HIDDEN"}, description="Lines about what was cleaned up")
    release: StringProperty(name="Release", options={"HIDDEN"}, description="Lines about the ball's release")


class BeyondMocapMarkers(bpy.types.PropertyGroup):
    """How recordings of markers are read and worked on, per scene."""

    attached_to = ("Scene.beyond_mocap_markers",)

    names: BoolProperty(name="Names", default=True, description="Write the labels of the active cloud at its markers")
    unit: FloatProperty(
        name="Unit", default=0.0, min=0.0, max=10.0, precision=4,
        description="Metres in one unit of a recording; 0: as its file says, or by the body's size",
    )
    filter: EnumProperty(name="Filter", items=FILTERS, default="butterworth", description="How the motion is smoothed")
    cutoff: FloatProperty(
        name="Cutoff", default=13.4, min=0.5, max=100.0, precision=1,
        description="Hertz up to which the Butterworth filter lets movements through",
    )
    plant: BoolProperty(name="Plant Feet", default=True, description="Hold feet where they stand")
    weights: BoolProperty(
        name="Weigh Markers", default=True, description="Trust markers less while their segment is deformed"
    )
    limits: BoolProperty(name="Joint Limits", default=True, description="Joints turn no further than a body's")
    smoothness: FloatProperty(
        name="Smoothness", default=0.0, min=0.0, max=0.2, precision=3, unit="TIME_ABSOLUTE",
        description="Seconds over which the whole sequence is solved as one that moves smoothly: 0.003 to 0.005 for "
        "throws, 0.02 for noisy walks; 0: each frame for itself",
    )
    floor: BoolProperty(name="Floor at 0", description="Move the body so that its lowest foot stands at height 0")
    dressed: BoolProperty(name="Make Body", default=True, description="Give the armature a simple body")
    add: BoolProperty(name="Add to Library", description="Write the motion with its words into the library's folder")
    words: StringProperty(name="Words", default="throwb", description="The words of the clip that is added")
    hand: EnumProperty(name="Hand", items=HANDS, default="AUTO", description="The hand that throws")
    thrown: EnumProperty(name="Ball", items=THROWN, default="baseball", description="What is thrown")
    radius: FloatProperty(
        name="Radius", default=0.0, min=0.0, max=0.5, precision=4,
        description="Metres; 0: fitted where a marker lies on the ball, else that of the ball's kind",
    )


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
