"""The main workflow on the sample, without a window: two players and the ball, from tracking data and labels to a
.blend.

    python sample_blend/demo.py --out build/demo

Runs with Blender as a Python module (`make demo` sets that up). Writes match.blend, player.bvh, report.json and
preview.png, a sheet of rendered frames, and says how to open them.
"""

from __future__ import annotations

import argparse
import atexit
import importlib
import os
import pathlib
import shutil
import signal
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
TILES = (4, 2)  # across, down
TILE = (480, 270)  # pixels
# the moving picture: long enough for a kick and what follows, small enough for a page
FILM_SECONDS, FILM_FPS = 4.8, 12.5
_folders: list[str] = []  # temporary ones


def load_extension():
    """Register the extension from this clone, with an empty profile in a folder that is removed in the end.

    Returns:
        A function that imports its modules by name, and one that unregisters it.
    """
    os.environ.setdefault("BLENDER_USER_RESOURCES", create_temporary_folder())
    sys.path.insert(0, str(HERE.parent))
    import batch

    name = batch.find_extension()
    extension = importlib.import_module(f"{name}.__init__")  # Blender makes a folder a package without running this
    extension.register()
    return lambda module: importlib.import_module(f"{name}.{module}"), extension.unregister


class Steps:
    """The parts of the workflow, each with its share of one progress bar."""

    def __init__(self, reporter, shares: dict[str, float]):
        """Begin the progress bar.

        Args:
            reporter: the command line's progress bar.
            shares: part -> share of the time it takes.
        """
        self.reporter, self.shares, self.done, self.current_part = reporter, shares, 0.0, ""
        self.start_time = time.perf_counter()

    def enter_part(self, part: str) -> None:
        """Begin a part."""
        self.done += self.shares.get(self.current_part, 0.0)
        self.current_part = part
        self.reporter.show_progress(self.done, part)
        if not sys.stderr.isatty():
            print(f"{time.perf_counter() - self.start_time:5.1f} s  {part}", flush=True)

    def show_progress(self, fraction: float, text: str) -> None:
        """Show the progress of the part."""
        self.reporter.show_progress(self.done + fraction * self.shares[self.current_part],
                                    f"{self.current_part}: {text}")


def prepare_scene(bpy) -> None:
    """Create an empty file with the stage, and the settings that an animator would fill in."""
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start = 30, 1
    bpy.ops.beyond_mocap.add_stage()
    scene.beyond_mocap.library_folder = str(HERE / "library")
    for number in (1, 2):
        bpy.ops.beyond_mocap.import_tracking(filepath=str(HERE / "match" / f"player{number}.csv"))


def synthesize_players(load, settings, steps) -> list[dict]:
    """Build the library, synthesize the takes and store them for Apply.

    Returns:
        The players' reports.
    """
    plans, session = load("scene.result.plans"), load("scene.core.session")
    quality, recipe = load("scene.result.quality"), load("beyond_mocap.synthesis.synthesize")
    steps.enter_part("Library")
    started = time.perf_counter()
    clips = load("beyond_mocap.library.build").build_library(settings.library_folder, progress=steps.show_progress)
    library_seconds = time.perf_counter() - started
    session.store_library(clips, None)
    settings.library_holds = load("operators.library.library").describe_library(clips)
    settings.library_gaps = load("operators.library.library").describe_gaps(clips)
    reports = []
    for player in settings.players:
        steps.enter_part(player.name)
        started = time.perf_counter()
        plan, _ = plans.build_plan(settings, player)
        load_seconds = time.perf_counter() - started
        take = recipe.synthesize(clips, plan, progress=steps.show_progress)
        total = time.perf_counter() - started + library_seconds
        reports.append(load("beyond_mocap.evaluation.report").evaluate(take, plan.track, clips))
        reports[-1]["seconds"].update(load=load_seconds, library=library_seconds, total=total)
        player.take = session.store_take(plan, take)
        player.quality, player.moments = quality.describe_quality(reports[-1]), quality.describe_moments(reports[-1])
    return reports


def choose_moments(plans, takes, count: int) -> list[tuple[float, int]]:
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
    keys = [(key.requested.time, player) for player, take in enumerate(takes) for key in take.keys]
    labelled = [(span, player) for player, plan in enumerate(plans) for span in plan.timeline.spans]
    spans = [(0.5 * (span.start + span.end), player) for span, player in labelled]
    chosen = sorted([*keys, *sorted(spans, key=lambda span: -min(abs(span[0] - key[0]) for key in keys))][:count])
    while len(chosen) < count:
        edges = [start, *(seconds for seconds, _ in chosen), end]
        widest = max(range(1, len(edges)), key=lambda i: edges[i] - edges[i - 1])
        seconds = 0.5 * (edges[widest - 1] + edges[widest])
        chosen = sorted([*chosen, (seconds, find_nearest_to_ball(takes, seconds))])
    return chosen


