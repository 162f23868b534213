#!/usr/bin/env python3
"""circline_studio in headless Chromium: clicks a disc, its centre and two edges of a photograph, and
holds the pose that the page shows against circline_compare on the scene that it saves.

    studio_page_test.py --studio=BIN --compare=BIN --frames=FOLDER --scene=disc.yaml [--screenshots=FOLDER]

Exit code 77: Chromium, its driver, selenium or the photographs are not there.
"""
import argparse
import json
import math
import os
import re
import shutil
import subprocess
import tempfile
import time
import urllib.request

from studio_page import By, Keys, NAMES, Page, Studio, skip

TRUE_NORMAL = (-0.05940087, 0.7557466, 0.6521645)  # Of NAMES[0], up to sign, by the dots.
RADIUS, DISTANCE = 31.7455, 620.1  # Of the disc, millimetres; from the camera to its centre.
DISC, CENTER = (166.3, 175.0), (166.34, 186.09)  # A point within it, and its centre, by the dots.
# Along the front and the left edge of the plate on NAMES[0]; the page snaps to what was found there.
FRONT, LEFT = (90.0, 257.5, 260.0, 234.8), (61.0, 165.0, 69.0, 243.0)


def check(condition, what):
    if not condition:
        raise AssertionError(what)
    print('ok: ' + what)


def far(a, b):
    return max(abs(x - y) for x, y in zip(sum(a, []), sum(b, [])))


def say_disc_and_edges(page):
    page.click(DISC)
    check(len(page.doc()['scene']['circles']) == 1, 'a click says the circle')
    ambiguous = len(page.driver.find_elements(By.CSS_SELECTOR, '.card'))
    check(ambiguous == 2, 'a circle alone has two poses, side by side')
    predicted = page.driver.execute_script('return circlineApp.estimate.drawings[0].circles[0].center_px')
    page.drag(predicted, CENTER)
    page.settle()
    center = page.doc()['scene']['circles'][0]['center']
    check(max(abs(a - b) for a, b in zip(center, CENTER)) < 0.6, 'its centre can be dragged')
    for line, role in ((FRONT, 'x'), (LEFT, 'y')):
        page.press('l')
        page.drag(line[:2], line[2:])
        page.press(role)
    page.press('v')
    pencils = {p['direction']: p['segments'] for p in page.doc()['scene']['pencils']}
    check(sorted(pencils) == ['x', 'y'], 'two edges are dropped on x and y')
    found = page.driver.execute_script('return circlineApp.detection.segments')
    check(all(any(far([s], [f[:4]]) < 1e-9 or far([s], [f[2:4] + f[:2]]) < 1e-9 for f in found)
              for s in pencils.values()), 'they snap to what was found')


