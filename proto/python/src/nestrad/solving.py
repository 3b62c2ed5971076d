"""A solve at a master, from the upload to the tables, through everything that may go wrong on the way."""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from typing import Any

import grpc
from google.protobuf.message import DecodeError

from . import fetching, protocol, upload
from .calls import Away, Busy, Calls, Forgotten, of_rpc
from .canopy import Canopy
from .errors import (
    CancelledError,
    InputError,
    LimitError,
    MasterError,
    NestradError,
    SolveError,
)
from .light import Light
from .optics import Band
from .progress import Bar
from .results import CanopyLight, Cost, balance_of

# as the command line has it
_FIRST_PATIENCE_S = 10.0
_PATIENCE_S = 60.0
_BUSY_PATIENCE_S = 15 * 60.0
_LONGEST_PAUSE_S = 60.0
_PAUSE_S = 0.5
_MOST_ROUNDS = 8
_CANCEL_S = 10.0
# a stream of progress that ends so soon, without news, is cut off; more of them than these are no accident
_SHORT_S = 10.0
_MOST_SHORT = 10

_STATES = {name: protocol.value("SolveState", f"SOLVE_STATE_{name}") for name in ("FINISHED", "FAILED", "CANCELLED")}
_FAILURES = {
    protocol.value("SolveFailure", "SOLVE_FAILURE_INPUT"): InputError,
    protocol.value("SolveFailure", "SOLVE_FAILURE_LIMIT"): LimitError,
}


class Resident:
    """A canopy, and the name that a master has for its geometry once it was uploaded."""

    def __init__(self, canopy: Canopy) -> None:
        self.canopy = canopy
        self.geometry_id: str | None = None


