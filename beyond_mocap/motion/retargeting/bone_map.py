"""Which joint of one skeleton is which of another: by a saved map, by names, and where these say nothing by structure.

A map is a JSON object, source joint -> target joint, as users of other tools keep them:

    {"Bip001 Pelvis": "Hips", "Bip001 L Thigh": "LeftUpLeg"}

It need not be complete: a joint that it leaves out is found by its name or by its place in the body (`humanoid`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ...base.errors import InputError
from ..humanoid import Humanoid, assemble, identify, identify_posed, roles_of
from ..motion import Motion
from ..skeleton import Skeleton

_FORM = '{"source joint": "target joint", ...}'


@dataclass(frozen=True)
class Pairs:
    """Two bodies and what they share.

    source, target: which joint is what. others: target joint -> source joint for joints without a meaning (fingers,
    twist bones). tops: the joints of source and target that end the trunk in the same place, None where there are none.
    """

    source: Humanoid
    target: Humanoid
    others: dict[int, int]
    tops: tuple[int, int] | None


def load(path: str | Path) -> dict[str, str]:
    """A saved map; InputError where the file cannot be read or is not a JSON object of names."""
    try:
        found = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", "a bone map (JSON)", "check the path") from None
    except (ValueError, RecursionError) as error:
        raise InputError(path, f"not JSON ({error})", _FORM, "mend the file") from None
    if not isinstance(found, dict) or not all(isinstance(name, str) for name in found.values()):
        raise InputError(path, "not an object of names", _FORM, "mend the file")
    return found


def save(path: str | Path, pairs: Pairs, source: Skeleton, target: Skeleton) -> None:
    """Writes the joints that belong together as a map that `load` reads; spines are shared by length and not in it."""
    theirs = roles_of(pairs.target)
    named = {joint: theirs[role] for role, joint in roles_of(pairs.source).items() if role in theirs}
    named |= {mine: its for its, mine in pairs.others.items()}
    table = {source.names[mine]: target.names[its] for mine, its in sorted(named.items())}
    Path(path).write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def pair(
    motion: Motion,
    skeleton: Skeleton,
    bone_map: Mapping[str, str] | str | Path | None = None,
    example: Motion | None = None,
) -> Pairs:
    """The joints of `motion`'s skeleton and of `skeleton` that belong together.

    bone_map: as `load` returns it, or a path. example: a recording on `skeleton`, whose poses show left from right
    where its names do not. Raises InputError for a map with unknown names and for skeletons without legs.
    """
    where = str(bone_map) if isinstance(bone_map, (str, Path)) else "bone map"
    table = load(bone_map) if isinstance(bone_map, (str, Path)) else dict(bone_map or {})
    links = {_index(motion.skeleton, mine, where): _index(skeleton, its, where) for mine, its in table.items()}
    found = _roles(motion.skeleton, motion), _roles(skeleton, example)
    if links:
        found = _linked(*found, links)
    source, target = (assemble(one.names, one.parents, roles) for one, roles in zip((motion.skeleton, skeleton), found))
    others = _others(motion.skeleton, skeleton, source, target, links)
    return Pairs(source, target, others, _tops(source, target))


def _index(skeleton: Skeleton, name: str, where: str) -> int:
    if name not in skeleton.names:
        raise InputError(where, f"no joint {name!r}", f"one of {', '.join(skeleton.names)}", "mend the name")
    return skeleton.names.index(name)


def _roles(skeleton: Skeleton, recording: Motion | None) -> dict[str, int]:
    """What names or structure tell; empty where they tell nothing."""
    try:
        return roles_of(identify(skeleton) if recording is None else identify_posed(recording))
    except InputError:
        return {}


def _linked(source: dict[str, int], target: dict[str, int], links: dict[int, int]):
    """Both bodies' roles with the map's pairs put through: a mapped joint has the role of the one that it is mapped
    to."""
    back = {joint: role for role, joint in target.items()}
    source, target = dict(source), dict(target)
    for mine, its in links.items():
        role = back.get(its) or next((role for role, joint in source.items() if joint == mine), None)
        if role is not None:
            source = {other: joint for other, joint in source.items() if joint != mine} | {role: mine}
            target[role] = its
    return source, target


def _others(source: Skeleton, target: Skeleton, mine: Humanoid, its: Humanoid, links: dict[int, int]) -> dict[int, int]:
    """Target joint -> source joint where neither has a meaning: mapped ones, and those of the same name."""
    taken = [set(roles_of(body).values()) | set(body.spine) for body in (mine, its)]
    same = {source.names.index(name): joint for joint, name in enumerate(target.names) if name in source.names}
    return {b: a for a, b in {**same, **links}.items() if a not in taken[0] and b not in taken[1]}


def _tops(source: Humanoid, target: Humanoid) -> tuple[int, int] | None:
    """Where both trunks end: at the neck, else at the head."""
    for part in ("neck", "head"):
        joints = getattr(source, part), getattr(target, part)
        if None not in joints:
            return joints
    return None
