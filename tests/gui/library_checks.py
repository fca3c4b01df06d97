"""The library panel in a real window: the list, the watched folder, other file forms, dropped files, words, assets."""

import shutil
import time

import bpy
from tab import (
    PICTURES,
    TAB,
    click_operator,
    copy_sample,
    get_settings,
    import_module,
    is_moving,
    open_task,
    output,
    report_time,
    run_operator,
    wait_until,
    wait_until_settled,
    window,
)
from window import draw_unfolded


def get_clip_list():
    """The list of clips."""
    return bpy.context.window_manager.beyond_mocap_clips


def open_sample(name="library"):
    """The sample, freshly opened, with a library of its own (a copy) and the tab in front."""
    bpy.ops.wm.open_mainfile(filepath=str(copy_sample() / "quickstart.blend"))
    yield 1.0
    folder = PICTURES.resolve() / f"library-{name}"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(copy_sample() / "library", folder, ignore=shutil.ignore_patterns(".beyond_mocap"))
    get_settings().library_folder = str(folder)
    yield from window.open_tab(window.find_area("VIEW_3D"), TAB)
    yield from open_task("LIBRARY")
    return folder


def unfold_step():
    """The panel Library with all that it can unfold; returns what folds it again."""
    fold = draw_unfolded(
        next(panel for panel in bpy.types.Panel.__subclasses__() if panel.__name__ == "BEYOND_MOCAP_PT_library")
    )
    window.find_area("VIEW_3D").tag_redraw()
    return fold


def check_the_list_and_its_buttons():
    folder = yield from open_sample()
    run_operator("beyond_mocap.build_library")
    yield from wait_until_settled()
    yield from wait_until(lambda: get_clip_list().total == 43 and not get_clip_list().missing,
                          what=lambda: get_clip_list().total)
    fold = unfold_step()
    yield from wait_for_drawing()
    window.save_picture(PICTURES / "library-list.png")
    get_clip_list().find = "kick"
    yield from wait_for_drawing()
    window.save_picture(PICTURES / "library-found.png")
    yield from click_operator("import_clip")
    yield from wait_until(
        lambda: bpy.context.object and bpy.context.object.name.startswith("kick"), what=lambda: bpy.context.object
    )
    assert is_moving(bpy.context.object), bpy.context.object
    window.save_picture(PICTURES / "library-imported.png")
    shutil.move(folder, folder.with_name("library-moved"))
    get_settings().library_watch = True
    yield from wait_until(lambda: get_clip_list().missing, what="the folder is gone")
    yield from wait_for_drawing()
    window.save_picture(PICTURES / "library-missing.png")
    fold()
    shutil.rmtree(folder.with_name("library-moved"))


def wait_for_drawing():
    """Panels have moved to where they belong: they glide there while the region is drawn again and again."""
    for _ in range(8):
        window.find_sidebar(window.find_area("VIEW_3D")).tag_redraw()
        yield 0.2


def check_news_are_told_and_nothing_is_built():
    folder = yield from open_sample("watched")
    run_operator("beyond_mocap.build_library", "EXEC_DEFAULT")
    get_settings().library_watch = True
    yield 1.0
    for number in range(3):
        shutil.copy(folder / "walking_1_2.bvh", folder / f"new_{number}.bvh")
    yield from wait_until(lambda: get_clip_list().news == "3 new clips",
                          what=lambda: get_clip_list().news)  # it may be read between two
    assert get_clip_list().total == 43, get_clip_list().total
    yield 0.5
    window.save_picture(PICTURES / "library-news.png")


