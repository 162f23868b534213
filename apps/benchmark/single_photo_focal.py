#!/usr/bin/python3
"""The focal length from one photo, everything detected, its calibration ignored: errors against the truth, whether the stated
deviations hold, and whether the guess matters.

  single_photo_focal.py DATA [--compare=build/release/bin/circline_compare] [--sets=a,b] [--photos]

DATA holds one folder a set, each with a groundtruth.yml (docs/photographs.md). `lens given`: principal point and
distortion are the calibration's. `nothing given`: no distortion, principal point in the middle, both uncertain. The focal length
starts at 60 degrees along the longer side, times 1, 0.7 and 1.4, with a deviation of 0.5 of its logarithm.

The answer of a photo is the best hypothesis of `joint`; its deviation is about that one, over all hypotheses at their
probabilities. `sure` are answers with a deviation of 5 % or less; `same`: with both other guesses an answer within one deviation
of the first's (two where that is above 5 %), of the photos that answer each time. `box, three directions`: the photos of both sets
of the box in which three of them were found.
"""
import argparse
import json
import math
import os
import re
import statistics
import subprocess
import tempfile

from photograph_answers import TO_SCENE

SIGMA = 0.5  # Of log f, of the guess.
GUESSES = (1.0, 0.7, 1.4)
GIVEN = {True: 'lens given', False: 'nothing given'}
# set, whether the lens is given
ROWS = [
    ('circles-discocal-rgb', True), ('circles-discocal-rgb', False), ('circles-discocal-tir', True), ('circles-discocal-tir', False),
    ('circles-visp36', True), ('circles-visp36', False), ('circles-robot10x10', True), ('circles-robot10x10', False),
    ('chessboard-opencv', True), ('chessboard-opencv', False), ('chessboard-charuco-robot', True), ('chessboard-charuco-robot', False),
    ('scene-lund', True), ('scene-lund', False), ('scene-lund-more', True), ('scene-lund-more', False),
    ('box-camprodon', True), ('box-camprodon', False), ('box-camprodon-more', True), ('box-camprodon-more', False),
    ('turntable-teabox', True), ('turntable-teabox', False), ('circle-mire2', True), ('circle-mire2', False),
]
CAMERA = re.compile(r'\{ ?id: "(\w+)", model: "(\w+)", width: (\d+), height: (\d+), '
                    r'camera_matrix: \[([^\]]*)\](?:, distortion: \[([^\]]*)\])?')
IMAGE = re.compile(r'file: "([^"]*)"\s+camera: "(\w+)"')


def guessed(scene, factor, lens_given):
    """The scene with guessed cameras."""
    def guess(match):
        name, model, width, height, matrix, distortion = match.groups()
        width, height = int(width), int(height)
        f = factor * max(width, height) / 2 / math.tan(math.radians(30))
        m = [float(v) for v in matrix.split(',')]
        if lens_given:
            cx, cy, aspect, lens = m[2], m[5], m[4] / m[0], ''
            distortion = distortion or '0., 0., 0., 0., 0.'
        else:
            model, distortion, aspect = 'opencv', '0., 0., 0., 0., 0.', 1.0
            cx, cy = (width - 1) / 2, (height - 1) / 2
            lens = f', principal_point_sigma_px: {0.03 * math.hypot(width, height)}, k1_sigma: 0.3'
        return (f'{{ id: "{name}", model: "{model}", width: {width}, height: {height}, camera_matrix: '
                f'[{f}, 0., {cx}, 0., {f * aspect}, {cy}, 0., 0., 1.], distortion: [{distortion}], focal_sigma: {SIGMA}{lens}')
    return CAMERA.sub(guess, scene)


