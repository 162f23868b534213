#!/usr/bin/python3
"""circline's solvers beside those of OpenCV, OpenGV and ViSP, of these what is installed: a table in Markdown, that of
docs/scene_files.md. Builds circline_compare with them in build/peers; or takes that of --build. Needs python3-numpy.

  apps/benchmark/peers.py [--build=FOLDER] [--images=300] [--write]      --write: puts the table into docs/scene_files.md

Photographs: the 12 of apps/demo/disc.yaml, fetched by apt. Simulated: a disc of radius 0.3 in a rectangle of 1.4 x 1.2, seen
from a distance of 4 to 8 at 15 to 60 degrees, f = 800; noise of 0.5 px on 100 points of its rim, on the image of its
centre and on the corners of the rectangle: known points for the peers, for ours two pairs of parallel lines of unknown size.
Errors are medians over all images, in degrees; of several poses that of the first counts. Times are lower quartiles,
of the wall, as other programs run, too.
"""
import collections
import os
import re
import statistics
import subprocess

import numpy as np

from scripts import TOP, bash, json_lines, median, parser_of, read, write

PAGE = os.path.join(TOP, 'docs/scene_files.md')
F, WIDTH, HEIGHT, NOISE_PX = 800.0, 640, 480, 0.5
HALF = np.array([0.7, 0.6])
# Rows: solver, stage, what it is given.
POINTS = 'four known points'
ROWS = [
    ('opencv_ippe', 'closed_form', POINTS), ('opencv_sqpnp', 'closed_form', POINTS), ('opencv_iterative', 'refined', POINTS),
    ('opengv_p3p', 'closed_form', POINTS), ('opengv_upnp', 'closed_form', POINTS), ('opengv_upnp', 'refined', POINTS),
    ('visp_points', 'closed_form', POINTS), ('visp_points', 'refined', POINTS),
    ('visp_circle', 'refined', 'a circle, its centre'),
    ('circle_center', 'closed_form', 'a circle, its centre'), ('circle_center', 'refined', 'a circle, its centre'),
    ('line_pairs', 'closed_form', 'two pairs of parallels'), ('line_pairs', 'refined', 'two pairs of parallels'),
    ('joint', 'refined', 'the circle, its centre, the parallels'),
]


def numbers(values):
    return '[' + ', '.join(f'{v:.6f}' for v in np.ravel(values)) + ']'


def rotation(axis, angle):
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def simulated_scene(num_images):
    rng = np.random.default_rng(1)
    lines = ['%YAML:1.0', '---', 'cameras:',
             f'  - {{ id: "cam", model: "pinhole", width: {WIDTH}, height: {HEIGHT}, '
             f'camera_matrix: {numbers([F, 0, 320, 0, F, 240, 0, 0, 1])} }}', 'images:']
    phase = np.arange(100) * 2 * np.pi / 100
    rim = 0.3 * np.c_[np.cos(phase), np.sin(phase)]
    corners = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]]) * HALF
    for _ in range(num_images):
        turn, tilt, way = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(15, 60)), rng.uniform(0, 2 * np.pi)
        world = rotation(np.array([np.cos(way), np.sin(way), 0.0]), tilt) @ np.diag([1.0, -1.0, -1.0]) @ \
            rotation(np.array([0.0, 0.0, 1.0]), turn)
        distance = rng.uniform(4, 8)
        origin = np.array([*rng.uniform(-0.1, 0.1, 2) * distance, distance])

        def project(plane_points):
            seen = np.c_[plane_points, np.zeros(len(plane_points))] @ world.T + origin
            return F * seen[:, :2] / seen[:, 2:] + [320, 240] + rng.normal(0, NOISE_PX, (len(seen), 2))

        contour, center, quad = project(rim), project(np.zeros((1, 2))), project(corners)
        known = np.c_[quad, corners, np.zeros(4)]
        lines += ['  - file: "none.png"', '    camera: "cam"', '    circles:',
                  f'      - {{ id: "disc", contour: {numbers(contour)}, center: {numbers(center)}, plane: "p", sigma_px: {NOISE_PX} }}',
                  '    pencils:',
                  f'      - {{ id: "x", segments: {numbers(quad)}, direction: "x", plane: "p", sigma_px: {NOISE_PX} }}',
                  f'      - {{ id: "y", segments: {numbers(quad[[0, 2, 1, 3]])}, direction: "y", plane: "p", sigma_px: {NOISE_PX} }}',
                  '    frame: { plane: "p", origin_is_center: "disc" }', f'    points: {numbers(known)}',
                  f'    truth: {{ rotation: {numbers(world)}, translation: {numbers(origin)}, symmetry: "D2" }}']
    return '\n'.join(lines) + '\n'


