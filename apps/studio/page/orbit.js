// The plane, its circles, the axes and the camera, seen from outside: lines only, so that a canvas
// and a turn about two axes are all it takes.
import {app, shownDrawing, shownHypothesis} from './store.js';
import {COLORS} from './pen.js';

const look = {yaw: -0.7, pitch: 0.45, zoom: 1};

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, s) => a.map((v) => v * s);
const plus = (a, b) => a.map((v, i) => v + b[i]);
const unit = (a) => scaled(a, 1 / Math.hypot(...a));

// {curves: [{points, color, width}], camera}: world coordinates.
function worldOf(shown, drawing) {
  const {rotation: r, translation: t} = shown, curves = [];
  const columns = [0, 1, 2].map((i) => [r[i], r[3 + i], r[6 + i]]);
  const turned = (v) => columns.map((column) => dot(column, v));  // From the camera's frame.
  const toWorld = (v) => turned([v[0] - t[0], v[1] - t[1], v[2] - t[2]]);
  const camera = toWorld([0, 0, 0]);
  let reach = 0.12 * Math.hypot(...t);
  for (const circle of drawing.circles) {
    const normal = unit(turned(circle.normal)), center = toWorld(circle.center);
    const side = unit(cross(normal, Math.abs(normal[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]));
    const other = cross(normal, side);
    const points = Array.from({length: 49}, (_, i) => plus(center, plus(
      scaled(side, circle.radius * Math.cos(i * Math.PI / 24)),
      scaled(other, circle.radius * Math.sin(i * Math.PI / 24)))));
    curves.push({points, color: COLORS.circle, width: 2});
    reach = Math.max(reach, Math.hypot(center[0], center[1]) + circle.radius);
  }
  reach *= 1.25;
  for (let i = -4; i <= 4; ++i) {
    const at = i * reach / 4;
    curves.push({points: [[at, -reach, 0], [at, reach, 0]], color: 'grid', width: 1});
    curves.push({points: [[-reach, at, 0], [reach, at, 0]], color: 'grid', width: 1});
  }
  ['x', 'y', 'z'].forEach((name, i) => {
    if (drawing.rotation_is_free && i < 2) return;
    const tip = [0, 0, 0];
    tip[i] = 0.8 * reach;
    curves.push({points: [[0, 0, 0], tip], color: COLORS[name], width: 3});
  });
  const focal = shown.focal_px || app.estimate.camera.camera_matrix[0];
  const depth = 0.22 * Math.hypot(...t), {width, height} = app.photo;
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => toWorld(
    [x * depth * width / 2 / focal, y * depth * height / 2 / focal, depth]));
  curves.push({points: [...corners, corners[0]], color: 'ink', width: 1.5});
  for (const corner of corners) curves.push({points: [camera, corner], color: 'ink', width: 1.5});
  curves.push({points: [camera, toWorld([0, 0, Math.hypot(...t)])], color: 'quiet', width: 1});
  return {curves, camera};
}

export function drawOrbit(canvas) {
  const ratio = window.devicePixelRatio || 1, {clientWidth: w, clientHeight: h} = canvas;
  canvas.width = w * ratio;
  canvas.height = h * ratio;
  const context = canvas.getContext('2d'), drawing = shownDrawing();
  if (!drawing || !w) return;
  const {curves, camera} = worldOf(shownHypothesis(), drawing);
  // +Z is up, seen from the side on which the camera is.
  const up = camera[2] < 0 ? -1 : 1;
  const cy = Math.cos(look.yaw), sy = Math.sin(look.yaw), cp = Math.cos(look.pitch), sp = Math.sin(look.pitch);
  const flat = ([x, y, z]) => [x * cy - up * y * sy, -(up * z * cp + (x * sy + up * y * cy) * sp)];
  const all = curves.flatMap((curve) => curve.points.map(flat));
  const low = [0, 1].map((i) => Math.min(...all.map((p) => p[i])));
  const high = [0, 1].map((i) => Math.max(...all.map((p) => p[i])));
  const scale = look.zoom * Math.min((w - 20) / (high[0] - low[0]), (h - 20) / (high[1] - low[1]));
  const style = getComputedStyle(canvas);
  const colors = {grid: style.getPropertyValue('--line'), ink: style.getPropertyValue('--ink'),
                  quiet: style.getPropertyValue('--quiet')};
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.lineCap = context.lineJoin = 'round';
  for (const {points, color, width} of curves) {
    context.beginPath();
    points.map(flat).forEach(([x, y], i) => {
      const px = w / 2 + scale * (x - (low[0] + high[0]) / 2), py = h / 2 + scale * (y - (low[1] + high[1]) / 2);
      if (i) context.lineTo(px, py); else context.moveTo(px, py);
    });
    context.strokeStyle = colors[color] || color;
    context.lineWidth = width;
    context.stroke();
  }
}

export function watchOrbit(canvas) {
  new ResizeObserver(() => drawOrbit(canvas)).observe(canvas);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => drawOrbit(canvas));
  canvas.addEventListener('pointerdown', (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener('pointermove', (event) => {
    if (!event.buttons) return;
    look.yaw += event.movementX * 0.01;
    look.pitch = Math.max(-1.5, Math.min(1.5, look.pitch + event.movementY * 0.01));
    drawOrbit(canvas);
  });
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    look.zoom = Math.max(0.3, Math.min(8, look.zoom * Math.exp(-event.deltaY * 0.0015)));
    drawOrbit(canvas);
  }, {passive: false});
}
