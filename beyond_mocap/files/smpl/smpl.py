"""Read and write motion as SMPL stores it: `poses`, `trans` and `mocap_framerate` in an .npz.

Joint frames of the rest pose are aligned with the world, x to the body's left, y up, z forward, so a local rotation
only changes its axes. The pelvis is at `trans` plus its place at rest, which no rotation moves (Loper et al. 2015,
eq. 2 to 4, with the translation added to the posed body). Recordings of AMASS have the world's z up, GVHMR's y up: the
pelvis tells.

    clip = read_smpl("shoot.npz")
    write_smpl("again.npz", clip.motion)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...base.errors import InputError, format_count
from ...motion import quaternion
from ...motion.contacts import measure_floor_height
from ...motion.humanoid import estimate_stature
from ...motion.motion import Motion
from ...motion.skeleton import Skeleton
from ..atomic import atomic_path
from ..bvh.bvh import BvhClip
from ..bvh.bvh_write import BvhForm
from ..plain_npz import list_arrays, read_named_arrays
from .smpl_skeleton import (
    JOINTS,
    PELVIS_AT_REST,
    STATURE_RANGE,
    TO_CORE,
    TOE_HEIGHT,
    build_smpl_skeleton,
    estimate_smpl_stature,
    read_model_skeleton,
)

MAX_TURN, MAX_METRES = 1000.0, 10_000.0
"""Radians and metres beyond which a number is damaged: rotation vectors are hardly above 2 pi."""
RATES = ("mocap_framerate", "mocap_frame_rate", "fps")
"""Arrays that hold the frames per second."""

_KIND = "a motion of SMPL as .npz: poses (T, 72, 156 or 165), trans (T, 3), mocap_framerate"
_NUMBERS = tuple(np.dtype(kind) for kind in ("<f4", "<f8", "<i4", "<i8", "|u1", "<u4", "<u8", "<i2"))
_MAX_BYTES = 1 << 30
_MAX_FRAMES = 1_000_000
_WIDTHS = {72: "SMPL", 156: "SMPL-H", 165: "SMPL-X"}
_DEFAULT_RATE = 30.0  # of GVHMR, which stores none
# (root rotation, body rotations, translation) of forms without `poses`
_PARTS = (
    ("root_orient", "pose_body", "trans"),
    ("smpl_params_global_global_orient", "smpl_params_global_body_pose", "smpl_params_global_transl"),
    ("net_outputs_pred_smpl_params_global_global_orient", "net_outputs_pred_smpl_params_global_body_pose",
     "net_outputs_pred_smpl_params_global_transl"),
    ("global_orient", "body_pose", "transl"),
)  # fmt: skip
_MOST_FAULTS = 3
_SHORTEST = 1.0  # seconds of steps that tell a stature
_USUAL_STATURE = 1.70  # metres, where neither the user nor the steps tell it
_LEAP = 2.5
"""m/s by which the pelvis' velocity may differ from those one frame before and after: no leg changes it so (1.2 at most
in 19 motions estimated from video, 7 where one leaps by 23 cm)."""
_FLIP = np.radians(1000.0)
"""1/s, the same for how fast a joint rotates (570 degrees/s at most in those motions)."""
_Z_UP = np.eye(3)
_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def is_smpl_file(path: Path) -> bool:
    """Return whether a file is an .npz whose arrays have the names of a motion of SMPL."""
    names = list_arrays(path)
    return "poses" in names or any(body in names for _, body, _ in _PARTS)


def read_smpl(path, stature: float | None = None, body_model: Path | None = None) -> BvhClip:
    """Read the motion of an .npz of SMPL, SMPL-H or SMPL-X (AMASS, ASAP, GVHMR).

    Args:
        path: the file. Nothing in it is executed: arrays of objects are refused.
        stature: of the person, metres; None finds the one that the steps fit.
        body_model: the .npz of the model, for the true bones of this person's `betas`; None takes mean proportions.
    Returns:
        The clip: 22 joints, the soles of standing feet at height 0, and what was assumed, left out or found.
    Raises:
        InputError: if it is not such a file.
    """
    path = Path(path)
    arrays = _read_arrays(path)
    poses, trans, form = _find_poses(path, arrays)
    fps, notes = find_rate(path, arrays)
    rotations = quaternion.from_rotation_vector(poses)
    to_world, up = find_up_axis(rotations[:, 0])
    local, root = to_core_axes(rotations, trans, to_world)
    skeleton, pelvis, origin = _choose_bones(Motion(build_smpl_skeleton(1.0), root, local, fps), arrays, stature,
                                           body_model)
    motion = Motion(skeleton, root + to_world @ TO_CORE.T @ pelvis, local, fps)
    floor = measure_floor_height(motion) - TOE_HEIGHT * estimate_stature(skeleton)
    motion = replace(motion, root_positions=motion.root_positions - (0.0, 0.0, floor))
    first = f"{form}, {up} up, {fps:g} frames per second, {len(motion)} frames; {origin}"
    return BvhClip(motion, BvhForm(), (first, *notes, *_list_left_out(form, arrays), *_list_faults(path.name, motion)))


def write_smpl(path, motion: Motion) -> tuple[str, ...]:
    """Write a motion on SMPL's joints as an .npz in AMASS' form: 24 joints, z up, shape unknown.

    Args:
        path: the file.
        motion: on the skeleton of `build_smpl_skeleton`, or one with its joints and T-pose.
    Returns:
        Notes on what the form cannot hold.
    Raises:
        InputError: if its joints are others, or the folder is not writable.
    """
    if motion.skeleton.names != JOINTS:
        raise InputError(path, f"a skeleton of {format_count(len(motion.skeleton), 'joint')}",
                         f"SMPL's {len(JOINTS)} joints", "retarget the motion to SMPL")
    axes = quaternion.from_matrix(TO_CORE)
    local = quaternion.multiply(quaternion.multiply(quaternion.inverse(axes), motion.rotations), axes)
    local[:, 0] = quaternion.multiply(motion.rotations[:, 0], axes)
    poses = np.zeros((len(motion), 24, 3))
    poses[:, : len(JOINTS)] = quaternion.to_rotation_vector(local)
    with atomic_path(Path(path)) as temporary, open(temporary, "wb") as file:
        np.savez(file, poses=poses.reshape(len(motion), -1), trans=motion.root_positions - PELVIS_AT_REST,
                 betas=np.zeros(10), gender=np.array("neutral"), mocap_framerate=np.array(motion.fps))
    return ("the hands of SMPL are straight, its betas 0: bones of other lengths are not part of this form",)


def _read_arrays(path: Path) -> Mapping[str, np.ndarray]:
    """Read the arrays that a motion may have."""
    if path.suffix.lower() != ".npz":
        raise InputError(path, f"a {path.suffix or 'file without ending'}: pickles can run code and are never opened",
                         _KIND, "save its arrays with numpy.savez")
    names = ("poses", "trans", "betas", *RATES, *(name for part in _PARTS for name in part))
    return read_named_arrays(path, _KIND, _NUMBERS, _MAX_BYTES, names)


def _find_poses(path: Path, arrays: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, str]:
    """Return rotation vectors (T, 22, 3), translations (T, 3), and the form's name."""
    if "poses" in arrays and "trans" in arrays:
        flat, trans = _flatten(arrays["poses"]), _flatten(arrays["trans"])
        form = _WIDTHS.get(flat.shape[1], "")
    else:
        part = next((part for part in _PARTS if all(name in arrays for name in part)), None)
        if part is None:
            raise InputError(path, f"arrays {', '.join(sorted(arrays)) or 'of other names'}", _KIND,
                             "export poses and trans")
        root, body, trans = (_flatten(arrays[name]) for name in part)
        if len(root) != len(body) or root.shape[1] != 3 or body.shape[1] not in (63, 69):
            raise InputError(path, f"{part[0]} {root.shape}, {part[1]} {body.shape}", "(T, 3) and (T, 63 or 69)")
        flat, form = np.hstack([root, body]), "SMPL in parts"
    if not form or trans.shape != (len(flat), 3):
        raise InputError(path, f"poses {flat.shape}, trans {trans.shape}", _KIND,
                         "export one person's motion; the command 'bodies' reads many")
    if not 2 <= len(flat) <= _MAX_FRAMES:
        raise InputError(path, format_count(len(flat), "frame"), f"2 to {_MAX_FRAMES:,}")
    if np.abs(trans).max() > MAX_METRES:
        raise InputError(path, f"trans up to {np.abs(trans).max():.3g}", f"metres, below {MAX_METRES:g}")
    if np.abs(flat).max() > MAX_TURN:
        raise InputError(path, f"poses up to {np.abs(flat).max():.3g}", f"radians, below {MAX_TURN:g}")
    return flat[:, : 3 * len(JOINTS)].reshape(len(flat), len(JOINTS), 3).astype(float), trans.astype(float), form


