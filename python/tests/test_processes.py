"""Threads, processes, interrupts and resumed runs."""

import multiprocessing
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


def test_workers_return_tables():
    tables = joblib.Parallel(2, timeout=120)(joblib.delayed(ss.optimal)(**PAPER | dict(t_f=[t_f])) for t_f in (0.03, 0.04))
    assert [table["work"][0] for table in tables] == list(ss.optimal(**PAPER | dict(t_f=[0.03, 0.04]))["work"])


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


# What a fresh process does until Ctrl-C; it prints the time of the exception. A shell starts jobs in the background with Ctrl-C ignored.
INTERRUPTED = """
    import signal, sys, time, numpy as np, slipsweep as ss
    signal.signal(signal.SIGINT, signal.default_int_handler)
    paper, out = dict(a=0.03, b=0.05, v_i=3.0, v_f=100.0), sys.argv[1]
    # Rows that take long, just above the critical stiffness.
    slow = dict(k=0.02 * (1 + np.linspace(1e-7, 2e-7, 12)), m=0.0)
    def sweep(name, **axes):
        ss.run({{"name": name, "axes": paper | axes, "tables": {{name: {{}}}}}}, out, progress=False)
    many = np.geomspace(0.01, 0.1, 20_000_000)
    print("ready", flush=True)
    try:
        {call}
    except KeyboardInterrupt:
        print(time.monotonic(), flush=True)
    {after}
    print(ss.optimal(**paper, t_f=0.02)["status"])
"""

CALLS = {
    "a function, many values": "ss.optimal(**paper, t_f=many)",
    "a function, a large grid": "ss.gap(**paper, t_f=np.geomspace(0.01, 0.1, 30), grid=dict.fromkeys(['alpha_2', 'alpha_3'], np.linspace(-1, 1, 1000)))",
    "a function, slow rows": "ss.step_response(**paper, **slow)",
    "a run": "sweep('optimal', t_f={'geomspace': [0.01, 0.1, 20_000_000]})",
    "a run, slow rows": "sweep('step_response', **slow)",
    "a plan": "ss.Sweep({'name': 'plan', 'axes': paper | slow, 'tables': {'step_response': {}}}).plan(out)",
}


@pytest.mark.parametrize("call", CALLS)
def test_ctrl_c_answers_within_a_fifth_of_a_second(call, tmp_path):
    # What was stopped can start again at once.
    after = CALLS[call] if call == "a run, slow rows" else ""
    script = textwrap.dedent(INTERRUPTED).format(call=CALLS[call], after=after)
    delays = []
    # A busy machine may answer late once.
    for attempt in range(3):
        command = [sys.executable, "-c", script, str(tmp_path / str(attempt))]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout.readline() == "ready\n"
            time.sleep(0.3)
            sent = time.monotonic()
            process.send_signal(signal.SIGINT)
            delays.append(float(process.stdout.readline()) - sent)
            assert process.stdout.read() == "ok\n"
        if delays[-1] < 0.2:
            break
    assert min(delays) < 0.2, delays


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
    first.send_signal(signal.SIGINT)
    said = first.communicate(timeout=60)[1]
    assert "KeyboardInterrupt" in said and first.returncode != 0
    kept = parts()
    assert 3 <= kept < 16
    ages = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("long/optimal/part-*.parquet")}
    second = subprocess.run(script, capture_output=True, text=True, check=True)
    assert second.stdout == "1000000\n" and parts() == 16
    assert all((tmp_path / "long/optimal" / name).stat().st_mtime_ns == age for name, age in ages.items())
