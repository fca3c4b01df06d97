"""The library panel in a real window: the list, the watched folder, other file forms, dropped files, words, assets."""

import shutil
import time

import bpy
from tab import PICTURES, TAB, moves, output, press, room, run, sample, settings, settled, until, window, within
from window import unfold


def listing():
    """The list of clips."""
    return bpy.context.window_manager.beyond_mocap_clips


def opened(name="library"):
    """The sample, freshly opened, with a library of its own (a copy) and the tab in front."""
    bpy.ops.wm.open_mainfile(filepath=str(sample() / "quickstart.blend"))
    yield 1.0
    folder = PICTURES.resolve() / f"library-{name}"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(sample() / "library", folder, ignore=shutil.ignore_patterns(".beyond_mocap"))
    settings().library_folder = str(folder)
    yield from window.open_tab(window.area("VIEW_3D"), TAB)
    return folder


def unfolded():
    """Step 1 with all that it can unfold; returns what folds it again."""
    fold = unfold(
        next(panel for panel in bpy.types.Panel.__subclasses__() if panel.__name__ == "BEYOND_MOCAP_PT_library")
    )
    window.area("VIEW_3D").tag_redraw()
    return fold


def check_the_list_and_its_buttons():
    folder = yield from opened()
    run("beyond_mocap.build_library")
    yield from settled()
    yield from until(lambda: listing().total == 43 and not listing().missing, what=lambda: listing().total)
    fold = unfolded()
    yield from drawn()
    window.picture(PICTURES / "library-list.png")
    listing().find = "kick"
    yield from drawn()
    window.picture(PICTURES / "library-found.png")
    yield from press("import_clip")
    yield from until(
        lambda: bpy.context.object and bpy.context.object.name.startswith("kick"), what=lambda: bpy.context.object
    )
    assert moves(bpy.context.object), bpy.context.object
    window.picture(PICTURES / "library-imported.png")
    shutil.move(folder, folder.with_name("library-moved"))
    settings().library_watch = True
    yield from until(lambda: listing().missing, what="the folder is gone")
    yield from drawn()
    window.picture(PICTURES / "library-missing.png")
    fold()
    shutil.rmtree(folder.with_name("library-moved"))


def drawn():
    """Panels have moved to where they belong: they glide there while the region is drawn again and again."""
    for _ in range(8):
        window.sidebar(window.area("VIEW_3D")).tag_redraw()
        yield 0.2


def check_news_are_told_and_nothing_is_built():
    folder = yield from opened("watched")
    run("beyond_mocap.build_library", "EXEC_DEFAULT")
    settings().library_watch = True
    yield 1.0
    for number in range(3):
        shutil.copy(folder / "walking_1_2.bvh", folder / f"new_{number}.bvh")
    yield from until(lambda: listing().news == "3 new clips", what=lambda: listing().news)  # it may be read between two
    assert listing().total == 43, listing().total
    yield 0.5
    window.picture(PICTURES / "library-news.png")


