#!/usr/bin/env python3
"""circline_studio in headless Chromium: clicks a disc, its centre and two edges of a photograph, and
holds the pose that the page shows against circline_compare on the scene that it saves.

    studio_page_test.py --studio=BIN --compare=BIN --frames=FOLDER --scene=disc.yaml [--screenshots=FOLDER]

Exit code 77: Chromium, its driver, selenium or the photographs are not there.
"""
import argparse
import base64
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request

SKIPPED = 77
NAMES = ['image.0007.pgm', 'image.0049.pgm', 'image.0091.pgm']
TRUE_NORMAL = (-0.05940087, 0.7557466, 0.6521645)  # Of NAMES[0], up to sign, by the dots.
RADIUS, DISTANCE = 31.7455, 620.1  # Of the disc, millimetres; from the camera to its centre.
DISC, CENTER = (166.3, 175.0), (166.34, 186.09)  # A point within it, and its centre, by the dots.
# Along the front and the left edge of the plate on NAMES[0]; the page snaps to what was found there.
FRONT, LEFT = (90.0, 257.5, 260.0, 234.8), (61.0, 165.0, 69.0, 243.0)


def skip(why):
    print('skipped: ' + why)
    sys.exit(SKIPPED)


try:
    from selenium import webdriver
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
except ImportError:
    skip('no python3-selenium')


def check(condition, what):
    if not condition:
        raise AssertionError(what)
    print('ok: ' + what)


class Studio:
    """The program, with photos and a calibration in a folder of its own."""

    def __init__(self, args, folder):
        self.photos = os.path.join(folder, 'photos')
        os.mkdir(self.photos)
        for name in NAMES:
            source = os.path.join(args.frames, name)
            if os.path.exists(source):
                shutil.copy(source, self.photos)
            elif os.path.exists(source + '.gz'):
                with open(os.path.join(self.photos, name), 'wb') as out:
                    out.write(subprocess.check_output(['gunzip', '-c', source + '.gz']))
            else:
                skip('no ' + source)
        camera = os.path.join(folder, 'camera.yml')
        with open(args.scene) as scene, open(camera, 'w') as out:
            text = scene.read()
            size = re.search(r'width: (\d+), height: (\d+)', text)
            matrix = re.search(r'camera_matrix: (\[[^]]*\])', text).group(1)
            distortion = re.search(r'distortion: (\[[^]]*\])', text).group(1)
            out.write(f'%YAML:1.0\n---\nimage_width: {size.group(1)}\nimage_height: {size.group(2)}\n'
                      f'camera_matrix: {matrix}\ndistortion_coefficients: {distortion}\n')
        self.process = subprocess.Popen(
            [args.studio, '--images=' + self.photos, '--camera=' + camera, '--port=0'],
            stdout=subprocess.PIPE, text=True)
        self.address = re.search(r'http://\S+/', self.process.stdout.readline()).group(0)

    def stop(self):
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(timeout=10)


class Page:
    def __init__(self, folder, address):
        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which('chromium')
        for flag in ['--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
                     '--disable-background-networking', '--disable-component-update', '--disable-sync',
                     '--window-size=1280,800', '--user-data-dir=' + os.path.join(folder, 'chromium')]:
            options.add_argument(flag)
        options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
        service = webdriver.chrome.service.Service(shutil.which('chromedriver'))
        self.driver = webdriver.Chrome(options=options, service=service)
        self.look(1280, False)
        self.address = address

    def look(self, width, dark):
        self.driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', {
            'width': width, 'height': 800, 'deviceScaleFactor': 1, 'mobile': False})
        self.driver.execute_cdp_cmd('Emulation.setEmulatedMedia', {'features': [
            {'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}]})

    def open(self):
        self.driver.get(self.address)
        self.settle()

    def settle(self):
        """Waits until the page has answered and kept all that was said."""
        end = time.time() + 60
        while not self.driver.execute_script(
                'return !!window.circlineIdle && circlineIdle() && !!window.circlineApp.detection'):
            if time.time() > end:
                raise AssertionError('the page does not come to rest')
            time.sleep(0.02)

    def screen(self, point):
        """Of a pixel of the photo: where it is on the page."""
        return self.driver.execute_script(
            'const b = document.getElementById("photo").getBoundingClientRect(), v = circlineView;'
            'return [b.left + v.x + (arguments[0] + 0.5) * v.scale,'
            '        b.top + v.y + (arguments[1] + 0.5) * v.scale];', *point)

    def drag(self, start, end):
        chain = ActionChains(self.driver, duration=0)
        x, y = self.screen(start)
        chain.w3c_actions.pointer_action.move_to_location(round(x), round(y))
        chain.w3c_actions.pointer_action.pointer_down()
        x, y = self.screen(end)
        for share in (0.5, 1.0):
            at = [a + share * (b - a) for a, b in zip(self.screen(start), (x, y))]
            chain.w3c_actions.pointer_action.move_to_location(round(at[0]), round(at[1]))
        chain.w3c_actions.pointer_action.pointer_up()
        chain.perform()

    def click(self, point):
        chain = ActionChains(self.driver, duration=0)
        x, y = self.screen(point)
        chain.w3c_actions.pointer_action.move_to_location(round(x), round(y))
        chain.w3c_actions.pointer_action.pointer_down()
        chain.w3c_actions.pointer_action.pointer_up()
        chain.perform()
        self.settle()

    def press(self, *keys):
        ActionChains(self.driver).send_keys(*keys).perform()
        self.settle()

    def control(self, key):
        ActionChains(self.driver).key_down(Keys.CONTROL).send_keys(key).key_up(Keys.CONTROL).perform()
        self.settle()

    def doc(self):
        return json.loads(self.driver.execute_script('return JSON.stringify(circlineApp.doc)'))

    def pose(self):
        """Rotation and translation, as the page shows them."""
        pose = self.driver.find_element(By.ID, 'pose')
        return [json.loads(pose.get_attribute('data-' + name)) for name in ('rotation', 'translation')]

    def shoot(self, path):
        picture = self.driver.execute_cdp_cmd('Page.captureScreenshot', {'format': 'png'})
        with open(path, 'wb') as out:
            out.write(base64.b64decode(picture['data']))

    def errors(self):
        return [entry['message'] for entry in self.driver.get_log('browser')
                if entry['level'] in ('SEVERE', 'WARNING')]


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
    page.press('m')
    page.drag((110.0, 170.0), (210.0, 200.0))
    page.settle()
    page.press('v')
    said = page.doc()
    measured = page.driver.execute_script('return circlineApp.estimate.measurements[0]')
    check(measured['value'] > 0 and measured['sigma'] > 0, 'a length is measured, with its sigma')
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
    page.control('z')


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
    rate = page.driver.execute_async_script('''
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
          else { at('pointerup', 0); done((circlineAnswers() - first) / t); }
        };
        step();''')
    print('while a centre is dragged: %.0f estimates a second' % rate)
    page.settle()
    page.control('z')


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
            page = Page(folder, studio.address)
            page.open()
            say_disc_and_edges(page)
            check_against_compare(page, args, folder)
            check_truth(page)
            check_undo_and_reload(page)
            check_exports(page, folder)
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
