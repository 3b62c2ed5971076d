"""A master of nestrad, for programs that hold their canopy in numpy arrays.

Lengths in metres, irradiances in W m-2, powers in W; z points up. Stubs are made from the .proto files
by `set_up`; they document every field.
"""

import time
from dataclasses import dataclass, field

import grpc
import numpy as np
from nestrad.v1 import client_pb2 as pb
from nestrad.v1 import results_pb2 as results_pb
from nestrad.v1 import scene_pb2 as scene_pb
from nestrad.v1.client_pb2_grpc import SolveServiceStub

LEAF, STEM, SOIL, STRUCTURE = range(4)

# messages are 8 MiB at most; a triangle takes about 80 bytes
_TRIANGLES = 6000
_ORGANS = 2000

_CHANNEL = [
    ("grpc.max_receive_message_length", 8 << 20),
    ("grpc.keepalive_time_ms", 20_000),
    ("grpc.keepalive_timeout_ms", 20_000),
]


@dataclass
class Geometry:
    """Triangles, and what they belong to."""

    vertices_m: np.ndarray  # (triangles, 3, 3)
    organ: np.ndarray  # (triangles,), index into organs
    material: np.ndarray  # (triangles,), index into materials
    organs: list  # of (plant, organ), both str
    materials: list  # of (name, LEAF | STEM | SOIL | STRUCTURE)
    pattern_m: tuple | None = None  # min x, min y, max x, max y; None: the scene stands alone
    soil_z_m: float | None = None  # None: light escapes downwards
    species: list | None = None  # one str per organ: plants of two species may have equal names


@dataclass
class Band:
    """A wavelength band: reflectance and transmittance of every material."""

    name: str
    optics: np.ndarray  # (materials, 4): rho and tau of the upper, rho and tau of the lower face
    soil_albedo: float = 0.0


@dataclass
class Sources:
    """Parallel sources above the canopy."""

    direction: np.ndarray  # (sources, 3), in which the light travels
    irradiance_W_m2: np.ndarray  # (sources, bands), on a horizontal surface


@dataclass
class Organs:
    """Light per organ; columns are (organs, bands)."""

    bands: list
    species: list = field(default_factory=list)
    plant: list = field(default_factory=list)
    organ: list = field(default_factory=list)
    area_m2: np.ndarray = None
    irradiance_upper_W_m2: np.ndarray = None
    irradiance_lower_W_m2: np.ndarray = None
    absorbed_W: np.ndarray = None
    absorbed_direct_W: np.ndarray = None
    absorbed_se_W: np.ndarray = None


