#!/usr/bin/python3
"""Are tracked poses right, and sure only where they are right? A line for each claim; the last line is `N passed, N failed`.

  tracking.py [DATA] [--frames=DIR] [--track=build/release/bin/circline_track] [--flags='...'] [--keep=DIR]

DIR is the folder of the 501 frames mire-2/image.NNNN.pgm of the Debian package visp-images-data, a plate with a disc that a
camera moves about; twelve of them have a truth, that of apps/demo/disc.yaml. DATA is that of photographs.py
(needs python3-opencv); without DATA its sets are left out.

  right    frames with a truth whose first pose has the right normal (within 5 degrees)
  sure     those of probability 0.95 or more, and how many of them are wrong
  flips    pairs of neighbours of one track, the normal of whose first pose is nearer to that of another pose of the frame
           before than to its first (of those more than 5 degrees apart); which of two poses is first when the track begins is
           open: flips of a first pose less probable than 0.6 are counted apart, as `settled`
  seen     frames that are part of their pose; where nothing is seen it is predicted, and not judged
  begins   how often the track begins (anew)

A disc alone has two poses. On mire-2 perspective and motion tell them apart in the end; that of turntable-teabox turns about
its own axis, which says nothing: both stay, in their order, neither likely. Boards are photographs taken from different
places, two seconds apart: the track begins anew with each, and each is to be read aright. The last line is the time for a
frame of 640 x 480: processor time of the program on one core, the least of three runs, for a photograph of a board seen by a
camera that turns; what it takes to start and to look at the first frame is taken off.
"""
import math
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile

import cv2
import numpy

from photographs import BOARDS
from scripts import TOP, Claims, frames_of, json_lines, make_scene, parser_of, read, write

FAR_DEG, SURE, OPEN = 5.0, 0.95, 0.6
DEVIATIONS = 2


def angle(a, b):
    cosine = abs(sum(x * y for x, y in zip(a, b)))
    return math.degrees(math.acos(min(1.0, cosine)))


def normal(rotation):
    return rotation[2::3]


