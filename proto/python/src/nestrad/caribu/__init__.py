"""CARIBU's calls, answered by nestrad: a pipeline changes its import, and nothing else.

    from nestrad.caribu import CaribuScene        # was: from openalea.caribu.CaribuScene import CaribuScene

Signatures, defaults, forms of materials and names of results are CARIBU's. Energies pass through in your unit: what
you give per m2 of ground comes out per m2 of leaf. What is different:

* Black materials, and materials with equal reflectance and transmittance, give right values where CARIBU refuses them
  or answers -1: `Ei_sup` and `Ei_inf` are always there, and `Ei` is their sum, for faces of unequal optics too. A
  triangle without area has NaN, as with CARIBU.
* `screen_size`, `screen_resolution`, `layers`, `height`, `debug`, `filecache`, `canfile` and `optfile` do nothing:
  nestrad plans by accuracy, and its far field follows from the scene.
* `d_sphere = 0` (layers alone) is solved on the true geometry.
* Light straight from the sources has an error of 0.3 % (rms over ids), scattered light one of about 0.5 %.
* Without a soil mesh the ground of an infinite scene is a plane at `z_soil`; by default at 0, or at the lowest point of
  a scene that reaches below.
* Virtual sensors are not there yet: `sensors` raises NotImplementedError.
"""

from .functions import (
    mixed_radiosity,
    radiosity,
    raycasting,
    x_mixed_radiosity,
    x_radiosity,
    x_raycasting,
)
from .scene import CaribuScene

__all__ = [
    "CaribuScene",
    "mixed_radiosity",
    "radiosity",
    "raycasting",
    "x_mixed_radiosity",
    "x_radiosity",
    "x_raycasting",
]
