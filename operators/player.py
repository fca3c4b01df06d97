"""Players: import their tracking data, choose, place and remove them."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.files.tracking.providers import PROVIDERS
from ..scene.core.settings import active_player, as_setting
from ..scene.player import dots, pins, tracks
from ..scene.result import bake, preview
from ..scene.timeline import strip_events, strips, word_checks
from ..scene.timeline.strips import show_player
from .verb import DroppedIntoView, ImportVerb, Verb

SHIRTS = {"home": ((0.75, 0.05, 0.06), (0.80, 0.30, 0.04)), "away": ((0.04, 0.14, 0.70), (0.02, 0.45, 0.60))}
SECTION = 60.0  # seconds of a whole match that are taken at first


class BEYOND_MOCAP_OT_import_tracking(ImportVerb, bpy.types.Operator):
    """Import players' positions: CSV files with time_s, x_m, y_m, or a provider's tracking file (TRACAB, Metrica,
SkillCorner, Sportec, Second Spectrum, Stats Perform). A text of the same name beside a CSV is taken as its words"""

    bl_idname = "beyond_mocap.import_tracking"
    bl_label = "Import Tracking"
    filename_ext = ".csv"
    filter_glob: StringProperty(default="*.csv;*.txt;*.dat;*.json;*.jsonl;*.xml", options={"HIDDEN"})
    metadata: StringProperty(
        name="Metadata", subtype="FILE_PATH",
        description="The provider's second file; where empty, one beside the tracking file whose name fits is taken",
    )
    provider: EnumProperty(name="Provider",
                           items=[("AUTO", "Guess", "By what the file looks like")]
                           + [(one.name, one.title, one.files.replace("`", "")) for one in PROVIDERS.values()],
                           description="Whose form the file has")

    def paths(self) -> list[str]:
        """The chosen files, without the words that lie beside a chosen CSV and come along with it."""
        chosen = self.chosen()
        if not chosen:
            raise InputError("import", "no file given", "a tracking file", "choose one")
        words = {path.with_suffix(".txt") for path in chosen if path.suffix.lower() == ".csv"}
        return [str(path) for path in chosen if path not in words]

    def do(self, context):
        """Read all files, then fill the list."""
        settings = context.scene.beyond_mocap
        provider = "" if self.provider == "AUTO" else self.provider
        read = [(path, *tracks.players_in(path, self.metadata, provider)) for path in self.paths()]
        if not settings.players:
            self.set_clock(settings, [player for _, found, _ in read for player in found])
        for path, found, notes in read:
            for player in found:
                self.add(settings, path, player, provider)
            for note in notes:
                self.report({"INFO"}, note)
        settings.active_player = len(settings.players) - sum(len(found) for _, found, _ in read)
        for player in list(settings.players)[settings.active_player :]:
            self.place(context, player)
        self.lengthen(context.scene, list(settings.players)[settings.active_player :])
        self.report({"INFO"}, f"players in the list: {len(settings.players)}")

    @staticmethod
    def set_clock(settings, found):
        """The first players' clock starts with the start frame; of a whole match the first minute is chosen."""
        settings.start_time = min(player.start for player in found)
        if any(player.feed_id for player in found):
            settings.section_start = settings.start_time
            settings.section_end = min(settings.start_time + SECTION, max(player.end for player in found))

    def place(self, context, player):
        """The player's dot, and his words as strips; a player without a track in the section or with words that cannot
        be read stays in the list and is told."""
        try:
            dots.ensure(context, player)
            if player.annotation_file:
                track = tracks.read_track(context.scene.beyond_mocap, player)
                words = strips.written_words(player, context.scene.beyond_mocap.rate, track)
                strips.write(context, player, words)
                self.tell_words(context.scene, player, words)
            elif not player.feed_id:
                self.report({"INFO"}, f"{player.name}: no words beside the track, so gaits by speed until you add some")
        except InputError as error:
            self.report({"WARNING"}, str(error))

    def tell_words(self, scene, player, words):
        """What came to the timeline, and what is wrong with it."""
        found = f"{len(words.keys)} key moments, {len(words.spans)} stretches"
        self.report({"INFO"}, f"{player.name}: words from {Path(player.annotation_file).name}: {found}")
        for frame, line in word_checks.lines_of(scene, player.dot):
            self.report({"WARNING"}, f"{player.name}, frame {frame}: {line}")

    def lengthen(self, scene, players):
        """Let the scene reach to the end of what has been imported, so that all of it plays while it is annotated."""
        before = scene.frame_end
        for player in players:
            frames = dots.keyed_frames(player.dot) if player.use and player.dot is not None else None
            if frames is not None:
                bake.lengthen(scene, frames[1])
        if scene.frame_end != before:
            self.report({"INFO"}, f"the scene ends at frame {scene.frame_end} now, with the tracks")

    def add(self, settings, path: str, found: tracks.Found, provider: str):
        """One more player in the list; of a whole match only the first is ticked."""
        entry = settings.players.add()
        entry.name = free_name(found.name, {player.name for player in settings.players})
        entry.tracking_file, entry.metadata_file = as_setting(path), as_setting(self.metadata) if self.metadata else ""
        entry.feed_id, entry.provider = found.feed_id, provider
        same_file = [player for player in settings.players if player.tracking_file == entry.tracking_file]
        entry.use = not found.feed_id or len(same_file) == 1
        team = found.team if found.feed_id else ("home", "away")[(len(settings.players) - 1) % 2]
        entry.shirt = SHIRTS.get(team, SHIRTS["home"])[0 if found.feed_id else (len(settings.players) - 1) // 2 % 2]
        words = Path(path).with_suffix(".txt")
        if not found.feed_id and words.is_file() and words != Path(path):
            entry.annotation_file = as_setting(str(words))


def shirt_for(number: int) -> tuple[float, float, float]:
    """The colour of the player with that number in a list whose players belong to no team."""
    return SHIRTS[("home", "away")[number % 2]][number // 2 % 2]


def free_name(wanted: str, taken: set[str]) -> str:
    """`wanted`, or the first "wanted 2", "wanted 3" ... that is not taken."""
    number, name = 1, wanted
    while name in taken:
        number += 1
        name = f"{wanted} {number}"
    return name


class BEYOND_MOCAP_FH_tracking(DroppedIntoView, bpy.types.FileHandler):
    """Tracking files dropped into the 3D view"""

    bl_idname = "BEYOND_MOCAP_FH_tracking"
    bl_label = "Player tracking"
    bl_import_operator = "beyond_mocap.import_tracking"
    bl_file_extensions = ".csv;.json;.jsonl;.xml;.dat"


class BEYOND_MOCAP_OT_choose_player(Verb, bpy.types.Operator):
    """Make this player the active one and select his dot; pressed in the NLA editor, that shows the selected only"""

    bl_idname = "beyond_mocap.choose_player"
    bl_label = "Show Player's Strips"
    player: StringProperty(name="Player", options={"SKIP_SAVE"},
                           description="The player's name; empty is the active one")
    needs = ("Leave the mode that you are in first", lambda context: context.mode == "OBJECT",
             "Import tracking in step 2 first", lambda context: len(context.scene.beyond_mocap.players) > 0)

    def do(self, context):
        settings = context.scene.beyond_mocap
        active = settings.players[min(settings.active_player, len(settings.players) - 1)]
        player = settings.players.get(self.player) if self.player else active
        if player is None:
            raise InputError("player", f"{self.player!r} is not in the list", "a player in the list")
        show_player(context, player)
        if context.area is not None and context.area.type == "NLA_EDITOR":
            context.space_data.dopesheet.show_only_selected = True


class BEYOND_MOCAP_OT_place_players(Verb, bpy.types.Operator):
    """Give every player without one a dot that runs along the track, and lay the words of his text or file on it as
strips. Files of earlier versions need this once; texts and files stay as they are"""

    bl_idname = "beyond_mocap.place_players"
    bl_label = "Bring to the Timeline"
    needs = ("Every player in the list has strips already",
             lambda context: any(strips.dot_of(player, context.scene) is None
                                 for player in context.scene.beyond_mocap.players))

    def do(self, context):
        """Read all tracks and words, then place those that could be read, and tell the others."""
        settings, read = context.scene.beyond_mocap, []
        troubles = []
        for player in settings.players:
            if strips.dot_of(player, context.scene) is not None:
                continue
            try:
                read.append((player, strips.written_words(player, settings.rate, tracks.read_track(settings, player))))
            except InputError as error:
                troubles.append(f"{player.name}: {error}")
        if not read:
            raise InputError("no player could be brought to the timeline", troubles[0])
        for player, timeline in read:
            strips.write(context, player, timeline)
        for trouble in troubles:
            self.report({"WARNING"}, trouble)
        self.report({"INFO"}, f"players brought to the timeline: {len(read)}")


class BEYOND_MOCAP_OT_player_from_dot(Verb, bpy.types.Operator):
    """Make players of the selected dots that no player in the list has, such as those appended from another file; their
strips come along"""

    bl_idname = "beyond_mocap.player_from_dot"
    bl_label = "Add Player from Dot"
    needs = "Select a dot that was appended from another file first", lambda context: bool(dots.orphans(context))

    def do(self, context):
        """A player for each; his strips are laid for this scene's clock."""
        settings = context.scene.beyond_mocap
        found = dots.orphans(context)
        if not settings.players:
            settings.start_time = min(dots.first_second(dot) for dot in found)
        for dot in found:
            name = free_name(dot.beyond_mocap_dot.player, {player.name for player in settings.players})
            dots.adopt(settings, dot, name)
        strip_events.put_in_order(context.scene)
        self.report({"INFO"}, f"players in the list: {len(settings.players)}")


class BEYOND_MOCAP_OT_remove_player(Verb, bpy.types.Operator):
    """Take the active player off the list, with his dot, his pins and the strips of his words; armature, action and
what his track is drawn by stay in the scene, and a preview that he shows is kept"""

    bl_idname = "beyond_mocap.remove_player"
    bl_label = "Remove Player"
    needs = "The list of players is empty", lambda context: active_player(context.scene.beyond_mocap) is not None

    def do(self, context):
        """Remove it and choose its neighbour."""
        settings = context.scene.beyond_mocap
        player = settings.players[settings.active_player]
        if player.result.state == "PREVIEW" and preview.shown(context.scene, player):
            preview.keep(context, player, "ACTION")  # else nobody would know any more what has been set aside
        elif player.result.state == "PREVIEW":
            preview.forget(player)
        pins.remove_all(player)
        dots.remove(context.scene, player)
        settings.players.remove(settings.active_player)
        settings.active_player = max(0, min(settings.active_player, len(settings.players) - 1))
