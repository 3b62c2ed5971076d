"""How much light every leaf of a 3D crop absorbs, in as many wavelength bands as you name.

    import nestrad

    canopy = nestrad.Canopy(vertices, triangles, organ=organ, pattern=(0, 0, 0.8, 1.5), soil_z=0.0)
    optics = {"PAR": {"leaf": (0.09, 0.05), "soil": 0.15}}
    light = nestrad.solve(canopy, optics, nestrad.sky(400.0), accuracy=1)
    light.organs.absorbed_W

Lengths are metres, irradiances W m-2, powers W; z points up, x east, y north. `nestrad.caribu` has the calls of CARIBU.
"""

from .canopy import Canopy, Material
from .errors import (
    AccessError,
    CancelledError,
    InputError,
    LimitError,
    MasterError,
    NestradError,
    ProgramError,
    SolveError,
)
from .light import Light, Sky, Sources, sky, sources, sun
from .progress import Progress
from .results import Balance, BandBalance, CanopyLight, Cost, Quantity
from .session import ResidentCanopy, Session, solve
from .solar import SunPosition, sun_position
from .tables import OrganTable, SoilTable, TriangleTable
from .weather import clear_sky, perez_sky

__all__ = [
    "AccessError",
    "Balance",
    "BandBalance",
    "CancelledError",
    "Canopy",
    "CanopyLight",
    "Cost",
    "InputError",
    "Light",
    "LimitError",
    "MasterError",
    "Material",
    "NestradError",
    "OrganTable",
    "ProgramError",
    "Progress",
    "Quantity",
    "ResidentCanopy",
    "Session",
    "Sky",
    "SoilTable",
    "SolveError",
    "Sources",
    "SunPosition",
    "TriangleTable",
    "clear_sky",
    "perez_sky",
    "sky",
    "solve",
    "sources",
    "sun",
    "sun_position",
]
