#!/usr/bin/python3
"""Do the stated standard deviations hold on photographs with truth? A table; exit code 1 if anything falls short.

  coverage.py DATA [--compare=build/release/bin/circline_compare] [--sets=part,of,names]
              [--flags='--threads=1'] [--json=FILE] [--against=FILE] [--keep=DIR]

DATA and what it needs as for photographs.py. --flags go to circline_compare, --keep keeps its output, --json
writes all numbers (those of single photos too), --against=FILE prints what changed since a run with --json=FILE.

A row is a set, what is given of it (`detected`: nothing) and a solver at a stage; or `pencils`: the directions of pencils
against their sigma_deg. An error has as many components as its answer: a rotation three, in the camera frame, by
sigma_rotation_deg; a normal or a direction two across it, each by sigma_normal_deg or sigma_deg, the sigma of the worse of
the two (where one is much better known, they count as covered somewhat too often). To each the truth's own deviation is
added in quadrature.

  photos   answered, of all; of pencils: directions found, of those with a truth and pencils to choose from
  in 2s    components within two standard deviations, of all
  least    1 % quantile of a binomial distribution of so many, each with 0.954: fewer are `short`
  e/s      median of |error| / sigma (a Gaussian's is 0.67); then the normal's and the turn's about it (no sigma is stated for
           it: at most what sigma_normal_deg leaves of sigma_rotation_deg)
  mean2    mean square of error / sigma, 1 if honest: NEES over dimension, correlations left out
  deg      median error, degrees; then the normal's and the turn's about it
  not 1st  photos whose first hypothesis is outside and another one less than half as far off, which is then judged in its
           place; and the highest probability of such a first one
  far      detected only: answers more than 5 degrees and 5 sigma off, which are of something else than the truth: not judged;
           and the highest probability of such an answer

Of truths that the evidence cannot tell apart the nearest counts: the senses of axes; rows and columns of a board; of a box,
where all is detected, its 24 rotations. Streets have two true directions, not quite orthogonal: a rotation is right if its
axes lie along one, along the other, or between, and its normal along their product. The last lines pool answers of a kind:
88 to 99 % are to lie within two. The truth of chessboard-opencv comes from the same corners: it has a pool of its own, with
a lower bound only.
"""
import collections
import itertools
import json
import math
import os
import sys
import tempfile

import cv2
import numpy

from photograph_answers import EQUAL, SURE, folder, run_set
from scripts import json_lines, parser_of, read, write
from to_scene import seq

# What is given: to_scene.py's arguments, and the solvers that are judged by it (none: all). The images of a board's centres
# and axes come from the truth; where they decide more than the choice of a hypothesis or the turn, there is no row.
LINES = ('lines', [], None)
CENTRE = ('a circle, its centre', ['--centre'], ('single_circle', 'circle_center', 'joint'))
AXES = ('a circle, axes', ['--centre', '--axes'], ('circle_frame',))
CIRCLES = [CENTRE, AXES, ('circles', ['--circles=all'], ('parallel_circles', 'joint')),
           ('equal circles', ['--circles=all', EQUAL], ('joint',))]
DETECTED = ('detected', ['--evidence=auto'], None)
STRAIGHT = (*DETECTED[:2], ('orthogonal_vanishing_points', 'line_pairs', 'joint'))  # Where no circle has a truth.

# What is given, and the truth's standard deviation: of a rotation, all three components together, degrees. A component has a
# third of the variance. (Of scene-*, of the two directions together; each has its own in the file.)
SETS = {
    'chessboard-opencv': ([LINES, ('all lines', ['--lines=all'], None), STRAIGHT], 0.14),  # Two cameras: 0.11 to 0.17.
    'chessboard-charuco-robot': ([LINES, STRAIGHT], 0.16),  # Camera and robot agree to 0.16.
    'box-camprodon': ([LINES, STRAIGHT], 0.34),  # Edges agree with the axes to 0.34.
    'box-camprodon-more': ([LINES, STRAIGHT], 0.34),
    'circle-mire2': ([CENTRE, DETECTED], 0.2),  # Mostly of its intrinsics.
    'circles-discocal-rgb': ([*CIRCLES, DETECTED], 0.03),  # Formally 0.012; two cameras agree to 0.04 at best.
    'circles-discocal-tir': ([*CIRCLES, DETECTED], 0.03),  # Formally 0.02 to 0.05.
    'circles-robot10x10': ([CENTRE, AXES, DETECTED], 0.22),  # Formally 0.19 to 0.27.
    'circles-visp36': ([*CIRCLES, DETECTED], 0.055),  # Formally.
    'scene-lund': ([LINES, STRAIGHT], 0.09),
    'scene-lund-more': ([LINES, STRAIGHT], 0.09),
    'turntable-teabox': ([('a circle', [], None), DETECTED], 0.18),  # Normal: 0.1 to 0.16.
}
SAME_CORNERS = 'chessboard-opencv'
BOXES = ('box-camprodon', 'box-camprodon-more', 'circle-mire2', 'turntable-teabox')

