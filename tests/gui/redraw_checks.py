"""How long our panels take to draw: Python time, with 22 players in the list and a take for each."""

import statistics
import time

import bpy
from tab import EXTENSION, PICTURES, TAB, copy_sample, list_tasks, open_task, output, report_time, window
from window import draw_unfolded

PLAYERS, LIMIT_MS = 22, 5.0
DRAWN = ("draw", "draw_header", "draw_item", "filter_items")
EDITORS = ("VIEW_3D", "NLA_EDITOR", "DOPESHEET_EDITOR")


def list_own_classes(base):
    """Our registered classes of this kind."""
    return [cls for cls in base.__subclasses__() if cls.__module__.startswith(EXTENSION) and cls.is_registered]


def write_match(folder):
    """Files of 22 players who jog for four seconds, each with a kick."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(PLAYERS):
        lines = [f"{t / 10:.1f},{0.28 * t:.3f},{2.0 * number:.3f}" for t in range(41)]
        (folder / f"player{number + 1}.csv").write_text("\n".join(["time_s,x_m,y_m", *lines]) + "\n")
        (folder / f"player{number + 1}.txt").write_text("2.0 kick\n")
    return folder.resolve()


def set_argument_count(count, function):
    """A function that declares so many arguments: Blender looks at that before it calls one."""
    return {
        2: lambda a, b: function(a, b),
        4: lambda a, b, c, d: function(a, b, c, d),
        8: lambda a, b, c, d, e, f, g, h: function(a, b, c, d, e, f, g, h),
        9: lambda a, b, c, d, e, f, g, h, i: function(a, b, c, d, e, f, g, h, i),
        10: lambda a, b, c, d, e, f, g, h, i, j: function(a, b, c, d, e, f, g, h, i, j),
    }[count]


class Stopwatch:
    """Takes the time of every draw function of our classes; `rounds`: function -> seconds in each round."""

    def __init__(self):
        self.rounds, self.undo = {}, []
        for cls in [*list_own_classes(bpy.types.Panel), *list_own_classes(bpy.types.UIList)]:
            for name in DRAWN:
                if any(name in vars(one) for one in cls.__mro__ if one.__module__.startswith(EXTENSION)):
                    self.wrap_function(cls, name)

    def wrap_function(self, cls, name):
        plain, own = getattr(cls, name), name in vars(cls)  # a mixin's draw is measured in each class that has it

        def timed(*arguments):
            start = time.perf_counter()
            try:
                return plain(*arguments)
            finally:
                self.rounds.setdefault(f"{cls.__name__}.{name}", [0.0])[-1] += time.perf_counter() - start

        setattr(cls, name, set_argument_count(plain.__code__.co_argcount, timed))
        self.undo.append(lambda: setattr(cls, name, plain) if own else delattr(cls, name))

    def next_round(self):
        for seconds in self.rounds.values():
            seconds.append(0.0)

    def compute_medians(self):
        """Milliseconds of each function in a round in which it was called."""
        return {name: 1000 * statistics.median([one for one in seconds if one] or [0.0])
                for name, seconds in self.rounds.items()}

    def stop(self):
        for undo in self.undo:
            undo()


def measure_redraws(kind, rounds=25):
    """Draw the tab of this kind of editor anew again and again; return the milliseconds of each draw function."""
    areas = [area for area in window.window.screen.areas if area.type == kind]
    # the timeline is a dope sheet too, with no room for tabs
    area = max(areas, key=lambda area: area.width * area.height)
    yield from window.open_tab(area, TAB)
    watch = Stopwatch()
    for _ in range(rounds):
        window.find_sidebar(area).tag_redraw()
        yield 0.05
        watch.next_round()
    watch.stop()
    return watch.compute_medians()


def report_medians(heading, medians):
    """Say the sum and the slowest; return the sum."""
    output.write_line(f"     {heading}: {sum(medians.values()):.2f} ms; " + ", ".join(
        f"{name.partition('_PT_')[2] or name} {value:.2f}"
        for name, value in sorted(medians.items(), key=lambda i: -i[1])[:5]))
    return sum(medians.values())


def check_the_tab_draws_quickly():
    bpy.ops.wm.read_homefile(use_empty=True, load_ui=True)
    yield 1
    settings = bpy.context.scene.beyond_mocap
    settings.library_folder = str(copy_sample() / "library")
    match = write_match(PICTURES / "match of 22")
    names = sorted(path.name for path in match.glob("*.csv"))
    bpy.ops.beyond_mocap.import_tracking(directory=f"{match}/", files=[{"name": name} for name in names])
    bpy.ops.beyond_mocap.build_library()
    assert bpy.ops.beyond_mocap.synthesize() == {"FINISHED"}
    assert len(bpy.context.scene.beyond_mocap.players) == PLAYERS
    yield 1
    sums = {}
    for task in list_tasks():
        yield from open_task(task)
        sums[f"{task} as it opens"] = report_medians(f"{task} as it opens", (yield from measure_redraws("VIEW_3D", 12)))
    fold_again = [draw_unfolded(panel) for panel in list_own_classes(bpy.types.Panel) if panel.bl_space_type
                  == "VIEW_3D"]
    for task in list_tasks():
        yield from open_task(task)
        sums[f"{task} unfolded"] = report_medians(f"{task} unfolded", (yield from measure_redraws("VIEW_3D", 12)))
    window.save_picture(PICTURES / "redraw.png")
    for fold in fold_again:
        fold()
    for name, value in sums.items():
        report_time(f"the tab {name}, ms", value, LIMIT_MS)


def check_the_tabs_of_the_timelines_draw_quickly():
    kinds = {panel.bl_space_type for panel in list_own_classes(bpy.types.Panel) if getattr(panel, "bl_category", "")
             == TAB}
    area = window.find_area("VIEW_3D")
    for kind in [kind for kind in EDITORS[1:] if kind in kinds]:
        area.type = kind
        yield 0.5
        spent = report_medians(kind, (yield from measure_redraws(kind)))
        assert spent > 0.0
        report_time(f"the tab in {kind}, ms", spent, LIMIT_MS)
        area.type = "VIEW_3D"
        yield 0.5
