"""The whole athlete: pieces meshed each as finely as they need, hemmed, stitched to one closed surface, weighted."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...base.easing import smoothstep
from ..landmarks import HEAD, SEGMENTS, SHOULDER
from ..look import HAIR_STYLES
from ..mesh import BOOTS, EYES, HAIR, PUPILS, SHIRT, SHORTS, SKIN, SOCKS, SOLES, TRIM
from ..template import Template
from . import clothes, head, limbs
from .fields import Field, mirror, place
from .meshing import Piece, compute_gradient, cut_piece, drop_unused, grade, keep_largest, mesh_field, project, relax
from .stitching import Surface
from .weights import compute_shares

SIZES = {  # m, edges of the faces of each piece: of the full body and the light one
    "head": (0.0066, 0.0150), "back": (0.0170, 0.0340), "shirt": (0.0270, 0.0640), "arm": (0.0200, 0.0430),
    "hand": (0.0074, 0.0270), "shorts": (0.0270, 0.0640), "leg": (0.0210, 0.0500), "sock": (0.0220, 0.0540),
    "boot": (0.0130, 0.0400), "hair": (0.0095, 0.0200), "brow": (0.0040, 0.0085),
}
SHIRT_HEM, SHORTS_HEM, SOCK_TOP, BOOT_TOP, SLEEVE_END, GLOVE_TOP = 0.885, 0.605, 0.462, 0.108, 0.185, 0.535
HAIR_BEHIND = -0.115  # m from the head's middle: what is further behind is a tail of hair
BAND = 0.020  # m, width of the edges of sleeves, shorts and socks
CROP = 0.0018, 0.0045  # m, cropped hair stands out of the skin at the hairline and within
LIPS = {SHIRT: 0.003, SHORTS: 0.003, SOCKS: 0.003, BOOTS: 0.004}
"""Metres of thickness at hems."""


def sculpt(light: bool) -> Template:
    """Sculpt the athlete.

    Args:
        light: about 2,000 faces in place of 12,000.
    """
    maker = _Maker(light)
    maker.add_body()
    count = len(maker.surface.vertices)
    parts = [0] * len(maker.surface.faces)
    for index, style in enumerate(HAIR_STYLES[:-1]):
        maker.add_hair(style)
        parts += [index + 1] * (len(maker.surface.faces) - len(parts))
    return _finish(maker.surface, np.array(parts), count)


class _Maker:
    """Makes the pieces and stitches them."""

    def __init__(self, light: bool):
        self.light, self.surface = light, Surface()
        self.head = head.build_head()

    def size(self, name: str) -> float:
        """Return the edge of the faces of a piece, m."""
        return SIZES[name][self.light]

    def tuck(self, depth: float) -> float:
        """Return how deep cloth goes on inside a hem, m: not at all in the light body."""
        return 0.0 if self.light else depth

    def make(self, name: str, solid: Field, axes, cuts, material: int) -> Piece:
        """Mesh a solid in a box, cut it where `cuts` are negative, and even it out.

        Args:
            name: key of SIZES.
            solid: the field.
            axes: lowest and highest corner (3,) m, or the grid's coordinates along each axis.
            cuts: fields.
            material: of its faces.
        """
        size = self.size(name)
        if len(axes) == 2:
            axes = [grade((low, size), (high, size)) for low, high in zip(*axes)]
        piece = mesh_field(solid, axes)
        relax(piece, solid, 6, 0.4 * size)
        for isoline in cuts:
            cut_piece(piece, solid, isoline, (None, material))
        keep_largest(piece)
        relax(piece, solid, 10, 0.4 * size)
        piece.materials = [material] * len(piece.faces)
        return piece

    def add_body(self) -> None:
        """Add all of the body but its hair."""
        neck = self._add_head()
        shirt = self._add_shirt(neck)
        for sign in (1.0, -1.0):
            self._add_arm(shirt, sign)
        tops = self._add_shorts(shirt)
        for sign in (1.0, -1.0):
            self._add_leg(tops, sign)
        for sign in (1.0, -1.0):
            self.surface.add(_make_eye(sign, self.light))
        for sign in (1.0, -1.0):
            low = HEAD + [0.05, 0.002 if sign > 0 else -0.068, 0.040]
            self.surface.add(self._make_hair_piece("brow", head.build_brows(self.head), (low, low + 0.066)))

    def _add_head(self) -> list[int]:
        """Add head and neck, finest in the face; return the neck's border."""
        fine, coarse = self.size("head"), self.size("back")
        x, y, z = HEAD
        axes = (grade((x - 0.135, coarse), (x - 0.03, coarse), (x + 0.06, fine), (x + 0.13, fine)),
                grade((y - 0.125, coarse), (y - 0.06, fine), (y + 0.06, fine), (y + 0.125, coarse)),
                grade((z - 0.187, coarse), (z - 0.10, coarse), (z - 0.06, fine), (z + 0.07, fine), (z + 0.175, coarse)))
        piece = self.make("head", self.head, axes, [lambda p: 0.030 - _measure_below_collar(p)], SKIN)
        self.scalp = Piece(piece.vertices.copy(), list(piece.faces), [HAIR] * len(piece.faces))
        return self.surface.add(piece)[0]

    def _add_shirt(self, neck: list[int]) -> dict[str, list[int]]:
        """Add the shirt with its collar; return the borders of hem and sleeves."""
        solid = clothes.build_shirt()
        cuts = [_measure_above_hem, _measure_below_collar,
                *[partial(_measure_sleeve, sign=sign, end=SLEEVE_END) for sign in (1.0, -1.0)]]
        box = np.array([-0.25, -0.46, 0.80]), np.array([0.25, 0.46, 1.62])
        piece = self.make("shirt", solid, box, cuts, SHIRT)
        for sign in (1.0, -1.0):
            cut_piece(piece, solid, partial(_measure_sleeve, sign=sign, end=SLEEVE_END - BAND), (TRIM, -1))
        borders = self.surface.add(piece)
        places = {"hem": (0, 0, 0.88), "neck": (0, 0, 1.53), "left": (0, 0.32, 1.34), "right": (0, -0.32, 1.34)}
        middles = np.array([self.surface.middle(border) for border in borders])
        found = {name: borders[int(np.argmin(np.linalg.norm(middles - place, axis=1)))]
                 for name, place in places.items()}
        self._add_collar(found["neck"], neck)
        return found

    def _add_collar(self, hole: list[int], neck: list[int]) -> None:
        """Add the collar between the shirt's hole and the neck: a band that stands up, its edge, its inner side."""
        points = np.array([self.surface.vertices[v] for v in hole])
        up = np.array([0.30, 0.0, 1.0]) / np.hypot(1.0, 0.30)
        slope = compute_gradient(self.head, points) * [1.0, 1.0, 0.2]
        inward = -slope / np.linalg.norm(slope, axis=1, keepdims=True)
        band = self.surface.extend(hole, points + 0.012 * up + 0.001 * inward, TRIM)
        edge = self.surface.extend(band, points + 0.012 * up + 0.0045 * inward, TRIM)
        below = self.surface.extend(edge, points - 0.012 * up + 0.0060 * inward, TRIM)
        self.surface.bridge(below, neck, (0.0, 0.0, 1.0), SKIN)

    def _add_arm(self, shirt: dict[str, list[int]], sign: float) -> None:
        """Add an arm with its hand, and the hem of its sleeve."""
        solid = limbs.build_bare_arm(self.light)
        box = np.array([-0.09, -0.09, -0.60]), np.array([0.09, 0.09, -0.08])
        cuts = [lambda p: -p[:, 2] - SLEEVE_END + self.tuck(0.025) + 0.012, lambda p: p[:, 2] + GLOVE_TOP - 0.008]
        arm = self.surface.add(_raise(self.make("arm", solid, box, cuts, SKIN), sign))
        rim, wrist = sorted(arm, key=lambda border: -self.surface.middle(border)[2])
        box = np.array([-0.10, -0.11, -0.80]), np.array([0.10, 0.09, -0.49])
        hand = _raise(self.make("hand", solid, box, [lambda p: -p[:, 2] - GLOVE_TOP], SKIN), sign)
        axis = limbs.ARM_TURN[:, 2] * [1.0, sign, 1.0]
        self.surface.bridge(self.surface.add(hand)[0], wrist, axis, SKIN)
        skin = _turn_arm(place(solid, SHOULDER, limbs.ARM_TURN), sign)
        self._add_hem(shirt["left" if sign > 0 else "right"], rim, axis, skin, (self.tuck(0.020), SHIRT, TRIM, SKIN))

    def _add_shorts(self, shirt: dict[str, list[int]]) -> dict[float, list[int]]:
        """Add the shorts and the hem of the shirt above them; return the borders of their legs by side."""
        solid = clothes.build_shorts()
        cuts = [lambda p: 0.965 - p[:, 2], lambda p: p[:, 2] - SHORTS_HEM - 0.10 * (np.abs(p[:, 1]) - 0.1)]
        size, gap = self.size("shorts"), 0.017
        axes = (grade((-0.25, size), (0.25, size)), grade((-0.28, size), (-0.05, gap), (0.05, gap), (0.28, size)),
                grade((0.54, size), (1.03, size)))
        piece = self.make("shorts", solid, axes, cuts, SHORTS)
        cut_piece(piece, solid, lambda p: p[:, 2] - SHORTS_HEM - 0.10 * (np.abs(p[:, 1]) - 0.1) - BAND, (TRIM, -1))
        borders = sorted(self.surface.add(piece), key=lambda border: self.surface.middle(border)[2])
        self._add_hem(shirt["hem"], borders[-1], (0.0, 0.0, 1.0), solid, (self.tuck(0.025), SHIRT, SHIRT, SHORTS))
        return {float(np.sign(self.surface.middle(border)[1])): border for border in borders[:2]}

    def _add_leg(self, tops: dict[float, list[int]], sign: float) -> None:
        """Add thigh, knee, sock and boot, and the hem of the shorts."""
        leg, sock, boot = limbs.build_leg(), limbs.build_sock(), limbs.build_boot()
        low, high = np.array([-0.14, -0.04, 0.02]), np.array([0.14, 0.22, 0.75])
        cuts = [lambda p: SHORTS_HEM + self.tuck(0.030) + 0.012 - p[:, 2], lambda p: p[:, 2] - SOCK_TOP + 0.004]
        skin = _flip(self.make("leg", leg, (low + [0, 0, 0.35], high), cuts, SKIN), sign)
        tube = self.make("sock", sock, (low, high),
                         [lambda p: SOCK_TOP - p[:, 2], lambda p: p[:, 2] - BOOT_TOP + 0.006], SOCKS)
        cut_piece(tube, sock, lambda p: SOCK_TOP - 1.5 * BAND - p[:, 2], (TRIM, -1))
        shoe = self.make("boot", boot, (np.array([-0.12, 0.02, -0.03]), np.array([0.25, 0.17, 0.16])),
                         [_measure_boot_top], BOOTS)
        cut_piece(shoe, boot, lambda p: p[:, 2] - 0.012 - 0.006 * smoothstep(p[:, 0], 0.10, 0.17), (SOLES, -1))
        thigh = sorted(self.surface.add(skin), key=lambda border: self.surface.middle(border)[2])
        stocking = sorted(self.surface.add(_flip(tube, sign)), key=lambda border: self.surface.middle(border)[2])
        collar = self.surface.add(_flip(shoe, sign))[0]
        up, side = np.array([0.0, 0.0, 1.0]), mirror if sign < 0 else (lambda field: field)
        self._add_hem(tops[sign], thigh[-1], up, side(leg), (self.tuck(0.030), SHORTS, TRIM, SKIN))
        self._add_hem(stocking[-1], thigh[0], -up, side(leg), (0.0, SOCKS, TRIM, SKIN))
        self._add_hem(collar, stocking[0], -up, side(sock), (0.0, BOOTS, BOOTS, SOCKS))

    def _add_hem(self, border: list[int], inner: list[int], axis, below: Field, form) -> None:
        """Fold a border inwards and stitch it to the border of what it covers.

        Args:
            border, inner: of the cloth, and of what is below it.
            axis: (3,) the direction into the cloth.
            below: the solid below the cloth.
            form: depth in metres of the inner side (0: none), its material, materials of the edge and of what is below.
        """
        depth, material, edge, other = form
        points = np.array([self.surface.vertices[v] for v in border])
        slope = compute_gradient(below, points)
        move = np.clip(below(points) - 0.0008, 0.0005, LIPS[material])
        inward = points - move[:, None] * slope / np.linalg.norm(slope, axis=1, keepdims=True)
        lip = self.surface.extend(border, inward, edge)
        if depth > 0.0:
            inside = _approach(inward + depth * np.asarray(axis), lambda p: below(p) - 0.004, 0.01)
            lip = self.surface.extend(lip, inside, material)
        self.surface.bridge(lip, inner, axis, other)

    def add_hair(self, style: str) -> None:
        """Add a style of hair."""
        if style == "crop":
            self._add_crop()
            return
        box = HEAD + [-0.19, -0.13, -0.13], HEAD + [0.13, 0.13, 0.20]
        self.surface.add(self._make_hair_piece("hair", head.build_hair(style, self.head), box))

    def _add_crop(self) -> None:
        """Add hair so short that it is the head's own surface, raised, cut at the hairline and closed along it."""
        piece = self.scalp
        cut_piece(piece, self.head, head.measure_hairline, (None, HAIR))
        keep_largest(piece)
        within = smoothstep(head.measure_hairline(piece.vertices), 0.0, 0.02)
        slope = compute_gradient(self.head, piece.vertices)
        normals = slope / np.linalg.norm(slope, axis=1, keepdims=True)
        piece.vertices = piece.vertices + (CROP[0] + (CROP[1] - CROP[0]) * within)[:, None] * normals
        for border in self.surface.add(piece):
            points = np.array([self.surface.vertices[v] for v in border])
            slope = compute_gradient(self.head, points)
            below = points - 3.0 * CROP[0] * slope / np.linalg.norm(slope, axis=1, keepdims=True)
            self.surface.extend(border, below, HAIR)

    def _make_hair_piece(self, name: str, solid: Field, box) -> Piece:
        """Make hair in a box, without what lies inside the head."""
        size = self.size(name)
        piece = mesh_field(solid, [grade((a, size), (b, size)) for a, b in zip(*box)])
        relax(piece, solid, 6, 0.4 * size)
        deep = self.head(piece.vertices) < -0.002
        piece.faces = [face for face in piece.faces if not all(deep[list(face)])]
        piece.materials = [HAIR] * len(piece.faces)
        drop_unused(piece)
        return piece


