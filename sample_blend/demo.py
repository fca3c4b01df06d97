"""The main workflow on the sample, without a window: two players and the ball, from tracking data and labels to a
.blend.

    python sample_blend/demo.py --out build/demo

Runs with Blender as a Python module (`make demo` sets that up). Writes match.blend, player.bvh, report.json and
preview.png, a sheet of rendered frames, and says how to open them.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
import pathlib
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
TILES = (4, 2)  # across, down
TILE = (480, 270)  # pixels


def load_extension():
    """Register the extension from this clone.

    Returns:
        A function that imports its modules by name, and one that unregisters it.
    """
    os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="beyond-mocap-demo-"))
    sys.path.insert(0, str(HERE.parent))
    import batch

    name = batch.extension()
    extension = importlib.import_module(name)
    extension.register()
    return lambda module: importlib.import_module(f"{name}.{module}"), extension.unregister


class Steps:
    """The parts of the workflow, each with its share of one progress bar."""

    def __init__(self, told, shares: dict[str, float]):
        """Begin the progress bar.

        Args:
            reporter: the command line's progress bar.
            shares: part -> share of the time it takes.
        """
        self.told, self.shares, self.done, self.now = told, shares, 0.0, ""
        self.begun = time.perf_counter()

    def enter(self, part: str) -> None:
        """Begin a part."""
        self.done += self.shares.get(self.now, 0.0)
        self.now = part
        self.told.progress(self.done, part)
        if not sys.stderr.isatty():
            print(f"{time.perf_counter() - self.begun:5.1f} s  {part}", flush=True)

    def progress(self, fraction: float, text: str) -> None:
        """Show the progress of the part."""
        self.told.progress(self.done + fraction * self.shares[self.now], f"{self.now}: {text}")


@contextlib.contextmanager
def quiet():
    """Hide what Blender prints, so that the progress bar stays intact."""
    sys.stdout.flush()
    terminal, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(terminal, 1)
        os.close(terminal)
        os.close(nowhere)


def prepare(bpy) -> None:
    """Create an empty file with the stage, and the settings that an animator would fill in."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start = 30, 1
    bpy.ops.beyond_mocap.add_stage()
    scene.beyond_mocap.library_folder = str(HERE / "library")
    for number in (1, 2):
        bpy.ops.beyond_mocap.import_tracking(filepath=str(HERE / "match" / f"player{number}.csv"))


def synthesize(load, settings, steps) -> list[dict]:
    """Build the library, synthesize the takes and store them for Apply.

    Returns:
        The players' reports.
    """
    plans, session = load("scene.result.plans"), load("scene.core.session")
    quality, recipe = load("scene.result.quality"), load("beyond_mocap.synthesis.synthesize")
    steps.enter("Library")
    begun = time.perf_counter()
    clips = load("beyond_mocap.library.build").build(settings.library_folder, progress=steps.progress)
    library_seconds = time.perf_counter() - begun
    session.keep_library(clips, None)
    settings.library_holds = load("operators.library").summary(clips)
    reports = []
    for player in settings.players:
        steps.enter(player.name)
        begun = time.perf_counter()
        plan, _ = plans.plan_of(settings, player)
        load_seconds = time.perf_counter() - begun
        take = recipe.synthesize(clips, plan, progress=steps.progress)
        total = time.perf_counter() - begun + library_seconds
        reports.append(load("beyond_mocap.evaluation.report").evaluate(take, plan.track, clips))
        reports[-1]["seconds"].update(load=load_seconds, library=library_seconds, total=total)
        player.take = session.keep_take(plan, take)
        player.quality, player.moments = quality.quality_lines(reports[-1]), quality.moment_lines(reports[-1])
    return reports


