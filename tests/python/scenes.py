"""A tilted plane with a circle and four lines, as a camera with a distorting lens sees it."""

import numpy as np

import circline


def camera() -> circline.Camera:
    return circline.Camera(
        id="cam0",
        model="opencv",
        width=1280,
        height=960,
        fx=1000.0,
        fy=1000.0,
        cx=640.0,
        cy=480.0,
        distortion=[-0.2, 0.05, 1e-3, -5e-4],
    )


def rotation(tilt: float = 0.6, turn: float = 0.3) -> np.ndarray:
    def about(axis: int, angle: float) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        return np.roll(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), (axis, axis), (0, 1))

    return about(0, tilt) @ about(1, 0.1) @ about(2, turn) @ np.diag([1.0, -1.0, -1.0])


TRANSLATION = np.array([0.3, -0.2, 14.0])


def pixels(x, y, noise_px: float, rng: np.random.Generator, turned: np.ndarray) -> np.ndarray:
    points = np.stack([x, y, np.zeros_like(x)], axis=-1)
    seen = camera().project(points @ turned.T + TRANSLATION)
    return seen + noise_px * rng.standard_normal(seen.shape)


def observations(noise_px: float = 0.3, seed: int = 1, **angles: float) -> circline.Observations:
    """100 points of a circle of radius 2, four lines of 50 points along X and Y."""
    turned = rotation(**angles)
    rng = np.random.default_rng(seed)
    angle = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    circle = circline.CircleObservation(
        id="c0",
        plane="p0",
        points=pixels(2 * np.cos(angle), 2 * np.sin(angle), noise_px, rng, turned),
        sigma_px=max(noise_px, 1e-3),
        radius=2.0,
    )
    along = np.linspace(-3, 3, 50)
    pencils = []
    for name in ("x", "y"):
        lines = []
        for across in (-3.0, 3.0):
            other = np.full_like(along, across)
            place = (along, other) if name == "x" else (other, along)
            lines.append(circline.LineObservation(points=pixels(*place, noise_px, rng, turned)))
        pencils.append(
            circline.PencilObservation(
                id=name, direction=name, plane="p0", lines=lines, sigma_px=max(noise_px, 1e-3)
            )
        )
    return circline.Observations(camera=camera(), circles=[circle], pencils=pencils)


def disc_photo() -> np.ndarray:
    """A bright disc seen obliquely, rendered with soft edges."""
    y, x = np.mgrid[0:480, 0:640].astype(float)
    u, v = (x - 330.0) / 120.0, (y - 250.0) / 70.0
    inside = (1.0 - np.hypot(u, v)) * 80.0
    return np.clip(60 + 140 / (1 + np.exp(-2.0 * inside)), 0, 255).astype(np.uint8)


def photo_camera() -> circline.Camera:
    return circline.Camera(width=640, height=480, fx=600, fy=600, cx=320, cy=240)
