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
    assert_no_trouble_since,
    moves,
    output,
    press_all,
    press_button,
    printed_since,
    sample,
    settings,
    trouble,
    until,
    wait_for_work,
    window,
    within,
)
from window import unfold

HEAVY = {"scipy", "sklearn", "kloppy", "c3d", "lxml", "joblib", "matplotlib"}


def check_it_is_enabled():
    assert addon_utils.check(EXTENSION) == (True, True), addon_utils.check(EXTENSION)
    yield 0


def check_enabling_is_light():
    assert not HEAVY & set(sys.modules), f"enabling imported {sorted(HEAVY & set(sys.modules))}"
    seconds = []
    for _ in range(3):
        addon_utils.disable(EXTENSION)
        for name in [name for name in sys.modules if name == EXTENSION or name.startswith(EXTENSION + ".")]:
            del sys.modules[name]
        start = time.process_time()  # not the clock: others may be at work
        assert addon_utils.enable(EXTENSION) is not None
        seconds.append(time.process_time() - start)
        yield 0.1
    within("enabling, s", min(seconds), 0.3)


def check_packages_come_from_our_wheels():
    """Debian has most of these packages too; what counts is the folder they are really loaded from."""
    extension = pathlib.Path(sys.modules[EXTENSION].__file__).parent
    unpacked = (extension.parents[1] / ".local").resolve()
    if "user_default" not in str(extension.resolve()):
        output.say("     run from the source folder, which carries no wheels: not looked at")
        return
    manifest = tomllib.loads((extension / "blender_manifest.toml").read_text("utf-8"))
    names = sorted({pathlib.PurePath(wheel).name.split("-")[0] for wheel in manifest["wheels"]})
    assert names, "the zip carries no wheels"
    modules = set()
    for name in names:
        distribution = importlib.metadata.distribution(name)
        assert below(distribution.locate_file(""), unpacked), f"{name} is found in {distribution.locate_file('')}"
        modules |= {file.parts[0].removesuffix(".py") for file in distribution.files
                    if file.name == "__init__.py" and len(file.parts) == 2 or file.suffix == ".py"
                    and len(file.parts) == 1}
    for module in sorted(modules):
        importlib.import_module(module)
    use_compiled_code()
    strangers = {name: module.__file__ for name, module in list(sys.modules.items())
                 if name.split(".")[0] in modules and getattr(module, "__file__", None)
                 and not below(module.__file__, unpacked)}
    assert not strangers, strangers
    output.say(f"     from the wheels: {', '.join(sorted(modules))}")
    yield 0


def below(path, folder):
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


def check_the_eye_and_the_hand():
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
    yield from press_all(["planted"])
    yield from until(lambda: pressed and len(set(trouble(printed_since(mark)))) >= 2, 30.0)
    for cls in planted:
        bpy.utils.unregister_class(cls)
    seen = printed_since(mark)
    assert pressed == ["VIEW_3D"], f"pressed in {pressed}"
    assert "ValueError: planted" in seen, seen
    assert len(set(trouble(seen))) >= 2, seen


check_the_eye_and_the_hand.plants_trouble = True


def check_the_tab_draws():
    mark = len(output.text())
    area = window.area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    assert window.sidebar(area).active_panel_category == TAB
    window.picture(PICTURES / "panel.png")
    assert_no_trouble_since(mark)


def check_every_button():
    """Press each operator's button of the tab once; whatever it opens is closed, whatever it starts is cancelled."""
    mark = len(output.text())
    fold_again = [unfold(panel) for panel in bpy.types.Panel.__subclasses__() if panel.__module__.startswith(EXTENSION)]
    pressed = yield from press_all()
    window.picture(PICTURES / "unfolded.png")
    for fold in fold_again:
        fold()
    assert pressed, "the tab has no button"
    assert_no_trouble_since(mark)


def states():
    """How far the players' results are."""
    return {player.result.state for player in settings().players}


def check_the_quickstart():
    """Open the sample as an animator does and press its three buttons: bodies move at the end."""
    mark = len(output.text())
    bpy.ops.wm.open_mainfile(filepath=str(sample() / "quickstart.blend"))
    yield 0.5
    for step, reached in (("build_library", lambda: "43 clips" in settings().library_holds),
                          ("synthesize", lambda: states() == {"PREVIEW"}),
                          ("accept", lambda: states() == {"ACCEPTED"})):
        yield from press_button(step)
        told = yield from wait_for_work()
        yield from until(reached, what=states)
        output.say(f"     pressed {step}: {told}")
    moving = [body.name for body in bpy.data.objects if body.type == "ARMATURE" and moves(body)]
    output.say(f"     moving: {', '.join(moving)}")
    assert moving, "no armature moves"
    yield 2
    window.picture(PICTURES / "quickstart.png")
    assert_no_trouble_since(mark)
