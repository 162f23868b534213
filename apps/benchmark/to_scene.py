#!/usr/bin/python3
"""Turns a set of photographs with truth into a scene file (docs/scene_files.md). Needs python3-opencv.

  to_scene.py SET OUT.yaml [--evidence=annotated|auto] [--lines=2|all] [--circles=1|all] [--centre] [--axes] [--radius]

SET holds groundtruth.yml, which OpenCV's FileStorage reads (docs/photographs.md); names of photos are written relative to OUT.

  annotated   segments and contours as measured in the photo; auto: nothing but the photo, the camera and the truth
  --lines     how many rows and columns of a chessboard become segments
  --circles   how many circles of a photo are given; 1: the largest in the photo
  --centre    adds the image of each circle's centre; --radius its radius
  --axes      adds the frame's oriented axes, from measured corners or centres
"""
import argparse
import os

import cv2
import numpy as np


def mat(node, key):
    child = node.getNode(key)
    return None if child.empty() else child.mat()


def seq(node, key):
    child = node.getNode(key)
    return [child.at(i) for i in range(child.size())] if child.isSeq() else []


def text(node, key, default=''):
    child = node.getNode(key)
    return default if child.empty() else child.string()


def number(value):
    """With a point or an exponent: the scene file's readers take `9` for an integer."""
    shown = f'{float(value):.9g}'
    return shown if any(c in shown for c in '.en') else shown + '.'


def row(values):
    return '[' + ', '.join(map(number, np.asarray(values, float).ravel())) + ']'


def camera(node, ident, width, height, lens=False):
    """`lens`: it counts as one with distortion, be that zero."""
    distortion = mat(node, 'distortion_coefficients')
    if distortion is None:
        distortion = np.zeros(5)
    lens = lens or np.any(distortion)
    return (f'  - {{ id: "{ident}", model: "{"opencv" if lens else "pinhole"}", width: {width}, height: {height}, '
            f'camera_matrix: {row(mat(node, "camera_matrix"))}' + (f', distortion: {row(distortion)}' if lens else '') + ' }')


def corner_lines(image, how_many):
    """(rows, columns) of a chessboard: end points, measured corners."""
    corners = mat(image, 'corners')
    if how_many == 'all' and image.getNode('corner_ids').empty() and corners is not None and len(corners) == 54:
        grid = corners.reshape(6, 9, 2)
        return [np.r_[r[0], r[-1]] for r in grid], [np.r_[grid[0, k], grid[-1, k]] for k in range(9)]
    return list(mat(image, 'row_lines')), list(mat(image, 'col_lines'))


def circle_lines(image, args):
    circles = [c for c in seq(image, 'circles') or seq(image, 'ellipses') if mat(c, 'contour') is not None]
    if args.circles == '1' and circles:
        circles = [max(circles, key=lambda c: np.ptp(mat(c, 'contour'), axis=0).prod())]
    lines = ['    circles:'] if circles else []
    for k, circle in enumerate(circles):
        more = ''
        if args.centre and mat(circle, 'centre_pixel') is not None:
            more += f', center: {row(mat(circle, "centre_pixel"))}'
        if args.radius and not circle.getNode('radius').empty():
            more += f', radius: {circle.getNode("radius").real():.9g}'
        lines.append(f'      - {{ id: "c{k}", contour: {row(mat(circle, "contour"))}, plane: "p0"{more} }}')
    return lines


def pencil_lines(image, args):
    pencils = []  # Name, direction, plane, segments.
    if mat(image, 'row_lines') is not None:
        rows, columns = corner_lines(image, args.lines)
        pencils = [('x', 'x', 'p0', rows), ('y', 'y', 'p0', columns)]
    for direction in seq(image, 'directions'):
        if mat(direction, 'segments') is not None:
            pencils.append((text(direction, 'name'), 'free', '', list(mat(direction, 'segments'))))
    axes = {}
    for line in seq(image, 'lines'):
        axes.setdefault(text(line, 'axis'), []).append(mat(line, 'segment').ravel())
    pencils += [(axis, axis, '', s) for axis, s in sorted(axes.items()) if axis in 'xyz' and len(s) >= 2]
    lines = ['    pencils:'] if pencils else []
    for name, direction, plane, segments in pencils:
        more = f', plane: "{plane}"' if plane else ''
        lines.append(f'      - {{ id: "{name}", segments: {row(np.array(segments))}, direction: "{direction}"{more} }}')
    return lines


