"""The skin of a character by part of the body, read from its meshes once: the soles that stand on the ground, and the
surfaces that meet the ball.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..rigs.driven import DrivenRig

TOUCHING_PARTS = ("foot", "toe", "hand", "head", "upper_leg")
_SOLE_DEPTH = 0.03  # m above the lowest point of a foot up to which its points belong to the sole
_SOLE_CELL, _SKIN_CELL = 0.012, 0.008  # m: one point is kept in each cell
_SAMPLE_DISTANCE, _MAX_CUTS = 0.012, 8  # m between points on large faces; parts into which an edge is cut at most


def read_skin(driven: DrivenRig, meshes: list[bpy.types.Object]) -> dict[str, np.ndarray]:
    """Read the points of a character's skin by part of the body.

    Args:
        driven: the rig in its rest pose, as Blender evaluated it last.
        meshes: on it.
    Returns:
        Part of the rig's map ("left foot") -> points (P, 3) in the axes of the part's joint, metres; without parts that
        have no skin.
    """
    part_of, found = _find_parts(driven), {}
    for mesh in meshes:
        for part, points in _read_mesh(driven, mesh, part_of).items():
            found.setdefault(part, []).append(points)
    heads = dict(zip(driven.parts, driven.to_metres(driven.rest_heads(*driven.parts))))
    return {part: thin_points(np.concatenate(rows) - heads[part], _SKIN_CELL) for part, rows in found.items()}


def select_soles(skin: dict[str, np.ndarray], driven: DrivenRig, side: str) -> dict[int, np.ndarray]:
    """Select the points on which a side's foot stands.

    Args:
        skin: of all parts.
        driven: the rig.
        side: "left" or "right".
    Returns:
        Joint -> points (P, 3) m in its axes; empty where the meshes have no foot.
    """
    parts = [part for part in (f"{side} foot", f"{side} toe") if part in skin]
    if not parts:
        return {}
    heights = {part: driven.to_metres(driven.rest_heads(part))[0, 2] for part in parts}
    lowest = min(float((skin[part][:, 2] + heights[part]).min()) for part in parts)
    low = {part: skin[part][skin[part][:, 2] + heights[part] < lowest + _SOLE_DEPTH] for part in parts}
    return {driven.parts.index(part): _keep_lowest(points) for part, points in low.items() if len(points)}


def _find_parts(driven: DrivenRig) -> dict[str, str]:
    """Find bone -> the part whose skin it carries: the part at whose joint it begins, else its parent's."""
    heads = {part: driven.rest_positions[driven.find_bone(part)] for part in driven.parts}
    near, found = 1e-3 * driven.controls.size, {}
    places, parts = np.array(list(heads.values())), list(heads)
    for bone in _sort_by_depth(driven.rig):
        away = np.linalg.norm(places - np.array(bone.head_local), axis=1)
        if away.min() < near:
            found[bone.name] = parts[int(away.argmin())]
        elif bone.parent is not None and bone.parent.name in found:
            found[bone.name] = found[bone.parent.name]
    return found


def _sort_by_depth(rig: bpy.types.Object) -> list[bpy.types.Bone]:
    return sorted(rig.data.bones, key=lambda bone: len(bone.parent_recursive))


def _read_mesh(driven: DrivenRig, thing: bpy.types.Object, part_of: dict[str, str]) -> dict[str, np.ndarray]:
    """Read a mesh's points by part, upright metres from the armature's origin."""
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    try:
        points = np.empty(3 * len(mesh.vertices))
        mesh.vertices.foreach_get("co", points)
        mesh.calc_loop_triangles()
        corners = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("vertices", corners)
        owner = _find_owners(thing, mesh, part_of)
    finally:
        evaluated.to_mesh_clear()
    inward = np.array(driven.rig.matrix_world.inverted() @ thing.matrix_world)
    points = driven.to_metres(points.reshape(-1, 3) @ inward[:3, :3].T + inward[:3, 3])
    parts = sorted({part for part in owner if part.rpartition(" ")[2] in TOUCHING_PARTS or part == _find_chest(driven)})
    return {part: _sample_part(points, corners.reshape(-1, 3), owner == part) for part in parts}


def _find_chest(driven: DrivenRig) -> str:
    """Find the uppermost part of the spine."""
    return max((part for part in driven.parts if part.startswith("spine")), default="hips")


def _find_owners(thing: bpy.types.Object, mesh: bpy.types.Mesh, part_of: dict[str, str]) -> np.ndarray:
    """Find the part that moves each vertex most, "" for none."""
    if thing.parent_type == "BONE":
        return np.full(len(mesh.vertices), part_of.get(thing.parent_bone, ""), dtype=object)
    names = [part_of.get(group.name, "") for group in thing.vertex_groups]
    owner = np.full(len(mesh.vertices), "", dtype=object)
    for vertex in mesh.vertices:
        groups = [one for one in vertex.groups if one.group < len(names)]
        if groups:
            owner[vertex.index] = names[max(groups, key=lambda one: one.weight).group]
    return owner


def _sample_part(points: np.ndarray, corners: np.ndarray, is_own: np.ndarray) -> np.ndarray:
    """Sample a part: its vertices, and points on its triangles where these are large."""
    faces = points[corners[is_own[corners].all(axis=1)]]
    edges = np.linalg.norm(faces - np.roll(faces, 1, axis=1), axis=2).max(axis=1, initial=0.0)
    cuts = np.clip(np.ceil(edges / _SAMPLE_DISTANCE), 1, _MAX_CUTS).astype(int)
    found = [points[is_own]]
    for count in np.unique(cuts[cuts > 1]):
        shares = np.array([(i, j, count - i - j) for i in range(count + 1) for j in range(count + 1 - i)]) / count
        found.append(np.einsum("pk,fkc->fpc", shares, faces[cuts == count]).reshape(-1, 3))
    return np.concatenate(found)


def thin_points(points: np.ndarray, cell: float) -> np.ndarray:
    """Thin points (P, 3) m to one in each cube of `cell` m."""
    _, kept = np.unique(np.floor(points / cell).astype(np.int64), axis=0, return_index=True)
    return points[np.sort(kept)]


def _keep_lowest(points: np.ndarray) -> np.ndarray:
    """Keep the lowest of the points (P, 3) m in each column."""
    ordered = points[np.argsort(points[:, 2], kind="stable")]
    _, kept = np.unique(np.floor(ordered[:, :2] / _SOLE_CELL).astype(np.int64), axis=0, return_index=True)
    return ordered[np.sort(kept)]
