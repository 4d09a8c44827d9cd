import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from skidpad.campaign.workers.pool import run_jobs
from skidpad.campaign.workers.worker import Job
from skidpad.core.vocabulary import Outcome
from support import jobs as work


def jobs(function, arguments, deadline=60.0):
    return [Job(f"{function.__name__}-{i}", function, a, deadline) for i, a in enumerate(arguments)]


def test_every_job_is_done_once_on_any_number_of_workers():
    for workers in (1, 2):
        done = list(run_jobs(jobs(work.square, range(7)), workers))
        assert sorted(f.value for f in done) == [0, 1, 4, 9, 16, 25, 36]
        assert all(f.failure is None for f in done)


def test_an_exception_is_reported_with_its_traceback_and_others_go_on():
    done = {f.job.argument: f for f in run_jobs(jobs(work.odd_only, [1, 2, 3]), 2)}
    assert done[2].failure is Outcome.CRASHED
    assert "ValueError: 2 is even" in done[2].detail
    assert done[1].value == 1
    assert done[3].value == 3


def test_a_worker_that_kills_itself_costs_only_its_job(tmp_path):
    tries = tmp_path / "tries"
    some = [*jobs(work.square, range(4)), *jobs(work.suicide, [str(tries)])]
    done = {f.job.key: f for f in run_jobs(some, 2)}
    assert done["suicide-0"].failure is Outcome.CRASHED
    assert "exit code -9" in done["suicide-0"].detail
    assert tries.read_text() == "xx"  # tried twice, no more
    assert sum(f.failure is None for f in done.values()) == 4


def test_a_hanging_job_is_killed_at_its_deadline():
    some = [*jobs(work.sleep, [60.0], deadline=0.5), *jobs(work.square, range(3))]
    done = {f.job.key: f for f in run_jobs(some, 2)}
    assert done["sleep-0"].failure is Outcome.TIMEOUT
    assert sum(f.failure is None for f in done.values()) == 3


def test_a_job_that_fails_once_succeeds_on_the_second_try(tmp_path):
    done = list(run_jobs(jobs(work.die_first, [str(tmp_path / "mark")]), 1))
    assert [f.value for f in done] == ["second"]


def test_a_job_that_forks_is_answered_once():
    done = list(run_jobs(jobs(work.fork, range(3)), 1))
    assert [f.value for f in done] == [0, 1, 2]
    assert [f.attempts for f in done] == [1, 1, 1]


def test_a_worker_that_dies_idle_is_replaced_and_costs_no_attempt(tmp_path):
    done, finished = [], run_jobs(jobs(work.own_pid, range(3)), 1)
    for end in finished:
        done.append(end.value)
        os.kill(end.value, signal.SIGKILL)  # between two jobs: the pool is waiting for us
        time.sleep(0.3)
    assert len(set(done)) == 3


@pytest.mark.parametrize(
    "begin",
    ["list(run_jobs([Job('a', *long)], 1))", "warm(partial(*long))"],
    ids=["worker", "warm-up"],
)
def test_children_leave_when_their_parent_is_killed(tmp_path, begin):
    pid_file = tmp_path / "pid"
    code = (
        f"import sys; sys.path.insert(0, {str(Path(work.__file__).parents[1])!r})\n"
        "from support import jobs\n"
        "from functools import partial\n"
        "from skidpad.campaign.workers.pool import run_jobs, warm\n"
        "from skidpad.campaign.workers.worker import Job\n"
        "if __name__ == '__main__':\n"
        f"    long = jobs.write_pid_and_sleep, {str(pid_file)!r}\n"
        f"    {begin}\n"
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
    pytest.fail("the child outlived its parent")


def test_workers_use_one_thread_per_library(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    (done,) = run_jobs(jobs(work.environment, ["OMP_NUM_THREADS"]), 1)
    assert done.value == "1"
    assert os.environ["OMP_NUM_THREADS"] == "7"
