"""Pictures of motions: rows of characters rendered with Cycles on the CPU.

    python sample_blend/contact_sheet.py CLIP.bvh OUT.png [FIRST_SECOND LAST_SECOND [COUNT]]

Characters are skinned here, one mesh per moment, so no armature is needed. Needs Blender 4.5 or newer, or its Python
module.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import bpy
import mathutils
import numpy as np

HERE = Path(__file__).resolve().parent
if __name__ == "__main__":
    sys.path.insert(0, str(HERE.parent))

from beyond_mocap.appearance.body import build_body  # noqa: E402
from beyond_mocap.appearance.mesh import MATERIALS, BodyMesh, deform_body  # noqa: E402
from beyond_mocap.appearance.picture import encode_png  # noqa: E402
from beyond_mocap.files.bvh import bvh  # noqa: E402
from beyond_mocap.motion.humanoid import compute_heading  # noqa: E402
from beyond_mocap.motion.motion import Motion, compute_pose, place_motion, sample_frames  # noqa: E402
from beyond_mocap.motion.quaternion import rotate_about_up  # noqa: E402

COLOURS = {"skin": (0.60, 0.36, 0.24), "shirt": (0.72, 0.06, 0.05), "shorts": (0.86, 0.86, 0.84),
           "socks": (0.72, 0.06, 0.05), "boots": (0.03, 0.03, 0.035), "hair": (0.045, 0.028, 0.02), "trim": (0.86, 0.86, 0.84),
           "soles": (0.35, 0.42, 0.03), "eyes": (0.72, 0.72, 0.70), "pupils": (0.02, 0.011, 0.007),
           "gloves": (0.62, 0.66, 0.10)}
BALL_RADIUS = 0.11  # m


@dataclass(frozen=True)
class Actor:
    """A character that is drawn.

    Attributes:
        motion: the motion on the pitch.
        colours: colours by material, over the default ones.
        body: the mesh to skin; None: built from the skeleton.
    """

    motion: Motion
    colours: dict | None = None
    body: BodyMesh | None = None


def create_scene(width: int, height: int, samples: int = 24) -> bpy.types.Scene:
    """Create an empty file with sun, sky and grass, set to render with Cycles on the CPU."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 3
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.view_settings.view_transform = "Standard"
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (0.62, 0.76, 0.92, 1.0)
    world.node_tree.nodes["Background"].inputs[1].default_value = 0.75
    scene.world = world
    light = bpy.data.lights.new("sun", "SUN")
    light.energy, light.angle = 3.2, 0.03
    sun = bpy.data.objects.new("sun", light)
    sun.rotation_euler = (0.75, 0.15, -0.5)
    scene.collection.objects.link(sun)
    add_mesh("grass", [(-300, -300, 0), (300, -300, 0), (300, 300, 0), (-300, 300, 0)], [(0, 1, 2, 3)],
             [create_material("grass", (0.10, 0.25, 0.07))])
    return scene