def moments(plans, takes, count: int) -> list[tuple[float, int]]:
    """Choose the moments to show.

    Key moments first, then the middles of labelled spans, then moments in the widest gaps.

    Args:
        plans: plans of the players.
        takes: takes of the players.
        count: how many moments.
    Returns:
        (seconds, number of the player to look at) of each, in order of time.
    """
    start, end = takes[0].start_time, takes[0].start_time + takes[0].motion.duration
    keys = [(key.asked.time, player) for player, take in enumerate(takes) for key in take.keys]
    asked = [(span, player) for player, plan in enumerate(plans) for span in plan.timeline.spans]
    spans = [(0.5 * (span.start + span.end), player) for span, player in asked]
    shown = sorted([*keys, *sorted(spans, key=lambda span: -min(abs(span[0] - key[0]) for key in keys))][:count])
    while len(shown) < count:
        edges = [start, *(seconds for seconds, _ in shown), end]
        widest = max(range(1, len(edges)), key=lambda i: edges[i] - edges[i - 1])
        seconds = 0.5 * (edges[widest - 1] + edges[widest])
        shown = sorted([*shown, (seconds, nearest_to_ball(takes, seconds))])
    return shown


def hips_at(take, seconds: float):
    """Return where a player's hips are at a time on the track's clock: (3,) m."""
    frame = round((seconds - take.start_time) * take.motion.fps)
    return take.motion.root_positions[min(max(frame, 0), len(take.motion) - 1)]


def nearest_to_ball(takes, seconds: float) -> int:
    """Return the number of the player nearest to the ball."""
    ball = next(take.ball for take in takes if take.ball is not None)
    place = ball.positions[abs(ball.times - seconds).argmin()]
    return min(range(len(takes)), key=lambda i: float(sum((hips_at(takes[i], seconds)[:2] - place[:2]) ** 2)))


def words_at(take, seconds: float) -> str:
    """Return what the player does at a time on the track's clock."""
    for key in take.keys:
        if abs(key.asked.time - seconds) < 0.15:
            return " ".join(key.asked.words)
    frame = round((seconds - take.start_time) * take.motion.fps)
    return " ".join(take.words[min(max(frame, 0), len(take.words) - 1)])


def render(bpy, load, plans, takes, out: pathlib.Path, steps) -> None:
    """Render the sheet of frames with Cycles on the CPU, which needs no graphics card and no window."""
    import numpy as np

    scene, frame_at = bpy.context.scene, load("scene.result.bake").frame_at
    following, scene.camera = scene.camera, close_camera(bpy)
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 12, False, 2
    scene.render.resolution_x, scene.render.resolution_y = TILE
    scene.render.use_persistent_data = True
    scene.view_settings.view_transform = "Standard"
    _stamp(scene.render)
    times = moments(plans, takes, TILES[0] * TILES[1])
    sheet = np.ones((TILES[1] * TILE[1], TILES[0] * TILE[0], 4), np.float32)
    with tempfile.TemporaryDirectory() as folder:
        for number, (seconds, player) in enumerate(times):
            steps.progress(number / len(times), f"frame {number + 1} of {len(times)}")
            scene.frame_set(round(frame_at(scene, seconds)))
            look_at(load, scene.camera, takes[player], seconds)
            scene.render.stamp_note_text = f"{seconds:.1f} s   {words_at(takes[player], seconds)}"
            scene.render.filepath = str(pathlib.Path(folder, f"{number}.png"))
            bpy.ops.render.render(write_still=True)
            row, column = divmod(number, TILES[0])
            top = (TILES[1] - row) * TILE[1]
            sheet[top - TILE[1] : top, column * TILE[0] : (column + 1) * TILE[0]] = _pixels(bpy, scene.render.filepath)
    _write_picture(bpy, sheet, out)
    bpy.data.cameras.remove(scene.camera.data)
    scene.camera = following
    scene.render.resolution_x, scene.render.resolution_y, scene.render.use_stamp = 1280, 720, False


def close_camera(bpy):
    """Create a camera that is placed beside one player after the other."""
    camera = bpy.data.objects.new("Close", bpy.data.cameras.new("Close"))
    camera.data.lens = 42.0
    bpy.context.scene.collection.objects.link(camera)
    return camera


