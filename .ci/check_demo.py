#!/usr/bin/env python3
"""Do the results of apps/demo.sh (build/demo) hold? The last line is `N passed, N failed`."""
import json
import math
import os
import statistics
import struct
import sys

DEMO = sys.argv[1] if len(sys.argv) > 1 else 'build/demo'
passed = failed = 0


def check(name, condition, found):
    global passed, failed
    if condition:
        passed += 1
    else:
        failed += 1
    print(f'{"ok    " if condition else "FAILED"} {name}: {found}')


def results(name):
    with open(os.path.join(DEMO, name, 'out', 'results.jsonl')) as lines:
        return [json.loads(line) for line in lines]


def num_photos(name):
    with open(os.path.join(DEMO, name, 'scene.yaml')) as scene:
        return sum('file:' in line for line in scene)


def select(name, solver, stage):
    """The lines of one solver, by image, best hypothesis first."""
    by_image = {}
    for line in results(name):
        if (line['solver'], line['stage'], line['status']) == (solver, stage, 'ok'):
            by_image.setdefault(line['image'], []).append(line)
    return [sorted(lines, key=lambda l: l['hypothesis']) for lines in by_image.values()]


def check_error(name, solver, stage, field, limit_deg, hypothesis='best'):
    """Median error over all photos, a photo without an answer counting as infinitely wrong."""
    errors = []
    for lines in select(name, solver, stage):
        if hypothesis == 'best':
            lines = lines[:1]
        errors.append(min(line[field] for line in lines))
    errors += [float('inf')] * (num_photos(name) - len(errors))
    median = statistics.median(errors)
    which = '' if hypothesis == 'best' else ', better of its hypotheses'
    check(f'{name}: {field} of {solver} ({stage}{which}), median of {len(errors)} photos',
          median <= limit_deg, f'{median:.3f} <= {limit_deg}')


def check_choice(name, solver, stage, share):
    """In how many photos the best hypothesis is the one nearest to the truth."""
    right = sum(lines[0]['normal_error_deg'] <= min(l['normal_error_deg'] for l in lines) + 0.1
                for lines in select(name, solver, stage))
    check(f'{name}: right hypothesis of {solver} ({stage}) first',
          right >= share * num_photos(name), f'{right} of {num_photos(name)}')


def check_axes(name, least, median_deg, worst_deg):
    """In how many photos the axes are known, and how far off these are."""
    errors = [lines[0]['rotation_error_deg'] for lines in select(name, 'joint', 'refined')
              if 'rotation_error_deg' in lines[0]]
    check(f'{name}: axes found', len(errors) >= least, f'{len(errors)} of {num_photos(name)}')
    median, worst = statistics.median(errors or [float('inf')]), max(errors, default=float('inf'))
    check(f'{name}: median of these axes', median <= median_deg, f'{median:.2f} <= {median_deg}')
    check(f'{name}: the worst of these axes', worst <= worst_deg, f'{worst:.2f} <= {worst_deg}')


def check_files(name):
    out = os.path.join(DEMO, name, 'out')
    files = ['results.jsonl', 'observations.jsonl', 'summary.csv', 'report.html', 'timings.jsonl']
    missing = [f for f in files if not os.path.exists(os.path.join(out, f))
               or os.path.getsize(os.path.join(out, f)) == 0]
    check(f'{name}: files', not missing, 'missing: ' + ', '.join(missing) if missing else 'all there')
    overlays = os.path.join(out, 'overlays')
    pictures = [f for f in os.listdir(overlays) if f.endswith('.png')] if os.path.isdir(overlays) else []
    check(f'{name}: overlays', len(pictures) >= num_photos(name),
          f'{len(pictures)} pictures of {num_photos(name)} photos')


def check_lines(name):
    """Contract of a result line: rotations are rotations, probabilities sum to one."""
    bad = []
    sums = {}
    for line in results(name):
        where = f'{line["image"]} {line["solver"]} {line["stage"]}'
        if line['status'] != 'ok':
            if not line['message']:
                bad.append(f'{where}: {line["status"]} without a reason')
            continue
        r = line['rotation']
        for i in range(3):
            for j in range(3):
                dot = sum(r[3 * i + k] * r[3 * j + k] for k in range(3))
                if abs(dot - (i == j)) > 1e-6:
                    bad.append(f'{where}: not a rotation')
        key = (line['image'], line['solver'], line['stage'], line['loss'], line['loss_scale_px'])
        sums[key] = sums.get(key, 0.0) + line['probability']
    bad += [f'{key}: probabilities sum to {s}' for key, s in sums.items() if abs(s - 1) > 1e-3]
    check(f'{name}: lines of results.jsonl', not bad, bad[0] if bad else 'sound')