def _flatten(array: np.ndarray) -> np.ndarray:
    """Return (T, N) of an array with leading axes of length 1 or joints in an axis of their own."""
    while array.ndim > 2 and len(array) == 1:
        array = array[0]
    return array.reshape(len(array), -1) if array.ndim > 1 and array.size else np.zeros((0, 0))


def find_rate(path: Path, arrays: Mapping[str, np.ndarray], usual: float = _DEFAULT_RATE) -> tuple[float, list[str]]:
    """Find the frames per second.

    Args:
        path: the file, for errors.
        arrays: its arrays.
        usual: of a file that has none.
    Returns:
        Frames per second, and a line where they are assumed.
    Raises:
        InputError: if they cannot be.
    """
    name = next((name for name in RATES if name in arrays), None)
    if name is None:
        return usual, [f"no frame rate in the file; {usual:g} frames per second assumed"]
    rate = float(arrays[name].reshape(-1)[0]) if arrays[name].size else 0.0
    if not 1.0 <= rate <= 1000.0:
        raise InputError(path, f"{name} {rate:g}", "1 to 1000 frames per second")
    return rate, []


def find_up_axis(pelvis: np.ndarray) -> tuple[np.ndarray, str]:
    """Find the world's up axis, towards which the pelvis' own points most.

    Args:
        pelvis: (T, 4) rotations from SMPL's rest frame to the file's world.
    Returns:
        (3, 3), the file's world to the core's, and the axis' name.
    """
    up = np.median(quaternion.rotate(pelvis, np.array([0.0, 1.0, 0.0])), axis=0)
    return (_Z_UP, "z") if abs(up[2]) >= abs(up[1]) else (_Y_UP, "y")


