"""Sender of a recording in a suit's format, for users without a suit: at its own rate, to this machine only."""

from __future__ import annotations

import os
import select
import socket
import time
from collections.abc import Callable
from pathlib import Path

from ...base.errors import InputError
from ...files.bvh import bvh_text
from .bvh_stream import read_hierarchy
from .listener import LOOPBACK

FORMS = ("bvh", "neuron")
CONNECTIONS = ("udp", "tcp", "serve")
"""Send datagrams; connect to a listener; or wait for a listener to connect, as Axis Neuron does."""
_HEADER_EVERY = 1.0  # s between two hierarchies over UDP
_TICK = 0.2  # s: longest wait between two checks for a stop
_AVATAR = "0 Avatar00 "
_LARGEST_DATAGRAM = 60000  # bytes


class Sender:
    """Sends a BVH file.

    Args:
        path: the BVH file.
        port: port of this machine.
        connection: one of CONNECTIONS.
        form: one of FORMS.
        rate: frames per second; None: the file's.
        loop: whether to repeat the file.
    Raises:
        InputError: for an unknown connection or form, a file that is no BVH file, or frames larger than a datagram.
    """

    def __init__(self, path, port: int, connection: str = "udp", form: str = "bvh", rate: float | None = None,
                 loop: bool = False):
        if connection not in CONNECTIONS or form not in FORMS:
            raise InputError("stream", f"{connection}, {form}",
                             f"one of {', '.join(CONNECTIONS)} and one of {', '.join(FORMS)}")
        text = bvh_text.read_bvh_text(path)
        self.path, self.port, self.connection, self.form, self.loop = Path(path), int(port), connection, form, loop
        self.frame_time = text.frame_time if rate is None else 1.0 / rate
        self.header = f"{read_hierarchy(path)}\nMOTION\nFrames: {len(text.values)}\nFrame Time: {self.frame_time:.6f}\n"
        lead, end = (_AVATAR, " ||") if form == "neuron" else ("", "\n")
        self.rows = [lead + " ".join(f"{value:.4f}" for value in row) + end for row in text.values]
        if connection == "udp" and max(len(self.header), len(self.rows[0])) > _LARGEST_DATAGRAM:
            raise InputError(path, "a frame or hierarchy larger than a datagram", "60 kB at most", "send it over TCP")

    def send_file(self, stopped: Callable[[], bool], report: Callable[[int], None] = lambda frames: None) -> int:
        """Send until the end of the file, or with `loop` until stopped.

        Args:
            stopped: whether to stop.
            report: receives the number of frames sent, after each frame.
        Returns:
            The number of frames sent.
        Raises:
            InputError: if there is no listener.
        """
        out = self._open_socket(stopped)
        if out is None:
            return 0
        with out:
            return self._send_frames(out, stopped, report)

    def _open_socket(self, stopped: Callable[[], bool]) -> socket.socket | None:
        """Open the socket; None if it was stopped before a listener connected."""
        if self.connection == "udp":
            out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            out.connect((LOOPBACK, self.port))
            return out
        if self.connection == "serve":
            return self._wait_for_listener(stopped)
        try:
            return socket.create_connection((LOOPBACK, self.port), timeout=5.0)
        except OSError as error:
            found = f"no listener ({error.strerror or error})"
            raise InputError(f"port {self.port}", found, "a listener", "start the stream in Blender first") from None

    def _wait_for_listener(self, stopped: Callable[[], bool]) -> socket.socket | None:
        """Wait for the first connection; None if it was stopped before."""
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as server:
            if os.name != "nt":  # on Windows it would let two programs share a port
                server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                server.bind((LOOPBACK, self.port))
            except OSError as error:
                raise InputError(f"port {self.port}", f"cannot be used ({error.strerror})", "a free port") from None
            server.listen(1)
            while not stopped():
                if select.select([server], [], [], _TICK)[0]:
                    client = server.accept()[0]
                    client.settimeout(5.0)
                    return client
        return None

    def _send_frames(self, out: socket.socket, stopped: Callable[[], bool], report) -> int:
        """Send frames at their times."""
        start, frame, header_due = time.monotonic(), 0, 0.0
        while not stopped() and (self.loop or frame < len(self.rows)):
            due = start + frame * self.frame_time
            early = due - time.monotonic()
            if early > 0.0:
                time.sleep(min(_TICK, early))
                continue
            if self.form == "bvh" and due >= header_due:
                self._send_text(out, self.header)
                header_due = due + _HEADER_EVERY if self.connection == "udp" else float("inf")
            clock = f"# sent {time.time():.6f}\n" if self.form == "bvh" else ""
            if not self._send_text(out, clock + self.rows[frame % len(self.rows)]):
                break
            frame += 1
            report(frame)
        return frame

    def _send_text(self, out: socket.socket, text: str) -> bool:
        """Send a text; True if it was sent, or if it is a datagram without a receiver."""
        try:
            out.sendall(text.encode())
            return True
        except (ConnectionRefusedError, BlockingIOError):
            return self.connection == "udp"
        except OSError:
            return False
