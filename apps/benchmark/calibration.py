#!/usr/bin/env python3
"""The camera from photographs with truth, nothing known of it nor of what it saw: errors, in percent and pixels, and how many
of the stated deviations they are. `pooled` counts focal lengths and principal points within two.

  calibration.py DATA [--converter=to_scene.py] [--calibrate=build/release/bin/circline_calibrate] [--draws=10]

DATA holds one folder a set, each with a groundtruth.yml; see photographs.py for the converter.
"""
import argparse
import json
import math
import os
import random
import re
import statistics
import subprocess
import tempfile

# set, converter's arguments, flags, how many photos are drawn (0: all)
SETS = [
    ('circles-discocal-rgb', ['--circles=all'], [], (0, 5, 3, 2)),
    ('circles-discocal-rgb', ['--evidence=auto'], [], (0,)),
    ('circles-discocal-tir', ['--circles=all'], [], (0,)),
    ('circles-discocal-tir', ['--evidence=auto'], [], (0,)),
    ('circles-robot10x10', ['--evidence=auto'], [], (0,)),
    ('circles-visp36', ['--evidence=auto'], ['--free=aspect'], (0,)),
    ('chessboard-opencv', ['--lines=all'], [], (0,)),
    ('chessboard-opencv', ['--evidence=auto'], [], (0,)),
]
CAMERA = re.compile(r'id: "(\w+)", model: "\w+", width: (\d+), height: (\d+), '
                    r'camera_matrix: \[([^\]]*)\], distortion: \[[^\]]*\]')


def read_truths(scene):
    truths = {}
    for name, _, _, matrix in CAMERA.findall(scene):
        m = [float(v) for v in matrix.split(',')]
        truths[name] = {'fx': m[0], 'fy': m[4], 'cx': m[2], 'cy': m[5]}
    return truths


def without_camera(scene, scale):
    """The cameras replaced by a guess: 60 degrees (times `scale`), no distortion."""
    def guess(match):
        name, width, height, _ = match.groups()
        f = scale * int(width) / 2 / math.tan(math.radians(30))
        middle = (int(width) - 1) / 2, (int(height) - 1) / 2
        return (f'id: "{name}", model: "opencv", width: {width}, height: {height}, '
                f'camera_matrix: [{f}, 0., {middle[0]}, 0., {f}, {middle[1]}, 0., 0., 1.], distortion: [0., 0., 0., 0., 0.]')
    return CAMERA.sub(guess, scene)


def photos_of(scene):
    head, *photos = re.split(r'(?m)^(?=  - file: )', scene)
    return head, photos


def calibrate(args, scene, flags, scratch):
    path, out = os.path.join(scratch, 'scene.yaml'), os.path.join(scratch, 'out')
    with open(path, 'w') as file:
        file.write(scene)
    run = subprocess.run([args.calibrate, f'--scene={path}', f'--output={out}', *flags], capture_output=True, text=True)
    if run.returncode != 0:
        return None
    with open(os.path.join(out, 'calibration.json')) as file:
        return json.load(file)


def judge(camera, truth, held):
    """Errors and their number of deviations, of f in percent and of the principal point in pixels."""
    focal = math.log(camera['fx'] / (truth['fx'] if 'aspect' not in held else math.sqrt(truth['fx'] * truth['fy'])))
    point = math.hypot(camera['cx'] - truth['cx'], camera['cy'] - truth['cy'])
    sigmas = [focal * camera['fx'] / camera['sigma']['fx']]
    sigmas += [(camera[c] - truth[c]) / camera['sigma'][c] for c in ('cx', 'cy') if camera['sigma'][c] > 0]
    return 100 * focal, point, sigmas


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('data')
    parser.add_argument('--converter', default=None)
    parser.add_argument('--calibrate', default='build/release/bin/circline_calibrate')
    parser.add_argument('--draws', type=int, default=10)
    parser.add_argument('--guess', type=float, default=1.0, help='times the focal length of 60 degrees')
    args = parser.parse_args()
    args.converter = args.converter or os.path.join(args.data, '..', 'tools', 'to_scene.py')
    pooled = []
    print(f'{"set":44} {"photos":>6} {"camera":>7} {"f %":>7} {"sigma %":>8} {"point px":>9} {"sigmas of f, cx, cy":>22}')
    with tempfile.TemporaryDirectory() as scratch:
        for data_set, given, flags, counts in SETS:
            source = os.path.join(scratch, 'source.yaml')
            subprocess.run(['/usr/bin/python3', args.converter, os.path.join(args.data, data_set), source, *given],
                           check=True, stdout=subprocess.DEVNULL)
            with open(source) as file:
                scene = file.read()
            truths = read_truths(scene)
            head, photos = photos_of(without_camera(scene, args.guess))
            held = [] if '--free=aspect' in flags else ['aspect']
            for count in counts:
                rng = random.Random(1)
                rows = {}
                for _ in range(args.draws if count else 1):
                    drawn = sorted(rng.sample(range(len(photos)), count)) if count else range(len(photos))
                    result = calibrate(args, head + ''.join(photos[i] for i in drawn), flags, scratch)
                    for camera in result['cameras'] if result else []:
                        rows.setdefault(camera['id'], []).append((*judge(camera, truths[camera['id']], held), camera))
                for name, draws in rows.items():
                    pooled += [s for d in draws for s in d[2]]
                    errors = statistics.median(abs(d[0]) for d in draws) if count else draws[0][0]
                    sigma = statistics.median(100 * d[3]['sigma']['fx'] / d[3]['fx'] for d in draws)
                    point = statistics.median(d[1] for d in draws)
                    tail = ' '.join(f'{s:6.1f}' for s in draws[0][2]) if not count else f'median of {len(draws)} of {args.draws} draws'
                    print(f'{data_set + " " + given[0]:44} {count or draws[0][3]["num_images"]:6} {name:>7} {errors:7.2f} {sigma:8.2f} '
                          f'{point:9.1f} {tail:>22}', flush=True)
                if not rows:
                    print(f'{data_set + " " + given[0]:44} {count or len(photos):6} no camera came out')
    within = sum(abs(s) <= 2 for s in pooled)
    print(f'pooled: {within} of {len(pooled)} within two deviations')


if __name__ == '__main__':
    main()
