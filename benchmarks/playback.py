"""How long Blender takes to evaluate a frame of a match with 22 characters, without drawing, and what was tried.

The scene is built by the extension as *Show Match* builds it, in a process of its own: this file as a script. Each
variant changes that scene, and is measured on the same frames.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
EXTENSION = "bl_ext.user_default.beyond_mocap"
CLIP = ROOT / "sample_blend" / "library" / "running_4_2.bvh"
PLAYERS, FPS = 22, 25.0
FRAMES = range(2, 122)
TARGET_MS = 25.0
LIGHT, FULL = 2000, 12000  # faces of a body
VARIANTS = {
    "as shown": (), "numbers hidden": ("hide_numbers",), "bones alone": ("hide_numbers", "hide_bodies"),
    "preserve volume": ("preserve_volume",),
    f"{LIGHT} faces": ("light",), f"{LIGHT} faces, preserve volume": ("light", "preserve_volume"),
    f"{LIGHT} faces, 4 weights a vertex": ("light", "limit_weights"),
    f"{LIGHT} faces, number within the body": ("light", "join_numbers"),
    f"{LIGHT} faces, cached points (MDD), no bones": ("light", "join_numbers", "cache_points"),
    f"{FULL} faces": ("full",), f"{FULL} faces, preserve volume": ("full", "preserve_volume"),
}  # fmt: skip


def section() -> list[str]:
    """Build the lines for results.md: milliseconds of a frame in each variant."""
    done = subprocess.run([sys.executable, "-P", __file__], cwd=ROOT, capture_output=True, text=True)
    found = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if not found:
        return [f"- not measured: {(done.stderr.strip().splitlines() or ['Blender said nothing'])[-1]}"]
    figures = json.loads(found[-1])
    rows = [f"| {name} | {one['faces']} | {one['objects']} | {one['ms']:.1f} |" for name, one in figures["ms"].items()]
    return [
        f"Blender {figures['blender']}: processor time of `frame_set` in a match scene of {PLAYERS} players with one "
        f"action each, without drawing, median of {len(FRAMES)} frames. Target with light bodies: {TARGET_MS:.0f} ms. "
        "Instances share no work between players, since each has another pose.",
        "", "| variant | faces of a body | meshes | ms a frame |", "|---|---|---|---|", *rows]  # fmt: skip


class PlaybackScene:
    """A match of 22 players in an empty file.

    Attributes:
        bones: the armatures.
        bodies, numbers: meshes.
    """

    def __init__(self):
        import bpy

        self.scene = bpy.context.scene
        self.scene.render.fps = int(FPS)
        import_module(f"{EXTENSION}.scene.match.show").show_match(bpy.context, build_section(), 1)
        self.bones = [thing for thing in self.scene.objects if thing.type == "ARMATURE"]
        meshes = [thing for thing in self.scene.objects if thing.type == "MESH" and thing.parent in self.bones]
        self.bodies = [thing for thing in meshes if thing.name.endswith(" body")]
        self.numbers = [thing for thing in meshes if thing not in self.bodies]

    def measure(self) -> dict[str, float]:
        """Measure the median milliseconds of a frame; also count faces and meshes."""
        self.scene.frame_set(FRAMES[0] - 1)
        seconds = []
        for frame in FRAMES:
            begun = time.process_time()
            self.scene.frame_set(frame)
            seconds.append(time.process_time() - begun)
        shown = [thing for thing in self.bodies + self.numbers if not thing.hide_viewport]
        faces = statistics.median([len(body.data.polygons) for body in self.bodies])
        return {"ms": 1000 * statistics.median(seconds), "faces": int(faces), "objects": len(shown)}

    def hide_numbers(self) -> None:
        """Hide the shirt numbers."""
        for number in self.numbers:
            number.hide_viewport = True

    def hide_bodies(self) -> None:
        """Hide the bodies; Blender evaluates their bones still."""
        for body in self.bodies:
            body.hide_viewport = True

    def preserve_volume(self) -> None:
        """Bend joints by dual quaternions."""
        for thing in self.bodies + self.numbers:
            thing.modifiers[0].use_deform_preserve_volume = True

    def light(self) -> None:
        """Reduce the bodies to LIGHT faces."""
        self._set_faces(LIGHT)

    def full(self) -> None:
        """Divide the bodies' faces, and reduce them to FULL."""
        self._set_faces(FULL)

    def _set_faces(self, wanted: int) -> None:
        import bpy

        made = {}
        for body in self.bodies:
            if body.data not in made:
                made[body.data] = self._remesh(bpy, body, wanted)
            body.data = made[body.data]

    def _remesh(self, bpy, body, wanted: int):
        """Build a mesh with about so many faces from a body's, with its weights."""
        thing = bpy.data.objects.new("remeshed", body.data.copy())
        self.scene.collection.objects.link(thing)
        while len(thing.data.polygons) * 4 ** len(thing.modifiers) < wanted:
            thing.modifiers.new("Finer", "SUBSURF").subdivision_type = "SIMPLE"
        thing.modifiers.new("Fewer", "TRIANGULATE")
        reducing = thing.modifiers.new("Fewer", "DECIMATE")
        reducing.ratio = min(1.0, wanted / self._count(bpy, thing))
        depsgraph = bpy.context.evaluated_depsgraph_get()
        mesh = bpy.data.meshes.new_from_object(thing.evaluated_get(depsgraph), preserve_all_data_layers=True,
                                               depsgraph=depsgraph)
        bpy.data.objects.remove(thing)
        return mesh

    def _count(self, bpy, thing) -> int:
        """Count the faces that an object's modifiers make."""
        return len(thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.polygons)

    def limit_weights(self) -> None:
        """Keep the four largest weights of each vertex."""
        import bpy

        for body in {body.data: body for body in self.bodies}.values():
            with bpy.context.temp_override(object=body, active_object=body):
                bpy.ops.object.vertex_group_limit_total(limit=4)

    def join_numbers(self) -> None:
        """Make each number part of its player's body: half as many objects, and a mesh for each player."""
        import bpy

        for number in self.numbers:
            body = next(body for body in self.bodies if body.parent == number.parent)
            body.data = body.data.copy()
            with bpy.context.temp_override(object=body, active_object=body, selected_objects=[body, number],
                                           selected_editable_objects=[body, number]):
                bpy.ops.object.join()
        self.numbers = []

    def cache_points(self) -> None:
        """Replace bones by the points of each frame from a file."""
        import bpy

        folder = Path(tempfile.mkdtemp())
        points = {body: [] for body in self.bodies}
        frames = range(1, FRAMES[-1] + 1)
        for frame in frames:
            self.scene.frame_set(frame)
            depsgraph = bpy.context.evaluated_depsgraph_get()
            for body in self.bodies:
                vertices = body.evaluated_get(depsgraph).data.vertices
                points[body].append(np.empty(3 * len(vertices), np.float32))
                vertices.foreach_get("co", points[body][-1])
        for number, body in enumerate(self.bodies):
            values = np.array(points[body])
            head = np.array([len(frames), values.shape[1] // 3], ">i4").tobytes()
            times = (np.arange(len(frames)) / FPS).astype(">f4").tobytes()
            (folder / f"{number}.mdd").write_bytes(head + times + values.astype(">f4").tobytes())
            body.modifiers.clear()
            cached = body.modifiers.new("Cache", "MESH_CACHE")
            cached.cache_format, cached.filepath, cached.frame_start = "MDD", str(folder / f"{number}.mdd"), 1
        for bones in self.bones:
            bones.animation_data_clear()


def build_section():
    """Build five seconds of a match: 22 players who all run, each from another place."""
    motion = replace(import_module(f"{EXTENSION}.beyond_mocap.files.bvh.bvh").read_bvh(CLIP).motion, fps=FPS)
    load = import_module(f"{EXTENSION}.scene.match.load")
    people = []
    for number in range(PLAYERS):
        place = np.array([-45.0 + 8.0 * (number % 11), -16.0 + 32.0 * (number // 11), 0.0])
        moved = replace(motion, root_positions=motion.root_positions + place)
        people.append(load.Character(id=f"player{number}", name="", number=number % 11 + 1,
                                     team=("home", "away")[number // 11], keeper=number % 11 == 0,
                                     motions=((0.0, moved),)))
    colours = {"home": "#c02020", "away": "#2040c0", "referee": "#101010"}
    seconds = FRAMES[-1] / FPS
    return load.MatchSection(start=0.0, end=seconds, length=105.0, width=68.0, colours=colours,
                             characters=tuple(people), ball=None)


def enable_extension() -> None:
    """Switch the extension on in an empty profile, as Blender loads it."""
    profile = tempfile.mkdtemp()
    os.environ["BLENDER_USER_RESOURCES"] = profile  # read once, when bpy is imported
    repository = Path(profile, "extensions", "user_default")
    repository.mkdir(parents=True)
    (repository / "beyond_mocap").symlink_to(ROOT, target_is_directory=True)
    import bpy  # noqa: F401  (brings addon_utils)

    # isort: split
    import addon_utils

    if addon_utils.enable(EXTENSION, default_set=True) is None:
        raise RuntimeError("the extension could not be enabled")


def main() -> None:
    """Measure all variants, and print the figures as a line of JSON."""
    with tempfile.TemporaryDirectory(prefix="beyond-mocap-playback-") as folder:
        tempfile.tempdir = folder  # Blender's profile and files go with it, however this ends
        measure_variants()


def measure_variants() -> None:
    """Measure all variants, and print the figures."""
    enable_extension()
    import bpy

    found = {}
    for name, changes in VARIANTS.items():
        bpy.ops.wm.read_homefile(use_empty=True)
        scene = PlaybackScene()
        for change in changes:
            getattr(scene, change)()
        found[name] = scene.measure()
    print(json.dumps({"blender": bpy.app.version_string, "ms": found}))


if __name__ == "__main__":
    main()
