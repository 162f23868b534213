"""What one photo tells about one pose: the structs of estimators/observations.h, field by field.

Pixels are those of the photo as taken, with the centre of the first at (0, 0). Arrays may be given
as anything that numpy can make float64 arrays of.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, List, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike

from ._circline import Camera, ConicFit, ConicReading, DirectionReading, LineFit, VanishingPointFit


class Fields:
    """A dataclass that takes no attribute but its fields: a misspelt one would say nothing."""

    if not TYPE_CHECKING:  # A type checker knows the fields; with this it would take any name.

        def __setattr__(self, name: str, value: Any) -> None:
            fields = self.__dataclass_fields__
            if name not in fields:
                near = difflib.get_close_matches(name, fields, n=1)
                hint = f"; did you mean '{near[0]}'?" if near else ""
                raise AttributeError(f"{type(self).__name__} has no attribute '{name}'{hint}")
            super().__setattr__(name, value)


def _points() -> np.ndarray:
    return np.empty((0, 2))


def _segments() -> np.ndarray:
    return np.empty((0, 2, 2))


@dataclass(eq=False)
class CircleObservation(Fields):
    """Image of one circle."""

    id: str = ""
    points: ArrayLike = field(default_factory=_points)
    """Contour, N x 2, pixels, any order; 5 or more."""
    normals: ArrayLike = field(default_factory=_points)
    """N x 2 unit gradients across the contour, zero where not known; or empty."""
    sigma_px: float = 0.0
    """Standard deviation of each coordinate of each point, pixels; 0: not known."""
    center: Optional[ArrayLike] = None
    """Image of the circle's centre (not the ellipse's), 2, pixels."""
    radius: float = 0.0
    """In the world's unit; 0: not known."""
    radius_sigma: float = 0.0
    """Of that radius, relative; 0: that of the noise model."""
    plane: str = ""
    """Circles and pencils with the same id share a plane; empty: with none."""
    concentric: str = ""
    """Circles with the same id share their centre; empty: with none."""
    contrast: int = 0
    """+1: brighter inside than outside, -1: darker, 0: not known."""
    radius_group: str = ""
    """Circles with the same id have equal radii, known or not; empty: with none."""
    diameters: ArrayLike = field(default_factory=_segments)
    """Chords through the centre, N x 2 x 2, pixels."""
    fit: Optional[ConicFit] = None
    """The ellipse, added by a fit."""
    inliers: ArrayLike = field(default_factory=lambda: np.empty(0, np.uint8))
    """N, 1: inlier, added by a fit; empty: all."""
    second: Optional[ConicReading] = None
    """A less likely ellipse, through points that `fit` leaves out."""


@dataclass(eq=False)
class LineObservation(Fields):
    """Image of one straight line: the end points of a segment, or points along it."""

    points: ArrayLike = field(default_factory=_points)
    """N x 2, pixels; 2 or more."""
    fit: Optional[LineFit] = None
    inliers: ArrayLike = field(default_factory=lambda: np.empty(0, np.uint8))
    is_parallel: bool = True
    """To the others of its pencil: else an outlier of the pencil's fit."""
    sigma_px: float = 0.0
    """Of each point's coordinates, pixels; 0: that of the pencil."""


@dataclass(eq=False)
class PencilObservation(Fields):
    """Images of lines that are parallel in space."""

    id: str = ""
    lines: List[LineObservation] = field(default_factory=list)
    direction: str = "free"
    """Along a world axis, "x", "y" or "z", or "free"."""
    plane: str = ""
    """The plane in which the lines lie; empty: none in particular."""
    sigma_px: float = 0.0
    """Of each point's coordinates, pixels; 0: not known."""
    fit: Optional[VanishingPointFit] = None
    readings: List[DirectionReading] = field(default_factory=list)
    """Directions that a detected pencil may have; empty: as `fit` says."""
    axis_probability: float = 1.0
    """Of a detected pencil, where the focal length is unknown: how probably it runs along its axis."""


@dataclass(eq=False)
class FrameObservation(Fields):
    """Where the world frame is wanted; all optional."""

    plane: str = ""
    """The plane Z = 0; empty: the first one named."""
    origin: Optional[ArrayLike] = None
    """Image of the world origin, 2, pixels."""
    x_axis: Optional[ArrayLike] = None
    """An oriented piece of the X axis' image, 2 x 2, pixels."""
    y_axis: Optional[ArrayLike] = None
    origin_is_center: str = ""
    """Id of the circle whose centre is the origin."""


@dataclass(eq=False)
class KnownAngle(Fields):
    """The angle between the directions of two pencils."""

    pencils: Tuple[str, str] = ("", "")
    value: float = 0.0
    """Radians, within 2 pi; lines have no sense: as well its negative, or pi less it."""
    sigma: float = 0.0
    """Radians; 0: exact."""


@dataclass(eq=False)
class KnownLength(Fields):
    """The distance between two points of a plane."""

    points: ArrayLike = field(default_factory=lambda: np.zeros((2, 2)))
    """2 x 2, pixels."""
    plane: str = ""
    """Empty: the frame's plane."""
    value: float = 0.0
    """In the world's unit."""
    sigma: float = 0.0
    """Of value, relative; 0: that of the noise model."""


@dataclass(eq=False)
class Observations(Fields):
    """Everything that one photo tells: detected, read from a scene file, or filled by hand."""

    camera: Camera = field(default_factory=Camera)
    stated_focal_px: float = 0.0
    """The focal length known beforehand, where `camera` has a likelier one; 0: that of `camera`."""
    found_k1: float = 0.0
    """What the k1 of `camera` has beyond the one known beforehand."""
    circles: List[CircleObservation] = field(default_factory=list)
    pencils: List[PencilObservation] = field(default_factory=list)
    frame: FrameObservation = field(default_factory=FrameObservation)
    known_angles: List[KnownAngle] = field(default_factory=list)
    known_lengths: List[KnownLength] = field(default_factory=list)
    num_dropped_points: int = 0
    """Pixels that the camera model cannot undistort, counted by fits."""
    message: str = ""
    """What a detection wants to say."""
