"""Motions in a file instead of memory: those of a library under construction, and all clips of one from the cache.

The file is one npy array of numbers: of each motion its root positions (T, 3), then its rotations (T, J, 4).
"""

from __future__ import annotations

import mmap
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from ..motion.motion import Motion
from ..motion.skeleton import Skeleton

Shape = tuple[Skeleton, int, float]
"""Skeleton, number of frames, and frames per second of a motion."""


class MotionWriter:
    """Writes motions one after the other, to be read like a list when the file is complete.

    Attributes:
        shapes: of the motions so far.
    """

    def __init__(self, path: Path | None):
        """Open the file; None keeps the motions in memory."""
        self.path, self.shapes = path, []  # type: ignore[var-annotated]
        self._kept: list[Motion] = []
        self._file = None if path is None else open(path, "wb")
        self._count = 0
        if self._file:
            self._write_header()

    def append(self, motion: Motion) -> None:
        """Write a motion; OSError where the disk is full."""
        self.shapes.append((motion.skeleton, len(motion), motion.fps))
        if self._file is None:
            self._kept.append(motion)
            return
        for part in (motion.root_positions, motion.rotations):
            self._file.write(np.ascontiguousarray(part).data)
            self._count += part.size

    def finish(self) -> Sequence[Motion]:
        """Complete the file and return its motions."""
        if self._file is None or self.path is None:
            return self._kept
        self._file.seek(0)
        self._write_header()
        self._file.close()
        return MappedMotions(map_array(self.path), self.shapes)

    def discard(self) -> None:
        """Remove the file, whose motions are needed no longer."""
        if self._file is not None and self.path is not None:
            self._file.close()
            with suppress(OSError):  # Windows keeps a file that is still mapped; its folder is removed later
                self.path.unlink()

    def _write_header(self) -> None:
        """Write the header for the numbers so far; numpy pads it, so that a longer number fits into its place."""
        header = {"descr": "<f8", "fortran_order": False, "shape": (self._count,)}
        np.lib.format.write_array_header_1_0(self._file, header)


class MappedMotions(Sequence):
    """The motions of a file, mapped into memory: only what is used is read.

    Each access lets go of what was read before, so that a walk through all motions needs the memory of one. Motions
    that were handed out stay valid; they are read again.
    """

    def __init__(self, numbers: np.ndarray, shapes: Iterable[Shape]):
        """Divide the numbers (N,) of a mapped file into motions, see `divide_into_motions`."""
        self._numbers, self._motions = numbers, divide_into_motions(numbers, shapes)

    def __len__(self) -> int:
        return len(self._motions)

    def __getitem__(self, number):
        self.release()
        return self._motions[number]

    def release(self) -> None:
        """Let go of the memory of all that was read."""
        mapped = self._numbers
        while isinstance(mapped, np.ndarray):
            mapped = mapped.base
        if isinstance(mapped, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
            mapped.madvise(mmap.MADV_DONTNEED)


def divide_into_motions(numbers: np.ndarray, shapes: Iterable[Shape]) -> list[Motion]:
    """Divide the numbers (N,) of a file into its motions, without looking at them.

    Raises:
        ValueError: if they are more or fewer than the shapes say.
    """
    motions, start = [], 0
    for skeleton, count, fps in shapes:
        middle = start + 3 * count
        end = middle + 4 * count * len(skeleton)
        root, rotations = numbers[start:middle], numbers[middle:end]
        motions.append(Motion.from_stored(skeleton, root.reshape(count, 3),
                                          rotations.reshape(count, len(skeleton), 4), fps))
        start = end
    if start != len(numbers):
        raise ValueError(f"{len(numbers)} numbers, {start} expected")
    return motions


def map_array(path: Path) -> np.ndarray:
    """Map the array of an npy file into memory, read-only; OSError or ValueError for a damaged one."""
    return np.load(path, mmap_mode="r", allow_pickle=False).view(np.ndarray)