def locate_hips(take, seconds: float):
    """Return where a player's hips are at a time on the track's clock: (3,) m."""
    frame = round((seconds - take.start_time) * take.motion.fps)
    return take.motion.root_positions[min(max(frame, 0), len(take.motion) - 1)]


def find_nearest_to_ball(takes, seconds: float) -> int:
    """Return the number of the player nearest to the ball."""
    ball = next(take.ball for take in takes if take.ball is not None)
    place = ball.positions[abs(ball.times - seconds).argmin()]
    return min(range(len(takes)), key=lambda i: float(sum((locate_hips(takes[i], seconds)[:2] - place[:2]) ** 2)))


def describe_moment(take, seconds: float) -> str:
    """Return what the player does at a time on the track's clock."""
    for key in take.keys:
        if abs(key.requested.time - seconds) < 0.15:
            return " ".join(key.requested.words)
    frame = round((seconds - take.start_time) * take.motion.fps)
    return " ".join(take.words[min(max(frame, 0), len(take.words) - 1)])


def render_sheet(bpy, load, plans, takes, out: pathlib.Path, steps) -> None:
    """Render the sheet of frames with Cycles on the CPU, which needs no graphics card and no window."""
    import numpy as np

    scene, frame_at = bpy.context.scene, load("scene.result.bake").compute_frame
    follow_camera, scene.camera = scene.camera, create_camera(bpy)
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 12, False, 2
    scene.render.resolution_x, scene.render.resolution_y = TILE
    scene.render.use_persistent_data = True
    scene.view_settings.view_transform = "Standard"
    _show_stamp(scene.render)
    times = choose_moments(plans, takes, TILES[0] * TILES[1])
    sheet = np.ones((TILES[1] * TILE[1], TILES[0] * TILE[0], 4), np.float32)
    with tempfile.TemporaryDirectory() as folder:
        for number, (seconds, player) in enumerate(times):
            steps.show_progress(number / len(times), f"frame {number + 1} of {len(times)}")
            scene.frame_set(round(frame_at(scene, seconds)))
            aim_camera(load, scene.camera, takes[player], seconds)
            scene.render.stamp_note_text = f"{seconds:.1f} s   {describe_moment(takes[player], seconds)}"
            scene.render.filepath = str(pathlib.Path(folder, f"{number}.png"))
            bpy.ops.render.render(write_still=True)
            row, column = divmod(number, TILES[0])
            top = (TILES[1] - row) * TILE[1]
            sheet[top - TILE[1] : top, column * TILE[0] : (column + 1) * TILE[0]] = _load_pixels(bpy,
                    scene.render.filepath)
    _write_picture(bpy, sheet, out)
    scene.render.use_stamp = False
    steps.enter_part("Film")
    render_film(bpy, load, takes[0], out.with_suffix(".webp"), steps)
    bpy.data.cameras.remove(scene.camera.data)
    scene.camera = follow_camera
    scene.render.resolution_x, scene.render.resolution_y, scene.render.use_stamp = 1280, 720, False


def render_film(bpy, load, take, out: pathlib.Path, steps) -> None:
    """Render a moving picture of a player around their first key moment, as animated WebP.

    Args:
        take: the player's take.
        out: the file.
        steps: shows the progress.
    """
    import numpy as np
    from PIL import Image

    scene, frame_at = bpy.context.scene, load("scene.result.bake").compute_frame
    start = take.keys[0].requested.time - 0.4 * FILM_SECONDS
    times = start + np.arange(round(FILM_SECONDS * FILM_FPS)) / FILM_FPS
    pictures = []
    with tempfile.TemporaryDirectory() as folder:
        for number, seconds in enumerate(times):
            steps.show_progress(number / len(times), f"picture {number + 1} of {len(times)}")
            scene.frame_set(round(frame_at(scene, seconds)))
            follow_player(scene.camera, take, seconds)
            scene.render.filepath = str(pathlib.Path(folder, f"{number}.png"))
            bpy.ops.render.render(write_still=True)
            pictures.append(Image.open(scene.render.filepath).convert("RGB"))
    pictures[0].save(out, save_all=True, append_images=pictures[1:], duration=round(1000 / FILM_FPS), loop=0,
                     quality=70)


def follow_player(camera, take, seconds: float) -> None:
    """Place the camera beside the player's path, moving as evenly as the player does over two seconds."""
    import numpy as np

    near = [locate_hips(take, seconds + shift) * [1.0, 1.0, 0.0] for shift in np.linspace(-1.0, 1.0, 9)]
    middle = np.mean(near, axis=0)
    _place_camera(camera, middle + [-1.5, -6.0, 1.9], middle + [0.0, 0.0, 0.8])