def to_core_axes(rotations: np.ndarray, trans: np.ndarray, to_world: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turn a motion into the core's axes.

    Args:
        rotations: (T, 22, 4) local, in the file's axes.
        trans: (T, 3) metres, the model's origin.
        to_world: (3, 3), see `find_up_axis`.
    Returns:
        Local rotations (T, 22, 4) and places of the model's origin (T, 3) m.
    """
    axes = quaternion.from_matrix(TO_CORE)
    local = quaternion.multiply(quaternion.multiply(axes, rotations), quaternion.inverse(axes))
    world = quaternion.multiply(quaternion.from_matrix(to_world), rotations[:, 0])
    local[:, 0] = quaternion.multiply(world, quaternion.inverse(axes))
    return local, trans @ to_world.T


def _choose_bones(unit: Motion, arrays: Mapping[str, np.ndarray], stature: float | None,
                  body_model: Path | None) -> tuple[Skeleton, np.ndarray, str]:
    """Choose the skeleton; return it, the pelvis at rest (3,) in core axes, and a line on where the bones are from."""
    betas = np.asarray(arrays.get("betas", np.zeros(10)), dtype=float).reshape(-1)
    if body_model is not None:
        skeleton, pelvis = read_model_skeleton(Path(body_model), betas)
        return skeleton, pelvis, f"bones of {Path(body_model).name}"
    found = stature or (estimate_smpl_stature(unit) if unit.duration >= _SHORTEST else 0.0)
    if stature is not None and not STATURE_RANGE[0] <= stature <= STATURE_RANGE[1]:
        raise InputError("stature", f"{stature:g} m", f"{STATURE_RANGE[0]:g} to {STATURE_RANGE[1]:g} m")
    why = "as given" if stature else "as the steps fit" if found else "assumed, there are too few steps to tell"
    shaped = "; its betas need the body model" if np.any(np.abs(betas) > 1e-6) else ""
    return (build_smpl_skeleton(found or _USUAL_STATURE), TO_CORE @ PELVIS_AT_REST,
            f"mean proportions, {found or _USUAL_STATURE:.2f} m tall {why}{shaped}")


def _list_left_out(form: str, arrays: Mapping[str, np.ndarray]) -> list[str]:
    """Tell which joints of a file are not read: those of fingers, jaw and eyes, where they move."""
    poses = arrays.get("poses")
    if form not in ("SMPL-H", "SMPL-X") or poses is None:
        return []
    rest = _flatten(poses)[:, 3 * len(JOINTS):]
    return ["fingers, jaw and eyes are left out"] if np.ptp(rest, axis=0).max() > 1e-3 else []


def _list_faults(name: str, motion: Motion) -> list[str]:
    """List leaps of the body and flips of joints between two frames, which a person does not do."""
    travel = np.diff(motion.root_positions, axis=0)
    turn = quaternion.to_rotation_vector(quaternion.multiply(quaternion.inverse(motion.rotations[:-1]),
                                                             motion.rotations[1:]))
    lines = [f"{name}, frame {frame + 1}: the body leaps by {np.linalg.norm(travel[frame]):.2f} m"
             for frame in np.flatnonzero(_measure_outliers(travel) * motion.fps > _LEAP)]
    angles = np.degrees(np.linalg.norm(turn, axis=-1))
    lines += [f"{name}, frame {frame + 1}: {JOINTS[joint]} flips by {angles[frame, joint]:.0f} degrees"
              for frame, joint in np.argwhere(_measure_outliers(turn) * motion.fps > _FLIP)]
    more = f"{name}: {format_count(len(lines) - _MOST_FAULTS, 'more fault')} of these kinds"
    return lines[:_MOST_FAULTS] + [more] * (len(lines) > _MOST_FAULTS)


def _measure_outliers(steps: np.ndarray) -> np.ndarray:
    """Measure by how much a step (T, ..., 3) differs from the one before and the one after it; 0 at both ends."""
    differences = np.zeros(steps.shape[:-1])
    change = np.linalg.norm(np.diff(steps, axis=0), axis=-1)
    differences[1:-1] = np.minimum(change[:-1], change[1:])
    return differences
