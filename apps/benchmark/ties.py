#!/usr/bin/python3
"""Does the first of a circle's two poses stay the same from frame to frame? Exit code 1 if refinement makes it jump more often.

  ties.py [FRAMES] [--compare=build/release/bin/circline_compare] [--flags='--threads=1'] [--verbose]

FRAMES is the folder of the 501 frames mire-2/image.NNNN.pgm (or .pgm.gz) of the Debian package visp-images-data, a plate with a
disc that a camera moves about; the camera is that of apps/demo/disc.yaml. Everything is detected, and `single_circle` answers
alone: two poses that explain the disc equally well. Counted is in how many pairs of neighbouring frames the normal of the
first pose is nearer to that of the second pose of the frame before than to that of its first.
"""
import os
import re
import sys
import tempfile

from scripts import HERE, compare, frames_of, parser_of, read, write

STAGES = ('closed_form', 'refined')
DISC = os.path.join(HERE, '..', 'demo', 'disc.yaml')


def write_scene(frames, scratch):
    """A scene file of all frames in order, with the camera of the demo and nothing annotated."""
    cameras = re.search(r'^cameras:\n.*?(?=^images:)', read(DISC), re.M | re.S).group()
    images = ''.join(f'  - {{ file: "{name}", camera: "cam0" }}\n' for name in frames)
    return write(os.path.join(scratch, 'scene.yaml'), '%YAML:1.0\n---\n' + cameras + 'images:\n' + images)


def normals_by_frame(results):
    """Of each stage: of each frame the normals of its poses, best first."""
    normals = {stage: {} for stage in STAGES}
    for line in results:
        frame = normals[line['stage']].setdefault(os.path.basename(line['image']), [])
        if line['status'] == 'ok':
            frame.append(line['rotation'][2::3])
    return normals


def likeness(a, b):
    return abs(sum(x * y for x, y in zip(a, b)))


def jumps(frames):
    """Names of the frames at which the first pose changes sides, and how many pairs of neighbours both have two poses."""
    names = list(frames)
    pairs = [(b, frames[a], frames[b]) for a, b in zip(names, names[1:]) if min(len(frames[a]), len(frames[b])) >= 2]
    return [name for name, before, now in pairs if likeness(now[0], before[1]) > likeness(now[0], before[0])], len(pairs)


def main():
    args = parser_of(__doc__, 'compare', data='?', flags='', verbose=False).parse_args()
    folder = args.data or '/usr/share/visp-images-data/ViSP-images/mire-2'
    with tempfile.TemporaryDirectory() as scratch:
        frames = frames_of(folder, scratch)
        if len(frames) < 2:
            sys.exit(f'no frames image.NNNN.pgm in {folder}; apt-get install visp-images-data')
        scene = write_scene(frames, scratch)
        results = compare(args, scene, os.path.join(scratch, 'out'), '--solvers=single_circle', *args.flags.split())
    normals = normals_by_frame(results)
    counts = {}
    for stage in STAGES:
        names, pairs = jumps(normals[stage])
        counts[stage] = len(names)
        print(f'single_circle, {stage}: the first pose changes sides in {len(names)} of {pairs} pairs of neighbours, '
              f'{len(frames)} frames' + (': ' + ' '.join(names) if args.verbose else ''))
    return counts['refined'] > counts['closed_form']


if __name__ == '__main__':
    sys.exit(main())
