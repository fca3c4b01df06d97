"""The extension in a real Blender's window, as its user meets it: switched on, drawn, pressed. See play.py."""

import importlib
import importlib.metadata
import pathlib
import sys
import time
import tomllib

import addon_utils
import bpy
from tab import (
    EXTENSION,
    PICTURES,
    TAB,
    assert_no_errors_since,
    copy_sample,
    find_errors,
    get_settings,
    is_moving,
    output,
    press_all_buttons,
    press_button,
    read_printed_since,
    report_time,
    wait_for_work,
    wait_until,
    window,
)
from window import draw_unfolded

HEAVY = {"scipy", "sklearn", "kloppy", "c3d", "lxml", "joblib", "matplotlib"}


def check_it_is_enabled():
    assert addon_utils.check(EXTENSION) == (True, True), addon_utils.check(EXTENSION)
    yield 0


def check_enabling_is_light():
    assert not HEAVY & set(sys.modules), f"enabling imported {sorted(HEAVY & set(sys.modules))}"
    seconds, sys.dont_write_bytecode = [], False  # as in a user's Blender, which compiles the code once
    for _ in range(4):
        addon_utils.disable(EXTENSION)
        for name in [name for name in sys.modules if name == EXTENSION or name.startswith(EXTENSION + ".")]:
            del sys.modules[name]
        start = time.process_time()  # not the clock: others may be at work
        assert addon_utils.enable(EXTENSION) is not None
        seconds.append(time.process_time() - start)
        yield 0.1
    report_time("enabling, s", min(seconds), 0.1)


def check_packages_come_from_our_wheels():
    """Debian has most of these packages too; what counts is the folder they are really loaded from."""
    extension = pathlib.Path(sys.modules[EXTENSION].__file__).parent
    unpacked = (extension.parents[1] / ".local").resolve()
    if "user_default" not in str(extension.resolve()):
        output.write_line("     run from the source folder, which carries no wheels: not looked at")
        return
    manifest = tomllib.loads((extension / "blender_manifest.toml").read_text("utf-8"))
    names = sorted({pathlib.PurePath(wheel).name.split("-")[0] for wheel in manifest["wheels"]})
    assert names, "the zip carries no wheels"
    modules = set()
    for name in names:
        distribution = importlib.metadata.distribution(name)
        assert is_below(distribution.locate_file(""), unpacked), f"{name} is found in {distribution.locate_file('')}"
        modules |= {file.parts[0].removesuffix(".py") for file in distribution.files
                    if file.name == "__init__.py" and len(file.parts) == 2 or file.suffix == ".py"
                    and len(file.parts) == 1}
    for module in sorted(modules):
        importlib.import_module(module)
    use_compiled_code()
    strangers = {name: module.__file__ for name, module in list(sys.modules.items())
                 if name.split(".")[0] in modules and getattr(module, "__file__", None)
                 and not is_below(module.__file__, unpacked)}
    assert not strangers, strangers
    output.write_line(f"     from the wheels: {', '.join(sorted(modules))}")
    yield 0


def is_below(path, folder):
    """Whether a path lies in a folder."""
    return folder in pathlib.Path(path).resolve().joinpath("x").parents


def use_compiled_code():
    """One small call into each compiled package, because importing the top of a package loads little of it."""
    import lxml.etree
    import numpy as np
    from scipy.spatial import cKDTree
    from sklearn.cluster import KMeans

    points = np.random.default_rng(0).normal(size=(60, 3))
    assert cKDTree(points).query(points[7])[1] == 7
    assert len(KMeans(3, n_init=1, random_state=0).fit(points).cluster_centers_) == 3
    assert lxml.etree.fromstring("<a><b/></a>")[0].tag == "b"


def check_the_test_finds_buttons_and_errors():
    """A planted button is found and pressed, planted errors are seen: else the next checks would prove nothing."""
    pressed = []

    class BEYOND_MOCAP_OT_planted(bpy.types.Operator):
        bl_idname, bl_label = "beyond_mocap.planted", "Planted"

        def execute(self, context):
            pressed.append(context.area.type)
            return {"FINISHED"}

    class BEYOND_MOCAP_PT_planted(bpy.types.Panel):
        bl_space_type, bl_region_type, bl_category, bl_label, bl_order = "VIEW_3D", "UI", TAB, "Planted", -1

        def draw(self, context):
            self.layout.operator("beyond_mocap.planted")
            self.layout.prop(context.scene, "no_such_property")
            raise ValueError("planted")

    mark = len(output.text())
    planted = (BEYOND_MOCAP_OT_planted, BEYOND_MOCAP_PT_planted)
    for cls in planted:
        bpy.utils.register_class(cls)
    yield from press_all_buttons(["planted"])
    yield from wait_until(lambda: pressed and len(set(find_errors(read_printed_since(mark)))) >= 2, 30.0)
    for cls in planted:
        bpy.utils.unregister_class(cls)
    seen = read_printed_since(mark)
    assert pressed == ["VIEW_3D"], f"pressed in {pressed}"
    assert "ValueError: planted" in seen, seen
    assert len(set(find_errors(seen))) >= 2, seen


check_the_test_finds_buttons_and_errors.plants_trouble = True


def check_the_tab_draws():
    mark = len(output.text())
    area = window.find_area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    assert window.find_sidebar(area).active_panel_category == TAB
    window.save_picture(PICTURES / "panel.png")
    assert_no_errors_since(mark)


def check_every_button():
    """Press each operator's button of the tab once; whatever it opens is closed, whatever it starts is cancelled."""
    mark = len(output.text())
    fold_again = [draw_unfolded(panel) for panel in bpy.types.Panel.__subclasses__()
                  if panel.__module__.startswith(EXTENSION)]
    pressed = yield from press_all_buttons()
    window.save_picture(PICTURES / "unfolded.png")
    for fold in fold_again:
        fold()
    assert pressed, "the tab has no button"
    assert_no_errors_since(mark)


def list_states():
    """How far the players' results are."""
    return {player.result.state for player in get_settings().players}


def check_the_quickstart():
    """Open the sample as an animator does and press its three buttons: bodies move at the end."""
    mark = len(output.text())
    bpy.ops.wm.open_mainfile(filepath=str(copy_sample() / "quickstart.blend"))
    yield 0.5
    for step, reached in (("build_library", lambda: "43 clips" in get_settings().library_holds),
                          ("synthesize", lambda: list_states() == {"PREVIEW"}),
                          ("accept", lambda: list_states() == {"ACCEPTED"})):
        yield from press_button(step)
        told = yield from wait_for_work()
        yield from wait_until(reached, what=list_states)
        output.write_line(f"     pressed {step}: {told}")
    moving = [body.name for body in bpy.data.objects if body.type == "ARMATURE" and is_moving(body)]
    output.write_line(f"     moving: {', '.join(moving)}")
    assert moving, "no armature moves"
    yield 2
    window.save_picture(PICTURES / "quickstart.png")
    assert_no_errors_since(mark)