def measure(build, scene, *flags):
    """By solver and stage: medians of the normal's and the rotation's error, infinite where there is none, and the time."""
    out = os.path.join(build, 'peers')
    subprocess.run([os.path.join(build, 'bin/circline_compare'), f'--scene={scene}', f'--output={out}', '--peers',
                    '--overlays=false', '--threads=1', *flags], check=True, stdout=subprocess.DEVNULL)
    found = collections.defaultdict(lambda: ([], [], []))
    for line in json_lines(os.path.join(out, 'results.jsonl')):
        for values, field in zip(found[line['solver'], line['stage']], ('normal_error_deg', 'rotation_error_deg')):
            if line['status'] != 'ok':
                values.append(float('inf'))
            elif line['hypothesis'] == 0 and field in line:
                values.append(line[field])
    for line in json_lines(os.path.join(out, 'timings.jsonl')):
        if 'solver' in line:
            found[line['solver'], line['stage']][2].append(line['microseconds'])
    return {key: [*map(median, values[:2]), statistics.quantiles(values[2], n=4)[0]]
            for key, values in found.items()}


def table(photographs, simulated):
    rows = ['| solver | from | photographs: normal | rotation | simulated: normal | rotation | µs |',
            '| --- | --- | --- | --- | --- | --- | --- |']
    for solver, stage, given in ROWS:
        if (solver, stage) not in simulated:
            continue
        errors = [*photographs[solver, stage][:2], *simulated[solver, stage][:2]]
        cells = [f'{e:.2f}' if np.isfinite(e) else '' for e in errors]
        name = f'`{solver}`' + (', refined' if stage == 'refined' and solver != 'joint' else '')
        rows.append('| ' + ' | '.join([name, given, *cells, f'{simulated[solver, stage][2]:.0f}']) + ' |')
    return '\n'.join(rows) + '\n'


def main():
    args = parser_of(__doc__, build='', images=300, write=False).parse_args()
    if not args.build:
        args.build = os.path.join(TOP, 'build/peers')
        bash('''options=(-DCIRCLINE_BUILD_{TESTS,BENCHMARKS}=OFF -DCIRCLINE_WERROR="${CIRCLINE_WERROR:-OFF}")
            for peer in opengv visp; do
              [ -z "$(dpkg-query -W -f '${db:Status-Abbrev}' "lib$peer-dev" 2> /dev/null | grep ^ii)" ] ||
                options+=("-DCIRCLINE_WITH_${peer^^}=ON")
            done
            quietly build/peers-configure.log cmake --preset release -B build/peers "${options[@]}"
            cmake --build build/peers --target circline_compare -j "$(nproc)" -- --quiet''')
    bash('lay_out disc')
    scene = write(os.path.join(args.build, 'peers.yaml'), simulated_scene(args.images))
    made = table(measure(args.build, os.path.join(TOP, 'build/demo/disc/scene.yaml')),
                 measure(args.build, scene, '--noise=exact'))
    print(made, end='')
    if args.write:
        write(PAGE, re.sub(r'\| solver \| from \| photographs.*?\n(?!\|)', lambda _: made, read(PAGE), flags=re.DOTALL))


if __name__ == '__main__':
    main()
