#!/usr/bin/python3
"""The focal length from one photo, everything detected, its calibration ignored: errors against the truth, whether the stated
deviations hold, and whether the guess matters.

  single_photo_focal.py DATA [--compare=build/release/bin/circline_compare] [--sets=a,b] [--photos]

DATA holds one folder a set, each with a groundtruth.yml (docs/photographs.md). `lens given`: principal point and
distortion are the calibration's. `nothing given`: no distortion, principal point in the middle, both uncertain. The focal length
starts at 60 degrees along the longer side, times 1, 0.7 and 1.4, with a deviation of 0.5 of its logarithm.

The answer of a photo is the best hypothesis of `joint`; its deviation is about that one, over all hypotheses at their
probabilities. `sure` are answers with a deviation of 5 % or less; `same`: with both other guesses an answer within one deviation
of the first's (two where that is above 5 %), of the photos that answer each time; `time`: what a photo takes against the same
with its calibration, detection and `joint` (median). `box, three directions`: the photos of both sets
of the box in which three of them were found.
"""
import itertools
import math
import os
import re
import statistics
import tempfile

from scripts import CAMERA, compare, json_lines, make_scene, parser_of, write

SIGMA = 0.5  # Of log f, of the guess.
GUESSES = (1.0, 0.7, 1.4)
GIVEN = {True: 'lens given', False: 'nothing given'}
SETS = ['circles-discocal-rgb', 'circles-discocal-tir', 'circles-visp36', 'circles-robot10x10', 'chessboard-opencv',
        'chessboard-charuco-robot', 'scene-lund', 'scene-lund-more', 'box-camprodon', 'box-camprodon-more', 'turntable-teabox',
        'circle-mire2']
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
        return (f'id: "{name}", model: "{model}", width: {width}, height: {height}, camera_matrix: '
                f'[{f}, 0., {cx}, 0., {f * aspect}, {cy}, 0., 0., 1.], distortion: [{distortion}], focal_sigma: {SIGMA}{lens}')
    return CAMERA.sub(guess, scene)


def answers(args, scene, scratch):
    """Of each photo all hypotheses of joint, best first; in which three directions were found; and what each has taken."""
    out = os.path.join(scratch, 'out')
    found = {}
    for line in compare(args, write(os.path.join(scratch, 'scene.yaml'), scene), out, '--solvers=joint'):
        if line['status'] == 'ok':
            found.setdefault(line['image'], []).append(line)
    three = {line['image'] for line in json_lines(os.path.join(out, 'observations.jsonl')) if len(line['pencils']) >= 3}
    times = {}
    for line in json_lines(os.path.join(out, 'timings.jsonl')):
        if line['stage'] == 'detect' or line.get('solver') == 'joint':
            times[line['image']] = times.get(line['image'], 0) + line['microseconds']
    return found, three, times


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


def show(name, num_photos, rows, ratios=()):
    time = f'{statistics.median(ratios):.1f}' if ratios else ''
    print(f'{name:42}{num_photos:9}' + ''.join(f'{c:>9}' for c in judge(rows)) + f'{time:>6}', flush=True)


def main():
    args = parser_of(__doc__, 'compare', data='1', sets='', photos=False).parse_args()
    heads = ['photos', 'answer', 'median %', '<= 5 %', '<= 10 %', 'in 2 s', 'sure', '<= 10 %', '> 20 %', 'same']
    print(f'{"set":42}' + ''.join(f'{h:>9}' for h in heads) + f'{"time":>6}')
    pooled, num_photos, all_ratios = [], 0, []
    boxes = {True: [], False: []}
    with tempfile.TemporaryDirectory() as scratch:
        for data_set, lens_given in itertools.product(SETS, (True, False)):
            if args.sets and data_set not in args.sets.split(','):
                continue
            scene = make_scene(args, data_set, os.path.join(scratch, 'source.yaml'), '--evidence=auto')
            truth = {m[0]: float(m[4].split(',')[0]) for m in CAMERA.findall(scene)}
            photos = dict(IMAGE.findall(scene))
            known = answers(args, scene, scratch)[2]
            runs, threes, times = zip(*(answers(args, guessed(scene, factor, lens_given), scratch) for factor in GUESSES))
            ratios = [times[0][photo] / known[photo] for photo in photos]
            all_ratios += ratios
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
            show(f'{data_set}, {GIVEN[lens_given]}', len(photos), rows, ratios)
    show('pooled', num_photos, pooled, all_ratios)
    for lens_given, rows in boxes.items():
        if rows:
            show(f'box, three directions, {GIVEN[lens_given]}', len(rows), rows)


if __name__ == '__main__':
    main()
