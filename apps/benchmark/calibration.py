#!/usr/bin/python3
"""The camera from photographs with truth, nothing known of it nor of what it saw: errors, in percent and pixels, and how many
of the stated deviations they are. `pooled` counts focal lengths and principal points within two.
Rows that end in OpenCV: cv2.calibrateCamera on the same photographs with the layout KNOWN, from the centres of the contours'
ellipses or the corners of cv2.findChessboardCorners. Needs python3-opencv.

  calibration.py DATA [--calibrate=build/release/bin/circline_calibrate] [--draws=10] [--guess=1.0]

DATA holds one folder a set, each with a groundtruth.yml (docs/photographs.md). --guess: of the focal length, in those of 60
degrees.
"""
import json
import math
import os
import random
import re
import statistics
import subprocess
import tempfile

import cv2
import numpy as np

from scripts import CAMERA, make_scene, parser_of, read, write

# set, to_scene.py's arguments, flags, how many photos are drawn (0: all)
SETS = [
    ('circles-discocal-rgb', ['--circles=all'], [], (0, 5, 3, 2)),
    ('circles-discocal-rgb', ['--evidence=auto'], [], (0,)),
    ('circles-discocal-tir', ['--circles=all'], [], (0,)),
    ('circles-discocal-tir', ['--evidence=auto'], [], (0,)),
    ('circles-robot10x10', ['--evidence=auto'], [], (0,)),
    ('circles-visp36', ['--evidence=auto'], ['--free=aspect'], (0,)),
    ('chessboard-opencv', ['--lines=all'], [], (0,)),
    ('chessboard-opencv', ['--evidence=auto'], [], (0,)),
]

def read_truths(scene):
    truths = {}
    for name, _, _, _, matrix, _ in CAMERA.findall(scene):
        m = [float(v) for v in matrix.split(',')]
        truths[name] = {'fx': m[0], 'fy': m[4], 'cx': m[2], 'cy': m[5]}
    return truths


def without_camera(scene, scale):
    """The cameras replaced by a guess: 60 degrees (times `scale`), no distortion."""
    def guess(match):
        name, _, width, height, _, _ = match.groups()
        f = scale * int(width) / 2 / math.tan(math.radians(30))
        middle = (int(width) - 1) / 2, (int(height) - 1) / 2
        return (f'id: "{name}", model: "opencv", width: {width}, height: {height}, '
                f'camera_matrix: [{f}, 0., {middle[0]}, 0., {f}, {middle[1]}, 0., 0., 1.], distortion: [0., 0., 0., 0., 0.]')
    return CAMERA.sub(guess, scene)


def photos_of(scene):
    head, *photos = re.split(r'(?m)^(?=  - file: )', scene)
    return head, photos


def calibrate(args, scene, flags, scratch):
    path, out = write(os.path.join(scratch, 'scene.yaml'), scene), os.path.join(scratch, 'out')
    run = subprocess.run([args.calibrate, f'--scene={path}', f'--output={out}', '--overlays=false', *flags], capture_output=True, text=True)
    return None if run.returncode != 0 else json.loads(read(os.path.join(out, 'calibration.json')))