class Solve:
    """One solve of a canopy."""

    def __init__(self, calls: Calls, resident: Resident, bands: Sequence[Band], light: Light, options: Any) -> None:
        self._calls = calls
        self._resident = resident
        self._bands = bands
        self._light = light
        self._options = options
        self._scene_id: str | None = None
        self._solve_id: str | None = None
        self._heard: float | None = None
        self._busy_since: float | None = None
        self._rounds = 0
        self._short = 0
        self._noted = False
        self._told: Any = None
        self._warnings: tuple[str, ...] = ()
        self._plan: tuple[str, ...] = ()

    def result(self, bar: Bar, triangles: bool) -> CanopyLight:
        """Solves, and fetches the tables. An interrupt cancels the solve at the master."""
        begun = time.monotonic()
        try:
            while True:
                try:
                    return self._attempt(bar, triangles)
                except Busy as busy:
                    self._wait(busy)
                except (Away, Forgotten) as error:
                    if isinstance(error, Forgotten):
                        self._scene_id = self._solve_id = None
                    since = begun if self._heard is None else self._heard
                    patience = _FIRST_PATIENCE_S if self._heard is None else _PATIENCE_S
                    lost = self._rounds > _MOST_ROUNDS or self._short > _MOST_SHORT
                    if lost or time.monotonic() - since > patience:
                        raise MasterError(str(error)) from None
                    self._note(f"{error}: trying again")
                    time.sleep(_PAUSE_S)
        except BaseException:
            self._cancel()
            raise

    def _attempt(self, bar: Bar, triangles: bool) -> CanopyLight:
        if self._solve_id is None:
            if self._scene_id is None:
                self._scene_id = self._upload()
                self._rounds += 1
            request = protocol.StartSolveRequest(scene_id=self._scene_id, options=self._options)
            self._solve_id = self._calls.answer("StartSolve", request).solve_id
            self._busy_since = None
        self._watch(bar)
        found = self._fetch(triangles)
        self._solve_id = None
        return found

    def _wait(self, busy: Busy) -> None:
        """Until the master may have room."""
        now = self._heard = time.monotonic()
        since = self._busy_since = now if self._busy_since is None else self._busy_since
        self._rounds = 0
        wait_s = min(busy.retry_after_s, _LONGEST_PAUSE_S)
        if now - since + wait_s > _BUSY_PATIENCE_S:
            raise LimitError(f"{busy}; the master had no room for {now - since:.0f} s") from None
        self._note(f"the master has no room ({busy}): trying again for {_BUSY_PATIENCE_S / 60:.0f} minutes")
        time.sleep(wait_s)

    def _note(self, note: str) -> None:
        """Says once why it takes so long."""
        if not self._noted:
            self._noted = True
            logging.getLogger("nestrad").warning(note)

    def _upload(self) -> str:
        resident = self._resident
        known = resident.geometry_id
        header = upload.header(resident.canopy, self._bands, self._light, known)
        slices = _Slices(header, upload.slices(resident.canopy) if known is None else ())
        try:
            answer = self._calls.answer("UploadScene", iter(slices), timeout=None)
        except Forgotten:
            resident.geometry_id = None
            raise
        except NestradError:
            slices.raise_fault()
            raise
        self._heard = time.monotonic()
        resident.geometry_id = answer.geometry_id
        self._warnings = tuple(answer.warnings)
        return str(answer.scene_id)

    def _watch(self, bar: Bar) -> None:
        request = protocol.WatchSolveRequest(solve_id=self._solve_id)
        begun, news = time.monotonic(), False
        self._plan = ()
        try:
            for message in _interruptible(self._calls.WatchSolve(request)):
                now = (message.state, message.stage, message.done, message.total, message.ahead)
                news = news or now != self._told
                self._told = now
                if self._is_over(message, bar):
                    return
            raise Away("the stream of progress ended before the solve")
        except Away:
            is_short = not news and time.monotonic() - begun < _SHORT_S
            self._short = self._short + 1 if is_short else 0
            raise

    def _is_over(self, message: Any, bar: Bar) -> bool:
        """Takes a message of progress."""
        self._heard = time.monotonic()
        bar.says(message)
        self._plan += tuple(message.plan)
        if message.state == _STATES["CANCELLED"]:
            self._solve_id = None
            raise CancelledError("the solve was cancelled at the master")
        if message.state == _STATES["FAILED"]:
            self._solve_id = None
            raise _FAILURES.get(message.failure, SolveError)(message.reason)
        return bool(message.state == _STATES["FINISHED"])

    def _fetch(self, triangles: bool) -> CanopyLight:
        canopy = self._resident.canopy
        bands = [band.name for band in self._bands]

        def begun(table: str) -> Any:
            number = protocol.value("ResultTable", f"RESULT_TABLE_{table.upper()}")
            return self._calls.FetchResults(protocol.FetchResultsRequest(solve_id=self._solve_id, table=number), None)

        # all at once: their answers are on the way while others are read
        tables = ("organs", "triangles", "soil", "summary") if triangles else ("organs", "soil", "summary")
        calls = {table: begun(table) for table in tables}

        def fetch(table: str) -> Iterator[memoryview]:
            return map(memoryview, _interruptible(calls[table]))

        try:
            organs = fetching.organs(fetch, canopy, bands)
            of_triangles = fetching.triangles(fetch, canopy, bands) if triangles else None
            soil = fetching.soil(fetch, bands)
            summary = fetching.summary(fetch)
        except NestradError:
            raise
        except (ValueError, DecodeError) as error:
            raise MasterError(f"the master sent what cannot be read: {error}") from None
        finally:
            for call in calls.values():
                call.cancel()
        faults = (summary.fault,) if summary.fault else ()
        stages = {stage.name: stage.wall_s for stage in summary.stages}
        return CanopyLight(
            organs,
            of_triangles,
            soil,
            balance_of(summary),
            self._warnings + faults,
            self._plan,
            Cost(summary.wall_s, summary.cpu_s, stages),
        )

    def _cancel(self) -> None:
        if self._solve_id is not None:
            request = protocol.CancelSolveRequest(solve_id=self._solve_id)
            # the first error counts
            with suppress(NestradError):
                self._calls.answer("CancelSolve", request, timeout=_CANCEL_S)


class _Slices:
    """Slices of an upload. gRPC hides what goes wrong while it takes them: it is kept here."""

    def __init__(self, header: bytes, rest: Iterable[bytes]) -> None:
        self._header = header
        self._rest = rest
        self._fault: BaseException | None = None

    def __iter__(self) -> Iterator[bytes]:
        yield self._header
        try:
            yield from self._rest
        except Exception as fault:
            self._fault = fault
            raise

    def raise_fault(self) -> None:
        """Raises what went wrong, if anything did."""
        if self._fault is not None:
            raise self._fault


def _interruptible(call: Any) -> Iterator[Any]:
    """The answers of a stream. They are read in a thread of their own, as Python drops an interrupt that comes while
    gRPC is in a callback."""
    answers: queue.SimpleQueue[Any] = queue.SimpleQueue()
    end = object()

    def read() -> None:
        try:
            for answer in call:
                answers.put(answer)
            answers.put(end)
        except BaseException as error:
            answers.put(error)

    threading.Thread(target=read, name="nestrad stream", daemon=True).start()
    try:
        while True:
            answer = answers.get()
            if answer is end:
                return
            if isinstance(answer, grpc.RpcError):
                raise of_rpc(answer)
            if isinstance(answer, BaseException):
                raise answer
            yield answer
    finally:
        call.cancel()
