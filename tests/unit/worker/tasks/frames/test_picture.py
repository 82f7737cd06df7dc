"""The limits of a POV-Ray process: the lower ones of job and worker."""

from __future__ import annotations

from lippmann.job.rendering.render_settings import RenderSettings
from worker.settings import WorkerSettings
from worker.tasks.frames.picture import process_limits, time_limits

GREEDY = RenderSettings(memory_mb=2**20, timeout_s=7 * 86_400)


def test_a_worker_gives_no_more_than_its_own_limits_whatever_the_order_says() -> None:
    worker = WorkerSettings(memory_mb=4096, timeout_s=100)
    limits, times = process_limits(GREEDY, worker), time_limits(GREEDY, worker, is_probe=False)
    assert (limits.memory_mb, times.total.seconds) == (4096, 100)
    assert limits.cpu_s == process_limits(RenderSettings(timeout_s=100), worker).cpu_s
    assert str(times.total) == "100 s, the limit that LIPPMANN_TIMEOUT_S of the worker gives"


def test_threads_have_the_cpu_seconds_that_they_take_together() -> None:
    (one, many) = (process_limits(GREEDY, WorkerSettings(timeout_s=100), threads=threads) for threads in (1, 16))
    assert (one.cpu_s, many.cpu_s) == (400, 1600)


def test_a_job_that_asks_for_less_gets_less() -> None:
    modest = RenderSettings(memory_mb=512, timeout_s=50)
    worker = WorkerSettings(memory_mb=4096, timeout_s=100)
    times = time_limits(modest, worker, is_probe=False)
    assert (process_limits(modest, worker).memory_mb, times.total.seconds) == (512, 50)
    assert str(times.total) == "50 s, the limit that render.timeout_s of the job gives"


def test_the_default_of_a_job_is_within_the_default_of_every_worker() -> None:
    job = RenderSettings()
    assert process_limits(job, WorkerSettings()).memory_mb == job.memory_mb
    assert time_limits(job, WorkerSettings(), is_probe=False).total.seconds == job.timeout_s
