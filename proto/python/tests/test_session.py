"""Sessions: masters elsewhere, canopies that stay resident."""

import os
import shutil
import subprocess
import threading
import time

import numpy as np
import pytest
from conftest import OPTICS
from served import Served, token_file

import nestrad
from nestrad import AccessError, InputError, MasterError, ProgramError, program

TOKEN = "a-token-of-the-crop-model"


def test_a_canopy_is_uploaded_and_traced_once(canopy):
    with Served() as master, nestrad.Session(master.address) as session:
        resident = session.canopy(canopy, OPTICS)
        suns = [nestrad.sun(100, elevation=elevation) for elevation in (20, 50, 80)]
        found = [resident.light(sun, accuracy=2) for sun in suns]
        dry = {band: dict(optics, leaf=(0.3, 0.2)) for band, optics in OPTICS.items()}
        found.append(resident.solve(suns[0], dry, accuracy=2))
        assert session.status().version
    uploads = [line for line in master.log if "scene uploaded" in line]
    assert len(uploads) == 4
    assert len({f.organs.absorbed_W.sum() for f in found}) == 4
    # as if each had been alone
    alone = nestrad.solve(canopy, OPTICS, suns[1], accuracy=2)
    assert (alone.organs.absorbed_W == found[1].organs.absorbed_W).all()


def test_workers_compute_for_a_session(canopy, sun, tmp_path):
    worker = program.find().parent / "nestrad-worker"
    if not worker.exists():
        pytest.skip(f"there is no {worker}")
    clients = token_file(tmp_path, "clients", TOKEN)
    workers = token_file(tmp_path, "workers", "a-token-of-the-workers")
    with Served("--client-token", clients, "--worker-token", workers) as master:
        command = [str(worker), "--master", master.address, "--threads", "1", "--token-file", workers]
        with (
            subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process,
            nestrad.Session(master.address, token=TOKEN) as session,
        ):
            try:
                begun = time.monotonic()
                while not session.status().workers:
                    assert time.monotonic() - begun < 60
                    time.sleep(0.05)
                found = session.solve(canopy, OPTICS, sun, accuracy=1)
                assert sum(worker.done for worker in session.status().workers) > 0
            finally:
                process.terminate()
    here = nestrad.solve(canopy, OPTICS, sun, accuracy=1)
    assert (found.triangles.absorbed_W_m2 == here.triangles.absorbed_W_m2).all()


def test_a_master_wants_its_token(canopy, sun, tmp_path):
    clients = token_file(tmp_path, "clients", TOKEN)
    workers = token_file(tmp_path, "workers", "a-token-of-the-workers")
    with Served("--client-token", clients, "--worker-token", workers) as master:
        for token in (None, "a-token-of-somebody-else", "a-token-of-the-workers"):
            with (
                nestrad.Session(master.address, token=token) as session,
                pytest.raises(AccessError, match=r"token|credentials"),
            ):
                session.solve(canopy, OPTICS, sun)
        with nestrad.Session(master.target, token=TOKEN) as session:
            assert len(session.solve(canopy, OPTICS, sun, accuracy=5).organs) == 20
    assert not any(TOKEN in line for line in master.log)