FAR_DEG, FAR_SIGMAS = 5.0, 5.0
POOLED_PERCENT = (88.0, 99.0)
KINDS = {'refined': 'other refined solvers', 'closed_form': 'closed forms'}

CUBE = [numpy.eye(3)[list(axes)] * signs for axes in itertools.permutations(range(3))
        for signs in itertools.product((1, -1), repeat=3)]
CUBE = [m for m in CUBE if numpy.linalg.det(m) > 0]
FLIPS = [m for m in CUBE if numpy.count_nonzero(numpy.diag(m)) == 3]
SQUARE = [m for m in CUBE if abs(m[2, 2]) == 1]
GROUPS = {'none': [numpy.eye(3)], 'D2': FLIPS, 'D4': SQUARE, 'cube': CUBE}  # Also 'axis': the normal only.

Truth = collections.namedtuple('Truth', 'rotations normal directions')  # All rotations that are right; directions by name.
Part = collections.namedtuple('Part', 'error sigma angle normal turn')  # Degrees; normal and turn: (error, sigma) or None.


def numbers(node, key):
    return numpy.array([value.real() for value in seq(node, key)])


def street_rotations(directions):
    """Axes along the one direction, along the other, and between, all about their product."""
    normal = numpy.cross(*directions)
    normal /= numpy.linalg.norm(normal)
    first = directions[0]
    second = numpy.cross(directions[1], normal)
    second *= numpy.sign(first @ second)
    for share in numpy.linspace(0.0, 1.0, 9):
        x = (1 - share) * first + share * second
        x /= numpy.linalg.norm(x)
        yield numpy.column_stack([x, numpy.cross(normal, x), normal])


def read_truths(args, data_set, scene, detected):
    """Of each image by its name."""
    storage = cv2.FileStorage(scene, cv2.FILE_STORAGE_READ)  # Storages must outlive their nodes.
    original = cv2.FileStorage(os.path.join(args.data, data_set, 'groundtruth.yml'), cv2.FILE_STORAGE_READ)
    images, originals = seq(storage, 'images'), seq(original, 'images')
    own = {d.getNode('name').string(): d.getNode('bootstrap_sd_deg').real() for d in seq(original, 'scene_directions')}
    result = {}
    for image, given in zip(images, originals):
        truth, axes = image.getNode('truth'), given.getNode('box_axes_cam')
        rotation, symmetry = numbers(truth, 'rotation'), truth.getNode('symmetry').string()
        directions = {d.getNode('pencil').string(): numbers(d, 'value') for d in seq(truth, 'directions')}
        sigmas = {name: own[name] / math.sqrt(2.0) for name in directions}
        rotations, normal = [], None
        if len(rotation):
            rotation = rotation.reshape(3, 3)
            normal = rotation[:, 2]
            if detected and data_set in BOXES:
                symmetry = 'cube'
            if not axes.empty():
                rotation = axes.mat()
            directions = dict(zip('xyz' if data_set in BOXES else 'xy', rotation.T))
            sigmas = dict.fromkeys(directions, SETS[data_set][1] / math.sqrt(3.0))
            rotations = [rotation @ m for m in GROUPS.get(symmetry, [])]
        elif len(directions) == 2:
            rotations = [r @ m for r in street_rotations(list(directions.values())) for m in CUBE]
        result[image.getNode('file').string()] = Truth(
            numpy.array(rotations), normal, {name: (d, sigmas[name]) for name, d in directions.items()})
    return result


def across(direction, estimate):
    """The error of a direction without sense along two directions across it, degrees."""
    error = numpy.cross(estimate * (numpy.sign(estimate @ direction) or 1.0), direction)
    size = numpy.linalg.norm(error)
    error *= math.degrees(math.atan2(size, abs(estimate @ direction))) / max(size, 1e-300)
    return numpy.linalg.svd(direction.reshape(1, 3))[2][1:] @ error


