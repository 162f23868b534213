"""The scenes of rendered_scenes.py, drawn at random; runs inside Blender:

  blender --background --factory-startup --python rendered_scenes_blender.py -- FIRST LAST FOLDER

Writes NNNN.png and NNNN.json for each number: kind, size and focal length, pixels, and `planes`,
the unit normals, in the camera frame, of all that is flat. Lengths are metres, Z is up.
"""

import colorsys
import json
import math
import random
import sys

import bpy
from mathutils import Euler, Matrix, Vector

UP = Vector((0, 0, 1))
UPRIGHT = math.pi / 2
TURN = 2 * math.pi


class Scene:
    """One scene: `random` draws it, `planes` collects the normals, world frame."""

    def __init__(self, number: int):
        self.random = random.Random(7919 * number + 13)
        self.planes = []
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.light_sky()

    def draw(self, least: float, most: float) -> float:
        return self.random.uniform(least, most)

    def happens(self, probability: float) -> bool:
        return self.random.random() < probability

    def light_sky(self):
        world = bpy.data.worlds.new("world")
        bpy.context.scene.world = world
        world.use_nodes = True
        nodes, links = world.node_tree.nodes, world.node_tree.links
        sky = nodes.new("ShaderNodeTexSky")
        sky.sky_type = "NISHITA"
        sky.sun_elevation, sky.sun_rotation = self.draw(0.3, 1.4), self.draw(0, TURN)
        sky.sun_size, sky.sun_intensity = self.draw(0.01, 0.2), self.draw(0.1, 1.0)
        links.new(sky.outputs[0], nodes["Background"].inputs[0])
        nodes["Background"].inputs[1].default_value = self.draw(0.06, 0.14)

    def color(self) -> tuple:
        hue, saturation, value = self.draw(0, 1), self.draw(0, 0.7), self.draw(0.05, 0.9)
        return (*colorsys.hsv_to_rgb(hue, saturation, value), 1)

    def material(self, *patterns: str, scale: float = 1.0, roughness: float = -1):
        """Of one of the patterns: plain, noise, waves, cells, bricks or checks."""
        pattern = self.random.choice(patterns or ("plain",))
        made = bpy.data.materials.new(pattern)
        made.use_nodes = True
        nodes, links = made.node_tree.nodes, made.node_tree.links
        surface = nodes["Principled BSDF"]
        roughness = roughness if roughness >= 0 else self.draw(0.2, 0.9)
        surface.inputs["Roughness"].default_value = roughness
        first, second = self.color(), self.color()
        surface.inputs["Base Color"].default_value = first
        if pattern == "plain":
            return made
        kind = {"noise": "Noise", "waves": "Wave", "cells": "Voronoi", "bricks": "Brick", "checks": "Checker"}
        texture = nodes.new("ShaderNodeTex" + kind[pattern])
        mapping = nodes.new("ShaderNodeMapping")
        mapping.inputs["Scale"].default_value = (scale, scale, scale)
        links.new(nodes.new("ShaderNodeTexCoord").outputs["Object"], mapping.inputs["Vector"])
        links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
        texture.inputs["Scale"].default_value = self.draw(1.5, 6)
        if pattern in ("bricks", "checks"):
            texture.inputs["Color1"].default_value = first
            texture.inputs["Color2"].default_value = second
            if pattern == "bricks":
                texture.inputs["Color2"].default_value = [0.8 * c for c in first[:3]] + [1]
                texture.inputs["Mortar"].default_value = second
                texture.inputs["Mortar Size"].default_value = self.draw(0.01, 0.03)
            links.new(texture.outputs["Color"], surface.inputs["Base Color"])
            return made
        if pattern == "waves":
            texture.inputs["Distortion"].default_value = self.draw(3, 10)
        ramp = nodes.new("ShaderNodeValToRGB")
        share = self.draw(0.1, 0.5)
        ramp.color_ramp.elements[0].color = first
        ramp.color_ramp.elements[1].color = [a * (1 - share) + b * share for a, b in zip(first, second)]
        links.new(texture.outputs["Fac" if pattern == "noise" else 0], ramp.inputs["Fac"])
        links.new(ramp.outputs["Color"], surface.inputs["Base Color"])
        return made

    def add(self, points, faces, material, at=(0, 0, 0), turned=(0, 0, 0), smooth=False):
        mesh = bpy.data.meshes.new("mesh")
        mesh.from_pydata([tuple(p) for p in points], [], faces)
        thing = bpy.data.objects.new("thing", mesh)
        bpy.context.collection.objects.link(thing)
        thing.location, thing.rotation_euler = at, turned
        mesh.materials.append(material)
        if smooth:
            for polygon in mesh.polygons:
                polygon.use_smooth = True
            mesh.use_auto_smooth, mesh.auto_smooth_angle = True, 0.7

    def ground(self, half: float, material, height: float = 0):
        corners = [(-half, -half, height), (half, -half, height), (half, half, height), (-half, half, height)]
        self.add(corners, [(0, 1, 2, 3)], material)

    def quad(self, middle, across, along, material):
        corners = [middle - across, middle + across, middle + across + along, middle - across + along]
        self.add(corners, [(0, 1, 2, 3)], material)

    def box(self, size, material, at, turn):
        x, y, z = size[0] / 2, size[1] / 2, size[2]
        points = [(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)]
        points += [(*p[:2], z) for p in points]
        sides = [(i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i) for i in range(4)]
        self.add(points, [(3, 2, 1, 0), (4, 5, 6, 7), *sides], material, at, (0, 0, turn))

    def turned(self, profile, material, at, turned=(0, 0, 0)):
        """What a lathe makes: `profile` has radius and height."""
        steps = 160
        angles = [TURN * i / steps for i in range(steps)]
        points = [(r * math.cos(a), r * math.sin(a), z) for a in angles for r, z in profile]
        n = len(profile)
        strips = [(i * n, (i + 1) % steps * n) for i in range(steps)]
        faces = [(a + j, b + j, b + j + 1, a + j + 1) for a, b in strips for j in range(n - 1)]
        self.add(points, faces, material, at, turned, smooth=True)

    def disc(self, radius, at, thickness, has_rings=False, turned=(0, 0, 0)):
        self.turned([(0, thickness), (radius, thickness), (radius, 0)], self.material("plain", "noise"), at, turned)
        for ring in range(self.random.randint(1, 3) if has_rings else 0):
            radius *= self.draw(0.55, 0.85)
            above = Euler(turned).to_matrix() @ Vector((0, 0, thickness + 0.0003 * (ring + 1)))
            self.turned([(0, 0), (radius, 0)], self.material(), Vector(at) + above, turned)

    def plate(self, radius, at):
        well, height = radius * self.draw(0.55, 0.75), radius * self.draw(0.06, 0.16)
        thick = radius * self.draw(0.01, 0.03)
        self.turned(
            [(0, thick), (well, thick), (1.04 * well, 1.5 * thick), (0.98 * radius, height),
             (radius, height + 0.3 * thick), (0.99 * radius, height - thick), (1.05 * well, 0), (0, 0)],
            self.material(roughness=self.draw(0.05, 0.4)), at)

    def cup(self, radius, height, at):
        thick, foot = radius * self.draw(0.03, 0.09), radius * self.draw(0.6, 1.0)
        self.turned(
            [(0, 0), (foot, 0), (radius, height), (radius - thick, height), (foot - thick, thick), (0, thick)],
            self.material(roughness=self.draw(0.05, 0.5)), at)

    def add_axes(self, turn) -> tuple:
        """Notes the sides of what is turned by so much, and returns its axes."""
        axes = Vector((math.cos(turn), math.sin(turn), 0)), Vector((-math.sin(turn), math.cos(turn), 0))
        self.planes += axes
        return axes

    def house(self, x, y, turn, size):
        self.box(size, self.material("plain", "noise", "bricks", scale=self.draw(0.8, 1.5)), (x, y, 0), turn)
        along, across = self.add_axes(turn)
        frame, glass = self.material(), self.material(roughness=0.1)
        for out, side, half, width in ((along, across, size[0] / 2, size[1]), (-along, across, size[0] / 2, size[1]),
                                       (across, along, size[1] / 2, size[0]), (-across, along, size[1] / 2, size[0])):
            columns = max(1, int(width / self.draw(2.2, 3.2)))
            w, h = self.draw(0.9, 1.4), self.draw(1.2, 1.8)
            for floor in range(max(2, int(size[2] / 3))):
                for k in range(columns):
                    if self.happens(0.1):
                        continue
                    place = out * half + side * ((k + 0.5) / columns - 0.5) * width
                    self.window(w, h, place + Vector((x, y, 0.8 + 3 * floor)), side, out, frame, glass)
        self.box((size[0] + 0.5, size[1] + 0.5, 0.3), self.material(), (x, y, size[2]), turn)

    def window(self, w, h, foot, side, out, frame, glass):
        rim = 0.08 * w
        self.quad(foot + 0.008 * out - rim * UP, side * (w / 2 + rim), (h + 2 * rim) * UP, frame)
        self.quad(foot + 0.012 * out, side * w / 2, h * UP, glass)
        if self.happens(0.7):
            self.quad(foot + 0.02 * out, side * 0.03, h * UP, frame)

    # What follows draws a scene, and returns where the camera looks, from how far, under which
    # elevation and, where that matters, from which azimuth.

    def table(self):
        self.ground(1.2, self.material("plain", "noise", "waves", "noise", "checks", scale=self.draw(1, 4)))
        self.ground(6, self.material("noise", scale=0.3), -0.7)
        self.planes.append(UP)
        taken = []
        for _ in range(self.random.randint(2, 6)):
            kind = self.random.choice(("plate", "cup", "disc", "rings", "book", "box"))
            least, most = {"plate": (0.08, 0.14), "cup": (0.03, 0.045), "disc": (0.04, 0.1),
                           "rings": (0.05, 0.12), "book": (0.13, 0.13), "box": (0.1, 0.1)}[kind]
            r = self.draw(least, most)
            spots = [(self.draw(-0.22, 0.22), self.draw(-0.22, 0.22), 0) for _ in range(60)]
            free = [s for s in spots if all(math.dist(s, t) > r + q for t, q in taken)]
            if not free:
                continue
            taken.append((free[0], r))
            self.put(kind, r, free[0])
        return (self.draw(-0.05, 0.05), self.draw(-0.05, 0.05), 0), self.draw(0.6, 1.1), self.draw(0.3, 1.25)

    def put(self, kind, r, at):
        if kind == "plate":
            self.plate(r, at)
        elif kind == "cup":
            if self.happens(0.6):
                self.plate(1.9 * r, at)
                at = (*at[:2], 0.008)
            self.cup(r, self.draw(0.05, 0.11), at)
        elif kind in ("disc", "rings"):
            self.disc(r, at, 0.004, kind == "rings")
        else:
            turn = self.draw(0, math.pi)
            size = (0.15, 0.21, self.draw(0.01, 0.04))
            if kind == "box":
                size = (self.draw(0.06, 0.12), self.draw(0.06, 0.12), self.draw(0.05, 0.2))
            self.box(size, self.material("plain", "noise", "bricks", "cells", scale=8), at, turn)
            self.add_axes(turn)

    def street(self):
        self.ground(200, self.material("noise", "plain"))
        self.planes.append(UP)
        turn = self.draw(0, TURN)
        self.house(0, 0, turn, (self.draw(8, 16), self.draw(8, 14), self.draw(6, 12)))
        along, across = self.planes[1:3]
        if self.happens(0.7):
            other = along * self.draw(14, 20) * self.random.choice((-1, 1))
            leans = 0 if self.happens(0.6) else self.draw(-0.5, 0.5)
            self.house(other.x, other.y, turn + leans, (self.draw(6, 10), self.draw(6, 12), self.draw(5, 11)))
        for _ in range(self.random.randint(0, 6)):  # Round trees.
            place = self.random.choice((along, across)) * self.random.choice((-11, 11))
            at = place + Vector((self.draw(-9, 9), self.draw(-9, 9), self.draw(1.5, 3)))
            bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=self.draw(0.8, 2), location=at)
            bpy.context.object.data.materials.append(self.material("cells", scale=2))
        return (0, 0, self.draw(2.5, 4.5)), self.draw(18, 30), self.draw(-0.02, 0.25)

    def pavement(self):
        paving = self.material("bricks", "noise", "bricks", "checks", "cells", scale=self.draw(1, 2))
        self.ground(50, paving)
        self.planes.append(UP)
        self.disc(self.draw(0.28, 0.4), (0, 0, 0), 0.006, True)
        if self.happens(0.5):  # A kerb.
            turn = self.draw(0, math.pi)
            place = self.add_axes(turn)[1] * self.draw(0.6, 1.0)
            self.box((30, 0.2, 0.12), self.material("noise", scale=2), place, turn)
        if self.happens(0.4):
            at = (self.draw(0.5, 0.9), self.draw(-0.9, -0.4), 0)
            self.disc(self.draw(0.1, 0.2), at, 0.006, self.happens(0.5))
        return (self.draw(-0.2, 0.2), self.draw(-0.2, 0.2), 0), self.draw(1.5, 3.5), self.draw(0.3, 1.2)

    def wheel(self):
        self.ground(50, self.material("noise", "bricks", "plain"))
        self.planes.append(UP)
        r, turned = self.draw(0.28, 0.36), (UPRIGHT, 0, self.draw(0, TURN))
        stands = Euler(turned).to_matrix()
        out, at = stands @ UP, Vector((0, 0, r))
        self.planes.append(out)
        tyre = self.material()
        tyre.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.02, 0.02, 0.02, 1)
        self.turned([(0.68 * r, 0), (0.72 * r, 0.015), (0.93 * r, 0.012), (r, -0.02), (r, -0.2), (0.7 * r, -0.2)], tyre, at, turned)
        rim = self.material(roughness=0.3)
        rim.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 0.8
        self.turned([(0.68 * r, 0), (0.66 * r, -0.01), (0.6 * r, -0.05), (0.2 * r, -0.03), (0.18 * r, -0.015), (0, -0.015)], rim, at, turned)
        bolts = self.random.randint(4, 6)
        for k in range(bolts):
            a = TURN * k / bolts
            place = stands @ Vector((0.4 * r * math.cos(a), 0.4 * r * math.sin(a), -0.035))
            self.turned([(0, 0), (0.06 * r, 0)], self.material(), at + place, turned)
        body = at - 0.28 * out - 0.1 * UP
        self.box((3, 0.1, 0.8), self.material(roughness=0.2), body, turned[2])
        azimuth = math.atan2(out.y, out.x) + self.draw(-0.9, 0.9)
        return at, self.draw(1.2, 2.2), self.draw(0.05, 0.6), azimuth

    def room(self):
        length, width, height = self.draw(3, 6), self.draw(3, 5), self.draw(2.4, 3)
        self.ground(length, self.material("checks", "bricks", "waves", "noise", scale=self.draw(0.8, 2)))
        self.planes += [UP, Vector((0, 1, 0)), Vector((1, 0, 0))]
        x, y = Vector((1, 0, 0)), Vector((0, 1, 0))
        wall = self.material(roughness=0.9)
        self.quad(width / 2 * y, length / 2 * x, height * UP, wall)
        self.quad(-length / 2 * x, width / 2 * y, height * UP, wall if self.happens(0.6) else self.material())
        for _ in range(self.random.randint(0, 4)):  # Pictures.
            on_y, size = self.happens(0.5), (self.draw(0.4, 1.2), self.draw(0.4, 1.2))
            side, out = (x, -y) if on_y else (y, x)
            reach = (length if on_y else width) / 2 - 0.8
            wall_at = (width / 2 - 0.001) * y if on_y else (0.001 - length / 2) * x
            foot = wall_at + self.draw(-reach, reach) * side + self.draw(0.8, 1.4) * UP
            self.window(*size, foot, side, out, self.material(), self.material("noise", scale=3))
        for _ in range(self.random.randint(0, 3)):  # Furniture.
            turn = self.draw(0, UPRIGHT) if self.happens(0.4) else 0
            size = (self.draw(0.4, 0.9), self.draw(0.4, 1.2), self.draw(0.3, 0.9))
            at = (self.draw(-length / 4, length / 4), self.draw(-width / 8, width / 3), 0)
            self.box(size, self.material("plain", "noise", "bricks", "checks"), at, turn)
            self.add_axes(turn)
        if self.happens(0.6):  # A clock.
            at = (self.draw(-length / 4, length / 4), width / 2 - 0.006, self.draw(1.5, 1.9))
            self.disc(self.draw(0.12, 0.2), at, 0.004, True, (UPRIGHT, 0, 0))
        if self.happens(0.4):  # A rug.
            at = (self.draw(-length / 6, length / 6), self.draw(-0.5, 0.5), 0)
            self.disc(self.draw(0.3, 0.6), at, 0.004, self.happens(0.5))
        lamp = bpy.data.lights.new("lamp", "AREA")
        lamp.energy, lamp.size = self.draw(30, 90), self.draw(0.3, 1)
        hung = bpy.data.objects.new("lamp", lamp)
        hung.location = (self.draw(0, 1), self.draw(-1, 0), height)
        bpy.context.collection.objects.link(hung)
        target = (self.draw(-0.5, 0.2), self.draw(0, 0.6), self.draw(0.5, 1.2))
        return target, self.draw(2.2, 4.0), self.draw(0.05, 0.5), self.draw(-1.3, -0.3)

    def photograph(self, file: str, target, distance, elevation, azimuth=None) -> dict:
        fov = math.radians(self.draw(38, 72))
        width, height = self.random.choice(((640, 480), (640, 480), (800, 600)))
        azimuth = self.draw(0, TURN) if azimuth is None else azimuth
        distance *= (math.radians(55) / fov) ** 0.7
        flat = math.cos(elevation)
        away = Vector((flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(elevation)))
        roll = self.draw(-0.05, 0.05) if self.happens(0.7) else self.draw(-0.3, 0.3)
        turn = (-away).to_track_quat("-Z", "Y").to_matrix() @ Matrix.Rotation(roll, 3, "Z")
        lens = bpy.data.cameras.new("camera")
        camera = bpy.data.objects.new("camera", lens)
        bpy.context.collection.objects.link(camera)
        camera.matrix_world = Matrix.Translation(Vector(target) + distance * away) @ turn.to_4x4()
        lens.sensor_fit, lens.angle, lens.clip_start = "HORIZONTAL", fov, 0.001
        if self.happens(0.4):
            lens.dof.use_dof, lens.dof.focus_distance = True, distance * self.draw(0.9, 1.1)
            lens.dof.aperture_fstop = self.random.choice((4, 8, 11)) * (2 if distance < 0.8 else 1)
        scene = bpy.context.scene
        scene.camera = camera
        scene.render.engine, scene.cycles.samples, scene.cycles.max_bounces = "CYCLES", 32, 3
        scene.cycles.use_denoising = False
        scene.view_settings.view_transform, scene.view_settings.exposure = "Filmic", self.draw(-0.3, 0.6)
        scene.render.resolution_x, scene.render.resolution_y = width, height
        scene.render.image_settings.file_format, scene.render.filepath = "PNG", file
        scene.render.threads_mode, scene.render.threads = "FIXED", 1
        bpy.ops.render.render(write_still=True)
        # Blender's camera looks along -Z, with Y up.
        cam_from_world = Matrix(((1, 0, 0), (0, -1, 0), (0, 0, -1))) @ turn.transposed()
        planes = [list(cam_from_world @ normal) for normal in self.planes]
        return {"width": width, "height": height, "focal_px": width / 2 / math.tan(fov / 2), "planes": planes}


KINDS = ("table", "street", "pavement", "wheel", "room")

first, last, folder = sys.argv[sys.argv.index("--") + 1 :]
for number in range(int(first), int(last)):
    print(f"\rscene {number} of {first} to {int(last) - 1}", end="", file=sys.stderr, flush=True)
    kind = KINDS[number % len(KINDS)]
    scene = Scene(number)
    view = getattr(scene, kind)()
    told = scene.photograph(f"{folder}/{number:04d}.png", *view)
    with open(f"{folder}/{number:04d}.json", "w", encoding="utf-8") as file:
        json.dump({"kind": kind, **told}, file)
