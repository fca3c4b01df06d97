"""A trial as objects: a mesh with one vertex for each marker, played by `nodes`, with its trajectories and drawn
labels.

The trajectories belong to the cloud alone and are in no collection, so they are invisible and are removed with it. A
vertex stores its marker in an attribute, so vertices can be deleted: those markers are then left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import bmesh
import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

from ...beyond_mocap.base.errors import InputError
from ..core import channels, frame_range
from ..core.live import Watcher
from ..core.measure import frames_per_second, units_per_metre
from . import nodes
from .settings import is_cloud

if TYPE_CHECKING:
    from ...beyond_mocap.markers.trial import MarkerTrial

RADIUS = 0.007  # metres of a marker's sphere

LABEL_WIDTH = 32  # pixels of a label at an interface scale of 1
LABEL_HEIGHT, RGBA, UNASSIGNED = 11, (1.0, 1.0, 1.0, 0.9), (1.0, 0.65, 0.1, 1.0)


def create_cloud(
    context: bpy.types.Context, trial: "MarkerTrial", start: float | None = None
) -> bpy.types.Object:
    """Create a cloud that plays a trial; the scene's end is extended.

    Args:
        context: with the scene, and the collection for the cloud.
        trial: the trial.
        start: scene frame of the first sample; None for the scene's first.
    Returns:
        The cloud.
    Raises:
        InputError: if no marker is visible, or the collection belongs to another file.
    """
    scene, units, target_collection = context.scene, units_per_metre(context.scene), context.collection
    check_visible(trial)
    if target_collection.library is not None:
        raise InputError(target_collection.name, "a linked collection", "one of this file",
                         "choose another in the Outliner")
    mesh = bpy.data.meshes.new(trial.name)
    mesh.vertices.add(len(trial.labels))
    _write_attribute(mesh, nodes.MARKER, "INT", np.arange(len(trial.labels), dtype=np.int32))
    cloud = bpy.data.objects.new(trial.name, mesh)
    target_collection.objects.link(cloud)
    properties = cloud.beyond_mocap_cloud
    properties.on = True
    for label in trial.labels:
        properties.labels.add().name = label
    start = float(scene.frame_start) if start is None else float(start)
    nodes.add_modifier(cloud, {"Start": start})
    properties.size = RADIUS * units
    write_trial(cloud, trial, scene)
    frame_range.fit_range(scene, start + trial.duration * frames_per_second(scene), [cloud])
    return cloud


def write_trial(cloud: bpy.types.Object, trial: "MarkerTrial", scene: bpy.types.Scene) -> None:
    """Write other or cleaned trajectories to a cloud, at the same playback speed; settings of a label stay by its name.

    Raises:
        InputError: if no marker is visible, or the cloud belongs to another file.
    """
    channels.check_local(cloud, cloud.data)
    check_visible(trial)
    if cloud.data.is_editmode:
        bpy.ops.object.mode_set(mode="OBJECT")
    properties = cloud.beyond_mocap_cloud
    if tuple(label.name for label in properties.labels) != trial.labels:
        _replace_labels(cloud, trial.labels)
    for label, share in zip(properties.labels, trial.visibility.mean(axis=0)):
        label.seen = 100.0 * float(share)
    modifier = nodes.find_modifier(cloud)
    default_step = trial.fps / frames_per_second(scene)
    step = nodes.get_input(modifier, "Step") * trial.fps / properties.fps if properties.fps else default_step
    properties.fps, properties.start, properties.subject = trial.fps, trial.start, trial.subject
    properties.events.clear()
    for event in trial.events:
        row = properties.events.add()
        row.name, row.side, row.seconds = event.label, event.side, event.seconds
    places = hold_last_places(trial.positions) * units_per_metre(scene)
    before = nodes.get_input(modifier, "Trajectories")
    nodes.set_input(modifier, "Trajectories", _create_trajectories(cloud.name, places, trial.visibility))
    nodes.set_input(modifier, "Markers", len(trial.labels))
    nodes.set_input(modifier, "Samples", len(trial))
    nodes.set_input(modifier, "Step", step)
    if before is not None and before.users == 0:
        mesh = before.data
        bpy.data.objects.remove(before)
        bpy.data.meshes.remove(mesh)
    cloud.data.attributes["position"].data.foreach_set("vector",
                                                       places[0, read_marker_indices(cloud)].astype(np.float32).ravel())
    nodes.draw_lines(cloud)


def read_trial(cloud: bpy.types.Object, scene: bpy.types.Scene) -> "MarkerTrial":
    """Read the trial that a cloud plays, with its present labels, in the cloud's own space.

    Raises:
        InputError: if the object has lost what it needs.
    """
    from ...beyond_mocap.markers.trial import MarkerEvent, MarkerTrial

    modifier = nodes.find_modifier(cloud) if is_cloud(cloud) else None
    mesh = _find_samples(modifier)
    if mesh is None:
        raise InputError(cloud.name, "no trajectories", "a cloud of markers", "import the recording again")
    properties, count, samples = cloud.beyond_mocap_cloud, nodes.get_input(modifier,
                                                                           "Markers"), nodes.get_input(modifier,
            "Samples")
    if len(mesh.vertices) != count * samples or len(properties.labels) != count or not samples:
        found = f"{len(mesh.vertices)} places for {count} markers and {samples} samples"
        raise InputError(cloud.name, found, "one per marker and sample", "import the recording again")
    places, seen = np.empty(3 * count * samples, np.float32), np.empty(count * samples, bool)
    mesh.attributes["position"].data.foreach_get("vector", places)
    mesh.attributes[nodes.SEEN].data.foreach_get("value", seen)
    places = places.reshape(samples, count, 3).astype(float) / units_per_metre(scene)
    places[~seen.reshape(samples, count)] = np.nan
    events = tuple(MarkerEvent(row.seconds, row.name, row.side) for row in properties.events)
    names = tuple(label.name.strip() for label in properties.labels)
    trial = MarkerTrial(labels=names, positions=places, fps=properties.fps, residuals=None, events=events,
                        start=properties.start, name=cloud.name, subject=properties.subject)
    marked = np.unique(read_marker_indices(cloud))
    if not len(marked):
        raise InputError(cloud.name, "no vertex of a marker", "one vertex per marker", "import the recording again")
    return trial if len(marked) == count else trial.select_markers([trial.labels[i] for i in marked])


def find_start_frame(cloud: bpy.types.Object) -> float:
    """Return the scene frame of the first sample; raise InputError where no modifier plays the cloud."""
    return float(nodes.get_input(_find_modifier(cloud), "Start"))


def compute_playback_rate(cloud: bpy.types.Object, scene: bpy.types.Scene) -> float:
    """Return the samples per second of the playback, which differ from the recording's in slow motion.

    Raises:
        InputError: if no modifier plays the cloud, or it is paused or runs backwards.
    """
    step = float(nodes.get_input(_find_modifier(cloud), "Step"))
    if step <= 0.0:
        raise InputError(cloud.name, f"a Step of {step:g}", "samples per frame, above 0", "set Step in the modifier")
    return step * frames_per_second(scene)


def _find_modifier(cloud: bpy.types.Object) -> bpy.types.Modifier:
    """Return the modifier that plays a cloud; raise InputError where it is missing."""
    modifier = nodes.find_modifier(cloud)
    if modifier is None:
        expected, step = f"the modifier {nodes.NAME}", "import the recording again"
        raise InputError(cloud.name, "no modifier that plays it", expected, step)
    return modifier


def _find_samples(modifier: bpy.types.Modifier | None) -> bpy.types.Mesh | None:
    """Return the mesh of all samples that a modifier plays; None where there is none."""
    holder = nodes.get_input(modifier, "Trajectories") if modifier is not None else None
    mesh = holder.data if holder is not None and holder.type == "MESH" else None
    return mesh if mesh is not None and nodes.SEEN in mesh.attributes else None


def sample_places(cloud: bpy.types.Object, frame: float) -> list[tuple[int, Vector]]:
    """Return the visible markers on a scene frame with their places in the cloud's own space, quickly, in any mode."""
    modifier = nodes.find_modifier(cloud)
    mesh = _find_samples(modifier)
    if mesh is None:
        return []
    count, samples = nodes.get_input(modifier, "Markers"), nodes.get_input(modifier, "Samples")
    row = min(max((frame - nodes.get_input(modifier, "Start")) * nodes.get_input(modifier, "Step"), 0.0), samples - 1.0)
    here = round(row)
    other = min(max(here + (1 if row > here else -1), 0), samples - 1)
    places, seen = mesh.vertices, mesh.attributes[nodes.SEEN].data
    if len(places) != count * samples:
        return []
    found = []
    for marker in range(count):
        near, far = here * count + marker, other * count + marker
        if seen[near].value:
            place = places[near].co
            found.append((marker, place.lerp(places[far].co, abs(row - here)) if seen[far].value else place.copy()))
    return found