def look_at(load, camera, take, seconds: float) -> None:
    """Place the camera half in front of the player, at the height of the chest."""
    import numpy as np
    from mathutils import Vector

    hips = hips_at(take, seconds) * [1.0, 1.0, 0.0]
    frame = min(max(round((seconds - take.start_time) * take.motion.fps), 0), len(take.motion) - 1)
    angle = load("beyond_mocap.motion.humanoid").heading(take.motion)[frame] - 0.9
    eye = Vector(hips + [4.6 * np.cos(angle), 4.6 * np.sin(angle), 1.55])
    camera.location = eye
    camera.rotation_euler = (Vector(hips + [0.0, 0.0, 0.85]) - eye).to_track_quat("-Z", "Y").to_euler()


def _stamp(settings) -> None:
    """Show only the note in renders."""
    settings.use_stamp = settings.use_stamp_note = True
    for name in ("date", "time", "render_time", "frame", "camera", "scene", "filename", "lens", "memory", "hostname",
                 "marker", "sequencer_strip", "frame_range"):
        setattr(settings, f"use_stamp_{name}", False)
    settings.use_stamp_labels, settings.stamp_font_size = False, 13
    settings.stamp_background, settings.stamp_foreground = (0, 0, 0, 0.55), (1, 1, 1, 1)


def _pixels(bpy, path: str):
    """Load the pixels (height, width, 4) of a picture, bottom row first."""
    import numpy as np

    picture = bpy.data.images.load(path)
    pixels = np.empty(TILE[0] * TILE[1] * 4, np.float32)
    picture.pixels.foreach_get(pixels)
    bpy.data.images.remove(picture)
    return pixels.reshape(TILE[1], TILE[0], 4)


def _write_picture(bpy, pixels, out: pathlib.Path) -> None:
    """Write pixels as a PNG file."""
    picture = bpy.data.images.new("preview", pixels.shape[1], pixels.shape[0])
    picture.pixels.foreach_set(pixels.ravel())
    picture.filepath_raw, picture.file_format = str(out), "PNG"
    picture.save()
    bpy.data.images.remove(picture)


def run(out: pathlib.Path) -> None:
    """Run the whole workflow."""
    load, switch_off = load_extension()
    import bpy

    told = load("beyond_mocap.cli.main").Told(False)
    steps = Steps(told,
                  {"Library": 0.2, "player1": 0.05, "player2": 0.05, "Accept": 0.03, "Render": 0.65, "Save": 0.02})
    with quiet():
        prepare(bpy)
    settings, session = bpy.context.scene.beyond_mocap, load("scene.core.session")
    reports = synthesize(load, settings, steps)
    steps.enter("Accept")
    made = [session.made(player.take) for player in settings.players]
    plans, takes = [one.plan for one in made], [one.take for one in made]
    with quiet():
        bpy.ops.beyond_mocap.accept()
    load("beyond_mocap.files.bvh.bvh").write(out / "player.bvh", takes[0].motion)
    others = dict(zip([player.name for player in settings.players][1:], reports[1:]))
    load("beyond_mocap.files.tables").write_report(out / "report.json", {**reports[0], "others": others})
    steps.enter("Render")
    with quiet():
        render(bpy, load, plans, takes, out / "preview.png", steps)
    steps.enter("Save")
    with quiet():
        bpy.context.scene.frame_set(1)
        bpy.ops.wm.save_as_mainfile(filepath=str(out / "match.blend"), compress=True)
    told.end()
    switch_off()
    print(f"""
Finished in {time.perf_counter() - steps.begun:.0f} s:
  {out / "match.blend"}   two players, the ball and a following camera: open it with Blender 4.5 or newer, press Space
  {out / "player.bvh"}    the first player's motion, for any other tool
  {out / "report.json"}   quality figures
  {out / "preview.png"}   eight rendered frames""")


def main() -> int:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(
        description="Two players and a ball, from the sample's tracking data and labels to Blender.")
    parser.add_argument("--out", type=pathlib.Path, default=HERE.parent / "build" / "demo", help="folder to write into")
    options = parser.parse_args()
    try:
        options.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        print(f"{options.out}: {error.strerror}; choose another folder with --out", file=sys.stderr)
        return 2
    run(options.out.resolve())
    return 0


if __name__ == "__main__":
    sys.exit(main())
