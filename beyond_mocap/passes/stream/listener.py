"""Listener for a BVH stream on this machine: one thread receives what arrives, the display asks for it.

Only the loopback address is bound or called, so nothing from another machine comes in and nothing goes out. Frames stay
in a ring buffer of some seconds. The thread never waits longer than a fifth of a second, reads a limited number of
bytes
per second, and ends with `stop`, which also closes all sockets.
"""

from __future__ import annotations

import atexit
import os
import select
import socket
import statistics
import threading
import time
import weakref
from collections import deque
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...files.bvh.bvh import BvhRows
from ...motion.skeleton import Skeleton
from .bvh_stream import BvhStream

LOOPBACK = "127.0.0.1"
PORT = 7001
PROTOCOLS = ("udp", "tcp", "call")
"""Datagrams that arrive; a sender connects to us; or we connect to a waiting sender, as Axis Neuron is."""
STALLED = 1.0
"""Seconds without a frame after which a stream counts as stalled."""
_SPOKEN = {"udp": "UDP", "tcp": "TCP", "call": "TCP"}
_TICK = 0.2  # s: longest wait for a socket
_CHUNK = 1 << 16  # bytes read at once
_MOST_A_SECOND = 8 << 20  # bytes read per second
_CALL_AGAIN = 1.0  # s between two attempts to connect
_RING = 6000  # frames in the ring buffer at most
_MEASURED = 60  # latest frames from which rate and delay are measured
_alive: weakref.WeakSet[Listener] = weakref.WeakSet()


@dataclass(frozen=True, eq=False, kw_only=True)
class Arrived:
    """A frame that has arrived.

    Attributes:
        number: counts from 1.
        time: s of the monotonic clock at which it arrived.
        sent: s of the same clock at which it was sent, or None.
        values: (C,) channels in the stream's units.
        rows: converts such values to poses.
    """

    number: int
    time: float
    sent: float | None
    values: np.ndarray
    rows: BvhRows


@dataclass(frozen=True, kw_only=True)
class Status:
    """The state of a stream.

    Attributes:
        state: "waiting" (no frame yet), "receiving", "stalled", "ended" (the sender has closed the connection),
            "failed", or "stopped".
        frames: total number of frames.
        rate: frames per second, recently.
        idle: s since the last frame.
        delay: median delay in s from sender to listener; None if the sender sends no times.
        invalid_count: number of invalid pieces.
        line: one line for the user.
    """

    state: str
    frames: int
    rate: float
    quiet: float
    way: float | None
    rubbish: int
    line: str


