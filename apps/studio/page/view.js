// The photo and what is drawn on it. Screen and photo are one scale and one shift apart; the centre
// of a pixel has whole coordinates.
import {app, isSaid, shownDrawing, shownHypothesis} from './store.js';
import {COLORS, Pen} from './pen.js';
import {foundOf, handlesOf, isEllipseSaid, sameSelection} from './scene.js';

const MANY_HANDLES = 24;  // Beyond, those of what is selected show.

const canvas = document.getElementById('photo');
export const view = {scale: 1, x: 0, y: 0};

export const toScreen = ([u, v]) => [view.x + (u + 0.5) * view.scale, view.y + (v + 0.5) * view.scale];
export const toPhoto = ([x, y]) => [(x - view.x) / view.scale - 0.5, (y - view.y) / view.scale - 0.5];

export function fit() {
  if (!app.photo) return;
  const {clientWidth: w, clientHeight: h} = canvas;
  view.scale = Math.min((w - 24) / app.photo.width, (h - 24) / app.photo.height);
  view.x = (w - view.scale * app.photo.width) / 2;
  view.y = (h - view.scale * app.photo.height) / 2;
}

export function zoom(factor, [x, y]) {
  const scale = Math.max(0.02, Math.min(60, view.scale * factor));
  view.x = x - (x - view.x) * scale / view.scale;
  view.y = y - (y - view.y) * scale / view.scale;
  view.scale = scale;
}

// Grid, horizon, box and axes of a hypothesis; `all`: not the axes alone.
export function drawPose(pen, drawing, all = true) {
  if (!drawing) return;
  for (const line of drawing.grid) pen.curve(line, '#ffffff', 1, {alpha: 0.6, rim: all});
  if (all) pen.curve(drawing.horizon, COLORS.horizon, 1.5, {dash: [7, 6], alpha: 0.8, rim: false});
  if (all) for (const edge of drawing.box) pen.curve(edge, '#ffffff', 1, {alpha: 0.85});
  ['x', 'y', 'z'].forEach((name, i) => {
    const axis = drawing.axes[i];
    if (!axis.length || (drawing.rotation_is_free && i < 2)) return;
    pen.arrow(axis, COLORS[name], 3);
    const tip = axis[axis.length - 1];
    if (all && tip) {
      const [x, y] = pen.place(tip), [x0, y0] = pen.place(drawing.origin), r = Math.hypot(x - x0, y - y0) || 1;
      pen.label(tip, drawing.rotation_is_free ? 'normal' : name.toUpperCase(), COLORS[name],
                [16 * (x - x0) / r, 16 * (y - y0) / r]);
    }
  });
}

// What has no part in the pose shown, by name: "c1", "L1[3]" for the fourth line of a pencil.
function leftOutNames() {
  const shown = shownHypothesis();
  return new Set(shown ? shown.left_out : []);
}

function isHovered(kind, id) {
  return app.hover && app.hover.kind === kind && app.hover.id === id;
}

// What was found and not said: greyed where it has no part in the pose.
function drawFound(pen) {
  if (!app.detection) return;
  const used = !isSaid(app.doc), leftOut = leftOutNames(), counts = {};
  const along = Object.fromEntries(app.detection.pencils.map((p) => [p.id, p.along]));
  const style = (isUsed, hover) => hover ? {alpha: 1} : isUsed ? {alpha: 0.9} : {alpha: 0.55, dash: [5, 4]};
  app.detection.segments.forEach((segment, i) => {
    const id = segment[4], number = counts[id] = (counts[id] ?? -1) + 1;
    const hover = isHovered('found-line', i), isUsed = used && !leftOut.has(`${id}[${number}]`);
    pen.line(segment, isUsed ? COLORS[along[id]] || COLORS.found : COLORS.found, hover ? 3 : 1.5,
             style(isUsed, hover));
  });
  for (const ellipse of app.detection.ellipses) {
    if (isEllipseSaid(app.doc, app.detection, ellipse.id)) continue;
    const hover = isHovered('found-circle', ellipse.id), isUsed = used && !leftOut.has(ellipse.id);
    pen.ellipse(ellipse, isUsed ? COLORS.circle : COLORS.found, hover ? 3.5 : 1.5, style(isUsed, hover));
  }
}

