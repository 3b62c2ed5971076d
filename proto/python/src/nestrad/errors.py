"""What can go wrong. All errors of this package are a `NestradError`."""

from __future__ import annotations


class NestradError(Exception):
    """The base of all errors of nestrad."""


class InputError(NestradError, ValueError):
    """An argument cannot be used. The message names it, and says what was expected and what was given."""


class LimitError(NestradError):
    """A limit (memory, time, size, queue) does not allow the solve. The message names the limit."""


class SolveError(NestradError):
    """The solve was computed, and went wrong. The message has the words of the master."""


class CancelledError(NestradError):
    """The solve was cancelled by somebody else."""


class MasterError(NestradError, ConnectionError):
    """The master cannot be reached, went away, or answered what cannot be."""


class AccessError(MasterError):
    """The master does not let this caller in: the token or the certificate is missing or wrong."""


class ProgramError(NestradError):
    """The program `nestrad` is missing, or does not start."""