def read_marker_indices(cloud: bpy.types.Object) -> np.ndarray:
    """Read the marker of each vertex: (V,) indices of labels; empty where the mesh has no such attribute."""
    mesh = cloud.data
    if mesh.is_editmode:  # the mesh has no data in Edit Mode
        shape = bmesh.from_edit_mesh(mesh)
        layer = shape.verts.layers.int.get(nodes.MARKER)
        found = np.array([vertex[layer] for vertex in shape.verts] if layer is not None else [], np.int32)
    elif nodes.MARKER not in mesh.attributes:
        return np.zeros(0, np.int32)
    else:
        found = np.empty(len(mesh.vertices), np.int32)
        mesh.attributes[nodes.MARKER].data.foreach_get("value", found)
    return np.clip(found, 0, max(len(cloud.beyond_mocap_cloud.labels) - 1, 0))


def check_visible(trial: "MarkerTrial") -> None:
    """Raise InputError where no marker is visible."""
    if not len(trial) or not trial.visibility.any():
        raise InputError(trial.name, "no marker is ever visible", "a recording with markers", "choose another file")


def hold_last_places(positions: np.ndarray) -> np.ndarray:
    """Fill the gaps of positions (T, M, 3) with the last visible place, or the next one at the start.

    A marker that is never visible is placed in the middle of all.
    """
    out, seen = positions.copy(), np.isfinite(positions).all(axis=-1)
    rows = np.arange(len(out))
    for marker in range(out.shape[1]):
        visible_rows = np.flatnonzero(seen[:, marker])
        if not len(visible_rows):
            out[:, marker] = positions[seen].mean(axis=0)
        elif len(visible_rows) < len(out):
            out[:, marker] = out[visible_rows[np.maximum(np.searchsorted(visible_rows, rows, side="right") - 1, 0)],
                                 marker]
    return out