class Listener:
    """Receives one stream at a time.

    Args:
        port: 1024 to 65535.
        protocol: one of PROTOCOLS.
        hierarchy: text of a BVH HIERARCHY section, for streams without one.
        unit: metres per unit of the stream; None: guessed.
        seconds: how long frames stay in the ring buffer.
    Raises:
        InputError: for an unknown protocol or a port out of range.
    """

    def __init__(self, port: int = PORT, protocol: str = "udp", hierarchy: str | None = None, unit: float | None = None,
                 seconds: float = 20.0):
        if protocol not in PROTOCOLS:
            raise InputError("protocol", f"{protocol!r}", f"one of {', '.join(PROTOCOLS)}")
        if not 1024 <= int(port) <= 65535:
            raise InputError("port", f"{port}", "1024 to 65535", f"suits often use {PORT}")
        self.port, self.protocol, self.seconds = int(port), protocol, seconds
        self.stream = BvhStream(hierarchy, unit)
        self._lock = threading.Lock()
        self._ring: deque[Arrived] = deque(maxlen=_RING)
        self._count = 0
        self._stop = threading.Event()
        self._state, self._why = "waiting", ""
        self._came, self._heard = 0, 0.0
        self._thread: threading.Thread | None = None
        self._server: socket.socket | None = None

    def start(self) -> "Listener":
        """Bind the port and start the thread.

        Raises:
            InputError: if another program uses the port.
        """
        if self.protocol != "call":
            kind = socket.SOCK_DGRAM if self.protocol == "udp" else socket.SOCK_STREAM
            self._server = socket.socket(socket.AF_INET, kind)
            try:
                if self.protocol == "tcp" and os.name != "nt":  # on Windows it would let two programs share a port
                    self._server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                self._server.bind((LOOPBACK, self.port))
                if self.protocol == "tcp":
                    self._server.listen(1)
            except OSError as error:
                self._server.close()
                raise InputError(f"port {self.port}", f"not available ({error.strerror or error})",
                                 "a free port", "choose another one, or stop the program that uses it") from None
        self._thread = threading.Thread(target=self._run, name="beyond_mocap stream", daemon=True)
        _alive.add(self)
        self._thread.start()
        return self

    def stop(self) -> None:
        """End the thread and close all sockets; repeated calls are allowed."""
        self._stop.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(5.0 * _TICK)
        self._state = "stopped" if self._state != "failed" else self._state
        _alive.discard(self)

    @property
    def running(self) -> bool:
        """Whether the thread still listens."""
        return self._thread is not None and self._thread.is_alive() and not self._stop.is_set()

    def since(self, number: int = 0) -> list[Arrived]:
        """List the frames after frame `number` that are still in the ring buffer, oldest first."""
        with self._lock:
            found = []
            for frame in reversed(self._ring):
                if frame.number <= number:
                    break
                found.append(frame)
        return found[::-1]

    def latest(self) -> Arrived | None:
        """Find the newest frame; None if there is none."""
        with self._lock:
            return self._ring[-1] if self._ring else None

    def status(self) -> Status:
        """Measure the state of the stream now."""
        now = time.monotonic()
        with self._lock:
            recent = list(self._ring)[-_MEASURED:]
            count = self._count
        quiet = now - recent[-1].time if recent else 0.0
        rate = 0.0
        if len(recent) > 1 and quiet <= STALLED:
            rate = (len(recent) - 1) / max(recent[-1].time - recent[0].time, 1e-6)
        ways = [way for way in map(_way, recent) if way is not None]
        state = self._state
        if state == "receiving" and quiet > STALLED:
            state = "stalled"
        way = statistics.median(ways) if ways else None
        return Status(state=state, frames=count, rate=rate, quiet=quiet, way=way, rubbish=self.stream.rubbish,
                      line=self._line(state, rate, quiet))

    def _line(self, state: str, rate: float, quiet: float) -> str:
        """Describe the state in one line for the user."""
        what = f"{_SPOKEN[self.protocol]} port {self.port}"
        if state == "receiving":
            return f"{rate:.0f} frames per second on {what}"
        if state == "stalled":
            return f"The stream has stalled: no frame for {quiet:.0f} s on {what}; start the sender again"
        if state == "ended":
            return f"The sender has closed the connection ({what}); waiting for it to connect again"
        if state == "failed":
            return f"The stream has failed: {self._why}; stop it and start it again"
        if state == "stopped":
            return "Not listening"
        if self.stream.rubbish:
            return f"{self.stream.rubbish} invalid pieces on {what}: {self.stream.told}"
        return f"Waiting for frames on {what} of this machine" if not self._why else f"{self._why} ({what})"

    def _run(self) -> None:
        """Receive until stopped; an error ends in the state "failed"."""
        try:
            {"udp": self._datagrams, "tcp": self._connections, "call": self._calls}[self.protocol]()
        except Exception as error:  # a thread that ends silently would look like a waiting stream
            self._state, self._why = "failed", f"{type(error).__name__}: {error}"
        finally:
            if self._server is not None:
                self._server.close()

    def _datagrams(self) -> None:
        """Receive UDP datagrams."""
        while not self._stop.is_set():
            if _readable(self._server):
                try:
                    data = self._server.recv(_CHUNK)
                except OSError:  # Windows reports resets for datagrams that were never sent
                    continue
                self._take(data, whole=True)

    def _connections(self) -> None:
        """Accept TCP connections, one at a time; a new one replaces the old one."""
        client = None
        try:
            while not self._stop.is_set():
                waiting = [self._server] if client is None else [self._server, client]
                ready, _, _ = select.select(waiting, [], [], _TICK)
                if self._server in ready:
                    client = self._instead(client, self._server.accept()[0])
                elif client in ready and not self._read(client):
                    client = self._instead(client, None)
        finally:
            self._instead(client, None)

    def _instead(self, old: socket.socket | None, new: socket.socket | None) -> socket.socket | None:
        """Replace a connection; incomplete pieces are dropped."""
        if old is not None:
            old.close()
            self.stream.lost()
            self._state = "ended" if self._count else "waiting"
        if new is not None:
            new.setblocking(False)
        return new

    def _calls(self) -> None:
        """Connect to a waiting sender, again and again."""
        while not self._stop.is_set():
            try:
                with socket.create_connection((LOOPBACK, self.port), timeout=_CALL_AGAIN) as client:
                    client.setblocking(False)
                    self._why = ""
                    while not self._stop.is_set():
                        if _readable(client) and not self._read(client):
                            break
                self.stream.lost()
                self._state = "ended" if self._count else "waiting"
            except OSError as error:
                self._why = f"No sender answers: {error.strerror or error}"
            self._stop.wait(_CALL_AGAIN)

    def _read(self, client: socket.socket) -> bool:
        """Read the bytes of a connection; False if it has ended."""
        try:
            data = client.recv(_CHUNK)
        except BlockingIOError:
            return True
        except OSError:
            return False
        if data:
            self._take(data)
        return bool(data)

    def _take(self, data: bytes, whole: bool = False) -> None:
        """Parse bytes and store their frames; a flood of bytes is slowed down."""
        now = time.monotonic()
        if now - self._heard >= 1.0:
            self._came, self._heard = 0, now
        self._came += len(data)
        if self._came > _MOST_A_SECOND:  # slow down a sender that floods the port
            self._stop.wait(max(0.0, self._heard + 1.0 - now))
        for frame in self.stream.feed(data, whole):
            with self._lock:
                self._count += 1
                if self._ring and frame.rows is not self._ring[-1].rows:
                    self._ring.clear()  # another skeleton: frames of the old one do not fit
                self._ring.append(Arrived(number=self._count, time=now, sent=_clock(frame.sent, now),
                                          values=frame.values, rows=frame.rows))
                while now - self._ring[0].time > self.seconds:
                    self._ring.popleft()
            self._state = "receiving"


def poses(frames: list[Arrived]) -> tuple[Skeleton, np.ndarray, np.ndarray]:
    """Convert frames of one body to poses.

    Args:
        frames: T frames.
    Returns:
        skeleton: the body's skeleton.
        root: (T, 3) m, Z up.
        rotations: (T, J, 4) local rotations.
    """
    rows = frames[-1].rows
    return rows.skeleton, *rows.poses(np.array([frame.values for frame in frames]))


def _way(frame: Arrived) -> float | None:
    """Compute the delay of a frame in s; None if it is unknown or the clocks do not agree."""
    way = None if frame.sent is None else frame.time - frame.sent
    return way if way is not None and -0.01 <= way <= 60.0 else None


def _clock(sent: float | None, now: float) -> float | None:
    """Convert seconds of the Unix clock to seconds of the monotonic clock."""
    return None if sent is None else sent - time.time() + now


def _readable(one: socket.socket) -> bool:
    """Whether a socket has data, after waiting _TICK at most."""
    return bool(select.select([one], [], [], _TICK)[0])


@atexit.register
def _stop_all() -> None:
    """Stop all listeners when the program exits."""
    for listener in list(_alive):
        listener.stop()
