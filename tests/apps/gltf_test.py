#!/usr/bin/env python3
"""Models of circline_reconstruct (a box, a cylinder on a plane, a plane) in programs of others: Khronos' validator finds
no fault, and Blender imports the meshes and the camera.

    gltf_test.py --reconstruct=BIN

Exit code 77: neither node with the module gltf-validator nor Blender is there. NODE_PATH says where node finds modules
that are not installed globally.
"""
import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

FOCAL, WIDTH, HEIGHT = 700.0, 640, 480
SIZE = (0.9, 0.6, 0.4)
EYE = (-1.3, -1.9, 1.7)
RADIUS, TIN_HEIGHT, TIN_AXIS = 0.3, 0.4, (0.45, 0.3)

VALIDATE = '''
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[1]));
require('gltf-validator').validateBytes(bytes).then(r => console.log(JSON.stringify(r.issues)));
'''
IMPORT = '''
import bpy, json, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
# Flat: the other shadings of Blender 3.4 need an older numpy than Debian 12 has.
bpy.ops.import_scene.gltf(filepath=sys.argv[-1], import_shading='FLAT')
print("FOUND " + json.dumps(sorted([o.type, o.name] for o in bpy.data.objects if o.type != "EMPTY")))
camera = next(o for o in bpy.data.objects if o.type == "CAMERA")
print("ANGLE %.9f" % camera.data.angle_y)
'''


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(sum(x * x for x in a))
    return tuple(x / length for x in a)


def pixel(x, y, z):
    """Of a point of a world that has z upwards and the box's lower nearest corner in its origin."""
    forward = unit([s / 2 - e for s, e in zip(SIZE, EYE)])
    right = unit(cross(forward, (0.0, 0.0, 1.0)))
    down = cross(forward, right)
    seen = [p - e for p, e in zip((x, y, z), EYE)]
    u, v, w = (sum(a * b for a, b in zip(axis, seen)) for axis in (right, down, forward))
    return FOCAL * u / w + 0.5 * (WIDTH - 1), FOCAL * v / w + 0.5 * (HEIGHT - 1)


def numbers(points):
    return '[' + ', '.join(f'{c:.6f}' for point in points for c in point) + ']'


def box():
    def c(x, y, z):
        return pixel(x * SIZE[0], y * SIZE[1], z * SIZE[2])

    edges = [('x', 'y', c(0, 1, 1), c(1, 1, 1)), ('y', 'x', c(1, 0, 1), c(1, 1, 1)), ('x', 'z', c(0, 0, 0), c(1, 0, 0)),
             ('y', 'z', c(0, 0, 0), c(0, 1, 0))]
    lines = ', '.join(f'{{ along: "{a}", far: "{f}", points: {numbers(p)} }}' for a, f, *p in edges)
    return (f', solids: [ {{ id: "carton", kind: "box", corner: {numbers([c(0, 0, 1)])}, x: {numbers([c(1, 0, 1)])}, '
            f'y: {numbers([c(0, 1, 1)])}, z: {numbers([c(0, 0, 0)])}, edges: [ {lines} ], length: [0.9, 0., 0.] }} ]')


def plane():
    def p(x, y, z=0.0):
        return pixel(TIN_AXIS[0] + x, TIN_AXIS[1] + y, z)

    def ring(z):
        return numbers(p(RADIUS * math.cos(2 * math.pi * k / 60), RADIUS * math.sin(2 * math.pi * k / 60), z) for k in range(60))

    def pencil(name, ends):
        return f'{{ id: "{name}", direction: "{name}", plane: "ground", segments: {numbers(ends)} }}'

    return (f', frame: {{ plane: "ground", origin_is_center: "base", x_axis: {numbers([p(0, 0), p(1, 0)])}, '
            f'y_axis: {numbers([p(0, 0), p(0, 1)])} }}, circles: [ {{ id: "base", plane: "ground", radius: {RADIUS}, '
            f'contour: {ring(0.0)} }}, {{ id: "rim", plane: "lid", contour: {ring(TIN_HEIGHT)} }} ], pencils: [ '
            + pencil('x', [p(-.6, -.5), p(.6, -.5), p(-.6, .5), p(.6, .5)]) + ', '
            + pencil('y', [p(-.6, -.5), p(-.6, .5), p(.6, -.5), p(.6, .5)]) + ' ]')


