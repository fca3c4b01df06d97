"""Rows of the lists of a passing scene: added, removed, moved up and down."""

from __future__ import annotations

import math

import bpy
from bpy.props import EnumProperty

from ..beyond_mocap.errors import InputError
from ..scene.measure import units_per_metre
from ..scene.passes import hits_shown, order, shown
from .verb import Verb

ROWS = (("players", "Players", "Who keeps the ball going"), ("passes", "Passes", "One after the other"))
WHAT = (
    ("ADD", "Add", "One more at the end"), ("REMOVE", "Remove", "The picked one"),
    ("UP", "Up", "The picked one earlier"), ("DOWN", "Down", "The picked one later"),
)  # fmt: skip
ACTIVE = {"players": "active_player", "passes": "active_pass"}
RING = 3.0  # metres from the 3D cursor at which players are added


class BEYOND_MOCAP_OT_passes_list(Verb, bpy.types.Operator):
    """Add, remove or move a player or a pass. A new player stands near the 3D cursor, or where the selected armature
stands, which becomes his body"""

    bl_idname = "beyond_mocap.passes_list"
    bl_label = "Players and Passes"

    rows: EnumProperty(name="List", items=ROWS, options={"SKIP_SAVE"}, description="Which list")
    what: EnumProperty(name="What", items=WHAT, options={"SKIP_SAVE"}, description="What to do")

    @classmethod
    def description(cls, _context, properties):
        """What this button does."""
        one = {"players": "player", "passes": "pass"}[properties.rows]
        if properties.what == "ADD" and one == "player":
            return (
                "Add a player near the 3D cursor; a selected armature that is nobody's yet becomes his body, and he "
                "stands where it does"
            )
        if properties.what == "ADD":
            return "Add a pass, from whoever gets the last one"
        moved = {"UP": "earlier", "DOWN": "later"}.get(properties.what)
        return f"Move the picked {one} {moved}" if moved else f"Remove the picked {one}"

    def do(self, context):
        """One of four things."""
        settings = context.scene.beyond_mocap_passes
        if self.what == "ADD":
            return add_player(context) if self.rows == "players" else add_pass(settings)
        rows, number = getattr(settings, self.rows), getattr(settings, ACTIVE[self.rows])
        if not 0 <= number < len(rows):
            raise InputError(self.rows, "none is picked", "a row of the list", "add one first")
        if self.what == "REMOVE":
            self.remove(settings, rows, number)
        else:
            self.move(settings, rows, number, number + (1 if self.what == "DOWN" else -1))

    def remove(self, settings, rows, number):
        """Take the row out; with a player his passes, his Empty and what the scene has made of him."""
        if self.rows == "players":
            shown.check(rows[number])
            shown.let_go(rows[number])
            name = rows[number].name
            for other in reversed(range(len(settings.passes))):
                if name in (settings.passes[other].who, settings.passes[other].to):
                    settings.passes.remove(other)
            order.remove_place(rows[number])
            settings.active_pass = max(0, min(settings.active_pass, len(settings.passes) - 1))
        else:
            order.remove_mark(rows[number].at)
        rows.remove(number)
        setattr(settings, ACTIVE[self.rows], max(0, min(number, len(rows) - 1)))

    def move(self, settings, rows, number, goal):
        """Exchange it with its neighbour."""
        if not 0 <= goal < len(rows):
            raise InputError(self.rows, "it is at the end of the list", "a row that can be moved that way")
        rows.move(number, goal)
        setattr(settings, ACTIVE[self.rows], goal)


def add_player(context) -> None:
    """One more player."""
    settings, scene = context.scene.beyond_mocap_passes, context.scene
    count, units = len(settings.players), units_per_metre(scene)
    body = context.view_layer.objects.active
    free = body is not None and body.type == "ARMATURE" and body.library is None and body.select_get()
    if free and not any(row.body == body for row in settings.players):
        place, facing = standing(scene, body)
        row = order.add_player(
            context, body.name if not _taken(settings, body.name) else order.free_name(settings), place, facing
        )
        row.body = body
        return
    angle = math.radians(90.0 + 120.0 * count) if count < 3 else math.radians(30.0 + 60.0 * (count - 3))
    ring = RING * (1.0 if count < 3 else 2.0)
    x, y = scene.cursor.location.x / units, scene.cursor.location.y / units
    order.add_player(
        context, order.free_name(settings), (x + ring * math.cos(angle), y + ring * math.sin(angle)), angle + math.pi
    )


def standing(scene, body) -> tuple[tuple[float, float], float]:
    """Where an armature stands now, and which way it looks."""
    from ..beyond_mocap.motion.humanoid import heading

    try:
        motion, first = hits_shown.motion_of(scene, body)
    except InputError:
        return order.stands(scene, body)
    row = min(max(scene.frame_current - first, 0), len(motion) - 1)
    return tuple(float(value) for value in motion.root_positions[row, :2]), float(heading(motion)[row])


def add_pass(settings) -> None:
    """One more pass, from who gets the last one to the next in the list."""
    names = [row.name for row in settings.players]
    if len(names) < 2:
        raise InputError("passes", f"{len(names)} players", "two or more", "add players first")
    last = settings.passes[-1] if len(settings.passes) else None
    row = settings.passes.add()
    row.who = last.to if last is not None and last.to in names else names[0]
    row.to = names[(names.index(row.who) + 1) % len(names)]
    if last is not None:
        row.kind, row.bounces = last.kind, last.bounces
    settings.active_pass = len(settings.passes) - 1


def _taken(settings, name: str) -> bool:
    return any(row.name == name for row in settings.players)