function drawSaid(pen) {
  const {scene, measure} = app.doc, drawing = shownDrawing(), leftOut = leftOutNames();
  const style = (name) => leftOut.has(name) ? {alpha: 0.55, dash: [5, 4]} : {};
  const isSelected = (selection) => app.selection && sameSelection(app.selection, selection);
  scene.pencils.forEach((pencil, p) => {
    for (let s = 0; 4 * s < pencil.segments.length; ++s) {
      const selected = isSelected({kind: 'line', pencil: p, segment: s});
      pen.line(pencil.segments.slice(4 * s, 4 * s + 4), COLORS[pencil.direction || 'free'], selected ? 4 : 2.5,
               style(`${pencil.id}[${s}]`));
    }
  });
  scene.circles.forEach((circle, index) => {
    const selected = isSelected({kind: 'circle', index});
    const ellipse = foundOf(app.detection, circle);
    if (ellipse) {
      pen.ellipse(ellipse, COLORS.circle, selected ? 4 : 2.5, style(circle.id));
    } else if (circle.contour) {
      for (let i = 0; i < circle.contour.length; i += 2) {
        pen.ring(circle.contour.slice(i, i + 2), 1, COLORS.circle, {width: 1});
      }
    }
    const center = centerOf(index);
    if (circle.center) pen.cross(circle.center, 8, COLORS.circle);
    else if (center && drawing) pen.ring(center, 4, COLORS.circle, {width: 1.5});
  });
  for (const name of ['x', 'y']) {
    const axis = scene.frame[`${name}_axis`];
    if (!axis) continue;
    pen.arrow([axis.slice(0, 2), axis.slice(2)], COLORS[name], isSelected({kind: `${name}_axis`}) ? 5 : 4);
    pen.label(axis.slice(2), `${name.toUpperCase()} axis`, COLORS[name], [0, 16]);
  }
  if (scene.frame.origin) {
    pen.ring(scene.frame.origin, 7, '#ffffff');
    pen.cross(scene.frame.origin, 11, '#ffffff');
  }
  const middle = ([x0, y0, x1, y1]) => [(x0 + x1) / 2, (y0 + y1) / 2];
  scene.known.length.forEach((length, index) => {
    pen.line(length.points, COLORS.known, isSelected({kind: 'known', index}) ? 4 : 2.5, {dash: [2, 6]});
    pen.label(middle(length.points), `= ${length.value}`, COLORS.known);
  });
  measure.forEach((item, index) => {
    for (let i = 0; i + 3 < item.points.length; i += 4) {
      pen.line(item.points.slice(i, i + 4), COLORS.measure, isSelected({kind: 'measure', index}) ? 4 : 2.5);
    }
    const found = app.estimate && app.estimate.measurements[index];
    if (found && item.points.length >= 4) pen.label(middle(item.points), measureText(found), COLORS.measure);
  });
}

// Where a said circle's centre is, or is predicted; null where nothing tells.
export function centerOf(index) {
  const circle = app.doc.scene.circles[index], drawing = shownDrawing();
  if (circle.center) return circle.center;
  const predicted = drawing && drawing.circles.find((c) => c.id === circle.id);
  if (predicted && predicted.center_px) return predicted.center_px;
  const ellipse = foundOf(app.detection, circle);
  return ellipse ? ellipse.center : null;
}

// A value to as many digits as its sigma lets it have.
export function withSigma(value, sigma) {
  if (value === null || value === undefined) return '–';
  const digits = sigma > 0 ? Math.max(0, Math.min(6, 1 - Math.floor(Math.log10(sigma)))) : 3;
  return sigma > 0 ? `${value.toFixed(digits)} ± ${sigma.toFixed(digits)}` : value.toFixed(digits);
}