def _approach(points: np.ndarray, solid: Field, most: float = 0.02) -> np.ndarray:
    """Move points (N, 3) onto a solid in small moves of at most a fifth of `most` metres."""
    for _ in range(12):
        points = project(solid, points, 0.2 * most)
    return points


def _measure_above_hem(points: np.ndarray) -> np.ndarray:
    """Measure how far points are above the shirt's hem, which is lower at the back, m."""
    return points[:, 2] - SHIRT_HEM - 0.02 * np.cos(np.arctan2(points[:, 1], points[:, 0]))


def _measure_below_collar(points: np.ndarray) -> np.ndarray:
    """Measure how far points are below the shirt's hole for the neck, m."""
    return (1.548 - points[:, 2] - 0.45 * (points[:, 0] + 0.02)) / np.hypot(1.0, 0.45)


def _measure_sleeve(points: np.ndarray, sign: float, end: float) -> np.ndarray:
    """Measure how far points are before the end of a sleeve, m; those of the trunk are far before it."""
    local = (points * [1.0, sign, 1.0] - SHOULDER) @ limbs.ARM_TURN
    return end + local[:, 2] + 3.0 * np.maximum(-local[:, 1] - 0.085, 0.0)


def _measure_boot_top(points: np.ndarray) -> np.ndarray:
    return BOOT_TOP - points[:, 2] - 0.25 * points[:, 0]


