"""Ctrl-C cancels at the master, and a master never outlives its process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from served import Served

import nestrad
from nestrad import protocol

_PATIENCE_S = 60.0
_HERE = Path(__file__).parent

LONG_SOLVE = """
import signal, sys
# a shell that runs the tests in the background has them ignore it
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.path.insert(0, {here!r})
from conftest import OPTICS, small_canopy
import nestrad
from nestrad import program

def look(now):
    if now.stage:
        print("runs", flush=True)

with nestrad.Session({address}) as session:
    if {address} == None:  # noqa: E711
        print("master", program.of_process().process_id, flush=True)
    try:
        session.solve(small_canopy(), OPTICS, nestrad.sky(100), accuracy=0.02, progress=look)
    except KeyboardInterrupt:
        sys.exit("interrupted")
"""


def start(address: str | None) -> subprocess.Popen[str]:
    code = LONG_SOLVE.format(here=str(_HERE), address=repr(address))
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def until(so, what: str) -> None:
    begun = time.monotonic()
    while not so():
        assert time.monotonic() - begun < _PATIENCE_S, what
        time.sleep(0.02)


def lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def states(address: str) -> list[int]:
    with nestrad.Session(address) as session:
        return [
            solve.state for solve in session._calls.answer("ListSolves", protocol.message("ListSolvesRequest")()).solves
        ]


def test_ctrl_c_cancels_at_the_master():
    with Served() as master:
        with start(master.address) as child:
            assert child.stdout.readline() == "runs\n"
            child.send_signal(signal.SIGINT)
            assert child.wait(_PATIENCE_S) == 1
            assert child.stderr.read() == "interrupted\n"
        cancelled = protocol.value("SolveState", "SOLVE_STATE_CANCELLED")
        until(lambda: states(master.address) == [cancelled], "the solve is cancelled")


def test_ctrl_c_ends_a_solve_of_the_own_master_at_once():
    with start(None) as child:
        master = int(child.stdout.readline().split()[1])
        assert child.stdout.readline() == "runs\n"
        child.send_signal(signal.SIGINT)
        begun = time.monotonic()
        assert child.wait(_PATIENCE_S) == 1
        assert time.monotonic() - begun < 20
        assert child.stderr.read() == "interrupted\n"
    until(lambda: not lives(master), "the master ends")


def test_a_master_ends_with_a_process_that_is_killed():
    with start(None) as child:
        master = int(child.stdout.readline().split()[1])
        assert child.stdout.readline() == "runs\n"
        assert lives(master)
        child.kill()
    until(lambda: not lives(master), "the master ends")


def test_a_process_of_its_own_has_a_master_of_its_own():
    code = f"""
import sys, os, multiprocessing
sys.path.insert(0, {str(_HERE)!r})
from conftest import OPTICS, small_canopy
import nestrad
from nestrad import program

def child(send):
    found = nestrad.solve(small_canopy(), OPTICS, nestrad.sun(100, elevation=50), accuracy=5)
    send.put((program.of_process().process_id, float(found.organs.absorbed_W.sum())))

if __name__ == "__main__":
    of_children = multiprocessing.get_context("spawn")
    send = of_children.Queue()
    process = of_children.Process(target=child, args=(send,))
    child(send)
    process.start()
    first, second = send.get(), send.get()
    process.join()
    assert first[0] != second[0] and first[1] == second[1], (first, second)
"""
    script = Path(os.environ.get("TMPDIR", "/tmp")) / f"nestrad-test-{os.getpid()}.py"
    script.write_text(code)
    try:
        ran = subprocess.run(
            [sys.executable, str(script)], capture_output=True, text=True, timeout=_PATIENCE_S, check=False
        )
    finally:
        script.unlink()
    assert ran.returncode == 0, ran.stderr