def test_https_with_an_authority_and_a_certificate(canopy, sun, tmp_path):
    if shutil.which("openssl") is None:
        pytest.skip("there is no openssl, which makes certificates")
    key, cert = tmp_path / "key.pem", tmp_path / "cert.pem"
    make = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=master"]
    make += ["-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(cert)]
    subprocess.run(make, check=True, capture_output=True)
    token = token_file(tmp_path, "clients", TOKEN)
    with Served("--tls-cert", str(cert), "--tls-key", str(key), "--client-token", token) as master:
        for ca in (cert, cert.read_bytes()):
            with nestrad.Session(f"https://{master.target}", token=TOKEN, ca=ca) as session:
                assert len(session.solve(canopy, OPTICS, sun, accuracy=5).organs) == 20


def test_a_master_that_was_started_again_gets_the_canopy_again(canopy, sun, caplog):
    with Served() as first:
        target = first.target
        session = nestrad.Session(first.address)
        resident = session.canopy(canopy, OPTICS)
        before = resident.solve(sun, accuracy=2)
    with session, Served(listen=target):
        after = resident.solve(sun, accuracy=2)
    assert (before.triangles.absorbed_W_m2 == after.triangles.absorbed_W_m2).all()
    assert all("trying again" in record.message for record in caplog.records)


def test_a_solve_outlives_a_master_that_is_killed_meanwhile(canopy, sun):
    masters = [Served()]

    def look(_):
        if len(masters) == 1:
            masters[0].stop()
            masters.append(Served(listen=masters[0].target))

    try:
        with nestrad.Session(masters[0].address) as session:
            found = session.solve(canopy, OPTICS, sun, accuracy=0.5, progress=look)
    finally:
        for master in masters:
            master.stop()
    assert len(masters) == 2
    assert (found.organs.absorbed_W == nestrad.solve(canopy, OPTICS, sun, accuracy=0.5).organs.absorbed_W).all()


def test_a_master_that_is_not_there_is_said_after_ten_seconds(canopy, sun):
    begun = time.monotonic()
    with (
        nestrad.Session("http://127.0.0.1:9") as session,
        pytest.raises(MasterError, match="the master cannot be reached"),
    ):
        session.solve(canopy, OPTICS, sun)
    assert 9 < time.monotonic() - begun < 40


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"address": "localhost"}, "address: expected http://HOST:PORT or https://HOST:PORT, found 'localhost'"),
        ({"address": "http://h:1", "ca": b"x"}, "ca, cert, key: expected an https address"),
        ({"address": "https://h:1", "ca": "/nowhere"}, "ca: expected a file with PEM, found /nowhere"),
        ({"token": "t"}, "token, ca, cert, key: expected with an address only"),
        ({"address": "http://h:1", "threads": 1}, "threads, memory_GiB: expected without an address only"),
    ],
)
def test_sessions_that_cannot_be_are_named(arguments, words):
    with pytest.raises(InputError, match=words):
        nestrad.Session(**arguments)


def test_a_session_may_have_a_master_of_its_own(canopy, sun):
    with nestrad.Session(threads=1, memory_GiB=2) as session:
        own = session._own.process_id
        assert own != program.of_process().process_id
        alone = session.solve(canopy, OPTICS, sun, accuracy=2)
    with pytest.raises(ProcessLookupError):
        os.kill(own, 0)
    # one thread or many: the same bits
    assert (alone.organs.absorbed_W == nestrad.solve(canopy, OPTICS, sun, accuracy=2).organs.absorbed_W).all()


def test_one_master_serves_all_threads_of_a_process(canopy, sun):
    found, masters = [], set()

    def solve():
        found.append(nestrad.solve(canopy, OPTICS, sun, accuracy=2).organs.absorbed_W)
        masters.add(program.of_process().process_id)

    threads = [threading.Thread(target=solve) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(masters) == 1
    assert all((f == found[0]).all() for f in found)


def test_a_master_that_died_is_started_again(canopy, sun):
    before = program.of_process()
    before._process.kill()
    before._process.wait()
    found = nestrad.solve(canopy, OPTICS, sun, accuracy=5)
    assert len(found.organs) == 20
    assert program.of_process() is not before
    before.close()


def test_a_program_that_is_missing_is_named(monkeypatch, tmp_path):
    monkeypatch.setenv("NESTRAD_PROGRAM", str(tmp_path / "nestrad"))
    with pytest.raises(ProgramError, match="NESTRAD_PROGRAM: expected a program, found"):
        program.find()
    monkeypatch.delenv("NESTRAD_PROGRAM")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("sys.executable", str(tmp_path / "python"))
    monkeypatch.setattr("sysconfig.get_path", lambda *_: str(tmp_path))
    with pytest.raises(ProgramError, match="the program nestrad is missing: expected it in"):
        program.find()
    for name, text in (("nestrad", "#!/bin/sh\necho no such thing >&2\nexit 1\n"),):
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    assert program.find() == tmp_path / "nestrad"
    with pytest.raises(ProgramError, match="does not start; it said: no such thing"):
        program.LocalMaster()


def test_optics_are_wanted_somewhere(canopy, sun):
    with nestrad.Session() as session:
        with pytest.raises(InputError, match=r"optics: expected here or in Session.canopy"):
            session.canopy(canopy).solve(sun)
        with pytest.raises(InputError, match=r"optics\['PAR'\]"):
            session.canopy(canopy, {"PAR": {}})


def test_hours_add_up_without_a_leak(canopy):
    with nestrad.Session() as session:
        resident = session.canopy(canopy, OPTICS)
        day = [nestrad.sun(50, elevation=5 + 5 * hour) for hour in range(12)]
        sums = np.array([resident.light(sun, accuracy=5).organs.absorbed_W.sum(0) for sun in day])
    assert sums.shape == (12, 2)
    assert threading.active_count() < 10