def _raise(piece: Piece, sign: float) -> Piece:
    """Move a piece from the arm's frame to the body."""
    piece.vertices = piece.vertices @ limbs.ARM_TURN.T + SHOULDER
    return _flip(piece, sign)


def _flip(piece: Piece, sign: float) -> Piece:
    """Mirror a piece to the right if `sign` is negative."""
    if sign < 0.0:
        piece = Piece(piece.vertices * [1.0, -1.0, 1.0], [face[::-1] for face in piece.faces], piece.materials)
    return piece


def _turn_arm(field: Field, sign: float) -> Field:
    return mirror(field) if sign < 0.0 else field


def _make_eye(sign: float, light: bool) -> Piece:
    """Make an eyeball with a dark pupil that looks ahead."""
    sides, angles = (8, (16, 33, 60, 110)) if light else (16, (16, 33, 60, 95, 140))
    around = 2.0 * np.pi * np.arange(sides) / sides
    radius = head.EYE_RADIUS - (0.0 if light else 0.0008)  # so that no vertex shows through the thin lids
    rows = [np.array([[radius, 0.0, 0.0]])]
    for angle in np.radians(angles):
        ring = np.stack([np.full(sides, np.cos(angle)), np.sin(angle) * np.cos(around),
                         np.sin(angle) * np.sin(around)], axis=1)
        rows.append(radius * ring)
    rows.append(np.array([[-radius, 0.0, 0.0]]))
    number, last = 1 + np.arange(len(angles) * sides).reshape(-1, sides), 1 + len(angles) * sides
    faces: list[tuple[int, ...]] = []
    materials: list[int] = []
    for i in range(sides):
        j = (i + 1) % sides
        faces.append((0, int(number[0, i]), int(number[0, j])))
        faces += [tuple(map(int, (number[r, i], number[r + 1, i], number[r + 1, j], number[r, j])))
                  for r in range(len(angles) - 1)]
        faces.append((last, int(number[-1, j]), int(number[-1, i])))
        materials += [PUPILS, PUPILS, *[EYES] * (len(angles) - 1)]
    shift = 0.0015 if light else 0.0  # the coarse lids lie further ahead
    return Piece(np.concatenate(rows) + HEAD + head.EYE * [1.0, sign, 1.0] + [shift, 0.0, 0.0], faces, materials)


