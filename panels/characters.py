"""A character of the file as the body of a player or of a match's teams: what the panels of both draw about it."""

from __future__ import annotations

from .tab import create_value_column, draw_header, draw_paragraph

TEAMS = ("home", "away", "referee", "keeper")


def draw_player_character(layout, player) -> None:
    """Draw a player's character with its kit."""
    if body := draw_header(layout, "player_character", "Character"):
        create_value_column(body).prop(player, "character", text="Body", placeholder="Built-in")
        draw_kit(body, player.character)
        draw_note(body, player.character_note)
        row = body.row()
        row.active = player.character is not None
        row.operator("beyond_mocap.update_character", icon="FILE_REFRESH")


def draw_team_characters(layout, match) -> None:
    """Draw the teams' characters with their kits."""
    if body := draw_header(layout, "match_characters", "Characters"):
        column, drawn = create_value_column(body), []
        for team in TEAMS:
            column.prop(match, f"{team}_character", placeholder="Team's" if team == "keeper" else "Built-in")
        for team in TEAMS:
            character = getattr(match, f"{team}_character")
            if character is not None and character not in drawn:
                body.label(text=character.name, icon="OUTLINER_OB_ARMATURE")
                draw_kit(body, character)
                drawn.append(character)
        draw_note(body, match.character_note)


def draw_kit(layout, character) -> None:
    """Draw which materials of a character are its kit."""
    if character is None:
        return
    column = create_value_column(layout)
    for part in ("shirt", "shorts", "socks"):
        column.prop(character.beyond_mocap_character, part, placeholder="By Name")


def draw_note(layout, note: str) -> None:
    """Draw what is wrong with a character."""
    for line in note.splitlines():
        draw_paragraph(layout, line, "ERROR")