export function measureText(found) {
  if (found.value === null) return 'beyond the horizon';
  const unit = found.unit === 'deg' ? '°' : found.unit === 'distance' ? ' d' : '';
  return withSigma(found.value, found.sigma) + unit;
}

function drawHandles(pen) {
  const handles = handlesOf(app.doc).filter(({selection: {kind}}) => kind !== 'circle' && kind !== 'origin');
  for (const handle of handles) {
    const selected = app.selection && sameSelection(app.selection, handle.selection);
    if (!selected && handles.length > MANY_HANDLES) continue;
    pen.ring(handle.list.slice(handle.at, handle.at + 2), selected ? 5 : 3.5, '#ffffff',
             {fill: selected ? '#0b6bcb' : '#1b2128', width: 1.5});
  }
}

function drawLoose(pen) {
  if (!app.loose) return;
  const {points, snapped} = app.loose;
  if (snapped) pen.line(snapped, COLORS.found, 5, {alpha: 0.9});
  pen.line(points, '#ffffff', 2.5);
  for (const i of [0, 2]) pen.ring(points.slice(i, i + 2), 4, '#ffffff', {fill: '#0b6bcb', width: 1.5});
}

export function draw() {
  const ratio = window.devicePixelRatio || 1, {clientWidth: w, clientHeight: h} = canvas;
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
    canvas.width = Math.round(w * ratio);
    canvas.height = Math.round(h * ratio);
  }
  const context = canvas.getContext('2d');
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, w, h);
  if (!app.photo) return;
  const {bitmap, width, height} = app.photo;
  context.imageSmoothingEnabled = view.scale < 2.5;
  context.drawImage(bitmap, view.x, view.y, view.scale * width, view.scale * height);
  const pen = new Pen(context, toScreen);
  drawFound(pen);
  drawPose(pen, shownDrawing());
  drawSaid(pen);
  drawHandles(pen);
  drawLoose(pen);
}

// The photo, small, with one hypothesis drawn on it.
export function drawThumbnail(small, drawing) {
  const context = small.getContext('2d'), {bitmap, width, height} = app.photo;
  const scale = Math.min(small.width / width, small.height / height);
  const x = (small.width - scale * width) / 2, y = (small.height - scale * height) / 2;
  context.clearRect(0, 0, small.width, small.height);
  context.globalAlpha = 0.75;
  context.drawImage(bitmap, x, y, scale * width, scale * height);
  context.globalAlpha = 1;
  drawPose(new Pen(context, ([u, v]) => [x + (u + 0.5) * scale, y + (v + 0.5) * scale], 0.9), drawing, false);
}

// The pixels about a point, eight times as large as on the photo.
export function drawLens(lens, point) {
  const context = lens.getContext('2d'), size = lens.width, scale = Math.max(8, 2.5 * view.scale);
  const {bitmap, width, height} = app.photo;
  const x = size / 2 - (point[0] + 0.5) * scale, y = size / 2 - (point[1] + 0.5) * scale;
  context.imageSmoothingEnabled = false;
  context.fillStyle = '#14181d';
  context.fillRect(0, 0, size, size);
  context.drawImage(bitmap, x, y, scale * width, scale * height);
  const pen = new Pen(context, ([u, v]) => [x + (u + 0.5) * scale, y + (v + 0.5) * scale]);
  drawSaid(pen);
  drawLoose(pen);
  const middle = size / 2, cross = new Pen(context, (p) => p);
  for (const [a, b] of [[0, middle - 6], [middle + 6, size]]) {
    cross.curve([[a, middle], [b, middle]], 'rgba(255, 255, 255, 0.9)', 1);
    cross.curve([[middle, a], [middle, b]], 'rgba(255, 255, 255, 0.9)', 1);
  }
}