def frame_lines(image):
    """The axes: first row and first column of corners, or of centres."""
    circles = seq(image, 'circles')
    if mat(image, 'row_lines') is not None:
        x, y = mat(image, 'row_lines')[0], mat(image, 'col_lines')[0]
    elif len(circles) >= 12:
        world = np.array([mat(c, 'centre_world').ravel()[:2] for c in circles])
        pixel = np.array([mat(c, 'centre_pixel').ravel() for c in circles])
        origin = pixel[np.argmin(world.sum(1))]
        x = np.r_[origin, pixel[np.argmax(world[:, 0] - world[:, 1])]]
        y = np.r_[origin, pixel[np.argmax(world[:, 1] - world[:, 0])]]
    else:
        return []
    return [f'    frame: {{ plane: "p0", origin: {row(np.ravel(x)[:2])}, x_axis: {row(x)}, y_axis: {row(y)} }}']


def truth_lines(image, args):
    rotation, translation = mat(image, 'R'), mat(image, 't')
    chessboard = mat(image, 'row_lines') is not None
    board = chessboard or len(seq(image, 'circles')) >= 12
    truth = []
    if rotation is not None and translation is not None:
        if args.evidence == 'auto':
            symmetry = 'D4' if board else 'axis'
        elif args.axes and board:
            symmetry = 'none'
        else:
            symmetry = 'D2' if chessboard or seq(image, 'lines') else 'axis'
        truth += [f'rotation: {row(rotation)}', f'translation: {row(translation)}', f'symmetry: "{symmetry}"']
    directions = [f'{{ pencil: "{text(d, "name")}", value: {row(mat(d, "direction_cam"))} }}' for d in seq(image, 'directions')
                  if mat(d, 'direction_cam') is not None]
    if directions:
        truth.append('directions: [ ' + ', '.join(directions) + ' ]')
    return ['    truth: { ' + ', '.join(truth) + ' }'] if truth else []


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('set')
    parser.add_argument('out')
    parser.add_argument('--evidence', default='annotated', choices=['annotated', 'auto'])
    parser.add_argument('--lines', default='2', choices=['2', 'all'])
    parser.add_argument('--circles', default='1', choices=['1', 'all'])
    for flag in ('centre', 'axes', 'radius'):
        parser.add_argument('--' + flag, action='store_true')
    args = parser.parse_args()
    storage = cv2.FileStorage(os.path.join(args.set, 'groundtruth.yml'), cv2.FILE_STORAGE_READ)  # Outlives its nodes.
    root = storage.root()
    size = [int(root.getNode(key).real()) for key in ('image_width', 'image_height')]
    lines = ['%YAML:1.0', '---', 'cameras:']
    lines += [camera(c, text(c, 'name'), *size) for c in seq(root, 'cameras')] or [camera(root, 'cam0', *size)]
    lines.append('images:')
    folder = os.path.dirname(os.path.abspath(args.out))
    for image in seq(root, 'images'):
        file = os.path.join(os.path.relpath(args.set, folder), text(image, 'file'))
        lines += [f'  - file: "{file}"', f'    camera: "{text(image, "camera", "cam0")}"']
        if args.evidence == 'annotated':
            lines += circle_lines(image, args) + pencil_lines(image, args)
            if args.axes and mat(image, 'R') is not None:
                lines += frame_lines(image)
        lines += truth_lines(image, args)
    os.makedirs(folder, exist_ok=True)
    with open(args.out, 'w') as out:
        out.write('\n'.join(lines) + '\n')


if __name__ == '__main__':
    main()
