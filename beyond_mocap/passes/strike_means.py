"""The motions of a library with which each player of a passing scene can strike."""

from __future__ import annotations

from itertools import zip_longest

import numpy as np

from ..annotation.striking import SIDED_PARTS
from ..ball.contact import Tool
from ..base.errors import InputError, NotInLibraryError
from ..library.library import Library
from .hit_library import LibraryHit, MatchWeights
from .hits import HitMotion, find_strongest_hit
from .pass_problem import Site
from .pass_scene import KINDS, RECEIVE, Example, Pass, PassScene
from .strike_choice import PartStrikes, StrikeMoments, collect_strike_moments

MOST_HITS = 24
"""Most hit motions that are tried for one strike; those that suit its kind best come first."""


class StrikeMeans:
    """The motions with which players can strike; each result is stored.

    Args:
        library: the library.
        scene: the passing scene.
        sizes: name -> size of the player's body over that of the library's skeleton.
    """

    def __init__(self, library: Library, scene: PassScene, sizes: dict[str, float]):
        self.library, self.scene, self.sizes = library, scene, sizes
        self._choices: dict[tuple[str, Tool | None], PartStrikes] = {}
        self._moments: dict[tuple, StrikeMoments] = {}

    def build_site(self, name: str, place: np.ndarray, one: Pass | None, number: int) -> Site:
        """Build the site of a strike of one player.

        Args:
            name: the player.
            place: (2,) m where they strike.
            one: the pass that leaves; None for the last strike.
            number: number of the pass that an error names.
        """
        player = self.scene.find_player(name)
        part = (one and one.part) or player.part
        side = player.side if one is None or one.side is None else one.side
        tool = (player.tool or Tool()) if part == "tool" else None
        kind = RECEIVE if one is None else one.kind
        try:
            size, example = self.sizes[name], one.example if one else None
            moments = self._collect_moments(part, side, self._find_tool(name, part), size=size, kind=kind,
                                            example=example)
        except InputError as error:
            raise InputError(f"pass {number}, {name}", str(error)) from None
        return Site(player=name, place=place, facing=self.scene.find_facing(name), kind=kind, part=part, tool=tool,
                    size=size, moments=moments, requested=one)

    def find_similar(self, name: str, hit: HitMotion) -> LibraryHit:
        """Find the library's strike that is most similar to a hit motion (eq. 2), by the same part and side.

        Args:
            name: the player who is to strike.
            hit: the hit motion.
        Raises:
            InputError: if the skeleton lacks the part.
            NotInLibraryError: if no clip strikes with it.
        """
        tool, example = self._find_tool(name, hit.part), Example("", hit=hit)
        return self._select_hits(hit.part, hit.side, tool, kind="", example=example)[0]

    def list_likely(self, name: str, part: str, side: str, latest: HitMotion | None) -> tuple[LibraryHit, ...]:
        """List the strikes that a user's strike is likely to be most similar to.

        Args:
            name: the player who is to strike.
            part: part that strikes.
            side: "left", "right", or "" for either.
            latest: what the user did last; None: nothing yet.
        Returns:
            Hit motions: those most similar to the latest one first; without one the best of each kind in turn.
        Raises:
            InputError: if the skeleton lacks the part.
        """
        own = self._find_strikes(part, self._find_tool(name, part))
        if latest is not None and latest.part == part:
            order, _ = own.measured.sort_by_similarity(latest, self._build_weights(), side or None)
            return tuple(own.hits[index] for index in order)
        kinds = [own.select_by_kind(kind, side) for kind in KINDS]
        in_turn = [hit for row in zip_longest(*kinds) for hit in row if hit is not None]
        return tuple(dict.fromkeys(in_turn))

    def _collect_moments(self, part, side, tool, size: float, kind: str, example) -> StrikeMoments:
        """Collect the moments with which a body of some size can strike."""
        key = (part, side, tool, size, kind, example)
        if key not in self._moments:
            hits = self._select_hits(part, side, tool, kind=kind, example=example)
            self._moments[key] = collect_strike_moments(self.library, hits, tool, size)
        return self._moments[key]

    def _select_hits(self, part: str, side: str, tool: Tool | None, kind: str, example) -> tuple[LibraryHit, ...]:
        """Select the hit motions for a kind of pass, or the one that is most similar to an example."""
        own, side_wanted = self._find_strikes(part, tool), side if part in SIDED_PARTS else ""
        if example is None:
            hits = own.select_by_kind(kind, side_wanted)[:MOST_HITS]
        else:
            order, _ = own.measured.sort_by_similarity(self._find_example(example, part, side, tool),
                                                       self._build_weights(), side_wanted or None)
            hits = tuple(own.hits[index] for index in order[:1])
        if not hits:
            with_what = f"the {side} {part}" if side_wanted else part
            others = self._list_parts()
            other = f"choose another part ({', '.join(others)}) or " if others else ""
            message = f"no clip of the library strikes with {with_what}; {other}add clips that do"
            raise NotInLibraryError(message, others)
        return hits

    def _find_tool(self, name: str, part: str) -> Tool | None:
        """Find what a player strikes with, in the size of the library's body."""
        tool = (self.scene.find_player(name).tool or Tool()) if part == "tool" else None
        return tool and tool.scale_to_library(self.sizes[name])

    def _list_parts(self) -> tuple[str, ...]:
        """List the parts with which clips of the library strike."""
        return tuple(part for part in ("foot", "head", "chest", "hand") if PartStrikes.from_library(self.library,
                part).hits)

    def _find_strikes(self, part: str, tool: Tool | None) -> PartStrikes:
        """Find the library's strikes with a part."""
        if (part, tool) not in self._choices:
            self._choices[part, tool] = PartStrikes.from_library(self.library, part, tool)
        return self._choices[part, tool]

    def _build_weights(self) -> MatchWeights:
        """Build the weights of eq. 2."""
        own, requested = MatchWeights(), self.scene.weights
        return MatchWeights(own.speed * requested.speed, own.vector * requested.vectors, own.time * requested.times)

    def _find_example(self, example, part: str, side: str, tool: Tool | None) -> HitMotion:
        """Find the strongest hit motion in a stretch of a recording, or return the given one."""
        if example.hit is not None:
            return example.hit
        clip = next((clip for clip in self.library.clips if clip.path == example.clip and not clip.mirrored), None)
        if clip is None:
            names = ", ".join(sorted({clip.path for clip in self.library.clips if not clip.is_synthetic})[:5])
            raise InputError("example", f"no recording {example.clip!r} in the library", f"one such as {names}")
        motion = clip.recording
        first = int(np.floor(example.start * motion.fps))
        last = len(motion) if example.end is None else int(np.ceil(example.end * motion.fps)) + 1
        if first > len(motion) - 3:
            found = f"{example.clip} from {example.start:g} s"
            raise InputError("example", found, f"a time up to {motion.duration:.2f} s")
        found = find_strongest_hit(motion.frames(first, min(last, len(motion))), part, side, tool)
        if found is None:
            raise InputError("example", f"no strike by {part} there in {example.clip}", "a stretch with a whole strike")
        return found