def create_material(name: str, colour) -> bpy.types.Material:
    """Create a matt material."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = 0.85
    return material


def add_mesh(name: str, vertices, faces, materials, material=None, smooth: bool = False) -> bpy.types.Object:
    """Create a mesh object in the scene; material: index per face."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(v) for v in np.asarray(vertices, dtype=float)], [], [tuple(f) for f in faces])
    for entry in materials:
        mesh.materials.append(entry)
    if material is not None:
        mesh.polygons.foreach_set("material_index", np.asarray(material, dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.full(len(mesh.polygons), smooth))
    mesh.update()
    mesh_object = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(mesh_object)
    return mesh_object


def add_bodies(actor: Actor, frames: np.ndarray, moved: np.ndarray | None = None) -> None:
    """Add the character at some moments.

    Args:
        actor: the character.
        frames: (N,) fractional frames.
        moved: (N, 3) m by which each is moved, None for none.
    """
    body = actor.body or build_body(actor.motion.skeleton, example=actor.motion)
    root, local = sample_frames(actor.motion, np.asarray(frames, dtype=float))
    places, world = compute_pose(actor.motion.skeleton, root, local)
    skins = deform_body(body, actor.motion.skeleton, places, world)
    colours = {**COLOURS, **(actor.colours or {})}
    materials = [create_material(name, colours[name]) for name in MATERIALS]
    for i, vertices in enumerate(skins):
        shifted = vertices if moved is None else vertices + moved[i]
        add_mesh("body", shifted, body.faces, materials, body.material, smooth=True)


def add_ball(centres: np.ndarray) -> None:
    """Add the ball at `centres` (N, 3) m."""
    material = create_material("ball", (0.9, 0.9, 0.88))
    for centre in np.atleast_2d(centres):
        bpy.ops.mesh.primitive_uv_sphere_add(segments=20, ring_count=12, radius=BALL_RADIUS, location=tuple(centre))
        ball = bpy.context.object
        ball.data.materials.append(material)
        ball.data.polygons.foreach_set("use_smooth", np.full(len(ball.data.polygons), True))


def add_camera(scene: bpy.types.Scene, eye, at, wide: float | None = None, lens: float = 50.0) -> None:
    """Add a camera.

    Args:
        scene: the scene.
        eye: (3,) m, where it is.
        at: (3,) m, where it looks.
        wide: m across for a parallel view, None for a perspective one.
        lens: mm, of the perspective view.
    """
    camera = bpy.data.cameras.new("camera")
    camera.clip_end = 500.0
    if wide is not None:
        camera.type, camera.ortho_scale = "ORTHO", wide
    camera.lens = lens
    camera_object = bpy.data.objects.new("camera", camera)
    camera_object.location = eye
    direction = np.asarray(at, dtype=float) - np.asarray(eye, dtype=float)
    camera_object.rotation_euler = mathutils.Vector(direction).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(camera_object)
    scene.camera = camera_object


def render(scene: bpy.types.Scene, path: Path) -> np.ndarray:
    """Render to a PNG file.

    Returns:
        The picture (H, W, 4), top row first, 0 to 1.
    """
    scene.render.filepath = str(path)
    scene.render.image_settings.file_format = "PNG"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], 4)[::-1]


def save_picture(picture: np.ndarray, path: Path) -> None:
    """Save a picture (H, W, 4), 0 to 1, as PNG."""
    path.write_bytes(encode_png(np.rint(255.0 * np.clip(picture, 0.0, 1.0)).astype(np.uint8)))


def render_strip(motion: Motion, frames: np.ndarray, out_png, *, ball=None, spacing: float = 1.15, samples: int = 12,
                 width: int = 1300) -> None:
    """Render moments of one motion side by side, seen from the side and (below) half from the front.

    Figures face right.

    Args:
        motion: the motion.
        frames: (N,) moments.
        out_png: the file.
        ball: (N, 3) m, the ball at these moments, or None.
        spacing: m between figures.
        samples: of Cycles.
        width: pixels.
    """
    frames = np.asarray(frames, dtype=float)
    facing = float(compute_heading(motion)[int(frames[0])])
    out = Path(out_png)
    pictures = []
    for turned in (0.0, np.radians(-52.0)):
        row = place_motion(motion, turned - facing)
        root, _ = sample_frames(row, frames)
        stand = spacing * np.arange(len(frames))
        moved = np.stack([stand - root[:, 0], -root[:, 1], np.zeros(len(frames))], axis=-1)
        scene = create_scene(width, int(width * 2.2 / (spacing * len(frames))), samples)
        add_bodies(Actor(row), frames, moved)
        if ball is not None:
            centres = np.stack([rotate_about_up(b, turned - facing) for b in np.asarray(ball)])
            add_ball(centres + moved)
        middle = np.array([stand[-1] / 2, 0.0, 0.93])
        add_camera(scene, middle + np.array([0.0, -30.0, 4.0]), middle, wide=spacing * len(frames))
        part = out.with_suffix(".part.png")
        pictures.append(render(scene, part))
        part.unlink()
    save_picture(np.concatenate(pictures, axis=0), out)


def main(arguments: list[str]) -> None:
    """Parse the command line and render."""
    clip, out, *span = arguments
    motion = bvh.read_bvh(clip).motion
    first, last = (float(span[0]), float(span[1])) if len(span) >= 2 else (0.5, 1.5)
    frames = np.linspace(first, last, int(span[2]) if len(span) > 2 else 10) * motion.fps
    render_strip(motion, frames, out)


if __name__ == "__main__":
    main(sys.argv[1:])
