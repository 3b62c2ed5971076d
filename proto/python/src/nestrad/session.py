"""A session with a master, and canopies that stay resident there."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

from . import arrays, program, protocol
from . import optics as optics_of
from .calls import Calls
from .canopy import Canopy
from .errors import InputError
from .light import Light, one_light
from .optics import Optics
from .progress import Bar, Show
from .results import CanopyLight
from .solving import Resident, Solve

Diameter = float | Literal["auto", "inf"]
Estimator = Literal["lines", "rays"]


class Session:
    """A connection to a master. Use it with `with`, or call `close`.

    Args:
        address: http://HOST:PORT or https://HOST:PORT. None: a master of this process, which is started when it is
            first needed, shared by all sessions without address, and ended with the process.
        token: the bearer token of clients.
        ca, cert, key: for https, files with PEM or their content: the authority of the master, and a certificate of
            this client with its key.
        threads: of a local master, 0 for one per processor. With it, or with `memory_GiB`, this session has a local
            master of its own.
        memory_GiB: the most that one solve of a local master may take.

    Raises:
        InputError: the address cannot be used.
        ProgramError: the program `nestrad` is missing or does not start.
    """

    def __init__(
        self,
        address: str | None = None,
        *,
        token: str | None = None,
        ca: str | Path | bytes | None = None,
        cert: str | Path | bytes | None = None,
        key: str | Path | bytes | None = None,
        threads: int | None = None,
        memory_GiB: float | None = None,
    ) -> None:
        self._own: program.LocalMaster | None = None
        if address is not None:
            if threads is not None or memory_GiB is not None:
                raise InputError("threads, memory_GiB: expected without an address only")
            self._calls = Calls(address, token, ca, cert, key)
            return
        if token or ca or cert or key:
            raise InputError("token, ca, cert, key: expected with an address only")
        if threads is None and memory_GiB is None:
            master = program.of_process()
        else:
            master = self._own = program.LocalMaster(threads or 0, memory_GiB)
        self._calls = Calls(master.address, master.token)

    @property
    def address(self) -> str:
        """Where the master is."""
        return self._calls.address

    def canopy(self, canopy: Canopy, optics: Optics | None = None) -> ResidentCanopy:
        """A canopy that stays at the master: it is uploaded and traced once, and lit as often as you like.

        Args:
            canopy: the canopy.
            optics: the optics of its solves, where a solve does not give its own: see `nestrad.solve`.
        """
        if not isinstance(canopy, Canopy):
            raise InputError(f"canopy: expected a nestrad.Canopy, found {type(canopy).__name__}")
        if optics is not None:
            optics_of.bands(optics, canopy)
        return ResidentCanopy(self._calls, canopy, optics)

    def solve(self, canopy: Canopy, optics: Optics, light: Light | Iterable[Light], **options: Any) -> CanopyLight:
        """The light of a canopy: see `nestrad.solve`."""
        return self.canopy(canopy).solve(light, optics, **options)

    def status(self) -> Any:
        """The master, its workers and its load: the message StatusResponse of client.proto, which names its fields."""
        return self._calls.answer("Status", protocol.StatusRequest())

    def close(self) -> None:
        """Ends the session. A master that the process shares goes on until the process ends."""
        self._calls.close()
        if self._own is not None:
            self._own.close()

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class ResidentCanopy:
    """A canopy that stays at a master. Another light, or other optics, trace nothing anew."""

    def __init__(self, calls: Calls, canopy: Canopy, optics: Optics | None) -> None:
        self._calls = calls
        self._resident = Resident(canopy)
        self._optics = optics

    @property
    def canopy(self) -> Canopy:
        """The canopy."""
        return self._resident.canopy

    def solve(
        self,
        light: Light | Iterable[Light],
        optics: Optics | None = None,
        *,
        accuracy: float | None = None,
        diameter: Diameter = "auto",
        memory_GiB: float | None = None,
        seed: int | None = None,
        estimator: Estimator = "lines",
        budget: float | None = None,
        triangles: bool = True,
        progress: Show = None,
    ) -> CanopyLight:
        """The light of the canopy: see `nestrad.solve`. Without `optics`, those of `Session.canopy` are used."""
        chosen = self._optics if optics is None else optics
        if chosen is None:
            raise InputError("optics: expected here or in Session.canopy, found none")
        bands = optics_of.bands(chosen, self.canopy)
        options = _options(accuracy, diameter, memory_GiB, seed, estimator, budget)
        solve = Solve(self._calls, self._resident, bands, one_light(light), options)
        with Bar(progress) as bar:
            return solve.result(bar, triangles)

    def light(self, light: Light | Iterable[Light], optics: Optics | None = None, **options: Any) -> CanopyLight:
        """The same as `solve`."""
        return self.solve(light, optics, **options)


def _options(
    accuracy: float | None,
    diameter: Diameter,
    memory_GiB: float | None,
    seed: int | None,
    estimator: Estimator,
    budget: float | None,
) -> Any:
    message = protocol.SolveOptions()
    for argument, field, given in (
        ("accuracy", "accuracy_percent", accuracy),
        ("memory_GiB", "memory_GiB", memory_GiB),
        ("budget", "budget_s", budget),
    ):
        if given is not None:
            setattr(message, field, _above_zero(argument, given))
    if diameter == "inf" or diameter == math.inf:
        message.diameter_m = math.inf
    elif diameter != "auto":
        if isinstance(diameter, str):
            raise InputError(f"diameter: expected metres, 'auto' or 'inf', found {diameter!r}")
        message.diameter_m = _above_zero("diameter", diameter)
    if seed is not None:
        if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 1 << 64:
            raise InputError(f"seed: expected a whole number from 0 to 2**64 - 1, found {seed!r}")
        message.seed = seed
    if estimator not in ("lines", "rays"):
        raise InputError(f"estimator: expected 'lines' or 'rays', found {estimator!r}")
    message.estimator = protocol.value("Estimator", f"ESTIMATOR_{estimator.upper()}")
    return message


def _above_zero(name: str, given: float) -> float:
    value = arrays.number(name, given, "a number above 0")
    if value <= 0:
        raise InputError(f"{name}: expected a number above 0, found {value}")
    return value


def solve(
    canopy: Canopy,
    optics: Optics,
    light: Light | Iterable[Light],
    *,
    accuracy: float | None = None,
    diameter: Diameter = "auto",
    memory_GiB: float | None = None,
    seed: int | None = None,
    estimator: Estimator = "lines",
    budget: float | None = None,
    triangles: bool = True,
    progress: Show = None,
) -> CanopyLight:
    """The light that every organ and triangle of a canopy absorbs, with its standard errors.

    It is computed by a master of this process, which is started by the first solve and ends with the process. For
    another master, and for many lights of one canopy, use `Session`.

    Args:
        canopy: triangles with their organs and materials.
        optics: a dict of bands; a band is a dict of materials. A material has rho (reflectance) and tau (transmittance)
            of light that arrives on a face: rho, (rho, tau), (rho_upper, tau_upper, rho_lower, tau_lower), or dicts.

            "soil" is the albedo of the soil plane: {"PAR": {"leaf": (0.09, 0.05), "soil": 0.15}}.
        light: what `sun`, `sky`, `sources`, `clear_sky` and `perez_sky` give, a sum of these, or a list of them.
        accuracy: target error of every band, bias included: rms over organs, percent of the mean absorbed power per
            area. With it finer rounds follow until it is met; without it there is one round, planned for 0.5 %.
        diameter: of the sphere within which light is exchanged on the true geometry, metres; "inf"; or "auto", which is
            "inf" where that fits the memory.
        memory_GiB: memory that the solve may take.
        seed: start of all random numbers.
        estimator: "lines"; "rays" is slower and independent of the lines.
        budget: seconds that the solve may take.
        triangles: False leaves out the table of triangles, which saves time and memory.
        progress: True or False, or a function that gets every `Progress`; None shows it on a terminal and in notebooks.

    Raises:
        InputError: an argument cannot be used; the message names it.
        LimitError: memory, time or size do not allow the solve.
        MasterError: the master cannot be reached, or went away.
        ProgramError: the program `nestrad` is missing or does not start.
    """
    with Session() as session:
        return session.canopy(canopy, optics).solve(
            light,
            accuracy=accuracy,
            diameter=diameter,
            memory_GiB=memory_GiB,
            seed=seed,
            estimator=estimator,
            budget=budget,
            triangles=triangles,
            progress=progress,
        )
