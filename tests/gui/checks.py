"""The extension in a real Blender's window, as its user meets it. Run inside Blender by tests/gui/run.

Each check is a generator (see window.py) that raises AssertionError. A failed check is told and the next one goes on.
"""

import importlib
import importlib.metadata
import pathlib
import re
import sys
import time
import tomllib
import traceback

import addon_utils
import bpy

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from window import Output, Window, talk, unfold  # noqa: E402

EXTENSION = "bl_ext.user_default.beyond_mocap"
TAB = "Beyond Mocap"
PICTURES = pathlib.Path("build/gui")
HEAVY = {"scipy", "sklearn", "kloppy", "lxml", "joblib", "matplotlib"}

output = Output()
window = Window()


def trouble(text):
    """The lines of printed text that only an error prints."""
    return re.findall(r"^(?:Traceback \(most recent call last\):.*|/.*\.py:\d+|.*rna_uiItem\w*:.*|UILayout\..*)$", text, re.M)


def printed_since(mark):
    """What was printed after the first `mark` characters."""
    return output.text()[mark:]


def assert_no_trouble_since(mark):
    """Fail with what was printed, each line once, where an error is in it."""
    printed = printed_since(mark)
    assert not trouble(printed), "printed:\n" + "\n".join(list(dict.fromkeys(printed.splitlines()))[:40])


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
        start = time.perf_counter()
        assert addon_utils.enable(EXTENSION) is not None
        seconds.append(time.perf_counter() - start)
        yield 0.1
    output.say(f"     enabling took {min(seconds):.3f} s")
    assert min(seconds) < 0.3, seconds


def check_packages_come_from_our_wheels():
    """Debian has most of these packages too; what counts is the folder they are really loaded from."""
    extension = pathlib.Path(sys.modules[EXTENSION].__file__).parent
    unpacked = (extension.parents[1] / ".local").resolve()
    manifest = tomllib.loads((extension / "blender_manifest.toml").read_text("utf-8"))
    names = sorted({pathlib.PurePath(wheel).name.split("-")[0] for wheel in manifest["wheels"]})
    assert names, "the zip carries no wheels"
    modules = set()
    for name in names:
        distribution = importlib.metadata.distribution(name)
        assert below(distribution.locate_file(""), unpacked), f"{name} is found in {distribution.locate_file('')}"
        modules |= {file.parts[0].removesuffix(".py") for file in distribution.files
                    if file.name == "__init__.py" and len(file.parts) == 2 or file.suffix == ".py" and len(file.parts) == 1}
    for module in sorted(modules):
        importlib.import_module(module)
    use_compiled_code()
    strangers = {name: module.__file__ for name, module in list(sys.modules.items())
                 if name.split(".")[0] in modules and getattr(module, "__file__", None) and not below(module.__file__, unpacked)}
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
    for cls in planted:
        bpy.utils.unregister_class(cls)
    yield 0.5
    seen = printed_since(mark)
    assert pressed == ["VIEW_3D"], f"pressed in {pressed}"
    assert "ValueError: planted" in seen, seen
    assert len(set(trouble(seen))) >= 2, seen


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


def press_all(wanted=None, then=None):
    """Press each button of the tab (or only the wanted operators'), page by page; return the calls that were pressed.

    `then` is what to do after each press; without it, whatever began is ended by Escape.
    """
    area = window.area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    region = window.sidebar(area)
    pressed, more = [], True
    while more and not (wanted and len(pressed) >= len(wanted)):
        found = yield from window.buttons(area, region)
        new = [call for call in found if call not in pressed and (wanted is None or operator_of(call) in wanted)]
        for call in new:  # a press may move the others: then they are looked for again
            if (yield from window.points_at(area, region, found[call])) == call:
                pressed.append(call)
                yield from press_one(call, found[call], then or end_what_began)
        more = bool(new) or (yield from window.scroll(region))
    return pressed


