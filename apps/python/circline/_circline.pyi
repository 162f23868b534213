import os
from typing import Any, Callable, Dict, Iterable, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .observations import CircleObservation, Observations
from .scene import SceneImage

Array = NDArray[np.float64]
Path = Union[str, os.PathLike[str]]

__version__: str

class Refused(RuntimeError): ...

class Camera:
    id: str
    model: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    def __init__(
        self,
        *,
        id: str = ...,
        model: str = ...,
        width: int = ...,
        height: int = ...,
        fx: float = ...,
        fy: float = ...,
        cx: float = ...,
        cy: float = ...,
        distortion: Sequence[float] = ...,
    ) -> None: ...
    @property
    def distortion(self) -> Tuple[float, ...]: ...
    @distortion.setter
    def distortion(self, arg1: Sequence[float]) -> None: ...
    def project(self, points: ArrayLike) -> Array: ...
    def calibrate(self, pixels: ArrayLike) -> Array: ...

class CameraSigma:
    log_focal: float
    log_aspect: float
    principal_point_px: float
    k1: float
    doubtful_log_focal: float
    def __init__(
        self,
        *,
        log_focal: float = ...,
        log_aspect: float = ...,
        principal_point_px: float = ...,
        k1: float = ...,
        doubtful_log_focal: float = ...,
    ) -> None: ...
    @staticmethod
    def exact() -> CameraSigma: ...

class NoiseModel:
    contour_px: float
    line_px: float
    correlation_px: float
    contour_offset_px: float
    circle_tilt_rad: float
    circle_height: float
    circle_shape: float
    line_direction_rad: float
    pencil_axis_rad: float
    grid_line: float
    radius: float
    length: float
    camera: CameraSigma
    spread: float
    def __init__(
        self,
        *,
        contour_px: float = ...,
        line_px: float = ...,
        correlation_px: float = ...,
        contour_offset_px: float = ...,
        circle_tilt_rad: float = ...,
        circle_height: float = ...,
        circle_shape: float = ...,
        line_direction_rad: float = ...,
        pencil_axis_rad: float = ...,
        grid_line: float = ...,
        radius: float = ...,
        length: float = ...,
        camera: CameraSigma = ...,
        spread: float = ...,
    ) -> None: ...
    @staticmethod
    def exact() -> NoiseModel: ...

class CameraPose:
    def __init__(self, rotation: ArrayLike, translation: ArrayLike) -> None: ...
    @property
    def rotation(self) -> Array: ...
    @property
    def translation(self) -> Array: ...

class ConicFit:
    @property
    def conic(self) -> Array: ...
    @property
    def covariance(self) -> Array: ...
    @property
    def rms_px(self) -> float: ...
    @property
    def irregularity(self) -> float: ...

class ConicReading:
    @property
    def fit(self) -> ConicFit: ...
    @property
    def inliers(self) -> List[int]: ...

class DirectionReading:
    @property
    def direction(self) -> Array: ...
    @property
    def probability(self) -> float: ...

class LineFit:
    @property
    def line(self) -> Array: ...
    @property
    def covariance(self) -> Array: ...
    @property
    def rms_px(self) -> float: ...

class VanishingPointFit:
    @property
    def direction(self) -> Array: ...
    @property
    def covariance(self) -> Array: ...

class CircleEstimate:
    @property
    def id(self) -> str: ...
    @property
    def normal(self) -> Array: ...
    @property
    def center(self) -> Array: ...
    @property
    def center_px(self) -> Array: ...
    @property
    def radius(self) -> float: ...

class PencilEstimate:
    @property
    def id(self) -> str: ...
    @property
    def direction(self) -> Array: ...
    @property
    def sigma_deg(self) -> float: ...

class PoseHypothesis:
    @property
    def cam_from_world(self) -> CameraPose: ...
    @property
    def metric(self) -> bool: ...
    @property
    def probability(self) -> float: ...
    @property
    def cost(self) -> float: ...
    @property
    def log_det(self) -> float: ...
    @property
    def covariance(self) -> Array: ...
    @property
    def rank(self) -> int: ...
    @property
    def free_directions(self) -> Array: ...
    @property
    def focal_scale(self) -> float: ...
    @property
    def focal_sigma(self) -> float: ...
    @property
    def focal_covariance(self) -> Array: ...
    @property
    def camera(self) -> Optional[Camera]: ...
    @property
    def left_out(self) -> List[str]: ...
    @property
    def structure(self) -> str: ...
    @property
    def rms_px(self) -> float: ...
    @property
    def num_inliers(self) -> int: ...
    @property
    def num_observations(self) -> int: ...
    @property
    def origin_observed(self) -> bool: ...
    @property
    def circles(self) -> List[CircleEstimate]: ...
    @property
    def pencils(self) -> List[PencilEstimate]: ...
    @property
    def rotation_is_free(self) -> bool: ...
    @property
    def sigma_rotation(self) -> Array: ...

class PoseEstimate:
    @property
    def solver(self) -> str: ...
    @property
    def hypotheses(self) -> List[PoseHypothesis]: ...
    @property
    def decided_by(self) -> str: ...
    @property
    def notes(self) -> List[str]: ...

class AdjustedCamera:
    @property
    def camera(self) -> Camera: ...
    @property
    def covariance(self) -> Array: ...
    @property
    def at_prior(self) -> List[str]: ...
    @property
    def num_photos(self) -> int: ...
    @property
    def rms_px(self) -> float: ...
    @property
    def sigma_by_photos(self) -> List[Tuple[int, float]]: ...
    @property
    def sigma_focal_px(self) -> float: ...