def create_camera(bpy):
    """Create a camera that is placed beside one player after the other."""
    camera = bpy.data.objects.new("Close", bpy.data.cameras.new("Close"))
    camera.data.lens = 42.0
    bpy.context.scene.collection.objects.link(camera)
    return camera


def aim_camera(load, camera, take, seconds: float) -> None:
    """Place the camera half in front of the player, at the height of the chest."""
    import numpy as np

    hips = locate_hips(take, seconds) * [1.0, 1.0, 0.0]
    frame = min(max(round((seconds - take.start_time) * take.motion.fps), 0), len(take.motion) - 1)
    angle = load("beyond_mocap.motion.humanoid").compute_heading(take.motion)[frame] - 0.9
    _place_camera(camera, hips + [4.6 * np.cos(angle), 4.6 * np.sin(angle), 1.55], hips + [0.0, 0.0, 0.85])


def _place_camera(camera, eye, target) -> None:
    """Place the camera at a point of the world and point it at another."""
    from mathutils import Vector

    camera.location = eye
    camera.rotation_euler = (Vector(target) - Vector(eye)).to_track_quat("-Z", "Y").to_euler()


def _show_stamp(settings) -> None:
    """Show only the note in renders."""
    settings.use_stamp = settings.use_stamp_note = True
    for name in ("date", "time", "render_time", "frame", "camera", "scene", "filename", "lens", "memory", "hostname",
                 "marker", "sequencer_strip", "frame_range"):
        setattr(settings, f"use_stamp_{name}", False)
    settings.use_stamp_labels, settings.stamp_font_size = False, 13
    settings.stamp_background, settings.stamp_foreground = (0, 0, 0, 0.55), (1, 1, 1, 1)


def _load_pixels(bpy, path: str):
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


def run_demo(out: pathlib.Path) -> None:
    """Run the whole workflow."""
    load, unregister = load_extension()
    import bpy

    silence_blender = load("scene.rigs.exporters").silence_blender
    reporter = load("beyond_mocap.cli.main").ProgressReporter(False)
    steps = Steps(reporter,
                  {"Library": 0.2, "player1": 0.05, "player2": 0.05, "Apply": 0.03, "Render": 0.1, "Film": 0.55,
                   "Save": 0.02})
    with silence_blender():
        prepare_scene(bpy)
    settings, session = bpy.context.scene.beyond_mocap, load("scene.core.session")
    reports = synthesize_players(load, settings, steps)
    steps.enter_part("Apply")
    results = [session.find_take(player.take) for player in settings.players]
    plans, takes = [result.plan for result in results], [result.take for result in results]
    with silence_blender():
        bpy.ops.beyond_mocap.accept()
    load("beyond_mocap.files.bvh.bvh").write_bvh(out / "player.bvh", takes[0].motion)
    others = dict(zip([player.name for player in settings.players][1:], reports[1:]))
    load("beyond_mocap.files.tables").write_report(out / "report.json", {**reports[0], "others": others})
    steps.enter_part("Render")
    with silence_blender():
        render_sheet(bpy, load, plans, takes, out / "preview.png", steps)
    steps.enter_part("Save")
    with silence_blender():
        bpy.context.scene.frame_set(1)
        bpy.ops.wm.save_as_mainfile(filepath=str(out / "match.blend"), compress=True)
    reporter.finish()
    unregister()
    print(f"""
Finished in {time.perf_counter() - steps.start_time:.0f} s:
  {out / "match.blend"}   two players, the ball and a following camera: open it with Blender 4.5 or newer, press Space
  {out / "player.bvh"}    the first player's motion, for any other tool
  {out / "report.json"}   quality figures
  {out / "preview.png"}   eight rendered frames
  {out / "preview.webp"}  a moving picture""")


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
    handle_interrupt()
    run_demo(options.out.resolve())
    return 0


def create_temporary_folder() -> str:
    """Create the folder of everything temporary, Blender's too, which is removed when the process ends."""
    folder = tempfile.mkdtemp(prefix="beyond-mocap-demo-")
    _folders.append(folder)
    tempfile.tempdir = os.environ["TMPDIR"] = folder
    return folder


@atexit.register
def remove_temporary_folders() -> None:
    """Remove what `create_temporary_folder` has created."""
    for folder in _folders:
        shutil.rmtree(folder, ignore_errors=True)


def handle_interrupt() -> None:
    """End at once on Ctrl-C: Blender's handlers would report the interrupt as an error of theirs, and go on."""
    messages = os.dup(sys.stderr.fileno())  # where Blender is silenced, stderr is too

    def end(*_) -> None:
        os.write(messages, b"\ndemo: cancelled\n")
        remove_temporary_folders()
        os._exit(130)

    signal.signal(signal.SIGINT, end)


def end_process(status: int) -> None:
    """End without Blender's cleaning up, which reports "Error: Not freed memory blocks" below the result."""
    remove_temporary_folders()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


if __name__ == "__main__":
    end_process(main())
