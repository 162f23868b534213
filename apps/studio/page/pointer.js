// Mouse, pen and finger on the photo: what is under them, and what they do to it.
import {app, change, changed, remember} from './store.js';
import {distance, ellipseDistance, segmentDistance, snap} from './geometry.js';
import {foundOf, handSigma, handlesOf, isEllipseSaid, sayCircle} from './scene.js';
import {centerOf, draw, drawLens, toPhoto, toScreen, view, zoom} from './view.js';

const canvas = document.getElementById('photo'), lens = document.getElementById('lens');
const HANDLE_PX = 10, LINE_PX = 7, SNAP_PX = 7;  // Of the screen.

let drag = null;  // {move(point, event), end(point, event), moved, start}
let pending = null;  // The first line of an angle.
let lensAt = null, lensFrame = 0;  // The pointer moves more often than frames are shown.

const screenOf = (event) => {
  const box = canvas.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
};
const round = (point) => point.map((value) => Math.round(value * 1000) / 1000);

// ---- What is under the pointer ----

function handleAt(screen) {
  let best = null, least = HANDLE_PX;
  const offer = (point, handle) => {
    const d = distance(toScreen(point), screen);
    if (d < least) { least = d; best = handle; }
  };
  for (const handle of handlesOf(app.doc)) {
    offer(handle.list.slice(handle.at, handle.at + 2), handle);
  }
  app.doc.scene.circles.forEach((circle, index) => {
    const center = centerOf(index);
    if (!circle.center && center) offer(center, {selection: {kind: 'circle', index}, center});
  });
  return best;
}

function saidAt(photo) {
  const reach = LINE_PX / view.scale, {scene, measure} = app.doc;
  for (const [p, pencil] of scene.pencils.entries()) {
    for (let s = 0; 4 * s < pencil.segments.length; ++s) {
      const near = segmentDistance(pencil.segments.slice(4 * s, 4 * s + 4), photo) < reach;
      if (near) return {kind: 'line', pencil: p, segment: s};
    }
  }
  for (const kind of ['x_axis', 'y_axis']) {
    if (scene.frame[kind] && segmentDistance(scene.frame[kind], photo) < reach) return {kind};
  }
  const lines = [['known', scene.known.length], ['measure', measure]];
  for (const [kind, list] of lines) {
    const index = list.findIndex(({points}) => segmentDistance(points, photo) < reach);
    if (index >= 0) return {kind, index};
  }
  const index = scene.circles.findIndex((circle) => {
    const ellipse = foundOf(app.detection, circle);
    if (ellipse && ellipse.center) return ellipseDistance(ellipse, photo) < reach;
    return (circle.contour || []).some((u, i, all) => i % 2 === 0 && distance([u, all[i + 1]], photo) < reach);
  });
  return index >= 0 ? {kind: 'circle', index} : null;
}

// A found thing: its rim, or for circles the inside of the smallest one about the point.
function foundAt(photo) {
  if (!app.detection) return null;
  const reach = LINE_PX / view.scale;
  let best = null, least = reach;
  for (const ellipse of app.detection.ellipses) {
    if (!ellipse.center || isEllipseSaid(app.doc, app.detection, ellipse.id)) continue;
    const d = ellipseDistance(ellipse, photo);
    if (d < least) { least = d; best = {kind: 'found-circle', id: ellipse.id}; }
  }
  app.detection.segments.forEach((segment, id) => {
    const d = segmentDistance(segment, photo);
    if (d < least) { least = d; best = {kind: 'found-line', id}; }
  });
  if (best) return best;
  const around = app.detection.ellipses
    .filter((e) => e.center && !isEllipseSaid(app.doc, app.detection, e.id) && isInside(e, photo))
    .sort((a, b) => a.axes[0] * a.axes[1] - b.axes[0] * b.axes[1]);
  return around.length ? {kind: 'found-circle', id: around[0].id} : null;
}