class KnownLayout:
    """Points of a set's sheet and where its photographs show them, as OpenCV has them."""

    def __init__(self, folder):
        storage = cv2.FileStorage(os.path.join(folder, 'groundtruth.yml'), cv2.FILE_STORAGE_READ)
        self.size = tuple(int(storage.getNode(k).real()) for k in ('image_width', 'image_height'))
        images = storage.getNode('images')
        self.photos = [self.points(folder, images.at(i)) for i in range(images.size())]

    @staticmethod
    def points(folder, image):
        """(camera, points of the sheet, pixels), or None."""
        name = image.getNode('camera').string() if not image.getNode('camera').empty() else 'cam0'
        circles = image.getNode('circles')
        if circles.size() > 0:
            circles = [circles.at(k) for k in range(circles.size())]
            world = [c.getNode('centre_world').mat().ravel() for c in circles]
            contours = [c.getNode('contour').mat() for c in circles]
            pixels = [cv2.fitEllipse(contour.reshape(-1, 2).astype(np.float32))[0] if contour is not None
                      else c.getNode('fitted_ellipse_raw').mat().ravel()[:2] for c, contour in zip(circles, contours)]
            return name, np.array(world, np.float32), np.array(pixels, np.float32)
        grey = cv2.imread(os.path.join(folder, image.getNode('file').string()), cv2.IMREAD_GRAYSCALE)
        found, corners = cv2.findChessboardCorners(grey, (9, 6))
        if not found:
            return None
        criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-4)
        corners = cv2.cornerSubPix(grey, corners, (11, 11), (-1, -1), criteria)
        return name, np.array([(k % 9, k // 9, 0) for k in range(54)], np.float32), corners.reshape(-1, 2)

    def calibrate(self, drawn, is_square):
        cameras = {}
        for i in drawn:
            if self.photos[i]:
                name, world, pixels = self.photos[i]
                cameras.setdefault(name, []).append((world, pixels))
        result = []
        for name, seen in cameras.items():
            f = self.size[0] / 2 / math.tan(math.radians(30))
            guess = np.array([[f, 0, (self.size[0] - 1) / 2], [0, f, (self.size[1] - 1) / 2], [0, 0, 1]])
            flags = cv2.CALIB_USE_INTRINSIC_GUESS | (cv2.CALIB_FIX_ASPECT_RATIO if is_square else 0)
            _, m, _, _, _, s, _, _ = cv2.calibrateCameraExtended([w for w, _ in seen], [p for _, p in seen], self.size, guess, None, flags=flags)
            s = s.ravel()
            # With a fixed aspect ratio the deviation of both focal lengths stands at fy.
            result.append({'id': name, 'fx': m[0, 0], 'fy': m[1, 1], 'cx': m[0, 2], 'cy': m[1, 2], 'num_images': len(seen),
                           'sigma': {'fx': s[0] if s[0] > 0 else s[1], 'fy': s[1], 'cx': s[2], 'cy': s[3]}})
        return {'cameras': result}


def print_rows(label, rows, count, draws):
    for name, judged in rows.items():
        errors = statistics.median(abs(j[0]) for j in judged) if count else judged[0][0]
        sigma = statistics.median(100 * j[3]['sigma']['fx'] / j[3]['fx'] for j in judged)
        point = statistics.median(j[1] for j in judged)
        tail = ' '.join(f'{s:6.1f}' for s in judged[0][2]) if not count else f'median of {len(judged)} of {draws} draws'
        print(f'{label:44} {count or judged[0][3]["num_images"]:6} {name:>7} {errors:7.2f} {sigma:8.2f} {point:9.1f} {tail:>22}', flush=True)


def judge(camera, truth, held):
    """Errors and their number of deviations, of f in percent and of the principal point in pixels."""
    focal = math.log(camera['fx'] / (truth['fx'] if 'aspect' not in held else math.sqrt(truth['fx'] * truth['fy'])))
    point = math.hypot(camera['cx'] - truth['cx'], camera['cy'] - truth['cy'])
    sigmas = [focal * camera['fx'] / camera['sigma']['fx']]
    sigmas += [(camera[c] - truth[c]) / camera['sigma'][c] for c in ('cx', 'cy') if camera['sigma'][c] > 0]
    return 100 * focal, point, sigmas


def main():
    args = parser_of(__doc__, 'calibrate', data='1', draws=10, guess=1.0).parse_args()
    pooled, seen = [], set()
    print(f'{"set":44} {"photos":>6} {"camera":>7} {"f %":>7} {"sigma %":>8} {"point px":>9} {"sigmas of f, cx, cy":>22}')
    with tempfile.TemporaryDirectory() as scratch:
        for data_set, given, flags, counts in SETS:
            scene = make_scene(args, data_set, os.path.join(scratch, 'source.yaml'), *given)
            truths = read_truths(scene)
            head, photos = photos_of(without_camera(scene, args.guess))
            layout = KnownLayout(os.path.join(args.data, data_set))
            is_first = data_set not in seen
            seen.add(data_set)
            held = [] if '--free=aspect' in flags else ['aspect']
            for count in counts:
                rng = random.Random(1)
                rows, peer = {}, {}
                for _ in range(args.draws if count else 1):
                    drawn = sorted(rng.sample(range(len(photos)), count)) if count else range(len(photos))
                    result = calibrate(args, head + ''.join(photos[i] for i in drawn), flags, scratch)
                    for camera in result['cameras'] if result else []:
                        rows.setdefault(camera['id'], []).append((*judge(camera, truths[camera['id']], held), camera))
                    for camera in layout.calibrate(drawn, 'aspect' in held)['cameras'] if is_first else []:
                        peer.setdefault(camera['id'], []).append((*judge(camera, truths[camera['id']], held), camera))
                pooled += [s for judged in rows.values() for j in judged for s in j[2]]
                print_rows(data_set + ' ' + given[0], rows, count, args.draws)
                if not rows:
                    print(f'{data_set + " " + given[0]:44} {count or len(photos):6} no camera came out')
                print_rows(data_set + ' OpenCV', peer, count, args.draws)
    within = sum(abs(s) <= 2 for s in pooled)
    print(f'pooled: {within} of {len(pooled)} within two deviations')


if __name__ == '__main__':
    main()
