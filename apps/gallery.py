#!/usr/bin/python3
"""The pictures of docs/photographs.md, and its column of what was found: run by apps/gallery.sh.

  gallery.py OUTPUT FOLDER...

The rows of the page name the photographs, which are in one of the folders. Exit code 1 if two solvers are sure of planes
more than 5 degrees apart without a note that says so.
"""
import collections
import itertools
import json
import math
import os
import re
import shutil
import subprocess
import sys

import cv2
import numpy

PAGE, PICTURES = 'docs/photographs.md', 'docs/pictures/photographs'
WIDTH, QUALITY = 480, 78
SURE, APART_DEG = 0.9, 5.0
ROW = re.compile(r'^\| !\[(?P<name>[^]]+)\]\((?P<picture>[^)]+)\) \| (?P<found>.*) \| (?P<seen>.*) \|$')


def json_lines(file):
    with open(file) as lines:
        return [json.loads(line) for line in lines]


def normal(answer):
    return numpy.array(answer['rotation'][2::3])


def degrees_apart(a, b):
    return math.degrees(math.acos(min(1.0, abs(float(a @ b)))))


def plural(count, noun):
    return f'{count} {noun}{"" if count == 1 else "s"}'


def describe(observed, answers):
    pencils = observed['pencils']
    text = f'{plural(len(observed["ellipses"]), "ellipse")}, {plural(sum(p["num_segments"] for p in pencils), "line")} in ' \
           f'{plural(len(pencils), "pencil")}'
    best = [a for a in answers if a['hypothesis'] == 0 and a['stage'] == 'refined' and a['status'] == 'ok']
    if not best:
        return text + '; no pose'
    shown = max(best, key=lambda a: (a['solver'] == 'joint', a['probability']))
    tilt = degrees_apart(normal(shown), numpy.array([0.0, 0.0, 1.0]))
    text += f'; `{shown["solver"]}` **{shown["probability"]:.2f}**, {tilt:.0f}° from frontal'
    return '; '.join([text] + [note for note in shown['notes'] if 'another plane' in note])


def unsaid(answers):
    """Pairs of sure solvers about different planes, neither of which says so."""
    for loss in {a['loss'] for a in answers}:
        sure = [a for a in answers if a['loss'] == loss and a['status'] == 'ok' and a['hypothesis'] == 0 and
                (a['probability'] or 0.0) >= SURE]
        for a, b in itertools.combinations(sure, 2):
            if degrees_apart(normal(a), normal(b)) > APART_DEG and not any(b['solver'] in note for note in a['notes']):
                yield f'{a["image"]}: {a["solver"]} and {b["solver"]}'


def write_picture(overlay, file):
    picture = cv2.imread(overlay)
    if picture.shape[1] > WIDTH:
        scale = WIDTH / picture.shape[1]
        picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    cv2.imwrite(file, picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])


def main():
    output, folders = sys.argv[1], sys.argv[2:]
    with open(PAGE) as page:
        lines = page.read().split('\n')
    names = [match['name'] for match in map(ROW.match, lines) if match]
    photos = [next((p for p in (os.path.join(f, name) for f in folders) if os.path.exists(p)), None) for name in names]
    if None in photos:
        sys.exit(f'{names[photos.index(None)]}: in none of the folders {", ".join(folders)}')
    shutil.rmtree(output, ignore_errors=True)
    subprocess.run(['build/release/bin/circline_compare', '--images=' + ','.join(photos), '--fov_deg=60', '--focal_sigma=0',
                    '--output=' + output],
                   check=True, stdout=subprocess.DEVNULL)
    observed = {os.path.basename(o['image']): o for o in json_lines(f'{output}/observations.jsonl')}
    answers = collections.defaultdict(list)
    for answer in json_lines(f'{output}/results.jsonl'):
        answers[os.path.basename(answer['image'])].append(answer)
    os.makedirs(PICTURES, exist_ok=True)
    for k, line in enumerate(lines):
        match = ROW.match(line)
        if not match:
            continue
        name = match['name']
        stem = os.path.splitext(name)[0]
        write_picture(f'{output}/overlays/{stem}.png', f'{PICTURES}/{stem}.jpg')
        lines[k] = f'| ![{name}](pictures/photographs/{stem}.jpg) | {describe(observed[name], answers[name])} | {match["seen"]} |'
    with open(PAGE, 'w') as page:
        page.write('\n'.join(lines))
    faults = [fault for name in names for fault in unsaid(answers[name])]
    for fault in faults:
        print(f'{fault} are sure of different planes, and no note says so')
    print(f'{len(names)} photographs; {PAGE} and {PICTURES} are written')
    return 1 if faults else 0


if __name__ == '__main__':
    sys.exit(main())