def _replace_labels(cloud: bpy.types.Object, names: tuple[str, ...]) -> None:
    """Replace the labels, as after markers were joined or left out; segment, landmark and role are kept by name."""
    properties, mesh = cloud.beyond_mocap_cloud, cloud.data
    known = {label.name.strip(): (label.segment, label.landmark, label.role) for label in properties.labels}
    mesh.clear_geometry()
    mesh.vertices.add(len(names))
    _write_attribute(mesh, nodes.MARKER, "INT", np.arange(len(names), dtype=np.int32))
    properties.labels.clear()
    with nodes.defer_lines():
        for name in names:
            label = properties.labels.add()
            label.name = name
            label.segment, label.landmark, label.role = known.get(name, ("", "", "NEEDED"))


def _create_trajectories(name: str, places: np.ndarray, seen: np.ndarray) -> bpy.types.Object:
    """Create the mesh of all samples (T, M, 3), on an object in no collection."""
    mesh = bpy.data.meshes.new(f"{name} trajectories")
    mesh.vertices.add(seen.size)
    mesh.attributes["position"].data.foreach_set("vector", places.astype(np.float32).ravel())
    _write_attribute(mesh, nodes.SEEN, "BOOLEAN", seen.ravel())
    return bpy.data.objects.new(mesh.name, mesh)


def _write_attribute(mesh: bpy.types.Mesh, name: str, kind: str, values: np.ndarray) -> None:
    found = mesh.attributes.get(name) or mesh.attributes.new(name, kind, "POINT")
    found.data.foreach_set("value", np.ascontiguousarray(values))


def list_visible_labels(context: bpy.types.Context) -> list[tuple[Vector, str, tuple]]:
    """List what is drawn: (place in the world, label, colour) of every visible marker."""
    thing = context.view_layer.objects.active
    if not context.scene.beyond_mocap_markers.names or not is_cloud(thing) or not thing.visible_get():
        return []
    rows = thing.beyond_mocap_cloud.labels
    found = []
    for marker, place in sample_places(thing, context.scene.frame_current_final):
        if marker < len(rows):
            colour = RGBA if rows[marker].segment or rows[marker].role in ("BALL", "OTHER") else UNASSIGNED
            found.append((thing.matrix_world @ place, rows[marker].name, colour))
    return found


def _draw_labels() -> None:
    """Draw the visible labels into the 3D view, without overlaps."""
    import blf

    context = bpy.context
    if context.space_data is None or not context.space_data.overlay.show_overlays:
        return
    scale, taken = context.preferences.system.ui_scale, set()
    blf.size(0, LABEL_HEIGHT * scale)
    for place, text, rgba in list_visible_labels(context):
        at = location_3d_to_region_2d(context.region, context.region_data, place)
        cell = at and (round(at.x / (LABEL_WIDTH * scale)), round(at.y / (LABEL_HEIGHT * scale)))
        if cell and cell not in taken:  # overlapping labels are unreadable
            taken.add(cell)
            blf.color(0, *rgba)
            blf.position(0, at.x + 6 * scale, at.y + 3 * scale, 0)
            blf.draw(0, text)


WATCHER = Watcher(name="Marker labels", draws=((bpy.types.SpaceView3D, _draw_labels, "POST_PIXEL"),))