class AdjustedPhoto:
    @property
    def ok(self) -> bool: ...
    @property
    def message(self) -> str: ...
    @property
    def same_as(self) -> int: ...
    @property
    def camera(self) -> int: ...
    @property
    def cam_from_world(self) -> CameraPose: ...
    @property
    def covariance(self) -> Array: ...
    @property
    def rms_px(self) -> float: ...
    @property
    def misfit(self) -> float: ...
    @property
    def num_grid_lines(self) -> int: ...
    @property
    def left_out(self) -> List[str]: ...
    @property
    def residuals(self) -> Array: ...

class AdjustedCircle:
    @property
    def id(self) -> str: ...
    @property
    def photo(self) -> int: ...
    @property
    def center(self) -> Array: ...
    @property
    def normal(self) -> Array: ...
    @property
    def radius(self) -> float: ...

class AdjustedDirection:
    @property
    def id(self) -> str: ...
    @property
    def photo(self) -> int: ...
    @property
    def direction(self) -> Array: ...

class GivenFrame:
    @property
    def scale(self) -> float: ...
    @property
    def rotation(self) -> Array: ...
    @property
    def translation(self) -> Array: ...
    @property
    def log_scale_sigma(self) -> float: ...

class AdjustedPhotos:
    @property
    def cameras(self) -> List[AdjustedCamera]: ...
    @property
    def photos(self) -> List[AdjustedPhoto]: ...
    @property
    def circles(self) -> List[AdjustedCircle]: ...
    @property
    def directions(self) -> List[AdjustedDirection]: ...
    @property
    def given(self) -> Optional[GivenFrame]: ...
    @property
    def rigid(self) -> bool: ...
    @property
    def metric(self) -> bool: ...
    @property
    def notes(self) -> List[str]: ...

class CirclePose:
    def __init__(self, normal: ArrayLike, center: ArrayLike) -> None: ...
    @property
    def normal(self) -> Array: ...
    @property
    def center(self) -> Array: ...

class PosePrior:
    def __init__(self, mean: CameraPose, covariance: ArrayLike) -> None: ...

class GravityPrior:
    def __init__(
        self, in_world: ArrayLike, in_camera: ArrayLike, sigma_rad: float = ...
    ) -> None: ...

def circle_poses(conic: ArrayLike) -> List[CirclePose]: ...
def project_circle(pose: CirclePose) -> Array: ...
def rotation_from_circle_and_frame(
    conic: ArrayLike, x_line: ArrayLike, y_line: ArrayLike
) -> List[Tuple[Array, float]]: ...
def rotation_from_line_pairs(x_lines: ArrayLike, y_lines: ArrayLike) -> Array: ...
def detect(
    image: NDArray[np.uint8],
    camera: Camera,
    *,
    min_ellipse_axis_px: float = ...,
    min_arc_deg: float = ...,
    min_segment_length_px: float = ...,
    max_circles: int = ...,
    max_pencils: int = ...,
    max_shared_plane_deg: float = ...,
    seed: int = ...,
    noise_model: Optional[NoiseModel] = ...,
) -> Observations: ...
def detect_circle(
    image: NDArray[np.uint8],
    camera: Camera,
    roi: Sequence[int],
    *,
    min_ellipse_axis_px: float = ...,
    min_arc_deg: float = ...,
    seed: int = ...,
    noise_model: Optional[NoiseModel] = ...,
) -> CircleObservation: ...
def fit(
    observations: Observations,
    *,
    inlier_threshold_px: float = ...,
    confidence: float = ...,
    max_iterations: int = ...,
    seed: int = ...,
    sigma_px: float = ...,
    direction_sigma_rad: float = ...,
    noise_model: Optional[NoiseModel] = ...,
    problems: Optional[List[str]] = ...,
) -> Observations: ...
def estimate(
    observations: Observations,
    *,
    conic_loss: str = ...,
    conic_loss_scale_px: float = ...,
    line_loss: str = ...,
    line_loss_scale_px: float = ...,
    conic_distance: str = ...,
    noise_model: Optional[NoiseModel] = ...,
    camera_sigma: Optional[CameraSigma] = ...,
    pose_prior: Optional[PosePrior] = ...,
    gravity_prior: Optional[GravityPrior] = ...,
    prior: Optional[CameraPose] = ...,
    max_iterations: int = ...,
    max_cost_gap: float = ...,
) -> PoseEstimate: ...
def adjust(
    observations_list: Iterable[Observations],
    *,
    conic_loss: str = ...,
    conic_loss_scale_px: float = ...,
    line_loss: str = ...,
    line_loss_scale_px: float = ...,
    noise_model: Optional[NoiseModel] = ...,
    camera_sigma: Dict[str, CameraSigma] = ...,
    num_radial: int = ...,
    tangential_sigma: float = ...,
    rigid: str = ...,
    square_grids: bool = ...,
    nearly_equal: float = ...,
    given_poses: Sequence[Optional[CameraPose]] = ...,
    given_rotation_sigma: float = ...,
    given_translation_sigma: float = ...,
    max_iterations: int = ...,
    num_threads: int = ...,
    num_solver_threads: int = ...,
    progress: Optional[Callable[[str, int, int], None]] = ...,
) -> AdjustedPhotos: ...
def load_scene(path: Path) -> List[SceneImage]: ...
def load_cameras(path: Path) -> List[Camera]: ...
def simulate(
    *,
    trials: int = ...,
    noise_px: Sequence[float] = ...,
    outlier_ratio: Sequence[float] = ...,
    outlier_kind: str = ...,
    focal: float = ...,
    translation: ArrayLike = ...,
    seed: int = ...,
    threads: int = ...,
) -> List[Dict[str, Any]]: ...