def check_ten_thousand_files_do_not_freeze_the_window():
    folder = yield from opened("large")
    for number in range(100):
        (folder / f"{number:03}").mkdir()
        for other in range(100):
            (folder / f"{number:03}" / f"{other:03}.bvh").touch()
    yield 2.0
    start = time.perf_counter()
    run("beyond_mocap.list_clips")
    yield from settled()
    yield from until(lambda: listing().total > 10000, what=lambda: listing().total)
    output.say(f"     listed {listing().total} clips in {time.perf_counter() - start:.2f} s")
    settings().library_watch = True
    fold, spent = unfolded(), []
    panel = next(panel for panel in bpy.types.Panel.__subclasses__() if panel.__name__ == "BEYOND_MOCAP_PT_library")
    drawn = panel.draw

    def timed(self, context):
        begun = time.perf_counter()
        drawn(self, context)
        spent.append(time.perf_counter() - begun)

    panel.draw = timed
    longest, last, end = 0.0, time.monotonic(), time.monotonic() + 12.0
    while time.monotonic() < end:
        window.area("VIEW_3D").tag_redraw()
        yield 0.02
        now = time.monotonic()
        longest, last = max(longest, now - last), now
    panel.draw = drawn
    fold()
    spent.sort()
    output.say(f"     drawn {len(spent)} times, {1000 * spent[len(spent) // 2]:.1f} ms in the median; longest wait "
               f"{longest:.2f} s")
    assert listing().total == 10043
    within("the panel, s", spent[len(spent) // 2], 0.005)
    within("longest wait, s", longest, 3.0)
    settings().library_watch = False
    shutil.rmtree(folder)


def check_clips_of_other_forms_are_converted():
    folder = yield from opened("forms")
    for name, export in (("walking_1_2", fbx), ("jogging_2_9", glb)):
        run("beyond_mocap.import_clips", "EXEC_DEFAULT", filepath=str(folder / f"{name}.bvh"))
        export(folder / name)
        (folder / f"{name}.bvh").unlink()
    (folder / "broken.fbx").write_bytes(b"no such thing")
    yield 0.5
    run("beyond_mocap.build_library")
    yield from settled()
    yield from until(lambda: listing().total)
    paths = [clip.path for clip in listing().shown]
    assert "walking_1_2.fbx" in paths and "jogging_2_9.glb" in paths and "broken.fbx" not in paths, paths
    assert window.window.scene.name != "Import" and "Import" not in bpy.data.scenes
    settings().library_folder = settings().library_folder  # as a user who types the same again
    run("beyond_mocap.import_clip", "EXEC_DEFAULT", path="walking_1_2.fbx")
    assert moves(bpy.context.object)


def fbx(path):
    """Export what is selected."""
    bpy.ops.export_scene.fbx(filepath=str(path) + ".fbx", use_selection=True, add_leaf_bones=False,
                             bake_anim_use_all_actions=False, bake_anim_use_nla_strips=False)


def glb(path):
    """Export what is selected."""
    bpy.ops.export_scene.gltf(filepath=str(path) + ".glb", export_format="GLB", use_selection=True)


def drop(folder, *names):
    """Files dropped into the 3D view."""
    area = window.area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        bpy.ops.wm.drop_import_file("INVOKE_DEFAULT", directory=str(folder), files=[{"name": name} for name in names])


def check_dropped_files():
    folder = yield from opened("dropped")
    yield from window.move(700, 400)
    drop(folder, "walking_1_2.bvh")
    yield from until(lambda: bpy.context.object and bpy.context.object.name.startswith("walking_1_2"))
    glb(folder / "dropped")
    count = len(bpy.data.objects)
    drop(folder, "dropped.glb")
    yield 1.0
    window.picture(PICTURES / "library-drop-menu.png")  # Blender asks: its own importer or this one
    assert len(bpy.data.objects) == count
    yield from window.press("ESC")
    run("beyond_mocap.import_clips", "EXEC_DEFAULT", directory=str(folder), files=[{"name": "dropped.glb"}])
    assert bpy.context.object.name.startswith("dropped") and moves(bpy.context.object)
    words = folder / "words.txt"
    words.write_text("1 2 running\n")
    drop(folder, "words.txt")

    def spans():
        player = settings().players[settings().active_player]
        return [span.words for span in room("scene.timeline.strips").read(player, window.window.scene).spans]

    yield from until(lambda: spans() == [("running",)], what=spans)


def check_a_clip_is_annotated():
    folder = yield from opened("annotated")
    (folder / "kick_low_top.txt").unlink()
    run("beyond_mocap.list_clips", "EXEC_DEFAULT")
    run("beyond_mocap.annotate_clip", path="kick_low_top.bvh")
    yield from settled()
    run("beyond_mocap.propose_words")
    yield from settled()
    rig = bpy.context.object
    area = window.area("PROPERTIES")
    kind, area.type = area.type, "NLA_EDITOR"
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        bpy.ops.nla.view_all()
    fold = unfolded()
    listing().find = "kick_low_top"
    yield from drawn()
    window.picture(PICTURES / "library-annotated.png")
    yield from press("save_words")
    yield from until((folder / "kick_low_top.txt").is_file)
    yield from settled()
    assert "kick right" in (folder / "kick_low_top.txt").read_text()
    before = (folder / "kick_low_top.txt").read_text()
    run("beyond_mocap.propose_words", least=0.9)
    run("beyond_mocap.save_words")  # asks
    yield 1.0
    window.picture(PICTURES / "library-asks.png")
    yield from window.press("ESC")
    yield 0.5
    assert (folder / "kick_low_top.txt").read_text() == before
    run("beyond_mocap.remove_clip")
    assert "kick_low_top" not in bpy.data.objects and "kick_low_top" not in bpy.data.armatures
    listing().find = ""
    fold()
    area.type = kind
    del rig


def check_words_are_judged_by_keys():
    folder = yield from opened("judged")
    (folder / "kick_low_top.txt").unlink()
    run("beyond_mocap.list_clips", "EXEC_DEFAULT")
    run("beyond_mocap.learn_words")
    yield from settled()
    yield from until(lambda: settings().words_model, what="words are learned")
    run("beyond_mocap.annotate_clip", path="kick_low_top.bvh")
    yield from settled()
    run("beyond_mocap.propose_words", review=True)
    yield from settled()
    group = bpy.context.object.beyond_mocap_proposals
    kick = next(index for index, one in enumerate(group.listed) if "kick" in one.name)
    assert group.listed[kick].source == "learned", group.listed[kick].source
    group.active = 0
    fold = unfolded()
    yield from drawn()
    window.picture(PICTURES / "library-proposals.png")
    view = window.area("VIEW_3D")
    yield from window.move(view.x + view.width // 3, view.y + view.height // 2)
    run("beyond_mocap.review_proposals")
    yield 0.5
    for index in range(len(group.listed)):
        group = bpy.context.object.beyond_mocap_proposals
        before = group.active
        yield from window.press("A" if "kick" in group.listed[before].name else "X")
        yield 0.3
    group = bpy.context.object.beyond_mocap_proposals
    told = [(one.name, one.state) for one in group.listed]
    assert [state for name, state in told] == [
        "ACCEPTED" if "kick" in name else "REFUSED" for name, _ in told], told
    yield from drawn()
    window.picture(PICTURES / "library-judged.png")
    yield from press("save_words")
    yield from until((folder / "kick_low_top.txt").is_file)
    assert "# learned" in (folder / "kick_low_top.txt").read_text()
    run("beyond_mocap.remove_clip")
    settings().words_model = ""
    fold()


def check_assets_have_pictures():
    yield from opened("assets")
    run("beyond_mocap.list_clips", "EXEC_DEFAULT")
    listing().find = "kick"
    run("beyond_mocap.make_assets", which="SHOWN")
    yield from settled()
    yield from until(lambda: len([a for a in bpy.data.actions if a.asset_data]) == 3)
    listing().find = ""
    area = window.area("VIEW_3D")
    area.ui_type = "ASSETS"
    yield 2.0
    area.spaces.active.params.asset_library_reference = "LOCAL"
    yield 2.0
    window.picture(PICTURES / "library-assets.png")
    area.ui_type = "VIEW_3D"
    yield 0.5
