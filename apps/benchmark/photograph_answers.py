"""Answers of circline_compare about photographs with truth, and their errors: for photographs.py."""
import itertools
import math
import os
import re

from scripts import TOP, bash, compare, make_scene, read, write

EQUAL = 'equal circles'  # Not for to_scene.py: all circles of a photo are one radius_group.
SURE = 0.9  # The probability of an answer that counts as sure.


def folder(data_set, options, scratch):
    return os.path.join(scratch, '_'.join((data_set, *options)).replace('=', '').replace(' ', '_'))


def run_set(args, data_set, options, scratch, *flags):
    """Result lines, and the scene file."""
    out = folder(data_set, options, scratch)
    scene = out + '.yaml'
    text = make_scene(args, data_set, scene, *(o for o in options if o != EQUAL))
    if EQUAL in options:
        write(scene, re.sub(r'(\{ id: "\w+", )(contour:)', r'\1radius_group: "dots", \2', text))
    return compare(args, scene, out, *flags), scene


def run(args, data_set, options, scratch, cache={}):
    """Result lines by image, solver and stage; one run for each set and evidence."""
    key = (data_set, *options)
    if key not in cache:
        cache[key], scene = run_set(args, data_set, options, scratch)
        if data_set == 'box-camprodon':
            cache[key] = set_box_errors(scene_rotations(scene), cache[key])
    return cache[key]


def run_demo(args, scene, scratch, cache={}):
    """Result lines of a scene of apps/demo, on photographs of Debian packages."""
    if scene not in cache:
        bash('lay_out "$1"', scene)
        cache[scene] = compare(args, f'{TOP}/build/demo/{scene}/scene.yaml', os.path.join(scratch, scene))
    return cache[scene]


def answers(lines, solver, stage):
    """For each image the hypotheses of one solver, best first; empty where it refused."""
    by_image = {}
    for line in lines:
        hypotheses = by_image.setdefault(line['image'], [])
        if (line['solver'], line['stage'], line['status']) == (solver, stage, 'ok'):
            hypotheses.append(line)
    return list(by_image.values())


def error(line, field):
    """Of directions the worst one."""
    value = line.get(field)
    if value is None:
        return float('inf')
    return max(value.values()) if isinstance(value, dict) else value


def determinant(m):
    return sum(m[i] * (m[3 + (i + 1) % 3] * m[6 + (i + 2) % 3] - m[3 + (i + 2) % 3] * m[6 + (i + 1) % 3]) for i in range(3))


def box_error(rotation, truth):
    """Of two rotations (row-major), in degrees, whichever face of a box and whichever of its edges the axes are."""
    relative = [[sum(truth[3 * k + i] * rotation[3 * k + j] for k in range(3)) for j in range(3)] for i in range(3)]
    best = 180.0
    for axes in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            turned = [signs[j] * (i == axes[j]) for i in range(3) for j in range(3)]
            if determinant(turned) < 0:
                continue
            trace = sum(relative[axes[j]][j] * signs[j] for j in range(3))
            best = min(best, math.degrees(math.acos(max(-1.0, min(1.0, (trace - 1) / 2)))))
    return best


def is_right_first(hypotheses):
    """Whether no other one is less than half as far off: readings of one pose differ by less than their errors."""
    errors = [error(line, 'normal_error_deg') for line in hypotheses]
    return 2.0 * min(errors) >= errors[0]


def matrices(file, before):
    """The numbers in the brackets that follow each `before`."""
    return [list(map(float, numbers.split(','))) for numbers in re.findall(before + r'\[([^\]]*)\]', read(file))]


def scene_rotations(scene):
    return matrices(scene, r'truth: \{ rotation: ')


def box_axes(args, data_set):
    """Of a box in each photo: rotations from its frame to the camera's."""
    return matrices(os.path.join(args.data, data_set, 'groundtruth.yml'), r'box_axes_cam: !![^\[]*')


def set_box_errors(truths, lines):
    """A box has no front: what is right of any of its faces is right."""
    images = list(dict.fromkeys(line['image'] for line in lines))
    for line in lines:
        if line.get('rotation_error_deg') is not None:
            line['rotation_error_deg'] = box_error(line['rotation'], truths[images.index(line['image'])])
    return lines


def sure_errors(images):
    """Of the rotation, of the photos with an answer that is sure."""
    return [error(h[0], 'rotation_error_deg') for h in images if h and h[0]['probability'] >= SURE]


def shares_plane(observation):
    """Whether a circle and pencils along x and y were found to lie in the plane of the world."""
    along = {p['along'] for p in observation['pencils'] if p['plane'] == 'p0'}
    return {'x', 'y'} <= along and any(e['plane'] == 'p0' for e in observation['ellipses'])


def pencils_error(directions, observation):
    """Of the direction that is farthest from the nearest pencil found, in degrees."""
    def angle(a, b):
        cosine = sum(x * y for x, y in zip(a, b)) / math.hypot(*a) / math.hypot(*b)
        return math.degrees(math.acos(min(1.0, abs(cosine))))

    found = [p['direction'] for p in observation['pencils'] if p['direction']]
    return max(min((angle(d, p) for p in found), default=float('inf')) for d in directions)


def any_error(line):
    """Of the rotation where it is known, else of the normal, else of the worst direction."""
    return next((error(line, field) for field in ('rotation_error_deg', 'normal_error_deg', 'direction_error_deg')
                 if line.get(field) is not None), float('inf'))
