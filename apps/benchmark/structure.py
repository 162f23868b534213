#!/usr/bin/python3
"""Does the structure of a photograph depend on its size, or on chance? A line for each set; exit code 1 if it does.

  structure.py DATA [--compare=build/release/bin/circline_compare] [--sets=part,of,names]
               [--sizes=0.5,1,2] [--seeds=1,2,3] [--flags='--threads=1']

DATA and what it needs as for photographs.py. Everything is detected in each photo, at each size of it (lenses
and truths follow) and with each seed; the answers of `joint` with a probability of 0.9 or more are compared with those of
the same photo at its own size with the first seed, if they are of the same plane (normals within 20 degrees).

  answers  photos with a sure answer at their own size, with the first seed, of all
  pairs    pairs of sure answers about the same plane
  agree    those whose normals are within three of the larger standard deviation
  other    pairs of sure answers about different planes
"""
import collections
import math
import os
import re
import shutil
import sys
import tempfile

import cv2
import numpy

from photograph_answers import SURE
from photographs import AUTOMATIC
from scripts import compare, make_scene, parser_of, write

SAME_PLANE_DEG = 20.0
SIGMAS = 3.0
LEAST_SHARE = 0.97  # Of pairs that agree.


def scaled_scene(text, size, scratch):
    """The scene with its photos, cameras at this size; pixel centres are at integers."""
    def camera(match):
        width, height = (round(size * int(match[k])) for k in (1, 2))
        fx, cx, fy, cy = (float(match[k]) for k in range(3, 7))
        return (f'width: {width}, height: {height}, camera_matrix: [{fx * size}, 0., {(cx + 0.5) * size - 0.5}, 0., '
                f'{fy * size}, {(cy + 0.5) * size - 0.5}, 0., 0., 1.]')

    def photo(match):
        image = cv2.imread(os.path.join(scratch, match[1]), cv2.IMREAD_COLOR)
        height, width = image.shape[:2]
        file = os.path.join(scratch, os.path.splitext(os.path.basename(match[1]))[0] + '.png')
        cv2.imwrite(file, cv2.resize(image, (round(size * width), round(size * height)),
                                     interpolation=cv2.INTER_AREA if size < 1.0 else cv2.INTER_CUBIC))
        return f'file: "{file}"'

    number, zero = r'\s*([-+.\deE]+)\s*,', r'\s*0\.?\s*,'
    matrix = number + zero + number + zero + number + number
    text = re.sub(rf'width: (\d+), height: (\d+), camera_matrix: \[{matrix}[^\]]*\]', camera, text)
    return re.sub(r'file: "([^"]*)"', photo, text)


def sure_answers(args, scene, flags, scratch):
    """Normals and their standard deviations, degrees, by photo."""
    out = os.path.join(scratch, 'out')
    shutil.rmtree(out, ignore_errors=True)
    answers, photos = {}, set()
    for line in compare(args, scene, out, '--solvers=joint', *flags, *args.flags.split()):
        name = os.path.splitext(os.path.basename(line['image']))[0]
        photos.add(name)
        # A normal that is not told is of no plane.
        if line['hypothesis'] == 0 and line['probability'] >= SURE and line['sigma_normal_deg'] is not None:
            answers[name] = (numpy.array(line['rotation'][2::3]), line['sigma_normal_deg'])
    return answers, photos


def count_pairs(base, other, counts):
    for name in base.keys() & other.keys():
        (a, sigma_a), (b, sigma_b) = base[name], other[name]
        angle = math.degrees(math.acos(min(1.0, abs(float(a @ b)))))
        if angle > SAME_PLANE_DEG:
            counts['other'] += 1
            continue
        counts['pairs'] += 1
        counts['agree'] += angle <= SIGMAS * max(sigma_a, sigma_b)


def main():
    args = parser_of(__doc__, 'compare', data='1', sets='', sizes='0.5,1,2', seeds='1,2,3', flags='').parse_args()
    sizes, seeds = [float(s) for s in args.sizes.split(',')], args.seeds.split(',')
    total = collections.Counter()
    print(f'{"set":26} answers   pairs  agree  other')
    for data_set in AUTOMATIC + ['scene-lund-more', 'box-camprodon-more']:
        if args.sets and not any(part in data_set for part in args.sets.split(',')):
            continue
        with tempfile.TemporaryDirectory() as scratch:
            scene = os.path.join(scratch, 'scene.yaml')
            text = make_scene(args, data_set, scene, '--evidence=auto')
            base, photos = sure_answers(args, scene, [f'--seed={seeds[0]}'], scratch)
            counts = collections.Counter(answers=len(base), photos=len(photos))
            for seed in seeds[1:]:
                count_pairs(base, sure_answers(args, scene, [f'--seed={seed}'], scratch)[0], counts)
            for size in sizes:
                if size == 1.0:
                    continue
                scaled = write(os.path.join(scratch, 'scaled.yaml'), scaled_scene(text, size, scratch))
                count_pairs(base, sure_answers(args, scaled, [f'--seed={seeds[0]}'], scratch)[0], counts)
        total += counts
        print(f'{data_set:26} {counts["answers"]:3}/{counts["photos"]:3} {counts["pairs"]:7} {counts["agree"]:6} '
              f'{counts["other"]:6}', flush=True)
    share = total['agree'] / max(1, total['pairs'])
    print(f'{total["agree"]} of {total["pairs"]} pairs agree, {100.0 * share:.1f} %; {total["other"]} are of other planes')
    return 0 if share >= LEAST_SHARE else 1


if __name__ == '__main__':
    sys.exit(main())
