"""A clip of a library: one recording or its mirrored twin."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..annotation import ClipAnnotation, swap_sides
from ..motion.mirror import mirror
from ..motion.motion import Motion
from .folder.recordings import CACHE_FOLDER

SYNTHETIC_FOLDER, LANDING_FOLDER = f"{CACHE_FOLDER}/made-gait/", f"{CACHE_FOLDER}/made-landing/"
"""Below a library: synthetic clips, and recordings that end in flight with their synthetic end."""

SYNTHETIC_FPS = 60.0  # of synthetic clips
T_POSE_MARGIN = 0.35  # s beside a T-pose in which the smoothed path of features is slower than the body
# how the file names of blends, kicks, long stands, long runs, walks and synthetic stands begin, and those of steps
BLEND_PREFIX, KICK_PREFIX, STAND_PREFIX, LOOP_PREFIX = "blend_", "kick_", "stand_", "loop_"
WALK_PREFIX, STILL_PREFIX = "walk_", "still_"
BACK_PREFIX, SIDE_PREFIX, TURN_PREFIX, STEP_PREFIX = "back_", "side_", "turn_", "step_"


@dataclass(frozen=True)
class RepairFigures:
    """Figures of one clip's repair.

    Attributes:
        pops: rotations replaced.
        drift: metres between the lowest and the highest floor.
        slid, slides: m/s of heels and toes in contact, before and after.
    """

    pops: int
    drift: float
    slid: float
    slides: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Clip:
    """One recording or its mirrored twin.

    Attributes:
        path: below the library's folder, with slashes.
        mirrored: whether it is the twin.
        motion: at its own rate, metres, the floor (2nd percentile of its toe heights) at height 0.
        annotations: in frames of its own rate, sides swapped on the twin.
        heel_toe_contacts: (T, 2, 2) bool, left and right foot, heel and toe in contact with the ground.
        recorded_count: number of recorded frames, where a synthetic landing and getting up follow (`library.landings`);
            None: all.
        repair_figures: what the repair found and left; None for synthetic clips.
        has_proposed_labels: whether the annotations are proposed (`library.proposals`), not written by a person.
        t_pose_frames: number of recorded frames at the start and at the end that show a T-pose in the file
            (`library.repair`), and the pose beside it here; nothing learns from them or plays them.
        ball: (T, 3) m of the recorded frames, the ball's centre in the motion's world, NaN where it is not known; None
            without a ball (`library.recorded_ball`).
    """

    path: str
    mirrored: bool
    motion: Motion
    annotations: tuple[ClipAnnotation, ...]
    heel_toe_contacts: np.ndarray
    recorded_count: int | None = None
    repair_figures: RepairFigures | None = None
    has_proposed_labels: bool = False
    t_pose_frames: tuple[int, int] = (0, 0)
    ball: np.ndarray | None = None

    @property
    def is_synthetic(self) -> bool:
        """Whether the clip is synthetic (`library.synthetic_clips`) and not a recording."""
        return self.path.startswith(SYNTHETIC_FOLDER)

    @property
    def recording(self) -> Motion:
        """The recorded part of the motion."""
        return self.motion if self.recorded_count is None else self.motion.frames(0, self.recorded_count)

    def source_at(self, frame: float) -> str:
        """Return the file that contains `frame` (the clip's own rate), as a path below the library.

        It is the recording, or for frames after its end the synthetic file with the same frames.
        """
        is_synthetic = self.recorded_count is not None and frame > self.recorded_count - 1
        if not is_synthetic:
            return self.path
        return LANDING_FOLDER + self.path + ("" if self.path.lower().endswith(".bvh") else ".bvh")

    @property
    def is_t_pose(self) -> bool:
        """Whether the recording shows nothing but a T-pose."""
        return self.t_pose_frames[0] >= len(self.motion)

    def select_t_poses(self, frames: np.ndarray) -> np.ndarray:
        """Select those of `frames` (T,), in the clip's own rate, that lie in a T-pose or beside it: (T,) bool."""
        (start, end), margin = self.t_pose_frames, T_POSE_MARGIN * self.motion.fps
        last = (len(self.motion) if self.recorded_count is None else self.recorded_count) - 1
        return ((start > 0) & (frames < start + margin)) | ((end > 0) & (frames > last - end - margin))

    @property
    def contacts(self) -> np.ndarray:
        """(T, 2) bool: left and right foot flat on the ground."""
        return self.heel_toe_contacts.all(axis=2)

    def labels_at(self, frame: float) -> frozenset[str]:
        """Return the labels of every row that covers `frame` (the clip's own rate)."""
        return frozenset(word for row in self.annotations if row.start <= frame <= row.end for word in row.words)

    def build_twin(self) -> "Clip":
        """Build the same clip with left and right exchanged, labels too (Faustino §3.1.2)."""
        rows = tuple(replace(row, words=tuple(swap_sides(row.words))) for row in self.annotations)
        heel_toe_contacts = self.heel_toe_contacts[:, ::-1]
        ball = None if self.ball is None else self.ball * (1.0, -1.0, 1.0)
        return Clip(path=self.path, mirrored=not self.mirrored, motion=mirror(self.motion), annotations=rows, ball=ball,
                    heel_toe_contacts=heel_toe_contacts, recorded_count=self.recorded_count,
                    repair_figures=self.repair_figures, has_proposed_labels=self.has_proposed_labels,
                    t_pose_frames=self.t_pose_frames)
