#!/usr/bin/env python3
"""Do the stated standard deviations cover the errors on photographs with truth? Prints one line a set and one for all.

  coverage.py DATA [--converter=to_scene.py] [--compare=build/release/bin/circline_compare]

For each photo and component of the rotation's error (camera frame; of circles alone, of the error of the normal, the better
hypothesis, with equal deviations in both components): is it within two standard deviations, the truth's own deviation added
in quadrature? 95 % of a Gaussian's are. DATA and the converter as for photographs.py.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

import cv2
import numpy

# set, converter's arguments, standard deviation of the truth's rotation (all three components together), degrees
SETS = [
    ('chessboard-opencv', [], 0.14),
    ('chessboard-opencv', ['--lines=all'], 0.14),
    ('chessboard-charuco-robot', [], 0.16),
    ('box-camprodon', [], 0.34),
    ('circle-mire2', [], 0.2),
    ('circles-discocal-rgb', ['--centre'], 0.15),
    ('circles-discocal-rgb', ['--circles=all'], 0.15),
    ('circles-discocal-tir', ['--centre'], 0.02),
    ('circles-discocal-tir', ['--circles=all'], 0.02),
    ('circles-robot10x10', ['--centre'], 0.27),
    ('circles-visp36', ['--centre'], 0.05),
    ('circles-visp36', ['--circles=all'], 0.05),
]
FLIPS = [numpy.diag(d) for d in ([1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1])]


def truths(scene):
    """Rotation and symmetry of each image."""
    storage = cv2.FileStorage(scene, cv2.FILE_STORAGE_READ)  # Must outlive its nodes.
    images = storage.getNode('images')
    result = {}
    for i in range(images.size()):
        truth = images.at(i).getNode('truth')
        rotation = truth.getNode('rotation')
        if rotation.size() == 9:
            values = [rotation.at(k).real() for k in range(9)]
            symmetry = truth.getNode('symmetry')
            result[images.at(i).getNode('file').string()] = (numpy.array(values).reshape(3, 3), symmetry.string())
    return result


def components(line, truth, symmetry):
    """delta in rotation_true = exp([delta]x) rotation_estimated, degrees; the smallest of what the evidence cannot tell."""
    estimate = numpy.array(line['rotation']).reshape(3, 3)
    choices = FLIPS if symmetry in ('D2', 'D4') else FLIPS[:1]
    deltas = [cv2.Rodrigues(truth @ flip @ estimate.T)[0].ravel() for flip in choices]
    return numpy.degrees(min(deltas, key=numpy.linalg.norm))


def normal_components(line, truth):
    """The error of the plane's normal along two directions across it, degrees."""
    normal, estimate = truth[:, 2], numpy.array(line['rotation']).reshape(3, 3)[:, 2]
    error = numpy.cross(estimate * numpy.sign(estimate @ normal), normal)
    across = numpy.linalg.svd(normal.reshape(1, 3))[2][1:]
    return numpy.degrees(across @ error)


def ratio(line, truth, symmetry, truth_deg):
    """Errors over standard deviations, one a component."""
    if None in line['sigma_rotation_deg']:
        sigma = numpy.hypot(line['sigma_normal_deg'], truth_deg) / numpy.sqrt(2.0)
        return numpy.abs(normal_components(line, truth)) / sigma
    sigma = numpy.hypot(line['sigma_rotation_deg'], truth_deg / numpy.sqrt(3.0))
    return numpy.abs(components(line, truth, symmetry)) / sigma


def chosen(lines):
    """Of each image the hypothesis to judge: the first, or where only the normal is known, the better one."""
    images = {}
    for line in lines:
        if (line['solver'], line['status']) == ('joint', 'ok'):
            images.setdefault(line['image'], []).append(line)
    for hypotheses in images.values():
        free = None in hypotheses[0]['sigma_rotation_deg']
        yield min(hypotheses, key=lambda line: line['normal_error_deg']) if free else hypotheses[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('data')
    parser.add_argument('--converter', default=None)
    parser.add_argument('--compare', default='build/release/bin/circline_compare')
    args = parser.parse_args()
    converter = args.converter or os.path.join(args.data, '..', 'tools', 'to_scene.py')
    covered = total = 0
    with tempfile.TemporaryDirectory() as scratch:
        for data_set, options, truth_deg in SETS:
            scene = os.path.join(scratch, '_'.join([data_set, *options]).replace('=', '') + '.yaml')
            subprocess.run(['/usr/bin/python3', converter, os.path.join(args.data, data_set), scene, *options], check=True)
            subprocess.run([args.compare, f'--scene={scene}', f'--output={scene[:-5]}', '--overlays=false'], check=True,
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            true = truths(scene)
            with open(os.path.join(scene[:-5], 'results.jsonl')) as lines:
                ratios = [r for line in chosen(map(json.loads, lines)) if line['image'] in true
                          for r in ratio(line, *true[line['image']], truth_deg)]
            within, count = sum(r <= 2.0 for r in ratios), len(ratios)
            covered, total = covered + within, total + count
            if count:
                print(f'{data_set} {" ".join(options)}: {within} of {count} within two standard deviations '
                      f'({100.0 * within / count:.0f} %), root mean square {numpy.sqrt(numpy.mean(numpy.square(ratios))):.2f}')
    if total == 0:
        sys.exit('no result with a truth')
    print(f'all: {covered} of {total} ({100.0 * covered / total:.1f} %)')


if __name__ == '__main__':
    main()
