import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from skidpad.campaign.pool import Job, run_jobs

HERE = "tests.campaign.jobs"


@pytest.fixture(autouse=True)
def importable_jobs(monkeypatch):
    root = str(Path(__file__).parents[2])
    monkeypatch.syspath_prepend(root)
    src = str(Path(root) / "src")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([root, src]))


def jobs(function, arguments, deadline=60.0):
    return [
        Job(f"{function}-{i}", f"{HERE}:{function}", a, deadline) for i, a in enumerate(arguments)
    ]


def test_every_job_is_done_once_on_any_number_of_workers():
    for workers in (1, 2):
        done = list(run_jobs(jobs("square", range(7)), workers))
        assert sorted(f.value for f in done) == [0, 1, 4, 9, 16, 25, 36]
        assert all(f.failure is None for f in done)


def test_an_exception_is_reported_with_its_traceback_and_others_go_on():
    done = {f.job.argument: f for f in run_jobs(jobs("odd_only", [1, 2, 3]), 2)}
    assert done[2].failure == "crashed"
    assert "ValueError: 2 is even" in done[2].detail
    assert done[1].value == 1
    assert done[3].value == 3


def test_a_worker_that_kills_itself_costs_only_its_job(tmp_path):
    tries = tmp_path / "tries"
    work = [*jobs("square", range(4)), *jobs("suicide", [str(tries)])]
    done = {f.job.key: f for f in run_jobs(work, 2)}
    assert done["suicide-0"].failure == "crashed"
    assert "exit code -9" in done["suicide-0"].detail
    assert tries.read_text() == "xx"  # tried twice, no more
    assert sum(f.failure is None for f in done.values()) == 4


def test_a_hanging_job_is_killed_at_its_deadline():
    work = [*jobs("sleep", [60.0], deadline=0.5), *jobs("square", range(3))]
    done = {f.job.key: f for f in run_jobs(work, 2)}
    assert done["sleep-0"].failure == "timeout"
    assert sum(f.failure is None for f in done.values()) == 3


def test_a_job_that_fails_once_succeeds_on_the_second_try(tmp_path):
    done = list(run_jobs(jobs("die_first", [str(tmp_path / "mark")]), 1))
    assert [f.value for f in done] == ["second"]


def test_a_worker_that_dies_idle_is_replaced_and_costs_no_attempt(tmp_path):
    done, finished = [], run_jobs(jobs("own_pid", range(3)), 1)
    for end in finished:
        done.append(end.value)
        os.kill(end.value, signal.SIGKILL)  # between two jobs: the pool is waiting for us
        time.sleep(0.3)
    assert len(set(done)) == 3


def test_workers_leave_when_their_parent_is_killed(tmp_path):
    pid_file = tmp_path / "pid"
    code = (
        "from skidpad.campaign.pool import Job, run_jobs\n"
        "if __name__ == '__main__':\n"
        f"    list(run_jobs([Job('a', '{HERE}:write_pid_and_sleep', {str(pid_file)!r})], 1))\n"
    )
    script = tmp_path / "parent.py"
    script.write_text(code)
    parent = subprocess.Popen([sys.executable, str(script)])
    while not (pid_file.exists() and pid_file.read_text()):
        time.sleep(0.05)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    child = int(pid_file.read_text())
    for _ in range(100):
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return
        status = Path(f"/proc/{child}/stat")
        if status.exists() and status.read_text().split(")")[1].split()[0] == "Z":
            return
        time.sleep(0.05)
    pytest.fail("the worker outlived its parent")


def test_workers_use_one_thread_per_library(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    (done,) = run_jobs(jobs("environment", ["OMP_NUM_THREADS"]), 1)
    assert done.value == "1"
    assert os.environ["OMP_NUM_THREADS"] == "7"
