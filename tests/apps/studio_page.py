"""circline_studio with photographs of its own, and its page in headless Chromium."""
import base64
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time

SKIPPED = 77
NAMES = ['image.0007.pgm', 'image.0049.pgm', 'image.0091.pgm']


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

    def measure(self, start, end):
        """The length between two pixels, as the page has it."""
        self.press('m')
        self.drag(start, end)
        self.press('v')
        return self.driver.execute_script('return circlineApp.estimate.measurements.at(-1)')

    def take_line(self, index):
        """As a click on a line that was found."""
        self.driver.execute_async_script(
            'const [id, done] = arguments;'
            'import("./pointer.js").then((m) => m.takeFound({kind: "found-line", id})).then(done);', index)
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
