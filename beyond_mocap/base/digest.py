"""Content digests: short names for contents, the same in every process and on every machine."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable

import numpy as np

Part = str | bytes | np.ndarray


def hex_digest(*parts: Part, digits: int = 16) -> str:
    """Compute the SHA-256 of all parts, one after the other.

    Args:
        parts: texts (taken as UTF-8), bytes, and arrays (taken as their numbers in C order, without shape or type).
        digits: number of hex digits to return, at most 64.
    Returns:
        The first `digits` hex digits.
    """
    return _fed(hashlib.sha256(), parts).hexdigest()[:digits]


def byte_digest(*parts: Part, size: int = 16) -> bytes:
    """Compute the BLAKE2b digest of all parts, one after the other; faster than SHA-256 on large arrays.

    Args:
        parts: texts (taken as UTF-8), bytes, and arrays (taken as their numbers in C order, without shape or type).
        size: bytes of the digest, at most 64; another size gives a different digest, not a longer one.
    Returns:
        `size` bytes.
    """
    return _fed(hashlib.blake2b(digest_size=size), parts).digest()


def _fed(hashed, parts: Iterable[Part]):
    """Feed all parts to a hash object and return it."""
    for part in parts:
        if isinstance(part, np.ndarray):
            part = np.ascontiguousarray(part).reshape(-1)
        hashed.update(part.encode() if isinstance(part, str) else part)
    return hashed