def _finish(surface: Surface, parts: np.ndarray, count: int) -> Template:
    """Finish the arrays: faces of three or four corners, the four largest shares of each vertex."""
    vertices = np.array(surface.vertices)
    faces, materials, owners = [], [], []
    for face, material, part in zip(surface.faces, surface.materials, parts):
        split = [face] if len(face) < 5 else [(face[0], *face[i : i + 3]) for i in range(1, len(face) - 1, 2)]
        faces += [(*one, -1)[:4] for one in split]
        materials += [material] * len(split)
        owners += [part] * len(split)
    shares = compute_shares(vertices)
    tail = np.arange(len(vertices)) >= count
    tail &= vertices[:, 0] < HEAD[0] + HAIR_BEHIND
    shares[tail] = np.eye(len(SEGMENTS))[SEGMENTS.index("head")]
    order = np.argsort(-shares, axis=1, kind="stable")[:, :4]
    largest = np.take_along_axis(shares, order, axis=1)
    return Template(vertices=vertices, faces=np.array(faces), materials=np.array(materials),
                     parts=np.array(owners), segments=order, shares=largest / largest.sum(axis=1, keepdims=True),
                     gloves=_measure_gloves(vertices))


def _measure_gloves(vertices: np.ndarray) -> np.ndarray:
    """Measure by how much gloves stand out of the skin at each vertex (V,) m."""
    out = np.zeros(len(vertices))
    for sign in (1.0, -1.0):
        local = (vertices * [1.0, sign, 1.0] - SHOULDER) @ limbs.ARM_TURN
        down = -local[:, 2]
        out += (down > GLOVE_TOP - 0.0005) * (vertices[:, 1] * sign > 0.3) * (0.006 - 0.0035 * (down > 0.665))
    return out