def track(args, name, inputs, extra=()):
    out = os.path.join(args.keep, name)
    run = subprocess.run([args.track, *inputs, f'--output={out}', '--overlays=false', *extra, *args.flags.split()],
                         stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if run.returncode != 0:
        sys.exit(f'{name}: {run.stderr}')
    return json_lines(os.path.join(out, 'results.jsonl'))


def count_flips(frames):
    flips, settled, before, sure = [], [], None, 0.0
    for frame in frames:
        normals = [normal(h['rotation']) for h in frame['hypotheses']]
        if before and normals and not frame['reinitialized']:
            others = [b for b in before[1:] if angle(b, before[0]) > FAR_DEG]
            if any(angle(normals[0], b) < angle(normals[0], before[0]) for b in others):
                (flips if sure >= OPEN else settled).append(frame)
        before, sure = normals, frame['probability']
    return flips, settled


def judge(frames, errors):
    """Text; how many are right, how many sure and wrong, flips."""
    errors = [(f, e) for f, e in errors if not f['predicted_only']]
    right = sum(e <= FAR_DEG for _, e in errors)
    sure = [(f, e) for f, e in errors if f['probability'] >= SURE]
    wrong = sum(e > FAR_DEG for _, e in sure)
    begins = sum(f['reinitialized'] for f in frames)
    flips, settled = count_flips(frames)
    text = (f'{sum(f["status"] == "ok" and not f["predicted_only"] for f in frames)} of {len(frames)} seen, '
            f'{right} of {len(errors)} right, median {statistics.median(e for _, e in errors):.2f} deg, {len(sure)} sure, '
            f'{wrong} of these wrong, {len(flips)} flips' + (f' (frames {", ".join(str(f["frame"]) for f in flips)})' if flips else '')
            + (f', {len(settled)} settled' if settled else '') + f', begins {begins}')
    return text, right, wrong, flips


def mire(args, claims):
    frames = frames_of(args.frames, args.keep)
    if not frames:
        print(f'skipped: no frames image.NNNN.pgm in {args.frames}; apt-get install visp-images-data')
        return
    demo = read(os.path.join(TOP, 'apps/demo/disc.yaml'))
    truth = {name: normal([float(v) for v in values.split(',')]) for name, values in
             re.findall(r'file: "(image\.\d+)\.pgm".*?truth: \{ rotation: \[([^\]]*)\]', demo, re.S)}
    camera = re.search(r'camera_matrix: (\[.*?\]),\s*distortion: (\[.*?\])', demo, re.S)
    calibration = write(os.path.join(args.keep, 'mire.yml'),
                        f'%YAML:1.0\n---\nimage_width: 384\nimage_height: 288\ncamera_matrix: {camera[1]}\n'
                        f'distortion_coefficients: {camera[2]}\n')
    stem = lambda f: os.path.splitext(os.path.basename(f['image']))[0]
    photos = [f'--images={",".join(frames)}', f'--camera={calibration}']
    for name, extra in (('disc alone', ['--roi=127,157,79,61']), ('all detected', [])):
        lines = track(args, 'mire-2 ' + name, photos, extra)
        errors = [(f, angle(normal(f['rotation']), truth[stem(f)])) for f in lines if f['rotation'] and stem(f) in truth]
        said, right, wrong, flips = judge(lines, errors)
        claims.check(f'mire-2, {name}: {said}', right == len(truth) and wrong == 0 and not flips)
    lines = track(args, 'mire-2 guessed', photos[:1])
    errors = [angle(normal(f['rotation']), truth[stem(f)]) / f['sigma_normal_deg'] for f in lines if f['rotation'] and stem(f) in truth]
    focal = float(camera[1].strip('[]').split(',')[0])
    off = [abs(math.log(f['focal_px'] / focal)) / (f['focal_sigma_px'] / f['focal_px']) for f in lines if f.get('focal_px')]
    within = [sum(e <= DEVIATIONS for e in of) for of in (errors, off)]
    last = lines[-1]
    claims.check(f'mire-2, all detected, nothing known of the camera: within two deviations {within[0]} of {len(errors)} normals and the '
                 f'focal length in {within[1]} of {len(off)} frames, at last {last["focal_px"]:.0f} +- {last["focal_sigma_px"]:.0f} px '
                 f'for {focal:.0f}, begins {sum(f["reinitialized"] for f in lines)}',
                 within[0] >= 10 and within[1] >= 0.9 * len(off))


def scene_of(args, data_set, *options):
    scene = os.path.join(args.keep, data_set + '.yaml')
    return scene, make_scene(args, data_set, scene, *options)


def teabox(args, claims):
    """The left camera's photographs, twenty frames of 25 a second apart, of each the rim's contour and nothing else."""
    scene, text = scene_of(args, 'turntable-teabox')
    head, images = text.split('images:\n')
    images = [i for i in re.split(r'(?=^  - file:)', images, flags=re.M) if '/left_' in i]
    images = [re.sub(r'^    (pencils|frame|known):.*?(?=^    \w|\Z)', '', i, flags=re.M | re.S) for i in images]
    write(scene, head + 'images:\n' + ''.join(images))
    lines = track(args, 'turntable-teabox', [f'--scene={scene}'], ['--fps=1.25'])
    flips, settled = count_flips(lines)
    flips += settled
    shares = [f['probability'] for f in lines if f['status'] == 'ok']
    begins = sum(f['reinitialized'] for f in lines)
    claims.check(f'turntable-teabox, disc alone: {len(shares)} of {len(images)} frames, probability of the first '
                 f'{min(shares):.2f} to {max(shares):.2f}, {len(flips)} flips, begins {begins}',
                 len(shares) == len(images) and not flips and all(0.3 <= p <= 0.7 for p in shares) and begins == 1)


def boards(args, claims):
    for data_set in BOARDS:
        scene, text = scene_of(args, data_set, '--evidence=auto')
        head, images = text.split('images:\n')
        images = re.split(r'(?=^  - file:)', images, flags=re.M)[1:]
        for camera in sorted(set(re.findall(r'camera: "(.*?)"', ''.join(images)))):
            write(scene, head + 'images:\n' + ''.join(i for i in images if f'camera: "{camera}"' in i))
            lines = track(args, f'{data_set} {camera}', [f'--scene={scene}'], ['--fps=0.5'])
            errors = [(f, f['normal_error_deg']) for f in lines if f.get('normal_error_deg') is not None]
            if not errors:
                errors = [(f, f['rotation_error_deg']) for f in lines if f.get('rotation_error_deg') is not None]
            said, right, wrong, flips = judge(lines, errors)
            claims.check(f'{data_set}, {camera}, all detected: {said}', right == len(lines) and wrong == 0 and not flips)


def turning(photo, camera, distortion, rotation):
    """The photo as the camera would take it turned by `rotation` (now from before), through the same lens."""
    height, width = photo.shape[:2]
    v, u = numpy.mgrid[0:height, 0:width].astype(numpy.float32)
    rays = cv2.undistortPoints(numpy.stack([u.ravel(), v.ravel()], 1)[:, None], camera, distortion)[:, 0]
    rays = numpy.c_[rays, numpy.ones(len(rays))] @ rotation
    pixels = cv2.projectPoints(rays, numpy.zeros(3), numpy.zeros(3), camera, distortion)[0].astype(numpy.float32)
    return cv2.remap(photo, pixels[:, 0, 0].reshape(height, width), pixels[:, 0, 1].reshape(height, width), cv2.INTER_CUBIC)


def speed(args, claims, num_frames=60):
    _, text = scene_of(args, 'chessboard-opencv', '--evidence=auto')
    numbers = lambda key: numpy.array([float(v) for v in re.search(key + r': \[(.*?)\]', text)[1].split(',')])
    camera, distortion = numbers('camera_matrix').reshape(3, 3), numbers('distortion')
    photo = cv2.imread(os.path.join(args.data, 'chessboard-opencv', 'left01.jpg'), cv2.IMREAD_GRAYSCALE)
    folder = os.path.join(args.keep, 'turning')
    os.makedirs(folder, exist_ok=True)
    for k in range(num_frames):
        turn = numpy.radians([3.0 * math.sin(0.15 * k), 4.0 * math.sin(0.1 * k), 2.0 * math.sin(0.2 * k)])
        cv2.imwrite(f'{folder}/{k:03d}.pgm', turning(photo, camera, distortion, cv2.Rodrigues(turn)[0]))
    calibration = write(os.path.join(args.keep, 'left.yml'), '%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n' + ''.join(
        f'{key}: [{", ".join(repr(float(v)) for v in values.ravel())}]\n'
        for key, values in (('camera_matrix', camera), ('distortion_coefficients', distortion))))

    def run(pattern, cold_every):
        """Lines, and processor time in all, ms."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        lines = track(args, 'speed', [f'--images={folder}/{pattern}', f'--camera={calibration}'],
                      ['--threads=1', f'--cold_every={cold_every}'])
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return lines, 1e3 * (after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)

    costs = {0: [], 1: []}  # Followed, and all looked at as a whole.
    for _ in range(3):
        _, begin = run('000.pgm', 0)
        for cold_every, list_of in costs.items():
            lines, total = run('*.pgm', cold_every)
            list_of.append((total - begin) / (len(lines) - 1))
    followed, cold = min(costs[0]), min(costs[1])
    claims.check(f'640 x 480, a chessboard: {followed:.1f} ms of a core for a frame, reading and writing included; '
                 f'{cold:.1f} ms where each is looked at as a whole (means of {len(lines) - 1})', followed <= 0.5 * cold)


def main():
    args = parser_of(__doc__, 'track', data='?', frames='/usr/share/visp-images-data/ViSP-images/mire-2', flags='',
                     keep=None).parse_args()
    claims = Claims()
    with tempfile.TemporaryDirectory() as scratch:
        args.keep = os.path.abspath(args.keep or scratch)
        os.makedirs(args.keep, exist_ok=True)
        mire(args, claims)
        if args.data:
            args.data = os.path.abspath(args.data)
            for part in (teabox, boards, speed):
                part(args, claims)
    return claims.end()


if __name__ == '__main__':
    sys.exit(main())