def check_calibration(side, focal_px, percent, point_px):
    """Nothing known, against OpenCV's calibration from the known board."""
    with open(f'build/demo/calibration/{side}/calibration.json') as file:
        camera = json.load(file)['cameras'][0]
    off = 100 * (camera['fx'] / focal_px[0] - 1)
    point = math.hypot(camera['cx'] - focal_px[1], camera['cy'] - focal_px[2])
    check(f'calibration {side}: focal length within {percent} %', abs(off) <= percent, f'{off:.2f} %')
    check(f'calibration {side}: principal point within {point_px} px', point <= point_px, f'{point:.1f} px')
    deviations = [100.0 * sigma for _, sigma in camera['sigma_by_photos']]
    check(f'calibration {side}: more photos tell more', deviations == sorted(deviations, reverse=True),
          ', '.join(f'{d:.1f}' for d in deviations) + ' %')


def check_track():
    lines = results('track')
    frames = len(os.listdir(os.path.join(DEMO, 'track', 'frames')))
    check('track: a line a frame', len(lines) == frames, f'{len(lines)} of {frames}')
    seen = sum(line['status'] == 'ok' and not line['predicted_only'] for line in lines)
    check('track: frames that are seen', seen >= 0.95 * frames, f'{seen} of {frames}')
    sure = sum(line['probability'] is not None and line['probability'] >= 0.95 for line in lines[30:])
    check('track: sure after thirty frames', sure >= 0.95 * (frames - 30), f'{sure} of {frames - 30}')
    check('track: begins once', sum(line['reinitialized'] for line in lines) == 1,
          sum(line['reinitialized'] for line in lines))
    out = os.path.join(DEMO, 'track', 'out')
    missing = [f for f in ('trajectory.txt', 'report.html', 'overlays.mp4') if not os.path.exists(os.path.join(out, f))]
    check('track: files', not missing, 'missing: ' + ', '.join(missing) if missing else 'all there')


def check_model():
    folder = os.path.join(DEMO, 'disc', 'model')
    files = ['model.glb', 'model.obj', 'model.mtl', 'texture.png', 'views.png', 'measurements.csv']
    missing = [f for f in files if not os.path.exists(os.path.join(folder, f))]
    check('disc: files of the model', not missing, 'missing: ' + ', '.join(missing) if missing else 'all there')
    glb = b''
    if 'model.glb' not in missing:
        with open(os.path.join(folder, 'model.glb'), 'rb') as file:
            glb = file.read()
    head = struct.unpack('<4sII', glb[:12]) if len(glb) >= 12 else None
    check('disc: model.glb is binary glTF 2, whole', head == (b'glTF', 2, len(glb)), f'{len(glb)} bytes')


check_track()
check_model()
for scene in ('chessboard', 'disc', 'box', 'dots'):
    check_files(scene)
    check_lines(scene)

check_error('chessboard', 'joint', 'refined', 'rotation_error_deg', 0.3)
check_error('chessboard', 'line_pairs', 'refined', 'rotation_error_deg', 0.3)
check_error('disc', 'joint', 'refined', 'rotation_error_deg', 0.2)
check_error('disc', 'circle_center', 'refined', 'normal_error_deg', 0.2)
check_error('disc', 'single_circle', 'closed_form', 'normal_error_deg', 0.2, 'better')
check_error('dots', 'joint', 'refined', 'normal_error_deg', 0.3)
check_error('box', 'joint', 'refined', 'normal_error_deg', 0.3)
check_axes('box', 8, 0.3, 1.0)
check_choice('disc', 'circle_center', 'refined', 0.95)
check_calibration('left', (532.8, 342.5, 233.9), 1.5, 5.0)
check_calibration('right', (537.5, 327.6, 248.9), 1.5, 5.0)

print(f'{passed} passed, {failed} failed')
sys.exit(failed > 0)
