"""The folder of a match: what is in it, which run works in it, and what is done already.

    with open_folder(request.out, identity) as folder:
        folder.write_state({"state": "running", ...})   # match.json, complete
        folder.piece_path("search", name)               # the file of a piece of work

No file in it is ever half-written. One run works in it at a time: the lock is the operating system's, so it ends with
its process, however that ends.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from io import FileIO
from pathlib import Path

from ..base.content import read_bytes
from ..base.errors import InputError, describe_no_folder
from ..files.atomic import atomic_write, build_write_error
from ..files.tables import to_plain
from .request import compute_digest

STATE = "match.json"
LABELS_FOLDER = "annotations"
VERSION = 1
_WORK, _LOCK, _ORDER = ".work", "lock", "order"  # the last file has the request's digest, in case match.json is lost
_PART = re.compile(r"\..+\.\d+\.\d+\.part")  # temporary files of `files.atomic`
_HEAD_BYTES, _DIGEST = 1000, re.compile(
    rb'"digest": *"([0-9a-f]+)"')  # first bytes of match.json, which contain its digest


@dataclass(eq=False)
class MatchFolder:
    """A folder while a run works in it.

    Attributes:
        path: the folder.
        digest: of the request that is worked on.
        previous_state: content of match.json when the folder was opened, {} if there was none or a damaged one.
        notes: messages for people.
    """

    path: Path
    digest: str
    previous_state: dict = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def player_path(self, player_file: str, ending: str) -> Path:
        """The path of a player's file with this ending, such as "take.npz"."""
        return self.path / f"{player_file}.{ending}"

    def labels_path(self, player_file: str) -> Path:
        """The path of the text with a player's labels."""
        return self.path / LABELS_FOLDER / f"{player_file}.txt"

    def write_state(self, state: Mapping) -> None:
        """Write match.json."""
        whole = {"version": VERSION, "digest": self.digest, **state}
        atomic_write(self.path / STATE, json.dumps(to_plain(whole), indent=1, ensure_ascii=False, allow_nan=False)
                     + "\n")

    def piece_path(self, kind: str, name: str) -> Path:
        """The path of a piece of work, whether it exists or not.

        Args:
            kind: of piece.
            name: its digest.
        Returns:
            The path, in an existing folder.
        """
        folder = self.path / _WORK / kind
        folder.mkdir(parents=True, exist_ok=True)
        return folder / f"{name}.npz"

    def has_pieces(self, kind: str) -> bool:
        """Say whether there is any piece of a kind."""
        return any((self.path / _WORK / kind).glob("*.npz"))

    def remove_pieces(self, kind: str, keep: Iterable[str]) -> None:
        """Remove all pieces of a kind except the names in `keep`."""
        kept_names = {f"{name}.npz" for name in keep}
        for path in (self.path / _WORK / kind).glob("*"):
            if path.name not in kept_names:
                path.unlink(missing_ok=True)


@contextlib.contextmanager
def open_folder(path: Path, identity: Mapping[str, object]) -> Iterator[MatchFolder]:
    """Open the folder for a request whose results are determined by `identity`; create it if needed.

    A damaged match.json is set aside, with a note, if there are pieces of work beside it.

    Args:
        path: the folder.
        identity: what determines the results, by name (`request.build_identity`).
    Returns:
        A context manager that gives the folder.
    Raises:
        InputError: if it cannot be created or written, holds results of another request or other files, or another run
            works in it.
    """
    check_folder(path)
    is_new, had_work = not path.exists(), (path / _WORK).exists()
    if (path / STATE).exists() and not any((path / _WORK).glob("*/*.npz")):  # nothing to resume from
        _read_own_state(path)
    try:
        (path / _WORK).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise build_write_error(path, error) from None
    with _hold_lock(path / _WORK / _LOCK, path) as lock:
        try:
            _write_owner(lock, path)
            before, notes = _read_previous_state(path, identity)
            _check_identity(path, before, identity)
            _remove_parts(path)
            atomic_write(path / _WORK / _ORDER, compute_digest(identity))
            yield MatchFolder(path, compute_digest(identity), before, notes)
        finally:
            if not (path / STATE).exists() and not had_work:  # no work has started
                shutil.rmtree(path / _WORK, ignore_errors=True)
                with contextlib.suppress(OSError):  # the user's own folder, or one with texts in it, stays
                    path.rmdir() if is_new else None


def _read_previous_state(path: Path, identity: Mapping[str, object]) -> tuple[dict, tuple[str, ...]]:
    """Read match.json and notes for people; set a damaged one aside.

    InputError if it belongs to another version, or is damaged and still names another request.
    """
    if not (path / STATE).exists():
        return {}, ()
    try:
        return _read_own_state(path), ()
    except _DamagedState as error:
        _check_identity(path, _read_digest(path), identity)
        os.replace(path / STATE, path / f"{STATE}.damaged")
        return {}, (f"{error.what}: renamed to {STATE}.damaged; finished work is found by its pieces",)


def _read_digest(path: Path) -> dict[str, str]:
    """Read the digest of the request from a damaged match.json, or from the folder of pieces."""
    if match := _DIGEST.search((path / STATE).read_bytes()[:_HEAD_BYTES]):
        return {"digest": match[1].decode()}
    kept = path / _WORK / _ORDER
    return {"digest": kept.read_text("ascii", "replace")} if kept.is_file() else {}


