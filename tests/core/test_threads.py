"""Calls beside each other in threads."""

from __future__ import annotations

import threading

import pytest

from skidpad.core.kernels import threads
from skidpad.core.kernels.threads import Beside


def test_results_come_by_call_and_all_calls_have_ended():
    gate, ended = threading.Event(), []

    def work(k):
        gate.wait(10.0)
        ended.append(k)
        return k * k

    with Beside() as beside:
        futures = [beside.start(work, k) for k in range(8)]
        gate.set()
    assert sorted(ended) == list(range(8))
    assert [f.result() for f in futures] == [k * k for k in range(8)]


def test_an_error_does_not_leave_others_running():
    ended = threading.Event()

    def slow():
        threading.Event().wait(0.1)
        ended.set()

    def work():
        with Beside() as beside:
            broken = beside.start(lambda: 1 // 0)
            beside.start(slow)
            broken.result()

    with pytest.raises(ZeroDivisionError):
        work()
    assert ended.is_set()


def test_one_processor_needs_no_thread(monkeypatch):
    monkeypatch.setattr(threads, "count_processors", lambda: 1)
    with Beside() as beside:
        assert beside.start(threading.get_ident).result() == threading.get_ident()
