"""Switching the extension on and off leaves nothing behind and hides no error."""

import importlib
import inspect
import pkgutil
import subprocess
import sys

import bpy
import pytest

TAB = "Beyond Mocap"
HEAVY = {"scipy", "sklearn", "kloppy", "c3d", "lxml", "joblib", "matplotlib"}
# Modules of the core that enabling must not load, and how many of the extension's own it loads in all. If one more is
# loaded, import it as a whole (`from ..scene.rigs import fit`), or inside the function that needs it.
CORE = {"annotation", "appearance.mesh", "ball.flight", "files.bvh.bvh", "library.library", "motion.humanoid",
        "motion.motion", "passes.pass_scene", "synthesis.plan", "synthesis.take"}  # fmt: skip
MOST_MODULES = 158
# A fresh process with this session's profile: enable, load the modules that are named, print all that are loaded, end
# without Blender's own ending (which may hang).
ENABLE = """
import os, sys
import bpy, addon_utils
assert addon_utils.enable(sys.argv[1]) is not None
for name in sys.argv[2:]:
    __import__(f"{sys.argv[1]}.{name}")
print(*sorted(sys.modules), flush=True)
os._exit(0)
"""


def our_classes():
    """Names of all registered classes whose code lies in the extension."""
    return sorted(cls.__name__ for cls in list_registered())


def list_registered():
    """All registered classes whose code lies in the extension."""
    return [
        cls
        for base in (bpy.types.Panel, bpy.types.Operator, bpy.types.PropertyGroup, bpy.types.UIList,
                     bpy.types.Menu, bpy.types.FileHandler, bpy.types.AddonPreferences)
        for cls in base.__subclasses__()
        if cls.__module__.startswith("bl_ext.user_default.beyond_mocap") and cls.is_registered
    ]


def test_the_tab_is_there(extension):
    panels = [cls for cls in bpy.types.Panel.__subclasses__() if getattr(cls, "bl_category", "") == TAB]
    assert any(cls.bl_space_type == "VIEW_3D" and cls.bl_region_type == "UI" for cls in panels)


def test_off_and_on_again(extension):
    before = our_classes()
    for _ in range(2):
        extension.unregister()
        assert our_classes() == [] and not hasattr(bpy.types.Scene, "beyond_mocap")
        extension.register()
        assert our_classes() == before and hasattr(bpy.types.Scene, "beyond_mocap")


MODULES = {
    "a": """
import bpy
from .b import B
class A(bpy.types.PropertyGroup):
    attached_to = ("Scene.planted_a", "Object.planted_a")
    b: bpy.props.PointerProperty(type=B)
class BEYOND_MOCAP_PT_child(bpy.types.Panel):
    bl_space_type, bl_region_type, bl_label = "VIEW_3D", "UI", "Child"
    bl_parent_id = "BEYOND_MOCAP_PT_parent"
    def draw(self, context): pass
""",
    "b": """
import bpy
class B(bpy.types.PropertyGroup):
    value: bpy.props.IntProperty()
done = []
def register(): done.append("on")
def unregister(): done.append("off")
""",
    "c": """
import bpy
from .a import A
class BEYOND_MOCAP_PT_parent(bpy.types.Panel):
    bl_space_type, bl_region_type, bl_label = "VIEW_3D", "UI", "Parent"
    def draw(self, context): pass
def register():
    if BROKEN: raise RuntimeError("planted")
""",
}


@pytest.mark.parametrize("broken", [False, True])
def test_classes_are_found_in_order_and_undone(extension, tmp_path, monkeypatch, broken):
    """What is pointed to and parents come first; an imported class is not registered again; a failure is undone."""
    registration = importlib.import_module(f"{extension.__name__}.scene.core.registration")
    package = f"planted_{broken}".lower()
    (tmp_path / package).mkdir()
    for name, text in {"__init__": "", **MODULES}.items():
        (tmp_path / package / f"{name}.py").write_text(text.replace("BROKEN", str(broken)))
    monkeypatch.syspath_prepend(tmp_path)
    if broken:
        with pytest.raises(RuntimeError, match="planted"):
            registration.register_package(package)
    else:
        registration.register_package(package)
        assert bpy.context.scene.planted_a.b.value == 0 and hasattr(bpy.types.Object, "planted_a")
        assert bpy.types.BEYOND_MOCAP_PT_child.is_registered
        registration.unregister_package(package)
    assert not hasattr(bpy.types.Scene, "planted_a") and not hasattr(bpy.types, "BEYOND_MOCAP_PT_parent")
    assert sys.modules[f"{package}.b"].done == ["on", "off"]