def judge(line, truth, own):
    """The error of a hypothesis, or None where it has none. `own`: standard deviation of a component of the truth."""
    estimate, sigma_normal = numpy.array(line['rotation']).reshape(3, 3), line['sigma_normal_deg']
    if None in line['sigma_rotation_deg'] or not len(truth.rotations):
        if sigma_normal is None or truth.normal is None:
            return None
        error, sigma = across(truth.normal, estimate[:, 2]), numpy.full(2, math.hypot(sigma_normal, own))
        return Part(error, sigma, numpy.linalg.norm(error), (error, sigma), None)
    nearest = truth.rotations[numpy.argmax(numpy.einsum('kij,ij->k', truth.rotations, estimate))]
    error, sigma = numpy.degrees(cv2.Rodrigues(nearest @ estimate.T)[0].ravel()), numpy.array(line['sigma_rotation_deg'])
    normal, turn, axis = None, None, estimate[:, 2]
    if sigma_normal is not None:
        rest = max(sigma @ sigma - sigma_normal ** 2, 0.0)
        normal = numpy.linalg.svd(axis.reshape(1, 3))[2][1:] @ error, numpy.full(2, math.hypot(sigma_normal, own))
        turn = numpy.array([axis @ error]), numpy.array([math.hypot(math.sqrt(rest), own)])
    return Part(error, numpy.hypot(sigma, own), numpy.linalg.norm(error), normal, turn)


class Row:
    def __init__(self, data_set, given, solver, stage):
        self.key = {'set': data_set, 'given': given, 'solver': solver, 'stage': stage}
        self.all = self.answered = 0
        self.photos, self.not_first, self.far = [], [], []  # Parts with their images; probabilities.

    def add(self, image, part, probability):
        self.answered += 1
        sigma = numpy.linalg.norm(part.sigma)
        if self.key['given'] == DETECTED[0] and part.angle > max(FAR_DEG, FAR_SIGMAS * sigma):
            self.far.append(probability)
        else:
            self.photos.append((image, part))

    def numbers(self):
        def ratios(pairs):
            return numpy.concatenate([abs(error) / sigma for error, sigma in pairs] or [[]])

        def degrees(pairs):
            return median([numpy.linalg.norm(error) for error, _ in pairs])

        every = [(part.error, part.sigma) for _, part in self.photos]
        normal, turn = ([getattr(part, n) for _, part in self.photos if getattr(part, n)] for n in ('normal', 'turn'))
        within, least = int(sum(ratios(every) <= 2.0)), least_within(ratios(every).size)
        return {**self.key, 'all': self.all, 'answered': self.answered, 'components': ratios(every).size, 'within': within,
                'least': least, 'short': within < least, 'mean_square': float(numpy.mean(ratios(every) ** 2)) if every else None,
                'ratios': [median(ratios(pairs)) for pairs in (every, normal, turn)],
                'degrees': [degrees(pairs) for pairs in (every, normal, turn)], 'not_first': self.not_first, 'far': self.far,
                'photos': [{'image': os.path.basename(image), 'error_deg': list(numpy.round(part.error, 5)),
                            'sigma_deg': list(numpy.round(part.sigma, 5))} for image, part in self.photos]}


def median(values):
    return float(numpy.median(values)) if len(values) else None


def least_within(count):
    """1 % quantile of a binomial distribution with 0.954."""
    total = 0.0
    for k in range(count + 1):
        total += math.comb(count, k) * 0.954 ** k * 0.046 ** (count - k)
        if total >= 0.01:
            return k
    return count


def solver_rows(data_set, given, only, lines, truths):
    own = SETS[data_set][1] / math.sqrt(3.0)
    rows, photos = {}, {}
    for line in lines:
        if only is None or line['solver'] in only:
            judged = photos.setdefault((line['solver'], line['stage'], line['image']), [])
            part = line['status'] == 'ok' and judge(line, truths[line['image']], own)
            if part:
                judged.append((part, round(line['probability'], 4)))
    for (solver, stage, image), judged in photos.items():
        row = rows.setdefault((solver, stage), Row(data_set, given, solver, stage))
        row.all += 1
        if not judged:
            continue
        part, probability = judged[0]
        nearest = min((other for other, _ in judged), key=lambda other: other.angle)
        if max(abs(part.error) / part.sigma) > 2.0 and nearest.angle < 0.5 * part.angle:
            part = nearest
            if given != DETECTED[0] or part.angle <= FAR_DEG:
                row.not_first.append(probability)
        row.add(image, part, probability)
    return list(rows.values())


def pencil_row(data_set, given, lines, truths):
    row = Row(data_set, given, 'pencils', '')
    for line in lines:
        pencils = [p for p in line['pencils'] if p['sigma_deg'] is not None]
        for name, (direction, own) in truths[line['image']].directions.items():
            parts = [(across(direction, numpy.array(p['direction'])), math.hypot(p['sigma_deg'], own)) for p in pencils
                     if p['id'] == name or given == DETECTED[0]]
            row.all += bool(parts)
            error, sigma = min(parts, key=lambda part: numpy.linalg.norm(part[0]), default=(None, None))
            if parts and numpy.linalg.norm(error) <= max(FAR_DEG, FAR_SIGMAS * sigma):  # Else it is that of no pencil.
                part = Part(error, numpy.full(2, sigma), numpy.linalg.norm(error), None, None)
                row.add(f'{line["image"]} {name}', part, 1.0)
    return [row]


