"""An image of a scene file (docs/scene_files.md)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, List, Optional

import numpy as np

from ._circline import CameraSigma
from .observations import Fields, Observations


@dataclass(eq=False)
class SceneImage(Fields):
    """A photo and what is known of it; nothing is fitted or detected yet."""

    name: str
    """As the scene file writes it."""
    path: str
    """Where it is."""
    observations: Observations
    """Camera, and what is annotated."""
    camera_sigma: Optional[CameraSigma] = None
    """How well the file says that the camera is known, for `estimate`; None: it does not say."""
    detect_everything: bool = False
    """No circle and no pencil is annotated."""
    rois: Dict[int, List[int]] = field(default_factory=dict)
    """By index in observations.circles: where to detect it, [x, y, width, height], pixels."""
    true_rotation: Optional[np.ndarray] = None
    """cam_from_world, (3, 3)."""
    true_translation: Optional[np.ndarray] = None
    """cam_from_world, (3,)."""
    symmetry: str = "none"
    """What the evidence cannot tell about the true rotation: none, D2, D4 or axis."""
