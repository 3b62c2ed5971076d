"""A master as somebody else would run it: at an address, with a token."""

from __future__ import annotations

import queue
import subprocess
import threading
from pathlib import Path

from nestrad import program

_PATIENCE_S = 60


class Served:
    """`nestrad serve` with these arguments besides, until it is left."""

    def __init__(self, *args: str, listen: str = "127.0.0.1:0") -> None:
        self.process = subprocess.Popen(
            [str(program.find()), "serve", "--listen", listen, *args],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.log: list[str] = []
        lines: queue.Queue[str] = queue.Queue()

        def follow() -> None:
            for line in self.process.stderr:
                self.log.append(line)
                lines.put(line)

        self._following = threading.Thread(target=follow, daemon=True)
        self._following.start()
        while "serves address=" not in (line := lines.get(timeout=_PATIENCE_S)):
            pass
        self.target = line.partition("serves address=")[2].split()[0]
        self.address = f"http://{self.target}"

    def stop(self) -> None:
        self.process.kill()
        self.process.wait()
        self._following.join()
        self.process.stderr.close()

    def __enter__(self) -> Served:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def token_file(folder: Path, name: str, token: str) -> str:
    path = folder / name
    path.write_text(token)
    return str(path)