def rows_of(args, data_set, given, options, only, scratch):
    lines, scene = run_set(args, data_set, options, scratch, *args.flags.split())
    truths = read_truths(args, data_set, scene, given == DETECTED[0])
    rows = solver_rows(data_set, given, only, lines, truths)
    rows += pencil_row(data_set, given, json_lines(os.path.join(folder(data_set, options, scratch), 'observations.jsonl')), truths)
    return [row.numbers() for row in rows if row.photos or row.far]


HEAD = ['set', 'given', 'solver', 'stage', 'photos', 'in 2s', 'least', '', 'e/s', 'nrml', 'turn', 'mean2', 'deg', 'nrml', 'turn',
        'not 1st', 'far']
FORMAT = '{:25}{:21}{:28}{:12}{:>6}{:>8}{:>6} {:5}{:>6}{:>6}{:>6}{:>7}{:>8}{:>7}{:>7}{:>9}{:>9}'


def columns(r):
    def text(value, digits):
        return '-' if value is None else f'{value:.{digits}f}'

    def often(probabilities):
        return f'{len(probabilities)}, {max(probabilities):.2f}' if probabilities else '-'

    return [r['set'], r['given'], r['solver'], r['stage'], f'{r["answered"]}/{r["all"]}', f'{r["within"]}/{r["components"]}',
            str(r['least']), 'short' if r['short'] else '', *(text(v, 2) for v in r['ratios']), text(r['mean_square'], 1),
            *(text(v, 3) for v in r['degrees']), often(r['not_first']), often(r['far'])]


def print_pooled(results):
    """Returns how many pools lie outside."""
    pools, outside = collections.defaultdict(lambda: [0, 0]), 0
    for r in results:
        key = (SAME_CORNERS if r['set'] == SAME_CORNERS else 'all other sets',
               'detected' if r['given'] == DETECTED[0] else 'annotated',
               r['solver'] if r['solver'] in ('joint', 'pencils') else KINDS[r['stage']])
        pools[key] = [pools[key][0] + r['within'], pools[key][1] + r['components']]
    for key, (within, count) in sorted(pools.items()):
        percent = 100.0 * within / max(count, 1)
        fails = percent < POOLED_PERCENT[0] or (percent > POOLED_PERCENT[1] and key[0] != SAME_CORNERS)
        outside += fails
        print(f'{", ".join(key)}: {within} of {count} within two standard deviations, {percent:.1f} %' + ' OUTSIDE' * fails)
    return outside


def print_changes(results, earlier):
    sets = {r['set'] for r in results}
    before, now = ({tuple(columns(r)[:4]): columns(r)[4:] for r in rows if r['set'] in sets}
                   for rows in (earlier, results))
    print('changed:')
    for key in dict.fromkeys([*before, *now]):
        if key in before and key in now:
            words = [f'{name} {old} -> {new}' for name, old, new in zip(HEAD[4:], before[key], now[key]) if old != new]
        else:
            words = ['new' if key in now else 'gone']
        if words:
            print(f'  {" ".join(key)}: {", ".join(words)}')


def main():
    args = parser_of(__doc__, 'compare', data='1', sets='', flags='', json=None, against=None, keep=None).parse_args()
    results = []
    print(FORMAT.format(*HEAD))
    with tempfile.TemporaryDirectory() as temporary:
        for data_set in (s for s in SETS if any(part in s for part in args.sets.split(','))):
            for given, options, only in SETS[data_set][0]:
                for row in rows_of(args, data_set, given, options, only, args.keep or temporary):
                    results.append(row)
                    print(FORMAT.format(*columns(row)), flush=True)
    if not results:
        sys.exit('no answer with a truth')
    short, outside = sum(r['short'] for r in results), print_pooled(results)
    sure = {f: sum(p >= SURE for r in results if r['solver'] == 'joint' for p in r[f]) for f in ('far', 'not_first')}
    print(f'{len(results)} rows, {short} short; {outside} pools outside; of joint with a probability of {SURE} or more: '
          f'{sure["far"]} far answers, {sure["not_first"]} first hypotheses that are not the right one')
    if args.json:
        write(args.json, json.dumps(results))
    if args.against:
        print_changes(results, json.loads(read(args.against)))
    return short + outside > 0


if __name__ == '__main__':
    sys.exit(main())