def check_ten_thousand_files_do_not_freeze_the_window():
    folder = yield from open_sample("large")
    for number in range(100):
        (folder / f"{number:03}").mkdir()
        for other in range(100):
            (folder / f"{number:03}" / f"{other:03}.bvh").touch()
    yield 2.0
    start = time.perf_counter()
    run_operator("beyond_mocap.list_clips")
    yield from wait_until_settled()
    yield from wait_until(lambda: get_clip_list().total > 10000, what=lambda: get_clip_list().total)
    output.write_line(f"     listed {get_clip_list().total} clips in {time.perf_counter() - start:.2f} s")
    get_settings().library_watch = True
    fold, spent = unfold_step(), []
    panel = next(panel for panel in bpy.types.Panel.__subclasses__() if panel.__name__ == "BEYOND_MOCAP_PT_library")
    drawn = panel.draw

    def timed(self, context):
        begun = time.perf_counter()
        drawn(self, context)
        spent.append(time.perf_counter() - begun)

    panel.draw = timed
    longest, last, end = 0.0, time.monotonic(), time.monotonic() + 12.0
    while time.monotonic() < end:
        window.find_area("VIEW_3D").tag_redraw()
        yield 0.02
        now = time.monotonic()
        longest, last = max(longest, now - last), now
    panel.draw = drawn
    fold()
    spent.sort()
    output.write_line(f"     drawn {len(spent)} times, {1000 * spent[len(spent) // 2]:.1f} ms in the median; longest "
                      f"wait {longest:.2f} s")
    assert get_clip_list().total == 10043
    report_time("the panel, s", spent[len(spent) // 2], 0.005)
    report_time("longest wait, s", longest, 3.0)
    get_settings().library_watch = False
    shutil.rmtree(folder)


def check_clips_of_other_forms_are_converted():
    folder = yield from open_sample("forms")
    for name, export in (("walking_1_2", export_fbx), ("jogging_2_9", export_glb)):
        run_operator("beyond_mocap.import_clips", "EXEC_DEFAULT", filepath=str(folder / f"{name}.bvh"))
        export(folder / name)
        (folder / f"{name}.bvh").unlink()
    (folder / "broken.fbx").write_bytes(b"no such thing")
    yield 0.5
    run_operator("beyond_mocap.build_library")
    yield from wait_until_settled()
    yield from wait_until(lambda: get_clip_list().total)
    paths = [clip.path for clip in get_clip_list().shown]
    assert "walking_1_2.fbx" in paths and "jogging_2_9.glb" in paths and "broken.fbx" not in paths, paths
    assert window.window.scene.name != "Import" and "Import" not in bpy.data.scenes
    get_settings().library_folder = get_settings().library_folder  # as a user who types the same again
    run_operator("beyond_mocap.import_clip", "EXEC_DEFAULT", path="walking_1_2.fbx")
    assert is_moving(bpy.context.object)


def export_fbx(path):
    """Export what is selected."""
    bpy.ops.export_scene.fbx(filepath=str(path) + ".fbx", use_selection=True, add_leaf_bones=False,
                             bake_anim_use_all_actions=False, bake_anim_use_nla_strips=False)


def export_glb(path):
    """Export what is selected."""
    bpy.ops.export_scene.gltf(filepath=str(path) + ".glb", export_format="GLB", use_selection=True)


def drop_files(folder, *names):
    """Files dropped into the 3D view."""
    area = window.find_area("VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        bpy.ops.wm.drop_import_file("INVOKE_DEFAULT", directory=str(folder), files=[{"name": name} for name in names])


def check_dropped_files():
    folder = yield from open_sample("dropped")
    yield from window.move_pointer(700, 400)
    drop_files(folder, "walking_1_2.bvh")
    yield from wait_until(lambda: bpy.context.object and bpy.context.object.name.startswith("walking_1_2"))
    export_glb(folder / "dropped")
    count = len(bpy.data.objects)
    drop_files(folder, "dropped.glb")
    yield 1.0
    window.save_picture(PICTURES / "library-drop-menu.png")  # Blender asks: its own importer or this one
    assert len(bpy.data.objects) == count
    yield from window.press_key("ESC")
    run_operator("beyond_mocap.import_clips", "EXEC_DEFAULT", directory=str(folder), files=[{"name": "dropped.glb"}])
    assert bpy.context.object.name.startswith("dropped") and is_moving(bpy.context.object)
    words = folder / "words.txt"
    words.write_text("1 2 running\n")
    drop_files(folder, "words.txt")

    def spans():
        player = get_settings().players[get_settings().active_player]
        return [span.words for span in import_module("scene.timeline.strips").read_player_timeline(player,
                window.window.scene).spans]

    yield from wait_until(lambda: spans() == [("running",)], what=spans)


def check_a_clip_is_annotated():
    folder = yield from open_sample("annotated")
    (folder / "kick_low_top.txt").unlink()
    run_operator("beyond_mocap.list_clips", "EXEC_DEFAULT")
    run_operator("beyond_mocap.annotate_clip", path="kick_low_top.bvh")
    yield from wait_until_settled()
    run_operator("beyond_mocap.propose_words")
    yield from wait_until_settled()
    rig = bpy.context.object
    area = window.find_area("PROPERTIES")
    kind, area.type = area.type, "NLA_EDITOR"
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window.window, area=area, region=region):
        bpy.ops.nla.view_all()
    fold = unfold_step()
    get_clip_list().find = "kick_low_top"
    yield from wait_for_drawing()
    window.save_picture(PICTURES / "library-annotated.png")
    yield from click_operator("save_words")
    yield from wait_until((folder / "kick_low_top.txt").is_file)
    yield from wait_until_settled()
    assert "kick right" in (folder / "kick_low_top.txt").read_text()
    before = (folder / "kick_low_top.txt").read_text()
    run_operator("beyond_mocap.propose_words", least=0.9)
    run_operator("beyond_mocap.save_words")  # asks
    yield 1.0
    window.save_picture(PICTURES / "library-asks.png")
    yield from window.press_key("ESC")
    yield 0.5
    assert (folder / "kick_low_top.txt").read_text() == before
    run_operator("beyond_mocap.remove_clip")
    assert "kick_low_top" not in bpy.data.objects and "kick_low_top" not in bpy.data.armatures
    get_clip_list().find = ""
    fold()
    area.type = kind
    del rig


def check_words_are_judged_by_keys():
    folder = yield from open_sample("judged")
    (folder / "kick_low_top.txt").unlink()
    run_operator("beyond_mocap.list_clips", "EXEC_DEFAULT")
    run_operator("beyond_mocap.learn_words")
    yield from wait_until_settled()
    yield from wait_until(lambda: get_settings().words_model, what="words are learned")
    run_operator("beyond_mocap.annotate_clip", path="kick_low_top.bvh")
    yield from wait_until_settled()
    run_operator("beyond_mocap.propose_words", review=True)
    yield from wait_until_settled()
    group = bpy.context.object.beyond_mocap_proposals
    kick = next(index for index, one in enumerate(group.listed) if "kick" in one.name)
    assert group.listed[kick].source == "learned", group.listed[kick].source
    group.active = 0
    fold = unfold_step()
    yield from wait_for_drawing()
    window.save_picture(PICTURES / "library-proposals.png")
    view = window.find_area("VIEW_3D")
    yield from window.move_pointer(view.x + view.width // 3, view.y + view.height // 2)
    run_operator("beyond_mocap.review_proposals")
    yield 0.5
    for index in range(len(group.listed)):
        group = bpy.context.object.beyond_mocap_proposals
        before = group.active
        yield from window.press_key("A" if "kick" in group.listed[before].name else "X")
        yield 0.3
    group = bpy.context.object.beyond_mocap_proposals
    told = [(one.name, one.state) for one in group.listed]
    assert [state for name, state in told] == [
        "ACCEPTED" if "kick" in name else "REFUSED" for name, _ in told], told
    yield from wait_for_drawing()
    window.save_picture(PICTURES / "library-judged.png")
    yield from click_operator("save_words")
    yield from wait_until((folder / "kick_low_top.txt").is_file)
    assert "# learned" in (folder / "kick_low_top.txt").read_text()
    run_operator("beyond_mocap.remove_clip")
    get_settings().words_model = ""
    fold()


def check_assets_have_pictures():
    yield from open_sample("assets")
    run_operator("beyond_mocap.list_clips", "EXEC_DEFAULT")
    get_clip_list().find = "kick"
    run_operator("beyond_mocap.make_assets", which="SHOWN")
    yield from wait_until_settled()
    yield from wait_until(lambda: len([a for a in bpy.data.actions if a.asset_data]) == 3)
    get_clip_list().find = ""
    area = window.find_area("VIEW_3D")
    area.ui_type = "ASSETS"
    yield 2.0
    area.spaces.active.params.asset_library_reference = "LOCAL"
    yield 2.0
    window.save_picture(PICTURES / "library-assets.png")
    area.ui_type = "VIEW_3D"
    yield 0.5
