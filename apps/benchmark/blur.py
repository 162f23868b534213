#!/usr/bin/python3
"""How much blur hides discs: of a rendered sheet of twelve, how many are detected.

  apps/benchmark/blur.py [BUILD]      BUILD: build/release, built with -DCIRCLINE_BUILD_PYTHON=ON

Rows: the radius of a disc and its contrast; columns: the standard deviation of a Gaussian blur,
pixels of the photo as taken. Noise of 2 grey values. The last rows have photos made half as large.
"""

import pathlib
import sys

BUILD = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build/release").resolve()
sys.path.insert(0, str(BUILD / "python"))

import cv2  # noqa: E402
import numpy as np  # noqa: E402

import circline  # noqa: E402

WIDTH, HEIGHT, FOCAL = 1280, 960, 1000.0
BLURS_PX = (1, 2, 3, 4, 5, 6, 8)
FINER = 3  # Drawn so much larger, then averaged.


def sheet(radius_px: float, contrast: int) -> np.ndarray:
    """4 x 3 dark discs on a tilted sheet, their radius 0.3 of the pitch."""
    photo = np.full((HEIGHT * FINER, WIDTH * FINER), 210, np.uint8)
    rotation = cv2.Rodrigues(np.array([0.5, 0.2, 0.1]))[0]
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    for column in (-1.5, -0.5, 0.5, 1.5):
        for row in (-1, 0, 1):
            rim = np.stack([column + 0.3 * np.cos(angle), row + 0.3 * np.sin(angle), 0 * angle])
            seen = rotation @ rim + [[0], [0], [0.3 * FOCAL / radius_px]]
            pixels = (FOCAL * seen[:2] / seen[2]).T + [WIDTH / 2, HEIGHT / 2]
            cv2.fillPoly(photo, [np.int32(np.round(pixels * FINER))], 210 - contrast)
    return cv2.resize(photo, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)


def found(photo: np.ndarray, blur_px: float, smaller: int) -> int:
    blurred = cv2.GaussianBlur(photo, (0, 0), blur_px).astype(float)
    blurred += np.random.default_rng(1).normal(0, 2, photo.shape)
    size = (WIDTH // smaller, HEIGHT // smaller)
    image = cv2.resize(np.uint8(np.clip(blurred, 0, 255)), size, interpolation=cv2.INTER_AREA)
    focal = FOCAL / smaller
    camera = circline.Camera(
        width=size[0], height=size[1], fx=focal, fy=focal, cx=size[0] / 2, cy=size[1] / 2
    )
    return len(circline.detect(image, camera).circles)


print(f"{'radius':>8}{'contrast':>10}{'size':>6}" + "".join(f"{b:>5} px" for b in BLURS_PX))
for smaller, radius_px, contrast in (
    (1, 10, 170), (1, 40, 170), (1, 60, 170), (1, 40, 80), (1, 40, 40), (2, 40, 170), (2, 40, 80)
):
    photo = sheet(radius_px, contrast)
    row = [found(photo, blur_px, smaller) for blur_px in BLURS_PX]
    size = f"1/{smaller}"
    print(f"{radius_px:>8}{contrast:>10}{size:>6}" + "".join(f"{n:>8}" for n in row), flush=True)
