#!/usr/bin/python3
"""Time and memory of circline_calibrate on simulated photos of one sheet of circles, nothing known of camera and sheet.

  many_photos.py [--photos=300] [--circles=100] [--calibrate=build/release/bin/circline_calibrate] [--anonymous]

Noise 0.15 px, 40 points a circle; --anonymous: a circle has another id in each photo.
"""
import math
import os
import resource
import subprocess
import tempfile
import time

import numpy as np

from peers import rotation
from scripts import parser_of

FOCAL, POINT, K1, WIDTH, HEIGHT = 900.0, (650.0, 470.0), -0.1, 1280, 960  # The truth, pixels.
GUESS = WIDTH / 2 / math.tan(math.radians(30))


def photo(rng, index, circles, anonymous):
    around, tilt, spin = rng.uniform(0, 2 * math.pi), rng.uniform(0.3, 0.8), rng.uniform(-1, 1)
    world = rotation(np.array([math.cos(around), math.sin(around), 0]), tilt) @ rotation(np.array([0, 0, 1]), spin) @ np.diag([1, -1, -1])
    translation = np.array([rng.uniform(-1, 1), rng.uniform(-1, 1), 16])
    angles = np.linspace(0, 2 * math.pi, 40, endpoint=False)
    side = math.isqrt(circles - 1) + 1
    names = rng.permutation(circles) if anonymous else np.arange(circles)
    lines = [f'  - file: "p{index:04d}.jpg"', '    camera: "c"', '    circles:']
    for k in range(circles):
        x, y = k % side - (side - 1) / 2, k // side - (side - 1) / 2
        p = world @ np.stack([x + 0.35 * np.cos(angles), y + 0.35 * np.sin(angles), 0 * angles]) + translation[:, None]
        ray = p[:2] / p[2]
        pixels = FOCAL * ray * (1 + K1 * (ray**2).sum(0)) + np.array(POINT)[:, None] + rng.normal(0, 0.15, (2, 40))
        contour = ', '.join(f'{v:.3f}' for v in pixels.T.ravel())
        lines.append(f'      - {{ id: "c{names[k]}", contour: [{contour}], plane: "p" }}')
    return '\n'.join(lines)


def main():
    args = parser_of(__doc__, 'calibrate', photos=300, circles=100, anonymous=False).parse_args()
    rng = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as folder:
        for i in range(args.photos):  # Not looked at: all circles are given.
            open(os.path.join(folder, f'p{i:04d}.jpg'), 'w').close()
        scene = os.path.join(folder, 'scene.yaml')
        with open(scene, 'w') as file:
            file.write(f'%YAML:1.0\n---\ncameras:\n  - {{ id: "c", model: "opencv", width: {WIDTH}, height: {HEIGHT}, camera_matrix: '
                       f'[{GUESS}, 0., {(WIDTH - 1) / 2}, 0., {GUESS}, {(HEIGHT - 1) / 2}, 0., 0., 1.], distortion: [0., 0., 0., 0., 0.] }}\nimages:\n')
            file.writelines(photo(rng, i, args.circles, args.anonymous) + '\n' for i in range(args.photos))
        start = time.monotonic()
        run = subprocess.run([args.calibrate, f'--scene={scene}', f'--output={folder}/out', '--overlays=false'], capture_output=True, text=True, check=False)
        seconds = time.monotonic() - start
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(run.stdout if run.returncode == 0 else run.stderr)
    print(f'{args.photos} photos of {args.circles} circles: {seconds:.1f} s, {used.ru_utime + used.ru_stime:.1f} s of processors, '
          f'{used.ru_maxrss / 1024:.0f} MB; the focal length is {FOCAL} px')
    raise SystemExit(run.returncode)


if __name__ == '__main__':
    main()
