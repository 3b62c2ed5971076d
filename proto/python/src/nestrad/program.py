"""A master of this process: the program `nestrad serve`, started when it is first needed and ended with the process."""

from __future__ import annotations

import atexit
import os
import queue
import secrets
import shutil
import subprocess
import sys
import sysconfig
import threading
from collections import deque
from pathlib import Path

from .errors import ProgramError

PROGRAM = "nestrad"
#: names the program that is to be used
VARIABLE = "NESTRAD_PROGRAM"
_START_S = 60.0
_END_S = 5.0
_SERVES = "serves address="
_LOG_LINES = 20


def find() -> Path:
    """The program: what NESTRAD_PROGRAM names; else the one beside this Python or in its folder of scripts, where the
    wheel puts it; else the first one on the path."""
    named = os.environ.get(VARIABLE)
    if named:
        path = Path(named)
        if not path.is_file() or not os.access(path, os.X_OK):
            raise ProgramError(f"{VARIABLE}: expected a program, found {named!r}")
        return path
    folders = [Path(sys.executable).parent, Path(sysconfig.get_path("scripts"))]
    user = f"{os.name}_user"
    if user in sysconfig.get_scheme_names():
        folders.append(Path(sysconfig.get_path("scripts", user)))
    for folder in folders:
        path = folder / PROGRAM
        if path.is_file() and os.access(path, os.X_OK):
            return path
    on_path = shutil.which(PROGRAM)
    if on_path:
        return Path(on_path)
    looked = ", ".join(map(str, dict.fromkeys(folders)))
    raise ProgramError(
        f"the program {PROGRAM} is missing: expected it in {looked} or on PATH; "
        f"install the wheel of nestrad, or set {VARIABLE} to the program"
    )


class LocalMaster:
    """A running `nestrad serve` on a free port of the loopback, with tokens that nobody else has.

    It ends when this process ends in whatever way, because then its stdin closes.

    Args:
        threads: 0 is one per processor.
        memory_GiB: the most that one solve may take. None: 90 % of the machine's memory, and 8 at least.
    """

    def __init__(self, threads: int = 0, memory_GiB: float | None = None) -> None:
        self.token = secrets.token_hex(24)
        self._owner = os.getpid()
        self._log: deque[str] = deque(maxlen=_LOG_LINES)
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        program = find()
        files = [_pipe(self.token), _pipe(secrets.token_hex(24))]
        args = [str(program), "serve", "--listen", "127.0.0.1:0", "--with-stdin"]
        args += ["--client-token", f"/dev/fd/{files[0]}", "--worker-token", f"/dev/fd/{files[1]}"]
        args += ["--threads", str(threads)]
        args += ["--memory", repr(_memory_GiB() if memory_GiB is None else memory_GiB)]
        try:
            self._process = subprocess.Popen(
                args,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                pass_fds=files,
                # Ctrl-C on the terminal is for this process
                start_new_session=True,
                env={**os.environ, "NESTRAD_LOG": "info"},
            )
        except OSError as error:
            raise ProgramError(f"{program}: expected a program, found {error}") from None
        finally:
            for file in files:
                os.close(file)
        self._following = threading.Thread(target=self._follow, name="nestrad log", daemon=True)
        self._following.start()
        self.address = self._wait_until_it_serves(program)
        atexit.register(self.close)

    def _follow(self) -> None:
        stderr = self._process.stderr
        assert stderr is not None
        waits = True
        with stderr:
            for line in stderr:
                text = line.decode(errors="replace").rstrip()
                self._log.append(text)
                if waits:
                    self._lines.put(text)
                    waits = _SERVES not in text
        self._lines.put(None)

    def _wait_until_it_serves(self, program: Path) -> str:
        while True:
            try:
                line = self._lines.get(timeout=_START_S)
            except queue.Empty:
                line = None
            except BaseException:
                self.close()
                raise
            if line is None:
                self.close()
                said = "\n".join(self._log) or "nothing"
                raise ProgramError(f"{program} does not start; it said: {said}")
            if _SERVES in line:
                return "http://" + line.partition(_SERVES)[2].split()[0]

    @property
    def runs(self) -> bool:
        """Whether the program is running."""
        return self._process.poll() is None

    @property
    def process_id(self) -> int:
        """The number of its process."""
        return self._process.pid

    def close(self) -> None:
        """Ends the program, and whatever it computes."""
        if os.getpid() != self._owner:
            # a forked process has no part in it
            return
        atexit.unregister(self.close)
        if self._process.stdin is not None:
            self._process.stdin.close()
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._following.join(_END_S)


_OF_PROCESS: dict[int, LocalMaster] = {}
_LOCK = threading.Lock()


def of_process() -> LocalMaster:
    """The master that all solves of this process share; a forked process gets its own."""
    with _LOCK:
        process = os.getpid()
        master = _OF_PROCESS.get(process)
        if master is None or not master.runs:
            _OF_PROCESS.clear()
            master = _OF_PROCESS[process] = LocalMaster()
        return master


def _memory_GiB() -> float:
    try:
        total_bytes = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (OSError, ValueError):
        total_bytes = 0
    return max(8.0, round(0.9 * total_bytes / 2**30, 3))


def _pipe(token: str) -> int:
    """A file that has the token, and that no other process can read."""
    read, write = os.pipe()
    os.write(write, token.encode())
    os.close(write)
    return read
