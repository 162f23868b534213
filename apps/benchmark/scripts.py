"""What the scripts here share: arguments, scene files, runs of circline_compare, claims."""
import argparse
import glob
import gzip
import json
import os
import re
import shutil
import statistics
import subprocess

HERE = os.path.dirname(os.path.abspath(__file__))
TOP = os.path.join(HERE, '..', '..')
BIN = os.path.join(TOP, 'build/release/bin')

# Of a camera of a scene file: id, model, width, height, camera_matrix, distortion (empty where there is none).
CAMERA = re.compile(r'id: "(\w+)", model: "(\w+)", width: (\d+), height: (\d+), '
                    r'camera_matrix: \[([^\]]*)\](?:, distortion: \[([^\]]*)\])?')


def parser_of(doc, *programs, data=None, **flags):
    """Takes --compare=PROGRAM for circline_compare and so on, DATA (or, with data='?', perhaps none) and flags with defaults."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    if data:
        parser.add_argument('data', nargs=None if data == '1' else data)
    for program in programs:
        parser.add_argument('--' + program, default=os.path.join(BIN, 'circline_' + program))
    for flag, default in flags.items():
        if default is False:
            parser.add_argument('--' + flag, action='store_true')
        else:
            parser.add_argument('--' + flag, default=default, type=str if default is None else type(default))
    return parser


def read(path):
    with open(path) as file:
        return file.read()


def write(path, text):
    with open(path, 'w') as file:
        file.write(text)
    return path


def json_lines(path):
    return [json.loads(line) for line in read(path).splitlines()]


def median(values):
    """Of nothing it is infinite."""
    return statistics.median(values or [float('inf')])


def bash(script, *arguments):
    """Runs a script with the functions of cmake/setup.sh."""
    subprocess.run(['bash', '-c', f'set -euo pipefail; . cmake/setup.sh; {script}', 'bash', *arguments], check=True, cwd=TOP)


def frames_of(folder, scratch):
    """Absolute paths of the frames image.NNNN.pgm, in order; of copies in `scratch` where they are compressed."""
    frames = []
    for frame in sorted(glob.glob(os.path.join(folder, 'image.*.pgm')) + glob.glob(os.path.join(folder, 'image.*.pgm.gz'))):
        name = os.path.abspath(frame)
        if frame.endswith('.gz'):
            name = os.path.join(scratch, os.path.basename(frame).removesuffix('.gz'))
            with gzip.open(frame) as packed, open(name, 'wb') as file:
                shutil.copyfileobj(packed, file)
        frames.append(name)
    return frames


def make_scene(args, data_set, scene, *options):
    """The scene file of a set of DATA, and its text."""
    subprocess.run([os.path.join(HERE, 'to_scene.py'), os.path.join(args.data, data_set), scene, *options], check=True)
    return read(scene)


def compare(args, scene, out, *flags):
    """Lines of results.jsonl."""
    subprocess.run([args.compare, f'--scene={scene}', f'--output={out}', '--overlays=false', *flags], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return json_lines(os.path.join(out, 'results.jsonl'))


class Claims:
    def __init__(self):
        self.passed = self.failed = 0

    def check(self, text, holds):
        self.passed += bool(holds)
        self.failed += not holds
        print(f'{"ok    " if holds else "FAILED"} {text}', flush=True)

    def end(self):
        """The exit code."""
        print(f'{self.passed} passed, {self.failed} failed')
        return self.failed > 0
