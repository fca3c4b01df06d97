"""What users of version 0.1 have saved opens today: files, and the names that scripts, keys and presets rely on.

tests/data/identifiers-0.1.txt lists these names. tests/data/saved_by_0_1.blend was saved by 0.1 under Blender 4.5: two
players, a take, an edited path, strips, a pin, a passing scene, and every setting away from its default; its text
"kept values" holds path and value of each. Neither is ever made again.
"""

import json
import pathlib

import bpy
import pytest

DATA = pathlib.Path(__file__).resolve().parents[2] / "data"
LINES = [line.partition(":") for line in (DATA / "identifiers-0.1.txt").read_text("utf-8").splitlines()[1:]]
NAMES = {tuple(name.split()): set(rest.split()) for name, _, rest in LINES}
RENAMED = {"told": "messages"}  # the hidden status texts: the only names that have changed since; they are no settings


def described(kind, name):
    """The RNA of an operator or a class; None where there is none."""
    if kind == "operator":
        found = getattr(bpy.ops.beyond_mocap, name.removeprefix("beyond_mocap."))
        return found.get_rna_type() if found.idname() in dir(bpy.types) else None
    name = name.partition(".")[0]
    ours = [base.bl_rna_get_subclass_py(name) for base in (bpy.types.PropertyGroup, bpy.types.AddonPreferences)]
    found = next(filter(None, ours), getattr(bpy.types, name, None))
    return found and found.bl_rna


@pytest.mark.parametrize("kind", ["operator", "class", "group", "place"])
def test_the_names_are_still_there(kind):
    missing = {}
    for (_, name), wanted in ((key, value) for key, value in NAMES.items() if key[0] == kind):
        found = described(kind, name)
        if kind == "place" and found:
            own = found.properties.get(name.partition(".")[2])
            has = {own.fixed_type.identifier} if own else set()
        else:
            has = set(found.properties.keys()) if found else None
        wanted = {RENAMED.get(one, one) for one in wanted} if kind == "group" else wanted
        if has is None or wanted - has:
            missing[name] = "all" if has is None else wanted - has
    assert missing == {}


@pytest.fixture
def opened():
    """The old file, open; what each path in it held."""
    bpy.ops.wm.open_mainfile(filepath=str(DATA / "saved_by_0_1.blend"))
    return json.loads(bpy.data.texts["kept values"].as_string())


def held(path):
    """What is at a path such as `bpy.data.scenes["Scene"].beyond_mocap.players[0].name`."""
    _, _, inner = path.partition("bpy.data.")
    collection, _, rest = inner.partition('["')
    name, _, rest = rest.partition('"].')
    found = getattr(bpy.data, collection)[name].path_resolve(rest)
    return sorted(found) if isinstance(found, set) else found if isinstance(found, (str, int, float)) else list(found)


def test_every_value_is_kept(opened):
    assert len(opened) > 400
    status = [path for path in opened if path.rpartition(".")[2] in RENAMED]
    assert len(status) == 7
    for path in status:
        place, _, name = path.rpartition(".")
        assert isinstance(held(f"{place}.{RENAMED[name]}"), str)
        opened.pop(path)
    for path in [path for path in opened if path.endswith(".beyond_mocap.version")]:
        assert held(path) > opened.pop(path)  # migrated, which is no setting either
    assert {path: held(path) for path in opened} == opened


def test_what_was_saved_can_be_worked_with(opened):
    """The body still follows its path, and gets its own motion back."""
    player = bpy.context.scene.beyond_mocap.players[0]
    assert player.body.beyond_mocap_ride.on and player.dot.animation_data.nla_tracks
    bpy.context.view_layer.objects.active = player.body
    assert bpy.ops.beyond_mocap.leave_path() == {"FINISHED"}
    assert not player.body.beyond_mocap_ride.on
    assert player.body.animation_data.action.name == "player1 take"
