#!/usr/bin/python3
"""The answers on the sets of apps/demo, against those of tests/golden.json: normals within a twentieth of their standard
deviation, that within 2 %, probabilities within 0.01, whatever compiler, build type and machine: one point more or less
that counts as an inlier moves them no further.

  tests/golden.py <circline_compare> [--write]      --write: makes these answers the golden ones

Of each photo and solver the first hypothesis. Photographs of the Debian packages opencv-doc and visp-images-data, where
.ci/run and apps/demo.sh leave them or installed; exit code 77, skipped, where neither is there.
"""
import json
import math
import os
import subprocess
import sys
import tempfile

TOP = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..')
GOLDEN = os.path.join(TOP, 'tests/golden.json')
VISP = 'visp-images-data', 'usr/share/visp-images-data/ViSP-images'
SETS = {'disc': VISP, 'box': VISP, 'dots': VISP, 'chessboard': ('opencv-doc', 'usr/share/doc/opencv-doc/examples/data')}


def at_hand(package, folder):
    return any(os.path.isdir(os.path.join(root, folder)) for root in ('/', os.path.join(TOP, 'build/packages', package)))


def answers(program, name):
    """{'photo solver stage': [normal, its standard deviation in degrees, probability]}"""
    subprocess.run(['bash', '-ec', f'. cmake/setup.sh; lay_out {name}'], check=True, cwd=TOP)
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([program, f'--scene={TOP}/build/demo/{name}/scene.yaml', f'--output={out}', '--overlays=false'],
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
        with open(os.path.join(out, 'results.jsonl')) as lines:
            rows = [json.loads(line) for line in lines]
    return {f'{r["image"]} {r["solver"]} {r["stage"]}':
            [[float(f'{x:.9f}') for x in r['rotation'][2::3]], float(f'{r["sigma_normal_deg"] or 0.0:.6g}'), round(r['probability'], 6)]
            for r in rows if r['status'] == 'ok' and r['hypothesis'] == 0}


def misses(found, golden):
    """What differs, in words."""
    for key in sorted(found.keys() | golden.keys()):
        if key not in found or key not in golden:
            yield f'{key}: {"no answer" if key not in found else "an answer where there was none"}'
            continue
        (n, sigma, p), (n0, sigma0, p0) = found[key], golden[key]
        off = math.degrees(math.dist(n, n0))
        if off > 0.05 * sigma0 + 1e-7 or abs(sigma - sigma0) > 0.02 * sigma0 or abs(p - p0) > 0.01:
            yield f'{key}: normal off by {off:.3g} degrees of {sigma0:.3g}, that {sigma:.3g}, p {p0} now {p}'


def main():
    program = os.path.abspath(sys.argv[1])
    sets = [name for name, where in SETS.items() if at_hand(*where)]
    if not sets:
        print('skipped: the photographs of visp-images-data and opencv-doc are not here')
        return 77
    found = {name: answers(program, name) for name in sets}
    if '--write' in sys.argv:
        with open(GOLDEN, 'w') as file:
            sets_text = (f' "{name}": {{\n' + ',\n'.join(f'  {json.dumps(k)}: {json.dumps(v)}' for k, v in rows.items()) + '\n }'
                         for name, rows in found.items())
            file.write('{\n' + ',\n'.join(sets_text) + '\n}\n')
        return 0
    with open(GOLDEN) as file:
        golden = json.load(file)
    wrong = [f'{name} {text}' for name in sets for text in misses(found[name], golden[name])]
    print('\n'.join(wrong))
    print(f'{sum(map(len, found.values()))} answers on {", ".join(sets)}: {len(wrong)} differ')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