def answers(args, scene, scratch):
    """Of each photo all hypotheses of joint, best first; and in which three directions were found."""
    path, out = os.path.join(scratch, 'scene.yaml'), os.path.join(scratch, 'out')
    with open(path, 'w') as file:
        file.write(scene)
    subprocess.run([args.compare, f'--scene={path}', f'--output={out}', '--overlays=false', '--solvers=joint'],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    found = {}
    with open(os.path.join(out, 'results.jsonl')) as file:
        for line in map(json.loads, file):
            if line['status'] == 'ok':
                found.setdefault(line['image'], []).append(line)
    with open(os.path.join(out, 'observations.jsonl')) as file:
        three = {line['image'] for line in map(json.loads, file) if len(line['pencils']) >= 3}
    return found, three


def answer(hypotheses):
    """Logarithm of the focal length, and its deviation."""
    best = math.log(hypotheses[0]['focal_px'])
    variance = sum(h['probability'] * ((h['focal_sigma'] / h['focal_scale']) ** 2 + (math.log(h['focal_px']) - best) ** 2)
                   for h in hypotheses)
    return best, math.sqrt(variance)


def percent(part, whole):
    return f'{part}/{whole}' if whole else '-'


def judge(rows):
    """Of (error, deviation, same or None)."""
    errors = [abs(math.expm1(e)) for e, _, _ in rows]  # Shares of the truth.
    sure = [abs(math.expm1(e)) for e, s, _ in rows if s <= 0.05]
    compared = [same for _, _, same in rows if same is not None]
    n = len(rows)
    def off(share):
        return sum(e <= share for e in errors)

    return [n, f'{100 * statistics.median(errors):.1f}' if n else '-', off(0.05), off(0.1),
            percent(sum(abs(e) <= 2 * s for e, s, _ in rows), n), len(sure),
            percent(sum(e <= 0.1 for e in sure), len(sure)), sum(e > 0.2 for e in sure),
            percent(sum(compared), len(compared))]


def show(name, num_photos, rows):
    print(f'{name:42}{num_photos:9}' + ''.join(f'{c:>9}' for c in judge(rows)), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('data')
    parser.add_argument('--compare', default='build/release/bin/circline_compare')
    parser.add_argument('--sets', default='', help='only these, separated by commas')
    parser.add_argument('--photos', action='store_true', help='a line for each photo')
    args = parser.parse_args()
    heads = ['photos', 'answer', 'median %', '<= 5 %', '<= 10 %', 'in 2 s', 'sure', '<= 10 %', '> 20 %', 'same']
    print(f'{"set":42}' + ''.join(f'{h:>9}' for h in heads))
    pooled, num_photos = [], 0
    boxes = {True: [], False: []}
    with tempfile.TemporaryDirectory() as scratch:
        for data_set, lens_given in ROWS:
            if args.sets and data_set not in args.sets.split(','):
                continue
            source = os.path.join(scratch, 'source.yaml')
            subprocess.run([TO_SCENE, os.path.join(args.data, data_set), source, '--evidence=auto'],
                           check=True, stdout=subprocess.DEVNULL)
            with open(source) as file:
                scene = file.read()
            truth = {m[0]: float(m[4].split(',')[0]) for m in CAMERA.findall(scene)}
            photos = dict(IMAGE.findall(scene))
            runs, threes = zip(*(answers(args, guessed(scene, factor, lens_given), scratch) for factor in GUESSES))
            rows = []
            for photo, camera in photos.items():
                found = [answer(run[photo]) if photo in run else None for run in runs]
                line = ' '.join('      -       ' if a is None else f'{100 * (a[0] - math.log(truth[camera])):6.1f}+-{100 * a[1]:<6.1f}'
                                for a in found)
                if args.photos:
                    print(f'    {os.path.basename(photo):36}{line}', flush=True)
                if found[0] is None:
                    continue
                log_f, sigma = found[0]
                within = (1 if sigma <= 0.05 else 2) * sigma
                same = all(abs(a[0] - log_f) <= within for a in found[1:]) if all(found) else None
                rows.append((log_f - math.log(truth[camera]), sigma, same))
                if data_set.startswith('box') and photo in threes[0]:
                    boxes[lens_given].append(rows[-1])
            pooled += rows
            num_photos += len(photos)
            show(f'{data_set}, {GIVEN[lens_given]}', len(photos), rows)
    show('pooled', num_photos, pooled)
    for lens_given, rows in boxes.items():
        if rows:
            show(f'box, three directions, {GIVEN[lens_given]}', len(rows), rows)


if __name__ == '__main__':
    main()