function isInside({center, axes, angle_rad: angle}, [u, v]) {
  const dx = u - center[0], dy = v - center[1];
  const x = dx * Math.cos(angle) + dy * Math.sin(angle), y = dy * Math.cos(angle) - dx * Math.sin(angle);
  return Math.hypot(x / axes[0], y / axes[1]) < 1;
}

// ---- What it does ----

function select(selection) {
  app.selection = selection;
  changed('view');
}

export function takeFound(found) {
  if (found.kind === 'found-circle') {
    change((doc) => {
      sayCircle(doc, app.detection, found.id);
      app.selection = {kind: 'circle', index: doc.scene.circles.length - 1};
    });
  } else {
    const points = app.detection.segments[found.id].slice(0, 4);
    app.loose = {points, snapped: points, group: app.detection.segments[found.id][4]};
    select(null);
  }
}

// A press on a handle: the first move makes it a change, which the whole drag is.
function dragHandle(handle) {
  select(handle.selection);
  const isCenter = handle.center !== undefined;
  return {
    isHandle: true,
    move(point) {
      if (!this.moved) remember();
      const circle = isCenter && app.doc.scene.circles[handle.selection.index];
      if (isCenter && !circle.center) circle.center = handle.center.slice();
      const list = isCenter ? circle.center : handle.list, at = isCenter ? 0 : handle.at;
      [list[at], list[at + 1]] = round(point);
      changed('doc');
    },
    end() { changed(this.moved ? 'doc' : 'view'); },  // From all points, and with the panel.
  };
}

// Whether a handle follows the pointer.
export const isDragging = () => Boolean(drag && drag.isHandle && drag.moved);

function drawLine(start) {
  return {
    move(point, event) {
      const points = round([...start, ...point]);
      const reach = SNAP_PX / view.scale, found = app.detection ? app.detection.segments : [];
      const isFree = app.tool !== 'line' || event.altKey;  // What is measured is as it was drawn.
      app.loose = {points, snapped: isFree ? null : snap(points, found, reach), drawing: true};
      changed('view');
    },
    end(point) {
      if (!this.moved) {
        const found = app.tool === 'line' ? foundAt(point) : null;
        app.loose = null;
        if (found) takeFound(found); else changed('view');
      } else if (app.loose) {
        const {points, snapped} = app.loose;
        if (snapped) Object.assign(app.loose, {points: snapped, drawn: points});
        app.loose.drawing = false;
        finishLine();
      }
    },
  };
}

// Measuring tools need no role; all else is asked for it (roles.js).
function finishLine() {
  const kind = app.tool, {points} = app.loose, sigma_px = handSigma(view.scale);
  if (kind === 'angle' && !pending) {
    pending = points;
    changed('view');
  } else if (['length', 'height', 'angle'].includes(kind)) {
    const all = kind === 'angle' ? [...pending, ...points] : points;
    pending = app.loose = null;
    change((doc) => {
      doc.measure.push({kind, points: all, sigma_px});
      app.selection = {kind: 'measure', index: doc.measure.length - 1};
    });
  } else {
    changed('view');
  }
}

// What was begun on one photo is nothing on the next one.
export function forgetDrag() {
  drag = pending = null;
  lens.hidden = true;
}

export function setTool(tool) {
  app.tool = tool;
  app.loose = pending = null;
  changed('view');
}

function setOrigin(point) {
  const near = app.doc.scene.circles.findIndex((_, index) => {
    const center = centerOf(index);
    return center && distance(toScreen(center), toScreen(point)) < HANDLE_PX;
  });
  change(({scene}) => {
    delete scene.frame.origin;
    delete scene.frame.origin_is_center;
    if (near >= 0) scene.frame.origin_is_center = scene.circles[near].id;
    else scene.frame.origin = round(point);
    app.selection = near >= 0 ? {kind: 'circle', index: near} : {kind: 'origin'};
  });
}