def test_a_registration_error_is_passed_on_and_undone(extension, monkeypatch):
    before = our_classes()
    extension.unregister()
    last = sys.modules[f"{extension.__name__}.{extension.PACKAGES[-1]}"]

    def broken():
        raise RuntimeError("planted")

    with monkeypatch.context() as patch:
        patch.setattr(last, "register", broken)
        with pytest.raises(RuntimeError, match="planted"):
            extension.register()
    assert our_classes() == []
    extension.register()
    assert our_classes() == before


def test_a_scene_that_cannot_watch_is_not_registered(extension, monkeypatch):
    before, scene = our_classes(), sys.modules[f"{extension.__name__}.scene"]
    live = sys.modules[f"{extension.__name__}.scene.core.live"]
    extension.unregister()

    def broken(*_):
        raise RuntimeError("planted")

    with monkeypatch.context() as patch:
        patch.setattr(live.Watcher, "draws", property(broken), raising=False)
        with pytest.raises(RuntimeError, match="planted"):
            scene.register()
    assert our_classes() == [] and not hasattr(bpy.types.Scene, "beyond_mocap") and not live._handlers
    extension.register()
    assert our_classes() == before


def test_the_core_has_one_name():
    with pytest.raises(ImportError):
        import beyond_mocap  # noqa: F401


def list_loaded(extension, *modules):
    """Modules that a fresh process has loaded after enabling, and then loading some of the extension's."""
    command = [sys.executable, "-P", "-c", ENABLE, extension.__name__, *modules]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return ran.stdout.splitlines()[-1].split()


def test_enabling_loads_nothing_heavy(extension):
    loaded = list_loaded(extension)
    own = [name.removeprefix(f"{extension.__name__}.") for name in loaded if name.startswith(extension.__name__)]
    assert not HEAVY & {name.partition(".")[0] for name in loaded}
    assert not CORE & {name.removeprefix("beyond_mocap.") for name in own}
    assert len(own) <= MOST_MODULES


def test_what_is_drawn_and_watched_from_the_first_moment_on_is_light(extension):
    """Watchers load these modules as soon as a window is drawn: it would wait for half a second."""
    first = ("scene.match.request", "scene.player.dots", "scene.player.tracks", "scene.result.freshness",
             "scene.result.plans", "scene.timeline.strips")
    loaded = list_loaded(extension, *first)
    assert f"{extension.__name__}.scene.player.tracks" in loaded
    assert not HEAVY & {name.partition(".")[0] for name in loaded}


def test_no_property_is_text():
    """Blender compiles a property that is text at every start: its module has no `from __future__`."""
    classes = {cls for registered in list_registered() for cls in registered.__mro__}
    texts = [text for cls in classes for text in inspect.get_annotations(cls).values() if isinstance(text, str)]
    assert [text for text in texts if "Property(" in text] == []


def test_what_has_something_to_register_is_named(extension):
    """Every module of `scene` with a class of Blender, a hook or a watcher is in its package's `REGISTERED`, as every
    package with one is in that of `scene`."""
    registration = importlib.import_module(f"{extension.__name__}.scene.core.registration")
    live = importlib.import_module(f"{extension.__name__}.scene.core.live")
    scene = importlib.import_module(f"{extension.__name__}.scene")
    for found in pkgutil.walk_packages(scene.__path__, f"{scene.__name__}."):
        package, _, name = found.name.rpartition(".")
        module = importlib.import_module(found.name)
        things = [thing for thing in vars(module).values()
                  if isinstance(thing, live.Watcher) or getattr(thing, "__module__", "") == found.name
                  and getattr(thing, "__name__", "") in ("register", "unregister")]
        if things or registration._list_classes(module) or hasattr(module, "REGISTERED"):
            assert name in importlib.import_module(package).REGISTERED, found.name