def cylinder():
    return plane() + ', solids: [ { id: "tin", kind: "cylinder", base: "base", rim: "rim" } ]'


MODELS = {'box': (box, {'box_x0', 'box_y0', 'box_z1'}), 'plane': (plane, None), 'cylinder': (cylinder, None)}


def reconstruct(program, folder, image):
    photo = os.path.join(folder, 'photo.pgm')
    with open(photo, 'wb') as file:
        file.write(b'P5 %d %d 255\n' % (WIDTH, HEIGHT) + bytes((u // 4 + v // 4) % 256 for v in range(HEIGHT) for u in range(WIDTH)))
    with open(os.path.join(folder, 'scene.yaml'), 'w') as file:
        file.write(f'%YAML:1.0\n---\ncameras:\n  - {{ id: "k", model: "pinhole", width: {WIDTH}, height: {HEIGHT}, camera_matrix: '
                   f'[{FOCAL}, 0., 319.5, 0., {FOCAL}, 239.5, 0., 0., 1.] }}\nimages:\n'
                   f'  - {{ file: "photo.pgm", camera: "k"{image} }}\n')
    out = os.path.join(folder, 'out')
    subprocess.run([program, f'--scene={folder}/scene.yaml', f'--output={out}'], check=True)
    return os.path.join(out, 'model.glb')


def node_environment():
    """None where node has no gltf-validator."""
    if not shutil.which('node'):
        return None
    paths = [os.environ.get('NODE_PATH', '')]
    if shutil.which('npm'):
        paths.append(subprocess.run(['npm', 'root', '-g'], capture_output=True, text=True).stdout.strip())
    environment = dict(os.environ, NODE_PATH=os.pathsep.join(filter(None, paths)))
    found = subprocess.run(['node', '-e', "require.resolve('gltf-validator')"], env=environment, stderr=subprocess.DEVNULL)
    return environment if found.returncode == 0 else None


def check(condition, what):
    if not condition:
        raise AssertionError(what)
    print('ok: ' + what)


def validate(name, model, environment):
    done = subprocess.run(['node', '-e', VALIDATE, model], env=environment, capture_output=True, text=True, check=True)
    issues = json.loads(done.stdout)
    check(issues['numErrors'] == issues['numWarnings'] == 0, f'{name}: the validator has no errors or warnings: {issues["messages"]}')


def open_in_blender(name, model, meshes):
    done = subprocess.run(['blender', '--background', '--python-exit-code', '3', '--python-expr', IMPORT, '--', model],
                          capture_output=True, text=True)
    check(done.returncode == 0, f'{name}: Blender imports it{done.stderr[-2000:] if done.returncode else ""}')
    found = json.loads(next(line for line in done.stdout.splitlines() if line.startswith('FOUND '))[6:])
    check([kind for kind, _ in found].count('CAMERA') == 1, f'{name}: one camera')
    check({n for kind, n in found if kind == 'MESH'} == meshes, f'{name}: the meshes {sorted(meshes)} of {found}')
    angle = float(next(line for line in done.stdout.splitlines() if line.startswith('ANGLE '))[6:])
    check(abs(angle - 2.0 * math.atan(0.5 * HEIGHT / FOCAL)) < 1e-5, f'{name}: the camera sees what the photo shows, {angle} rad')


def glb_meshes(model):
    with open(model, 'rb') as file:
        header = file.read(20)
        return {mesh['name'] for mesh in json.loads(file.read(int.from_bytes(header[12:16], 'little')))['meshes']}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--reconstruct', required=True)
    args = parser.parse_args()
    environment, blender = node_environment(), shutil.which('blender')
    if environment is None and not blender:
        print('skipped: neither gltf-validator nor Blender is there')
        return 77
    for name, (image, meshes) in MODELS.items():
        with tempfile.TemporaryDirectory() as folder:
            model = reconstruct(args.reconstruct, folder, image())
            written = glb_meshes(model)
            check(meshes is None or written == meshes, f'{name}: meshes {sorted(written)}')
            if environment is not None:
                validate(name, model, environment)
            if blender:
                open_in_blender(name, model, written)
    return 0


if __name__ == '__main__':
    sys.exit(main())
