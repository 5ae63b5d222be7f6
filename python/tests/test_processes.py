"""Threads, processes, interrupts and resumed runs."""

import multiprocessing
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import joblib
import numpy as np
import pytest
from conftest import PAPER

import slipsweep as ss


def work(t_f):
    """Rows enough for several threads."""
    return float(ss.optimal(**PAPER | dict(t_f=np.linspace(0.02, t_f, 1000)))["work"].sum())


@pytest.fixture(scope="module")
def expected():
    # The pool of this process runs before any fork.
    return [work(t_f) for t_f in (0.03, 0.04, 0.05)]


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_multiprocessing(method, expected):
    with multiprocessing.get_context(method).Pool(2) as pool:
        assert pool.map_async(work, (0.03, 0.04, 0.05)).get(timeout=120) == expected


@pytest.mark.parametrize("backend", ["loky", "multiprocessing", "threading"])
def test_joblib(backend, expected):
    assert joblib.Parallel(2, backend=backend, timeout=120)(joblib.delayed(work)(t_f) for t_f in (0.03, 0.04, 0.05)) == expected


@pytest.mark.parametrize("scheduler", ["processes", "threads"])
def test_dask(scheduler, expected):
    import dask

    tasks = [dask.delayed(work)(t_f) for t_f in (0.03, 0.04, 0.05)]
    assert list(dask.compute(*tasks, scheduler=scheduler, num_workers=2)) == expected


def test_other_threads_continue():
    count, done = 0, threading.Event()

    def tick():
        nonlocal count
        while not done.is_set():
            count += 1
            time.sleep(0.001)

    ticker = threading.Thread(target=tick)
    ticker.start()
    ss.optimal(**PAPER | dict(t_f=np.geomspace(0.01, 0.1, 200_000)))
    done.set()
    ticker.join()
    assert count > 20


def interrupted(call):
    """Seconds from Ctrl-C to the exception."""
    sent = []

    def interrupt():
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    # A shell starts jobs in the background with Ctrl-C ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.3, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        call()
    return time.perf_counter() - sent[0]


def test_ctrl_c_answers_at_once(tmp_path):
    many = np.geomspace(0.01, 0.1, 20_000_000)
    assert interrupted(lambda: ss.optimal(**PAPER | dict(t_f=many))) < 0.2
    # The engine is not left in a state that matters.
    assert ss.optimal(**PAPER)["status"] == "ok"


RUN = """
    import sys, numpy as np, slipsweep as ss
    axes = dict(t_f={"geomspace": [0.01, 0.1, 1_000_000]}, a=0.03, b=0.05, v_i=3.0, v_f=100.0)
    d = ss.run({"name": "long", "axes": axes, "tables": {"optimal": {"columns": ["work"]}}}, sys.argv[1])
    print(len(d["optimal"]))
"""


def test_an_interrupted_run_continues(tmp_path):
    script = [sys.executable, "-c", textwrap.dedent(RUN), str(tmp_path)]
    parts = lambda: len(list(tmp_path.glob("long/optimal/part-*.parquet")))  # noqa: E731
    first = subprocess.Popen(script, stderr=subprocess.PIPE, text=True)
    while parts() < 3 and first.poll() is None:
        time.sleep(0.01)
    sent = time.perf_counter()
    first.send_signal(signal.SIGINT)
    said = first.communicate(timeout=60)[1]
    assert "KeyboardInterrupt" in said and first.returncode != 0
    assert time.perf_counter() - sent < 2.0
    kept = parts()
    assert 3 <= kept < 16
    ages = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("long/optimal/part-*.parquet")}
    second = subprocess.run(script, capture_output=True, text=True, check=True)
    assert second.stdout == "1000000\n" and parts() == 16
    assert all((tmp_path / "long/optimal" / name).stat().st_mtime_ns == age for name, age in ages.items())