def _read_own_state(path: Path) -> dict:
    """Read match.json with the digest of its request; InputError as for `read_state`."""
    state = read_state(path)
    if not isinstance(state.get("digest"), str):
        raise _DamagedState(path / STATE, "no digest")
    return state


class _DamagedState(InputError):
    """A match.json that is not in the expected form. what: where and what, without the next step."""

    def __init__(self, path: Path, found: str):
        super().__init__(path, found, "the state of a match", "choose another folder for the match")
        self.what = f"{path}: {found}"


def _remove_parts(path: Path) -> None:
    """Remove temporary files of a killed run; only this run writes here."""
    for part in path.rglob(".*.part"):
        if _PART.fullmatch(part.name):
            with contextlib.suppress(OSError):
                part.unlink()


def read_state(folder: str | os.PathLike) -> dict:
    """Read a folder's match.json.

    Args:
        folder: the match's folder.
    Returns:
        Its content.
    Raises:
        InputError: if there is none, or it cannot be read.
    """
    path = Path(folder) / STATE
    try:
        state = json.loads(read_bytes(path, "the state of a match"))
    except (ValueError, RecursionError) as error:
        raise _DamagedState(path, f"not valid JSON ({' '.join(str(error).split())[:80]})") from None
    players = state.get("players") if isinstance(state, dict) else None
    ids = [one.get("id") if isinstance(one, dict) else None for one in players] if isinstance(players, list) else [None]
    if not all(isinstance(one, str) and one for one in ids):
        raise _DamagedState(path, "no list of players")
    if "version" not in state:
        raise _DamagedState(path, "no version")
    if state["version"] != VERSION:
        raise InputError(path, f"version {state['version']}", f"{VERSION}", "run the match again with this version")
    return state


def check_folder(path: Path) -> None:
    """Check before work starts that the folder is a match's, empty, or can be created; InputError otherwise."""
    if path.exists() and not path.is_dir():
        raise InputError(path, describe_no_folder(path), "a folder", "choose another name")
    if not path.exists() and not path.absolute().parent.is_dir():
        raise InputError(path, "the folder above it does not exist", "an existing folder", "create that folder first")
    place = path if path.is_dir() else path.absolute().parent
    if not os.access(place, os.W_OK | os.X_OK):
        raise InputError(path, "cannot be written to", "a writable folder", "choose another folder")
    if path.is_dir() and not (path / STATE).exists() and not (path / _WORK).exists():
        other = next((one.name for one in sorted(path.iterdir()) if one.name != LABELS_FOLDER), None)
        if other is not None:
            raise InputError(path, f"holds other files ({other})", "an empty or a new folder", "choose another folder")
    _check_kinds(path)


def _check_kinds(folder: Path) -> None:
    """Check that what stands where a match keeps its state and its folders is a file or a folder as it should be."""
    step = "remove it, or choose another folder for the match"
    if (folder / STATE).is_dir():
        raise InputError(folder / STATE, "is a folder", "the state of a match", step)
    for path in (folder / _WORK, folder / LABELS_FOLDER):
        if path.exists() and not path.is_dir():
            raise InputError(path, describe_no_folder(path), "a folder", step)


def _check_identity(path: Path, before: dict, identity: Mapping[str, object]) -> None:
    """Check that the folder's results belong to this request; InputError names the first difference."""
    if not before or before.get("digest") == compute_digest(identity):
        return
    earlier = before.get("identity")
    known = to_plain(dict(identity)) if isinstance(earlier, dict) else {}
    other = next((name for name in {**known, **(earlier or {})} if earlier.get(name) != known.get(name)), None)
    what = f" (its {_FIELD_NAMES.get(other, other)} differs)" if other else ""
    raise InputError(path, f"holds the results of another request{what}", "a folder for this request only",
                     "choose another folder, or delete this one")


_FIELD_NAMES = {
    "start": "start time", "end": "end time", "tracking": "tracking file", "meta": "metadata", "events": "events file",
    "events_meta": "events metadata", "events_provider": "events provider",
    "joints": "file of joints", "solve_touches": "touch solving", "players": "list of players", "fps": "frame rate",
    "seed": "seed",
    "watch": "strength of watching the ball", "nearest": "nearest labels setting", "provider": "provider",
    "strength": "strength of the legs", "masses": "segment masses", "fatigue": "fatigue",
    "form": "version", "software": "version",
}


@contextlib.contextmanager
def _hold_lock(lock: Path, folder: Path) -> Iterator[FileIO]:
    """Hold the lock and give its open file; InputError if another process has it."""
    with open(lock, "a+b", buffering=0) as file:  # closing would write again what found no room
        try:
            _acquire_lock(file)
        except OSError:
            file.seek(0)
            process = file.read(20).decode("ascii", "replace").strip()
            found = f"another run (process {process}) uses it" if process else "another run uses it"
            raise InputError(folder, found, "one run at a time", "wait for it, or choose another folder") from None
        yield file


def _write_owner(file: FileIO, folder: Path) -> None:
    """Write this process's number into the lock; InputError where the disk is full."""
    try:
        file.truncate(0)
        file.write(str(os.getpid()).encode())
    except OSError as error:
        raise build_write_error(folder, error) from None


def _acquire_lock(file) -> None:
    """Acquire the operating system's lock on an open file, or raise OSError."""
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        file.seek(1 << 20)  # a byte beyond the content: locked bytes cannot be read by others
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]  # Windows only
        return
    fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
