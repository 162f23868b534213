#!/usr/bin/python3
"""Photographs whose truth is exact: tables with cups and plates, streets, pavements, wheels and rooms, rendered by Blender.

  apt-get install --no-install-recommends blender
  apps/benchmark/rendered_scenes.py [--first=0] [--count=50] [--folder=build/rendered-scenes]

What is not in the folder yet is rendered (15 seconds each); then a lens, a blur, noise and JPEG, each drawn with the scene's
number. Everything is detected, twice: through the camera, and with nothing known of it. The plane that `joint` finds counts as
the nearest of those that the scene has. Columns: answers; sure ones (probability 0.9 or more); of these the median error of the
normal, degrees, how many are within two and three standard deviations (of two components), and the median error of the focal
length, where it was not known, and how many are within two. Then sure answers beyond three, one a line.
"""
import json
import os
import random
import shutil
import subprocess
import sys

import cv2
import numpy

import scripts


def render(args, numbers):
    missing = [n for n in numbers if not os.path.exists(f'{args.folder}/{n:04d}.json')]
    if missing and not shutil.which('blender'):
        sys.exit('blender is not installed: apt-get install --no-install-recommends blender')
    if missing:
        script = os.path.join(scripts.HERE, 'rendered_scenes_blender.py')
        print(f'{len(missing)} of {len(numbers)} scenes are to be rendered, {len(missing) / 4:.1f} minutes', file=sys.stderr)
        subprocess.run(['blender', '--background', '--factory-startup', '--python-exit-code', '1', '--python', script, '--',
                        str(missing[0]), str(missing[-1] + 1), args.folder], check=True, stdout=subprocess.DEVNULL)
        print(file=sys.stderr)


def expose(args, number):
    """A photograph of a rendering, and what is true of it."""
    path = f'{args.folder}/{number:04d}'
    truth = json.loads(scripts.read(path + '.json'))
    draw, noise = random.Random(31 * number + 5), numpy.random.default_rng(number)
    image = cv2.imread(path + '.png').astype(numpy.float32)
    height, width = image.shape[:2]
    truth['k1'] = draw.choice((0.0, 0.0, draw.uniform(-0.15, 0.03)))
    truth['center'] = (width - 1) / 2, (height - 1) / 2
    if truth['k1']:
        matrix = numpy.array([[truth['focal_px'], 0, truth['center'][0]], [0, truth['focal_px'], truth['center'][1]], [0, 0, 1]])
        pixels = numpy.stack(numpy.meshgrid(numpy.arange(width, dtype=float), numpy.arange(height, dtype=float)), -1)
        straight = cv2.undistortPoints(pixels.reshape(-1, 1, 2), matrix, numpy.array([truth['k1'], 0, 0, 0]), P=matrix)
        straight = straight.reshape(height, width, 2).astype(numpy.float32)
        image = cv2.remap(image, straight[..., 0], straight[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    blur = draw.choice((0, 0.5, 0.8))
    if blur:
        image = cv2.GaussianBlur(image, (0, 0), blur)
    image += noise.normal(0, draw.uniform(0.5, 4), image.shape)
    cv2.imwrite(path + '.jpg', numpy.clip(image, 0, 255).astype(numpy.uint8),
                [cv2.IMWRITE_JPEG_QUALITY, draw.choice((80, 90, 95))])
    return truth


def scene_file(args, truths, is_known):
    cameras, images = [], []
    for number, t in truths.items():
        f, (x, y) = t['focal_px'] if is_known else t['width'] / 2 / numpy.tan(numpy.pi / 6), t['center']
        how = f'distortion: [{t["k1"]}, 0., 0., 0., 0.]' if is_known else (
            f'distortion: [0., 0., 0., 0., 0.], focal_sigma: 0.5, principal_point_sigma_px: {0.02 * t["width"]}, k1_sigma: 0.1')
        cameras.append(f'  - {{ id: "c{number}", model: "opencv", width: {t["width"]}, height: {t["height"]}, '
                       f'camera_matrix: [{f}, 0., {x}, 0., {f}, {y}, 0., 0., 1.], {how} }}')
        images.append(f'  - {{ file: "{number:04d}.jpg", camera: "c{number}" }}')
    return scripts.write(f'{args.folder}/{"known" if is_known else "unknown"}.yaml',
                         '\n'.join(['%YAML:1.0', '---', 'cameras:', *cameras, 'images:', *images]) + '\n')


def score(line, truth):
    normal = numpy.array(line['rotation']).reshape(3, 3)[:, 2]
    cosines = [abs(normal @ numpy.array(plane)) for plane in truth['planes']]
    sigmas = [s for s in line['sigma_rotation_deg'] if s is not None]
    focal = line.get('focal_px', truth['focal_px']) / truth['focal_px']
    return {'is_sure': line['probability'] >= 0.9, 'error': float(numpy.degrees(numpy.arccos(min(1.0, max(cosines))))),
            'sigma': line.get('sigma_normal_deg') or max(sigmas), 'focal': abs(focal - 1),
            'focal_deviation': abs(numpy.log(focal)) * line.get('focal_scale', 1) / max(line.get('focal_sigma') or 0, 1e-9)}


def report(title, truths, lines):
    first = {int(line['image'][-8:-4]): line for line in lines
             if line['solver'] == 'joint' and line['status'] == 'ok' and line['hypothesis'] == 0}
    scores = {n: score(line, truths[n]) for n, line in first.items()}
    print(f'{title:<12}{"photos":>8}{"answers":>8}{"sure":>6}{"degrees":>9}{"in 2":>6}{"in 3":>6}{"focal %":>9}{"in 2":>6}')
    for kind in sorted({t['kind'] for t in truths.values()}):
        of_kind = [n for n in truths if truths[n]['kind'] == kind]
        sure = [scores[n] for n in of_kind if n in scores and scores[n]['is_sure']]
        within = [sum(s['error'] < k * 1.22 * s['sigma'] for s in sure) for k in (2, 3)]
        middle = [numpy.median([s[key] for s in sure]) if sure else numpy.nan for key in ('error', 'focal')]
        print(f'  {kind:<10}{len(of_kind):>8}{sum(n in scores for n in of_kind):>8}{len(sure):>6}{middle[0]:>9.2f}{within[0]:>6}'
              f'{within[1]:>6}{100 * middle[1]:>9.1f}{sum(s["focal_deviation"] < 2 or s["focal"] == 0 for s in sure):>6}')
    for n, s in scores.items():
        if s['is_sure'] and s['error'] > 3 * 1.22 * s['sigma']:
            print(f'    {n:04d} {truths[n]["kind"]}: {s["error"]:.2f} degrees, stated {s["sigma"]:.2f}')


args = scripts.parser_of(__doc__, 'compare', first=0, count=50, folder='build/rendered-scenes').parse_args()
os.makedirs(args.folder, exist_ok=True)
numbers = range(args.first, args.first + args.count)
render(args, numbers)
truths = {n: expose(args, n) for n in numbers}
for is_known in (True, False):
    title = 'the camera' if is_known else 'nothing'
    report(title, truths, scripts.compare(args, scene_file(args, truths, is_known), f'{args.folder}/out', '--solvers=joint'))
