"""Work spread over processes and over a cluster: all of it is done, once, whatever becomes of the workers."""

import os
import signal
import threading
import time

import pytest

from beyond_mocap.base.errors import InputError, UserCancelledError
from beyond_mocap.match.pieces import pool
from beyond_mocap.match.pieces.interrupts import block_interrupts
from beyond_mocap.match.pieces.pool import TaskFailure, WorkerConfig, run_tasks, start_workers


def numbers(count, *more):
    return [(number, (number, *more)) for number in range(count)]


@pytest.mark.parametrize("workers", [1, 2])
def test_everything_is_done_once(chores, workers):
    assert sorted(run_tasks(numbers(9), chores.square, WorkerConfig(workers))) == [(n, n * n) for n in range(9)]


@pytest.mark.parametrize("address, local", [
    ("tcp://127.0.0.1:8786", True), ("localhost:8786", True), ("tls://[::1]:1", True), ("tcp://10.0.0.5:8786", False),
    ("tcp://127.0.0.1.evil.org:8786", False), ("tcp://[bad", False), ("http://localhost@evil.org:1", False),
])
def test_offline_only_this_machine_is_asked(monkeypatch, address, local):
    """Blender says whether it is online; a scheduler elsewhere is not even looked up then."""
    monkeypatch.setenv(pool.OFFLINE, "1")
    monkeypatch.setattr("socket.getaddrinfo", lambda *_, **__: pytest.fail("looked up"))
    assert pool._is_loopback(address) is local
    if not local:
        with pytest.raises(InputError, match="another machine, and Blender is offline.*Allow Online Access"):
            pool.check_workers(WorkerConfig(1, address))


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="the system has no such masks")
def test_ctrl_c_does_not_reach_processes_that_are_being_started(chores):
    """They are started by a thread here; what comes in the meantime reaches this process afterwards."""
    pool.stop_workers()
    found = []
    thread = threading.Thread(target=lambda: found.extend(run_tasks(numbers(2), chores.blocks, WorkerConfig(2))))
    thread.start()
    thread.join(120.0)
    assert sorted(found) == [(0, True), (1, True)]
    arrived, before = False, signal.signal(signal.SIGINT, signal.default_int_handler)  # in the background it is ignored
    try:
        with pytest.raises(KeyboardInterrupt), block_interrupts():
            signal.pthread_kill(threading.get_ident(), signal.SIGINT)
            arrived = True
    finally:
        signal.signal(signal.SIGINT, before)
    assert arrived and signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


@pytest.mark.parametrize("workers", [1, 2])
def test_what_fails_fails_alone_and_says_why(chores, workers):
    found = dict(run_tasks(numbers(5), chores.odd, WorkerConfig(workers)))
    assert found == {0: 0, 2: 2, 4: 4, 1: TaskFailure("ValueError: 1 is odd"), 3: TaskFailure("ValueError: 3 is odd")}


def test_tasks_are_taken_only_as_far_as_there_are_workers(chores):
    taken = []

    def watched():
        for task in numbers(40):
            taken.append(task)
            yield task

    going = run_tasks(watched(), chores.square, WorkerConfig(2))
    next(going)
    assert len(taken) <= 2 * pool.PIECES_PER_WORKER + 1
    assert len(list(going)) == 39


def test_a_worker_that_is_killed_costs_nothing(chores, tmp_path):
    found = dict(run_tasks(numbers(8, tmp_path, 1), chores.deadly, WorkerConfig(2)))
    assert {key: value[0] for key, value in found.items()} == {n: n for n in range(8)}


def test_a_worker_that_ends_while_results_are_looked_at_costs_nothing(chores):
    """The pool is broken before anything else is handed out."""
    going = run_tasks([(number, (0.01,)) for number in range(12)], chores.slow, WorkerConfig(2))
    found = [next(going)]
    os.kill(found[0][1], signal.SIGKILL)
    time.sleep(1.0)
    found += going
    assert sorted(key for key, _ in found) == list(range(12))


def test_a_piece_that_kills_every_worker_fails_alone(chores, tmp_path):
    found = dict(run_tasks(numbers(8, tmp_path, 99), chores.deadly, WorkerConfig(2)))
    assert "worker process ended" in found.pop(3).reason
    assert {key: value[0] for key, value in found.items()} == {n: n for n in range(8) if n != 3}


def test_workers_that_are_started_early_change_nothing(chores):
    """Whether what they begin with ends well, fails, or ends them."""
    for work, number in ((chores.square, 2), (chores.odd, 1), (os._exit, 1)):
        start_workers(WorkerConfig(2), work, (number,))
        time.sleep(1.0)
        assert sorted(run_tasks(numbers(5), chores.square, WorkerConfig(2))) == [(n, n * n) for n in range(5)]


def test_cancelling_does_not_wait_for_the_work(chores):
    begun = time.monotonic()
    with pytest.raises(UserCancelledError):
        list(run_tasks([(n, (60.0,)) for n in range(4)], chores.slow, WorkerConfig(2), lambda: time.monotonic() > begun
                       + 1.0))
    assert time.monotonic() - begun < 50.0


def test_what_pieces_took_is_told(chores):
    told = []
    list(run_tasks(numbers(3), chores.square, WorkerConfig(2), report_result=told.append))
    assert len(told) == 3 and all(5.0 < one.memory < 1000.0 and 0.0 <= one.seconds < 5.0 for one in told)


def test_fewer_than_one_worker_is_told():
    with pytest.raises(InputError, match="workers: 0; expected 1 or more"):
        WorkerConfig(0)


def test_a_scheduler_that_does_not_answer_is_told(chores, monkeypatch):
    monkeypatch.setattr(pool, "_ANSWER_TIMEOUT", "500ms")
    for address in ("tcp://127.0.0.1:9", "nonsense://x"):
        with pytest.raises(InputError, match="scheduler: .* does not answer"):
            list(run_tasks(numbers(1), chores.square, WorkerConfig(1, address)))


def test_a_cluster_does_the_same_though_a_worker_is_killed_midway(chores, cluster):
    address, processes = cluster
    tasks = [(n, (0.1,)) for n in range(30)]
    found, killed = {}, False
    for key, pid in run_tasks(tasks, chores.slow, WorkerConfig(1, address)):
        found[key] = pid
        if len(set(found.values())) == 2 and not killed:
            killed = True
            os.kill(processes[1].pid, signal.SIGKILL)
    assert killed and set(found) == set(range(30))
    assert all(isinstance(pid, int) for pid in found.values())
    assert sorted(run_tasks(numbers(9), chores.square, WorkerConfig(1, address))) == [(n, n * n) for n in range(9)]


@pytest.mark.parametrize("gone, told", [([0, 1, 2], "the scheduler has stopped"), ([1, 2], "no worker for 1 s")])
def test_a_cluster_that_goes_away_is_told(chores, cluster, monkeypatch, gone, told):
    address, processes = cluster
    monkeypatch.setattr(pool, "MAX_WAIT", 1.0)
    threading.Timer(2.0, lambda: [processes[number].kill() for number in gone]).start()
    with pytest.raises(InputError, match=f"scheduler: {told}"):
        list(run_tasks([(n, (60.0,)) for n in range(4)], chores.slow, WorkerConfig(1, address)))
