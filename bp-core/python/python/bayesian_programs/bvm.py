"""The Bayesian Volumetric Map with arrays in and out.

    from bayesian_programs import bvm

    head = bvm.Head()
    look = head.look(depth, focal_px=(525, 525), centre_px=(319.5, 239.5), yaw=0.1)
    head.map.occupancy          # P(O = 1), (ρ, elevation, azimuth)
    look["next"]["azimuth"]     # where to look next, rad to the left

The frame: x ahead, y to the left, z up, m. Azimuth and yaw are positive to the left, elevation and pitch upwards, rad.
"""

from ._native import Gaze, Head, Map
from ._native import _disparities as disparities

__all__ = ["Gaze", "Head", "Map", "disparities"]