function pan(screen) {
  const from = {...view};
  return {
    free: true,
    move(_, event) {
      const [x, y] = screenOf(event);
      view.x = from.x + x - screen[0];
      view.y = from.y + y - screen[1];
      draw();
    },
    end(point) {
      if (!this.moved) select(null);
    },
  };
}

function press(screen, event) {
  const photo = toPhoto(screen);
  if (event.button === 1 || event.button === 2) return pan(screen);
  if (app.tool !== 'select' && app.tool !== 'origin') return drawLine(photo);
  if (app.tool === 'origin') return {move() {}, end: setOrigin};
  app.loose = null;
  const handle = handleAt(screen);
  if (handle) return dragHandle(handle);
  const said = saidAt(photo), found = foundAt(photo);
  if (said) return {move() {}, end: () => select(said)};
  if (found) return {move() {}, end: () => takeFound(found)};
  return pan(screen);
}

function showLens(screen) {
  const shown = app.photo && (app.tool !== 'select' || (drag && !drag.free));
  lens.hidden = !shown;
  if (!shown) return;
  lens.classList.toggle('left', screen[0] > canvas.clientWidth / 2 && screen[1] < canvas.clientHeight / 2);
  lensAt = toPhoto(screen);
  if (lensFrame) return;
  lensFrame = requestAnimationFrame(() => {
    lensFrame = 0;
    if (!lens.hidden) drawLens(lens, lensAt);
  });
}

// What was found, and what the detection takes it for.
function nameOf({kind, id}) {
  if (kind === 'found-circle') {
    const {plane} = app.detection.ellipses.find((e) => e.id === id);
    return `circle ${id}${plane ? `, plane ${plane}` : ''}`;
  }
  const pencil = app.detection.pencils.find((p) => p.id === app.detection.segments[id][4]);
  if (!pencil) return 'line';
  const along = pencil.along === 'free' ? '' : ` along ${pencil.along}`;
  return `line of group ${pencil.id}${along}${pencil.plane ? `, plane ${pencil.plane}` : ''}`;
}

function hover(screen) {
  const found = app.tool === 'select' || app.tool === 'line' ? foundAt(toPhoto(screen)) : null;
  const over = handleAt(screen) ? null : found;
  if (JSON.stringify(over) !== JSON.stringify(app.hover)) {
    app.hover = over;
    canvas.title = over ? nameOf(over) : '';
    draw();
  }
  canvas.style.cursor = app.tool !== 'select' ? 'crosshair'
    : handleAt(screen) ? 'move' : over || saidAt(toPhoto(screen)) ? 'pointer' : 'grab';
}

canvas.addEventListener('pointerdown', (event) => {
  if (!app.photo) return;
  canvas.focus();
  canvas.setPointerCapture(event.pointerId);
  const screen = screenOf(event);
  drag = press(screen, event);
  drag.start = screen;
  showLens(screen);
});
canvas.addEventListener('pointermove', (event) => {
  if (!app.photo) return;
  const screen = screenOf(event);
  if (drag && (drag.moved || distance(screen, drag.start) > 3)) {
    drag.move(toPhoto(screen), event);
    drag.moved = true;
  } else if (!drag) {
    hover(screen);
  }
  showLens(screen);
});
function release(event) {
  if (!drag) return;
  const ended = drag, screen = screenOf(event);
  drag = null;
  ended.end(toPhoto(screen), event);
  showLens(screen);
}
canvas.addEventListener('pointerup', release);
canvas.addEventListener('pointercancel', release);
canvas.addEventListener('pointerleave', () => { lens.hidden = !drag; });
canvas.addEventListener('contextmenu', (event) => event.preventDefault());
canvas.addEventListener('wheel', (event) => {
  event.preventDefault();
  zoom(Math.exp(-event.deltaY * 0.0015), screenOf(event));
  draw();
}, {passive: false});
