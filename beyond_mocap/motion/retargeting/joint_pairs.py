"""The joints of two skeletons that belong together: by a saved map, by names, and where these say nothing by structure.

A map is a JSON object, source joint -> target joint, as other tools use it:

    {"Bip001 Pelvis": "Hips", "Bip001 L Thigh": "LeftUpLeg"}

It need not be complete: a joint that it leaves out is found by its name or by its position in the body (`humanoid`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ...base.content import read_utf8
from ...base.errors import InputError
from ..humanoid import Humanoid, build_humanoid, identify_joints, identify_posed_joints, list_roles
from ..motion import Motion
from ..skeleton import Skeleton

_MAP_FORM = '{"source joint": "target joint", ...}'


@dataclass(frozen=True)
class JointPairs:
    """Two bodies and the joints they share.

    Attributes:
        source, target: the joints by meaning.
        others: target joint -> source joint for joints without a meaning (fingers, twist bones).
        trunk_tops: the joints of source and target that end the trunk at the same part; None where there are none.
    """

    source: Humanoid
    target: Humanoid
    others: dict[int, int]
    trunk_tops: tuple[int, int] | None


def read_bone_map(path: str | Path) -> dict[str, str]:
    """Read a saved bone map.

    Args:
        path: a JSON file.
    Returns:
        Source joint -> target joint.
    Raises:
        InputError: if the file cannot be read or is not a JSON object of names.
    """
    try:
        found = json.loads(read_utf8(path, "a bone map (JSON)"))
    except (ValueError, RecursionError):
        raise InputError(path, "not JSON", _MAP_FORM, "correct the file") from None
    if not isinstance(found, dict) or not all(isinstance(name, str) for name in found.values()):
        raise InputError(path, "not an object of names", _MAP_FORM, "correct the file")
    return found


def write_bone_map(path: str | Path, pairs: JointPairs, source: Skeleton, target: Skeleton) -> None:
    """Write the matching joints as a map for `read_bone_map`; spines are shared by length and not part of it."""
    theirs = list_roles(pairs.target)
    named = {joint: theirs[role] for role, joint in list_roles(pairs.source).items() if role in theirs}
    named |= {mine: its for its, mine in pairs.others.items()}
    table = {source.names[mine]: target.names[its] for mine, its in sorted(named.items())}
    Path(path).write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def pair_joints(
    motion: Motion, skeleton: Skeleton, bone_map: Mapping[str, str] | str | Path | None = None,
    example: Motion | None = None,
) -> JointPairs:
    """Match the joints of `motion`'s skeleton and of `skeleton`.

    Args:
        motion: a recording on the source.
        skeleton: the target.
        bone_map: as from `read_bone_map`, or a path.
        example: a recording on `skeleton`, whose poses show left and right where its names do not.
    Returns:
        The pairs.
    Raises:
        InputError: for a map with unknown names and for skeletons without legs.
    """
    where = str(bone_map) if isinstance(bone_map, (str, Path)) else "bone map"
    table = read_bone_map(bone_map) if isinstance(bone_map, (str, Path)) else dict(bone_map or {})
    links = {_find_joint(motion.skeleton, mine, where): _find_joint(skeleton, its, where) for mine,
             its in table.items()}
    found = _find_roles(motion.skeleton, motion), _find_roles(skeleton, example)
    if links:
        found = _apply_links(*found, links)
    source, target = (build_humanoid(one.names, one.parents, roles) for one,
                      roles in zip((motion.skeleton, skeleton), found))
    others = _pair_other_joints(motion.skeleton, skeleton, source, target, links)
    return JointPairs(source, target, others, _find_trunk_tops(source, target))


def _find_joint(skeleton: Skeleton, name: str, where: str) -> int:
    if name not in skeleton.names:
        raise InputError(where, f"no joint {name!r}", f"one of {', '.join(skeleton.names)}", "correct the name")
    return skeleton.names.index(name)


def _find_roles(skeleton: Skeleton, recording: Motion | None) -> dict[str, int]:
    """Find the roles that names or structure show; empty where they show nothing."""
    try:
        return list_roles(identify_joints(skeleton) if recording is None else identify_posed_joints(recording))
    except InputError:
        return {}


def _apply_links(source: dict[str, int], target: dict[str, int], links: dict[int, int]):
    """Apply the map's pairs to both bodies' roles: a mapped joint takes its partner's role."""
    back = {joint: role for role, joint in target.items()}
    source, target = dict(source), dict(target)
    for mine, its in links.items():
        role = back.get(its) or next((role for role, joint in source.items() if joint == mine), None)
        if role is not None:
            source = {other: joint for other, joint in source.items() if joint != mine} | {role: mine}
            target[role] = its
    return source, target


def _pair_other_joints(source: Skeleton, target: Skeleton, mine: Humanoid, its: Humanoid,
                       links: dict[int, int]) -> dict[int, int]:
    """Pair joints without a meaning, target -> source: mapped ones, and those of the same name."""
    taken = [set(list_roles(body).values()) | set(body.spine) for body in (mine, its)]
    same = {source.names.index(name): joint for joint, name in enumerate(target.names) if name in source.names}
    return {b: a for a, b in {**same, **links}.items() if a not in taken[0] and b not in taken[1]}


def _find_trunk_tops(source: Humanoid, target: Humanoid) -> tuple[int, int] | None:
    """Find where both trunks end: at the neck, else at the head."""
    for part in ("neck", "head"):
        joints = getattr(source, part), getattr(target, part)
        if None not in joints:
            return joints
    return None
