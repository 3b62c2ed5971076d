"""How a solve goes on: as a bar on a terminal or in a notebook, or handed to a function."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Progress:
    """Where a solve is."""

    #: what is being done; empty where it has no name
    stage: str
    #: steps of the stage that are done, and steps it has; 0 of 0 where they are not counted
    done: int
    total: int
    #: solves that come before this one
    ahead: int
    #: what is computed and why, a line each; in one message alone
    plan: tuple[str, ...]


#: True or False, a function that gets every `Progress`, or None: a bar where somebody looks
Show = bool | Callable[[Progress], None] | None


class Bar:
    """Shows progress, and takes it away at the end."""

    def __init__(self, show: Show) -> None:
        self._tell = show if callable(show) else None
        wanted = _somebody_looks() if show is None else bool(show) and self._tell is None
        self._make = _maker() if wanted else None
        self._bar: Any = None
        self._stage: tuple[str, int] | None = None

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def says(self, message: Any) -> None:
        """Takes a message of the master."""
        if self._tell is not None:
            now = (message.stage, message.done, message.total, message.ahead)
            self._tell(Progress(*now, tuple(message.plan)))
        if self._make is None:
            return
        text = message.stage or (f"{message.ahead} solves before this one" if message.ahead else "")
        stage = (text, message.total)
        if stage != self._stage:
            self._end()
            self._stage = stage
            self._bar = self._make(text, message.total) if text else None
        if self._bar is not None:
            self._bar.to(message.done)

    def _end(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None


def _in_notebook() -> bool:
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    return type(shell).__name__ == "ZMQInteractiveShell"


def _somebody_looks() -> bool:
    return _in_notebook() or (sys.stderr is not None and sys.stderr.isatty())


def _maker() -> Callable[[str, int], Any]:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return _Line

    class Tqdm:
        def __init__(self, stage: str, total: int) -> None:
            self._bar = tqdm(desc=stage, total=total or None, leave=False, delay=0.3)

        def to(self, done: int) -> None:
            self._bar.update(done - self._bar.n)

        def close(self) -> None:
            self._bar.close()

    return Tqdm


class _Line:
    """A line that is written over, where there is no tqdm."""

    def __init__(self, stage: str, total: int) -> None:
        self._stage, self._total, self._width = stage, total, 0

    def to(self, done: int) -> None:
        text = f"{self._stage} {done}/{self._total}" if self._total else self._stage
        self._write(text)

    def close(self) -> None:
        self._write("")
        sys.stderr.write("\r")
        sys.stderr.flush()

    def _write(self, text: str) -> None:
        sys.stderr.write("\r" + text.ljust(self._width))
        sys.stderr.flush()
        self._width = len(text)
