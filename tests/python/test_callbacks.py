"""Callbacks and cancelling: what a callback raises comes out, Ctrl-C works without a context, nothing is swallowed."""

import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest
import sgrt
from conftest import ISOCENTRE, body_points, take_ctrl_c


@pytest.fixture(scope="module")
def cloud() -> sgrt.Surface:
    return sgrt.Surface(body_points(60_000, 7))


def test_progress_is_called_in_order(cloud):
    seen = []
    cloud.estimate_normals(context=sgrt.Context(progress=lambda fraction, stage: seen.append((stage, fraction))))
    assert seen
    assert all(isinstance(stage, str) and 0 <= fraction <= 1 for stage, fraction in seen)
    for stage in {stage for stage, _ in seen}:
        fractions = [f for s, f in seen if s == stage]
        assert fractions == sorted(fractions)


def test_progress_runs_on_the_calling_thread(cloud):
    threads = set()
    context = sgrt.Context(threads=2, progress=lambda *_: threads.add(threading.get_ident()))
    cloud.estimate_normals(context=context)
    assert threads == {threading.get_ident()}


def test_true_cancels(cloud):
    with pytest.raises(sgrt.Cancelled) as error:
        cloud.estimate_normals(context=sgrt.Context(progress=lambda *_: True))
    assert error.value.word == "cancelled"


class Odd(Exception):
    pass


@pytest.mark.parametrize("raised", [Odd("of my own"), KeyboardInterrupt(), SystemExit(5), MemoryError()])
def test_what_progress_raises_comes_out_unchanged(cloud, raised):
    def progress(fraction, stage):
        raise raised

    context = sgrt.Context(progress=progress)
    with pytest.raises(type(raised)) as error:
        cloud.estimate_normals(context=context)
    assert error.value is raised
    # ... and the context is as good as before for other calls.
    with pytest.raises(type(raised)):
        cloud.estimate_normals(context=context)


def test_an_answer_without_a_truth_value(cloud):
    with pytest.raises(ValueError, match="ambiguous"):
        cloud.estimate_normals(context=sgrt.Context(progress=lambda *_: np.zeros(2)))


def test_wrong_signature(cloud):
    with pytest.raises(TypeError):
        cloud.estimate_normals(context=sgrt.Context(progress=lambda: None))


def test_not_callable():
    with pytest.raises(TypeError):
        sgrt.Context(progress=3)
    with pytest.raises(TypeError):
        sgrt.Context(log="text")


@pytest.mark.parametrize("options", [{"threads": -1}, {"threads": 257}, {"max_isa": "mmx"}])
def test_context_options(options):
    with pytest.raises(sgrt.InvalidArgument, match=next(iter(options))):
        sgrt.Context(**options)


def test_a_callback_may_call_the_library(cloud, reference):
    found = []

    def progress(fraction, stage):
        if not found:
            found.append(sgrt.surface_distance(reference, reference))

    cloud.estimate_normals(context=sgrt.Context(progress=progress))
    assert np.nanmax(np.abs(found[0])) < 0.1


# REQ-CTX-003
def test_but_not_on_its_own_context(cloud, reference):
    def progress(fraction, stage):
        reference.estimate_normals(context=context)

    context = sgrt.Context(progress=progress)
    with pytest.raises(sgrt.InvalidArgument, match="context"):
        cloud.estimate_normals(context=context)


def test_other_threads_run_meanwhile(cloud):
    """The lock of the interpreter is free during a call."""
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.002)

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.perf_counter()
    cloud.estimate_normals()
    end = time.perf_counter()
    stop.set()
    thread.join()
    inside = [t for t in ticks if begin < t < end]
    assert end - begin > 0.02
    assert len(inside) > (end - begin) / 0.05


# REQ-CTX-004
def test_a_shared_context_queues(reference, live):
    context = sgrt.Context(threads=2, progress=lambda *_: None)
    results = []

    def work():
        results.append(sgrt.icp_align(reference, live, isocentre_mm=ISOCENTRE, context=context))

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({r.reference_from_live.tobytes() for r in results}) == 1
    assert len(results) == 4


SCRIPT = """
import sys, sgrt
sys.path.insert(0, {tests!r})
from conftest import body_points
surface = sgrt.Surface(body_points(500_000, 7))
print("ready", flush=True)
try:
    surface.estimate_normals(neighbours=200, {context})
except KeyboardInterrupt:
    print("interrupted")
    sys.exit(7)
print("finished")
"""


@pytest.mark.parametrize("context", ["", "context=sgrt.Context(threads=2)"])
def test_ctrl_c_cancels_a_long_call(context, request):
    code = SCRIPT.format(tests=str(request.path.parent), context=context)
    child = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE, text=True, preexec_fn=take_ctrl_c
    )
    try:
        assert child.stdout.readline() == "ready\n"
        time.sleep(0.5)
        sent = time.perf_counter()
        child.send_signal(signal.SIGINT)
        output, _ = child.communicate(timeout=60)
        waited = time.perf_counter() - sent
    finally:
        child.kill()
    assert (child.returncode, output) == (7, "interrupted\n")
    assert waited < 3