def check_against_compare(page, args, folder):
    page.control('s')
    scene = os.path.join(folder, 'photos', 'scene.json')
    out = os.path.join(folder, 'out')
    subprocess.run([args.compare, '--scene=' + scene, '--output=' + out, '--solvers=joint',
                    '--overlays=false'], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(os.path.join(out, 'results.jsonl')) as lines:
        best = json.loads(lines.readline())
    compared = [best['rotation'], best['translation']]
    check(far(page.pose(), compared) < 1e-9, 'the pose shown is that of circline_compare on the saved scene')


def check_undo_and_reload(page):
    pose, said = page.pose(), page.doc()
    page.control('z')
    check(len(page.doc()['scene']['pencils']) == 1 and far(page.pose(), pose) > 1e-9, 'undo takes a line back')
    page.control('y')
    check(page.doc() == said and far(page.pose(), pose) == 0.0, 'redo brings it again')
    quarter, half = ([a + share * (b - a) for a, b in zip(FRONT[:2], FRONT[2:])] for share in (0.25, 0.5))
    page.measure(quarter, half)
    said = page.doc()
    check(far([said['measure'][0]['points']], [quarter + half]) < 1.0, 'what is measured is as it was drawn')
    time.sleep(0.6)  # The draft is kept half a second after the last change.
    page.settle()
    page.open()
    check(page.doc() == said and far(page.pose(), pose) == 0.0, 'a reload loses nothing')


def check_truth(page):
    rotation, _ = page.pose()
    cosine = abs(sum(rotation[3 * i + 2] * TRUE_NORMAL[i] for i in range(3)))
    check(cosine > math.cos(math.radians(1.0)), 'the normal is within 1 degree of the truth')
    field = page.driver.find_element(By.CSS_SELECTOR, '#panel li input')
    field.send_keys(str(RADIUS), Keys.TAB)
    page.settle()
    check(abs(math.hypot(*page.pose()[1]) / DISTANCE - 1) < 0.02, 'a known radius gives the distance, within 2 %')
    # From the leftmost point of the rim through the centre's image.
    contour = page.doc()['scene']['circles'][0]['contour']
    rim = list(zip(contour[::2], contour[1::2]))
    center = page.driver.execute_script('return circlineApp.estimate.drawings[0].circles[0].center_px')
    angle = lambda p: math.atan2(p[1] - center[1], p[0] - center[0])
    left = min(rim)
    right = min(rim, key=lambda p: math.cos(angle(p) - angle(left)))
    measured = page.measure(left, right)
    value, sigma = measured['value'], measured['sigma']
    print('the diameter, measured: %.2f +- %.2f mm, of %.2f' % (value, sigma, 2 * RADIUS))
    check(sigma < 0.05 * value and abs(value - 2 * RADIUS) < 3 * sigma, 'a length is measured within its sigma')
    page.control('z')
    page.control('z')


def check_groups(page):
    """Groups of found lines, and free ones; all is undone at the end."""
    lines = lambda doc: sum(len(p['segments']) // 4 for p in doc['scene']['pencils'])
    before = page.doc()
    group = page.driver.execute_script('return circlineApp.detection.segments.map(s => s[4])')
    size, name = max((group.count(g), g) for g in group)
    page.take_line(group.index(name))
    page.driver.find_element(By.CSS_SELECTOR, '#roles [data-role^=all]').click()
    page.settle()
    count = lines(page.doc())
    page.take_line(group.index(name))
    check(2 <= size and lines(before) < count <= lines(before) + size and
          not page.driver.find_elements(By.CSS_SELECTOR, '#roles [data-role^=all]'),
          'a group of %d lines is said once' % size)
    page.press(Keys.ESCAPE)
    for key in ('p', 'P'):
        page.press('l')
        page.drag((20.0, 20.0), (60.0, 25.0))
        page.press(key)
    free = [p for p in page.doc()['scene']['pencils'] if p['direction'] == 'free' and p['id'].startswith('lines')]
    check(len(free) == 2, 'Shift+P begins another group of parallel lines')
    for _ in range(3):
        page.control('z')
    check(page.doc() == before, 'and all of it can be undone')


def check_exports(page, folder):
    for name, file in (('gltf', 'cameras.gltf'), ('colmap', 'images.txt'), ('csv', 'measurements.csv')):
        page.driver.execute_script(
            'const e = document.getElementById("export"); e.value = arguments[0];'
            'e.dispatchEvent(new Event("change"));', name)
        path = os.path.join(folder, 'photos', 'export', NAMES[0], file)
        end = time.time() + 10
        while not os.path.exists(path) and time.time() < end:
            time.sleep(0.05)
        check(os.path.getsize(path) > 20, 'export of ' + file)


def check_saves_nothing_of_a_photo_to_come(page):
    """Ctrl+S between the key for another photo and its being there."""
    session = lambda: json.load(urllib.request.urlopen(page.address + 'api/session/0'))['saved']
    saved = session()
    page.press(Keys.PAGE_DOWN)
    page.driver.execute_script(
        'const press = (key, ctrlKey) => window.dispatchEvent(new KeyboardEvent("keydown", {key, ctrlKey}));'
        'press("PageUp", false); press("s", true);')
    page.settle()
    check(len(saved['circles']) == 1 and session() == saved, 'what is not there yet is not saved')


def check_rest(page):
    page.press(Keys.PAGE_DOWN)
    check(page.driver.execute_script('return circlineApp.image') == 1, 'the next photo')
    page.press(Keys.PAGE_UP)
    check(len(page.doc()['scene']['pencils']) == 2, 'and back, with all that was said')
    names = page.driver.execute_script('return performance.getEntriesByType("resource").map(e => e.name)')
    # "blob:" is what the page makes itself.
    check(all(n.startswith((page.address, 'blob:')) for n in names), 'nothing is fetched from elsewhere')
    for name in ['', 'style.css', 'main.js', 'view.js', 'panel.js', 'icon.svg']:
        text = urllib.request.urlopen(page.address + name).read().decode()
        check(not re.search(r'(https?:)?//[a-z]', text.replace('http://www.w3.org/2000/svg', '').replace('// ', '')),
              'no external reference in ' + (name or 'the page'))


def quote_speed(page):
    page.driver.execute_script('performance.clearMarks()')
    page.driver.get('about:blank')
    page.open()
    print('from opening the page to its first pose: %.0f ms' % page.driver.execute_script(
        'return circlineApp.firstPose'))
    rate, server = page.driver.execute_async_script('''
        performance.clearResourceTimings();
        performance.setResourceTimingBufferSize(1000);
        const done = arguments[0], canvas = document.getElementById('photo');
        const box = canvas.getBoundingClientRect(), v = circlineView;
        const [u, w] = circlineApp.doc.scene.circles[0].center, first = circlineAnswers();
        const at = (type, dx) => canvas.dispatchEvent(new PointerEvent(type, {
          pointerId: 1, bubbles: true, button: 0,
          clientX: box.left + v.x + (u + 0.5) * v.scale + dx, clientY: box.top + v.y + (w + 0.5) * v.scale}));
        canvas.setPointerCapture = () => {};
        at('pointerdown', 0);
        const start = performance.now();
        const step = () => {
          const t = (performance.now() - start) / 1000;
          at('pointermove', 6 + 5 * Math.sin(5 * t));
          if (t < 2) requestAnimationFrame(step);
          else {
            at('pointerup', 0);
            const served = performance.getEntriesByType('resource').filter((e) => e.name.endsWith('api/estimate'))
              .map((e) => e.serverTiming[0].duration).sort((a, b) => a - b);
            done([(circlineAnswers() - first) / t, served[served.length >> 1]]);
          }
        };
        step();''')
    print('while a centre is dragged: %.0f estimates a second; each takes the server %.1f ms (median)' % (rate, server))
    page.settle()
    pose = page.pose()
    page.open()
    check(far(page.pose(), pose) == 0.0, 'and the pose when it is let go is from all points')


def main():
    parser = argparse.ArgumentParser()
    for name in ('studio', 'compare', 'frames', 'scene', 'screenshots'):
        parser.add_argument('--' + name, required=name != 'screenshots')
    args = parser.parse_args()
    if not shutil.which('chromium') or not shutil.which('chromedriver'):
        skip('no chromium, or no chromium-driver')
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio(args, folder)
        page = None
        try:
            second = subprocess.run([args.studio, '--images=' + studio.photos, '--port=0'],
                                    capture_output=True, text=True, timeout=60)
            check(second.returncode == 2 and 'another run' in second.stderr, 'a folder has one studio at a time')
            page = Page(folder, studio.address)
            page.open()
            say_disc_and_edges(page)
            check_against_compare(page, args, folder)
            check_truth(page)
            check_undo_and_reload(page)
            check_groups(page)
            check_exports(page, folder)
            check_saves_nothing_of_a_photo_to_come(page)
            check_rest(page)
            quote_speed(page)
            check(page.errors() == [], 'no error in the console')
            if args.screenshots:
                os.makedirs(args.screenshots, exist_ok=True)
                for width in (1280, 800):
                    for dark in (False, True):
                        page.look(width, dark)
                        time.sleep(0.3)
                        page.shoot(os.path.join(args.screenshots, f'{width}{"-dark" if dark else ""}.png'))
        finally:
            if page:
                page.driver.quit()
            code = studio.stop()
        check(code == 0, 'an interrupt ends the studio, exit code 0')


main()