class Master:
    """A connection to a master at HOST:PORT: encrypted where `ca` (PEM) is given."""

    def __init__(self, address, token=None, ca=None, cert=None, key=None):
        if ca is None:
            channel = grpc.insecure_channel(address, _CHANNEL)
        else:
            credentials = grpc.ssl_channel_credentials(ca, key, cert)
            channel = grpc.secure_channel(address, credentials, _CHANNEL)
        self._channel = channel
        self._stub = SolveServiceStub(channel)
        self._metadata = [("authorization", f"Bearer {token}")] if token else None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._channel.close()

    def upload(self, geometry, bands, sources):
        """Uploads a scene. The answer has scene_id, geometry_id, facts and warnings."""
        return self._upload(lambda: _slices(geometry, bands, sources))

    def relight(self, geometry_id, bands, sources):
        """Uploads other light and optics for a geometry that the master holds."""
        header = _header(bands, sources)
        header.geometry_id = geometry_id
        return self._upload(lambda: iter([scene_pb.SceneSlice(header=header)]))

    def _upload(self, slices):
        return _patiently(lambda: self._stub.UploadScene(slices(), metadata=self._metadata))

    def solve(self, scene_id, progress=None, **options):
        """Starts a solve and waits for its end; `options` are the fields of SolveOptions. `progress` is called
        with every message of the master. Ctrl-C, or any other exception, cancels the solve at the master.
        Returns the name of the solve."""
        request = pb.StartSolveRequest(scene_id=scene_id, options=pb.SolveOptions(**options))
        started = _patiently(
            lambda: self._stub.StartSolve(request, timeout=60, metadata=self._metadata)
        )
        solve_id = started.solve_id
        try:
            request = pb.WatchSolveRequest(solve_id=solve_id)
            for now in self._stub.WatchSolve(request, metadata=self._metadata):
                if progress:
                    progress(now)
        except BaseException:
            self.cancel(solve_id)
            raise
        if now.state != pb.SOLVE_STATE_FINISHED:
            state = pb.SolveState.Name(now.state).removeprefix("SOLVE_STATE_").lower()
            raise RuntimeError(f"solve {solve_id} {state}: {now.reason}")
        return solve_id

    def cancel(self, solve_id):
        """Stops a solve."""
        request = pb.CancelSolveRequest(solve_id=solve_id)
        self._stub.CancelSolve(request, timeout=10, metadata=self._metadata)

    def organs(self, solve_id):
        """Light per organ of a finished solve."""
        slices = [slice.organs for slice in self._fetch(solve_id, results_pb.RESULT_TABLE_ORGANS)]
        organs = Organs(bands=list(slices[0].bands))
        shape = (-1, len(organs.bands))
        for slice in slices:
            organs.species += slice.species
            organs.plant += slice.plant
            organs.organ += slice.id
        organs.area_m2 = np.concatenate([slice.area_m2 for slice in slices])
        for column in results_pb.ItemLight.DESCRIPTOR.fields_by_name:
            values = np.concatenate([getattr(slice.light, column) for slice in slices])
            setattr(organs, column, values.reshape(shape))
        return organs

    def summary(self, solve_id):
        """Energy balance, errors and cost of a finished solve: a SolveSummary."""
        return next(self._fetch(solve_id, results_pb.RESULT_TABLE_SUMMARY)).summary

    def _fetch(self, solve_id, table):
        request = pb.FetchResultsRequest(solve_id=solve_id, table=table)
        return self._stub.FetchResults(request, metadata=self._metadata)


def _patiently(call):
    """A call of a master that may have no room: tried again when it says, for 15 minutes."""
    end = time.monotonic() + 900
    while True:
        try:
            return call()
        except grpc.RpcError as error:
            wait = dict(error.trailing_metadata() or ()).get("retry-after")
            if wait is None or time.monotonic() + float(wait) > end:
                raise
            time.sleep(float(wait))


def _header(bands, sources):
    header = scene_pb.SceneHeader()
    for band in bands:
        header.bands.add(
            name=band.name,
            soil_albedo=band.soil_albedo,
            materials=[
                scene_pb.MaterialOptics(rho_upper=a, tau_upper=b, rho_lower=c, tau_lower=d)
                for a, b, c, d in np.asarray(band.optics)
            ],
        )
    for (x, y, z), irradiance_W_m2 in zip(sources.direction, sources.irradiance_W_m2):
        header.sources.add(
            direction_x=x, direction_y=y, direction_z=z, irradiance_W_m2=irradiance_W_m2
        )
    return header


def _slices(geometry, bands, sources):
    header = _header(bands, sources)
    new = header.new_geometry
    new.triangles = len(geometry.vertices_m)
    new.organs = len(geometry.organs)
    for name, kind in geometry.materials:
        new.materials.add(name=name, kind=kind)
    if geometry.pattern_m is not None:
        names = ("min_x_m", "min_y_m", "max_x_m", "max_y_m")
        new.pattern.CopyFrom(scene_pb.PatternRectangle(**dict(zip(names, geometry.pattern_m))))
    if geometry.soil_z_m is not None:
        new.soil_z_m = geometry.soil_z_m
    yield scene_pb.SceneSlice(header=header)

    for first in range(0, len(geometry.organs), _ORGANS):
        plants, organs = zip(*geometry.organs[first : first + _ORGANS])
        species = geometry.species and geometry.species[first : first + _ORGANS]
        part = scene_pb.OrganSlice(first=first, plant=plants, id=organs, species=species)
        yield scene_pb.SceneSlice(organs=part)

    for first in range(0, len(geometry.vertices_m), _TRIANGLES):
        part = slice(first, first + _TRIANGLES)
        triangles = scene_pb.TriangleSlice(
            first=first,
            vertices_m=np.asarray(geometry.vertices_m[part], float).ravel().tolist(),
            organ=np.asarray(geometry.organ[part]).tolist(),
            material=np.asarray(geometry.material[part]).tolist(),
        )
        yield scene_pb.SceneSlice(triangles=triangles)