def operator_of(call):
    """The operator's name in a call as Blender writes it.

    >>> operator_of("bpy.ops.beyond_mocap.build_library(rebuild=True)")
    'build_library'
    """
    return call.split("(")[0].rpartition(".")[2]


def press_one(call, place, then):
    """Press the button that stood there, and tell what came of it."""
    usable = can_run(call)
    yield from window.click(*place)
    yield 0.3
    reaction = yield from then()
    output.say(f"     pressed {call}: {reaction if usable else 'greyed out'}")


def can_run(call):
    """Whether a button's operator says that it can be used just now."""
    group, name = call.split("(")[0].split(".")[-2:]
    area = window.area("VIEW_3D")
    with bpy.context.temp_override(window=window.window, area=area, region=window.sidebar(area)):
        return getattr(getattr(bpy.ops, group), name).poll()


def end_what_began():
    """Leave the file browser, dialog or running operator that a button brought up; say which it was."""
    manager = bpy.context.window_manager
    reaction = "done"
    for _ in range(20):
        browser = next((w for w in manager.windows if any(a.type == "FILE_BROWSER" for a in w.screen.areas)), None)
        running = [operator.bl_idname for operator in window.window.modal_operators]
        if browser is None and not running:
            return reaction
        reaction = "opened the file browser" if browser else f"ran {running}"
        yield from window.escape_from(browser or window.window)
        yield 0.5
    raise AssertionError(f"{reaction} and did not end by Escape")


def wait_for_work(limit=120):
    """Wait until no operator is running any more; say how long it took."""
    start = time.monotonic()
    while window.window.modal_operators:
        assert time.monotonic() - start < limit, f"still running after {limit} s"
        yield 0.2
    return f"took {time.monotonic() - start:.1f} s"


def check_the_quickstart():
    """Open the sample as an animator does and press its three buttons: bodies move at the end."""
    mark = len(output.text())
    bpy.ops.wm.open_mainfile(filepath=str((PICTURES / "sample" / "quickstart.blend").resolve()))
    yield 1.5
    steps = ["build_library", "synthesize", "bake"]
    pressed = yield from press_all(steps, then=wait_for_work)
    assert [operator_of(call) for call in pressed] == steps, pressed
    moving = [body.name for body in bpy.data.objects if body.type == "ARMATURE" and moves(body)]
    output.say(f"     moving: {', '.join(moving)}")
    assert moving, "no armature moves"
    yield 2
    window.picture(PICTURES / "quickstart.png")
    assert_no_trouble_since(mark)


def moves(body):
    """Whether an armature's bones stand differently at two frames of the scene."""
    scene = bpy.context.scene
    poses = []
    for frame in (scene.frame_start, (scene.frame_start + scene.frame_end) // 2):
        scene.frame_set(frame)
        poses.append([tuple(bone.matrix.translation) for bone in body.pose.bones])
    return poses[0] != poses[1]


def all_checks():
    """Run the checks in the order of the file; the status is 1 where one failed."""
    checks = [value for name, value in globals().items() if name.startswith("check_")]
    failed = 0
    for check in checks:
        name, start = check.__name__.removeprefix("check_").replace("_", " "), time.monotonic()
        try:
            yield from check()
            output.say(f"ok   {name} ({time.monotonic() - start:.0f} s)")
        except Exception:
            failed += 1
            window.picture(PICTURES / f"failed-{check.__name__}.png")
            output.say(f"FAIL {name}\n{traceback.format_exc()}")
    (PICTURES / "output.txt").write_text(output.text(), "utf-8")
    output.say(f"window tests: {len(checks) - failed} passed, {failed} failed in Blender {bpy.app.version_string}")
    return min(failed, 1)


bpy.context.preferences.view.show_splash = False
bpy.context.preferences.system.use_region_overlap = False  # else each move over the sidebar draws the whole view anew
talk(all_checks, output, limit=840)
