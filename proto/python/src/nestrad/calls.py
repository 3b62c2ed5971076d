"""Calls of a master: a channel, its methods, and errors in the master's words."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import grpc

from . import protocol
from .errors import AccessError, InputError, LimitError, MasterError, NestradError, SolveError

_MOST_MESSAGE_BYTES = 8 << 20
_OPTIONS = [
    ("grpc.max_receive_message_length", _MOST_MESSAGE_BYTES),
    ("grpc.max_send_message_length", _MOST_MESSAGE_BYTES),
    ("grpc.keepalive_time_ms", 20_000),
    ("grpc.keepalive_timeout_ms", 20_000),
    # a master that was started again is found again soon
    ("grpc.initial_reconnect_backoff_ms", 500),
    ("grpc.max_reconnect_backoff_ms", 2_000),
    ("grpc.enable_retries", 0),
]
_URL = re.compile(r"(?:(https?)://)?([^/\s]+:\d+)/?\Z")

#: an answer that is not here after this is an error, seconds
ANSWER_S = 60.0


class Away(MasterError):
    """The master may be there again soon."""


class Forgotten(MasterError):
    """The master does not hold what was named, or no longer."""


class Busy(LimitError):
    """The master has no room for now."""

    def __init__(self, message: str, retry_after_s: float) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s


class Calls:
    """A connection to a master. Each method of the service is an attribute; requests may be encoded already.

    Args:
        address: http://HOST:PORT, https://HOST:PORT, or HOST:PORT.
        token: the bearer token of clients.
        ca, cert, key: files with PEM, or their content: the authority of the master, and a certificate of this client
            with its key. An https address without `ca` is checked by the authorities that gRPC knows.
    """

    UploadScene: Any
    StartSolve: Any
    WatchSolve: Any
    FetchResults: Any
    CancelSolve: Any
    Status: Any

    def __init__(
        self,
        address: str,
        token: str | None = None,
        ca: str | Path | bytes | None = None,
        cert: str | Path | bytes | None = None,
        key: str | Path | bytes | None = None,
    ) -> None:
        found = _URL.match(address)
        if not found:
            raise InputError(f"address: expected http://HOST:PORT or https://HOST:PORT, found {address!r}")
        scheme, target = found.groups()
        secure = scheme == "https"
        if not secure and (ca or cert or key):
            raise InputError(f"ca, cert, key: expected an https address, found {address!r}")
        self.address = address
        self._metadata = (("authorization", f"Bearer {token}"),) if token else ()
        if secure:
            credentials = grpc.ssl_channel_credentials(_pem("ca", ca), _pem("key", key), _pem("cert", cert))
            self._channel = grpc.secure_channel(target, credentials, _OPTIONS)
        else:
            self._channel = grpc.insecure_channel(target, _OPTIONS)
        for method in protocol.methods():
            setattr(self, method.name, self._bind(method))

    def _bind(self, method: Any) -> Callable[..., Any]:
        kind = "_".join(
            "stream" if streams else "unary" for streams in (method.client_streaming, method.server_streaming)
        )
        # results come as they are on the wire: their lists are made arrays without a detour
        decode = None if method.name == "FetchResults" else protocol.response(method).FromString
        call = getattr(self._channel, kind)(
            f"/{protocol.PACKAGE}.{protocol.SERVICE}/{method.name}",
            request_serializer=_encoded,
            response_deserializer=decode,
        )
        start = call if method.server_streaming else call.future

        def bound(request: Any, timeout: float | None = None) -> Any:
            return start(request, timeout=timeout, metadata=self._metadata)

        return bound

    def answer(self, method: str, request: Any, timeout: float | None = ANSWER_S) -> Any:
        """The answer of a method that gives one; its errors are those of nestrad. An interrupt cancels the call."""
        future = getattr(self, method)(request, timeout)
        try:
            return future.result()
        except grpc.RpcError as error:
            raise of_rpc(error) from None
        except BaseException:
            future.cancel()
            raise

    def close(self) -> None:
        """Ends the connection."""
        self._channel.close()


def _encoded(request: Any) -> bytes:
    return request if isinstance(request, bytes) else bytes(request.SerializeToString())


def _pem(name: str, given: str | Path | bytes | None) -> bytes | None:
    if given is None or isinstance(given, bytes):
        return given
    try:
        return Path(given).read_bytes()
    except OSError as error:
        raise InputError(f"{name}: expected a file with PEM, found {given}: {error.strerror}") from None


def of_rpc(error: Any) -> NestradError:
    """The error of nestrad for one of gRPC."""
    code = error.code()
    words = error.details() or code.name.lower()
    codes = grpc.StatusCode
    if code in (codes.UNAUTHENTICATED, codes.PERMISSION_DENIED):
        return AccessError(f"the master does not let this caller in: {words}")
    for key, value in error.trailing_metadata() or ():
        if key == "retry-after":
            return Busy(words, float(value))
    if code in (codes.INVALID_ARGUMENT, codes.OUT_OF_RANGE):
        return InputError(words)
    if code is codes.RESOURCE_EXHAUSTED:
        return LimitError(words)
    if code is codes.NOT_FOUND:
        return Forgotten(words)
    if code in (codes.UNAVAILABLE, codes.UNKNOWN, codes.CANCELLED, codes.INTERNAL, codes.DEADLINE_EXCEEDED):
        return Away(f"the master cannot be reached: {words}")
    return SolveError(words)
