"""Players: import their tracking data, choose, place and remove them."""

from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty

from ..beyond_mocap.base.errors import InputError
from ..beyond_mocap.base.fixes import Fix
from ..scene.characters import player_character
from ..scene.core import frame_range, notices
from ..scene.core.settings import find_active_player, to_absolute_path, to_setting_path
from ..scene.match.settings import AUTO, PROVIDER_ITEMS
from ..scene.player import dots, pins, tracks
from ..scene.result import ball_tracks, preview
from ..scene.timeline import label_checks as word_checks
from ..scene.timeline import strip_events, strips
from .operator_base import BaseOperator, ImportOperator, ViewDropHandler

SHIRTS = {"home": ((0.75, 0.05, 0.06), (0.80, 0.30, 0.04)), "away": ((0.04, 0.14, 0.70), (0.02, 0.45, 0.60))}
MOST_OFFERED = 3  # text files that are offered as a player's labels
SECTION_SECONDS = 60.0  # seconds of a whole match that are selected at first


class BEYOND_MOCAP_OT_import_tracking(ImportOperator, bpy.types.Operator):
    """Import players' positions: CSV files with time_s, x_m, y_m, or a provider's tracking file (TRACAB, Metrica,
SkillCorner, Sportec, Second Spectrum, Stats Perform, Common Data Format, GPS and others); a text file with the name of
a CSV is read as its labels"""

    bl_idname = "beyond_mocap.import_tracking"
    bl_label = "Import Tracking"
    presents = True
    filename_ext = ".csv"
    filter_glob: StringProperty(default="*.csv;*.txt;*.dat;*.json;*.jsonl;*.xml;*.gpx", options={"HIDDEN"})
    metadata: StringProperty(
        name="Metadata", subtype="FILE_PATH",
        description="The provider's second file; empty finds one with a matching name beside the tracking file",
    )
    provider: EnumProperty(name="Provider", items=PROVIDER_ITEMS, description="Provider whose format the file has")

    def list_paths(self) -> list[str]:
        """List the chosen files, without label files beside a chosen CSV, which are imported with it."""
        chosen = self.list_chosen_files()
        if not chosen:
            raise InputError("import", "no file given", "a tracking file", "choose one")
        from ..beyond_mocap.annotation.label_candidates import find_track_labels

        words = {find_track_labels(path) for path in chosen if path.suffix.lower() == ".csv"}
        return [str(path) for path in chosen if path not in words]

    def read_files(self, provider):
        """Read all files, as path, players and notes; one that an earlier one has brought with it is left out, as the
        receivers of a squad do.
        """
        known = set()
        for path in self.list_paths():
            found, notes = tracks.list_players(path, self.metadata, provider)
            people = Path(path).parent, frozenset(player.feed_id or path for player in found)
            if people not in known:
                known.add(people)
                yield path, found, notes

    def do(self, context):
        """Read all files, then add the players."""
        self.offers = []
        settings = context.scene.beyond_mocap
        provider = "" if self.provider == AUTO else self.provider
        read = list(self.read_files(provider))
        if not settings.players:
            self.set_clock(settings, [player for _, found, _ in read for player in found])
        for path, found, notes in read:
            for player in found:
                self.add_player(settings, path, player, provider)
            for note in notes:
                self.report({"INFO"}, note)
        settings.active_player = len(settings.players) - sum(len(found) for _, found, _ in read)
        for player in list(settings.players)[settings.active_player :]:
            self.create_dot(context, player)
        self.extend_scene(context.scene, list(settings.players)[settings.active_player :])
        if self.offers and self.is_pressed():
            notices.show_notices(min(self.offers))
        self.report({"INFO"}, f"Players in the list: {len(settings.players)}")

    @staticmethod
    def set_clock(settings, found):
        """Start the clock with the first players at the start frame; of a whole match the first minute is selected."""
        settings.start_time = min(player.start for player in found)
        if any(player.feed_id for player in found):
            settings.section_start = settings.start_time
            settings.section_end = min(settings.start_time + SECTION_SECONDS, max(player.end for player in found))

    def create_dot(self, context, player):
        """Create the player's dot, with the player's labels as strips.

        A player without a track in the section or with labels that cannot be read stays in the list, with a warning.
        """
        try:
            dots.ensure_dot(context, player)
            if player.annotation_file:
                track = tracks.read_track(context.scene.beyond_mocap, player)
                words = strips.read_written_labels(player, context.scene.beyond_mocap.rate, track)
                strips.write_player_timeline(context, player, words)
                self.report_labels(context.scene, player, words)
            elif not player.feed_id:
                self.report({"INFO"}, f"{player.name}: no label file beside the track; gaits follow its speed")
                self.offer_labels(context, player)
        except InputError as error:
            self.report({"WARNING"}, str(error))

    def offer_labels(self, context, player):
        """Offer text files beside the track that may have the player's labels under another name."""
        from ..beyond_mocap.annotation.label_candidates import find_label_candidates

        path = to_absolute_path(player.tracking_file)
        found = find_label_candidates(path)
        if not found:
            return
        names = " or ".join(file.name for file in found[:MOST_OFFERED])
        fixes = *(Fix("use_labels", str(file)) for file in found[:MOST_OFFERED]), Fix("choose_labels")
        error = InputError(player.name, f"no file {Path(path).with_suffix('.txt').name} beside the track",
                           "", f"the file {names} may have its labels", fixes=fixes)
        subject = notices.Subject(topic=f"labels {player.name}", room=self.find_room(), title=self.bl_label,
                                  player=player.name)
        self.offers.append(notices.post_notice(context.scene, subject, error, is_error=False))
        self.report({"INFO"}, str(error))

    def report_labels(self, scene, player, words):
        """Report the labels of the timeline and their problems."""
        source = Path(player.annotation_file).name
        self.report({"INFO"}, f"{player.name}: {strips.describe_counts(words)} from {source}")
        for frame, line in word_checks.list_problems(scene, player.dot):
            self.report({"WARNING"}, f"{player.name}, frame {frame}: {line}")

    def extend_scene(self, scene, players):
        """Extend the scene to the end of the imported tracks, so that all of them play during annotation."""
        before = scene.frame_end
        for player in players:
            frames = dots.find_key_range(player.dot) if player.use and player.dot is not None else None
            if frames is not None:
                frame_range.fit_range(scene, frames[1], dots.list_dots(scene))
        if scene.frame_end != before:
            self.report({"INFO"}, f"Scene end set to frame {scene.frame_end}, the end of the tracks")

    def add_player(self, settings, path: str, found: "tracks.PlayerInFile", provider: str):
        """Add one player to the list; of a whole match only the first is selected."""
        from ..beyond_mocap.annotation.label_candidates import find_track_labels

        entry = settings.players.add()
        entry.name = find_free_name(found.name, {player.name for player in settings.players})
        entry.tracking_file, entry.metadata_file = to_setting_path(path), to_setting_path(
            self.metadata) if self.metadata else ""
        entry.feed_id, entry.provider = found.feed_id, provider
        same_file = [player for player in settings.players if player.tracking_file == entry.tracking_file]
        entry.use = not found.feed_id or len(same_file) == 1
        team = found.team if found.feed_id else ("home", "away")[(len(settings.players) - 1) % 2]
        entry.shirt = SHIRTS.get(team, SHIRTS["home"])[0 if found.feed_id else (len(settings.players) - 1) // 2 % 2]
        if not found.feed_id and (labels := find_track_labels(path)):
            entry.annotation_file = to_setting_path(str(labels))


def choose_shirt(number: int) -> tuple[float, float, float]:
    """Choose the colour of the player with that number in a list whose players belong to no team."""
    return SHIRTS[("home", "away")[number % 2]][number // 2 % 2]


def find_free_name(name_base: str, taken: set[str]) -> str:
    """Return `name_base`, or the first of "NAME 2", "NAME 3" ... that is not taken."""
    number, name = 1, name_base
    while name in taken:
        number += 1
        name = f"{name_base} {number}"
    return name


class BEYOND_MOCAP_FH_tracking(ViewDropHandler, bpy.types.FileHandler):
    """Tracking files dropped into the 3D view"""

    bl_idname = "BEYOND_MOCAP_FH_tracking"
    bl_label = "Player Tracking"
    bl_import_operator = "beyond_mocap.import_tracking"
    bl_file_extensions = ".csv;.json;.jsonl;.xml;.dat;.gpx"


class BEYOND_MOCAP_OT_choose_player(BaseOperator, bpy.types.Operator):
    """Make this player active and select the player's dot; in the NLA editor, show only the selected strips"""

    bl_idname = "beyond_mocap.choose_player"
    bl_label = "Show Player's Strips"
    player: StringProperty(name="Player", options={"SKIP_SAVE"},
                           description="The player's name; empty uses the active player")
    needs = ("Switch to Object Mode first", lambda context: context.mode == "OBJECT",
             "Import tracking in step 2 first", lambda context: len(context.scene.beyond_mocap.players) > 0)

    def do(self, context):
        settings = context.scene.beyond_mocap
        active = settings.players[min(settings.active_player, len(settings.players) - 1)]
        player = settings.players.get(self.player) if self.player else active
        if player is None:
            raise InputError("player", f"{self.player!r} is not in the list", "a player in the list")
        strips.show_player(context, player)
        if context.area is not None and context.area.type == "NLA_EDITOR":
            context.space_data.dopesheet.show_only_selected = True


class BEYOND_MOCAP_OT_place_players(BaseOperator, bpy.types.Operator):
    """Add a dot that follows the track for every player without one, and their labels as strips on it; files of earlier
versions need this once"""

    bl_idname = "beyond_mocap.place_players"
    bl_label = "Add to Timeline"
    needs = ("All players have strips already",
             lambda context: any(strips.find_dot(player, context.scene) is None
                                 for player in context.scene.beyond_mocap.players))

    def do(self, context):
        """Read all tracks and labels, then place the players that could be read, and report the others."""
        settings, read = context.scene.beyond_mocap, []
        errors = []
        for player in settings.players:
            if strips.find_dot(player, context.scene) is not None:
                continue
            try:
                read.append((player, strips.read_written_labels(player, settings.rate,
                                                                tracks.read_track(settings, player))))
            except InputError as error:
                errors.append((player.name, error))
        if not read:
            name, error = errors[0]
            found, next_step = error.parts
            raise InputError("timeline", f"no player could be added, the first is {name}: {found}", next_step=next_step)
        for player, timeline in read:
            strips.write_player_timeline(context, player, timeline)
        for name, error in errors:
            self.report({"WARNING"}, f"{name}: {error}")
        self.report({"INFO"}, f"Players added to the timeline: {len(read)}")


class BEYOND_MOCAP_OT_player_from_dot(BaseOperator, bpy.types.Operator):
    """Add players for the selected dots that belong to none, such as dots appended from another file, with their
strips"""

    bl_idname = "beyond_mocap.player_from_dot"
    bl_label = "Add Player from Dot"
    needs = "Select a dot that was appended from another file first", lambda context: bool(
        dots.list_orphan_dots(context))

    def do(self, context):
        """Add a player for each; the strips follow this scene's clock."""
        settings = context.scene.beyond_mocap
        found = dots.list_orphan_dots(context)
        if not settings.players:
            settings.start_time = min(dots.find_first_second(dot) for dot in found)
        for dot in found:
            name = find_free_name(dot.beyond_mocap_dot.player, {player.name for player in settings.players})
            dots.add_player_for_dot(settings, dot, name)
        strip_events.normalize_strips(context.scene)
        self.report({"INFO"}, f"Players in the list: {len(settings.players)}")


class BEYOND_MOCAP_OT_remove_player(BaseOperator, bpy.types.Operator):
    """Remove the active player with dot, pins and label strips; armature, action and drawn curve stay in the scene, and
a preview is applied"""

    bl_idname = "beyond_mocap.remove_player"
    bl_label = "Remove Player"
    needs = "No players in the list", lambda context: find_active_player(context.scene.beyond_mocap) is not None

    def do(self, context):
        """Remove the player and choose the next one."""
        settings = context.scene.beyond_mocap
        player = settings.players[settings.active_player]
        if player.result.state == "PREVIEW" and preview.is_shown(context.scene, player):
            preview.apply_preview(context, player,
                                  "ACTION")  # otherwise the data set aside for the preview would be lost
        elif player.result.state == "PREVIEW":
            preview.drop_preview(player)
        pins.remove_all_pins(player)
        dots.remove_dot(context.scene, player)
        notices.clear_player_notices(context.scene, player.name)
        settings.players.remove(settings.active_player)
        settings.active_player = max(0, min(settings.active_player, len(settings.players) - 1))
        ball_tracks.post_difference(context.scene)


def has_character(context) -> bool:
    """Whether the active player has a character and a motion."""
    player = find_active_player(context.scene.beyond_mocap)
    return player is not None and player.character is not None and player.body is not None


class BEYOND_MOCAP_OT_update_character(BaseOperator, bpy.types.Operator):
    """Give the active player's character the present motion of their body, such as after editing its keys"""

    bl_idname = "beyond_mocap.update_character"
    bl_label = "Update Body"
    needs = "Synthesize, then choose a character for the active player", has_character

    def do(self, context):
        player = find_active_player(context.scene.beyond_mocap)
        lines = player_character.show_character(context, player)
        player.character_note = "\n".join(lines)
        self.report({"INFO"}, f"{player.character.name} plays the motion of {player.name}")
