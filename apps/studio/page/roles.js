// The bar beside a line that was drawn: drop it on a direction, an axis, a known length.
import {app, change, changed} from './store.js';
import {DIRECTIONS, isLineSaid, lineSigma, sayLine} from './scene.js';
import {toScreen, view} from './view.js';

const bar = document.getElementById('roles'), canvas = document.getElementById('photo');
const WORDS = {x: ['x', 'A line along x (X)'], y: ['y', 'A line along y (Y)'],
               z: ['z', 'A line along z, out of the plane (Z)'],
               free: ['∥', 'A line parallel to others: of the same group as the last one (P)']};

let group = '';  // The free lines that the last one joined.
export function forgetGroup() { group = ''; }

// `begin`: a free line is the first of a new group.
export function dropLoose(role, begin = false) {
  const line = app.loose;
  if (!line) return;
  app.loose = null;
  if (DIRECTIONS.includes(role)) {
    const joined = role === 'free' && !begin ? line.group || group : '';
    change((doc) => {
      app.selection = sayLine(doc, line.points, role, lineSigma(line, view.scale), joined);
      if (role === 'free') group = doc.scene.pencils[app.selection.pencil].id;
    });
  } else {
    change(({scene}) => {
      scene.frame[role] = line.points;
      app.selection = {kind: role};
    });
  }
}

function dropLength(value) {
  const line = app.loose;
  app.loose = null;
  change(({scene}) => {
    scene.known.length.push({points: line.drawn || line.points, value});
    app.selection = {kind: 'known', index: scene.known.length.length - 1};
  });
}

// Of a found line: those of its group that are not said yet.
const restOfGroup = ({group: id}) =>
  id ? app.detection.segments.filter((s) => s[4] === id && !isLineSaid(app.doc, s)) : [];

// A found line stands for its whole group.
function dropGroup() {
  const line = app.loose, segments = restOfGroup(line);
  const of = app.detection.pencils.find((p) => p.id === line.group);
  app.loose = null;
  change((doc) => {
    let joined = line.group;
    for (const segment of segments) {
      app.selection = sayLine(doc, segment.slice(0, 4), of.along, lineSigma(line, view.scale), joined);
      joined = doc.scene.pencils[app.selection.pencil].id;
    }
  });
}

function button(text, title, work, className = '') {
  const element = document.createElement('button');
  Object.assign(element, {textContent: text, title, className});
  element.dataset.role = text;
  element.addEventListener('click', work);
  bar.append(element);
}

let shown = null;  // The line that the bar is of.

export function showRoles() {
  const wanted = app.loose && !app.loose.drawing && ['select', 'line'].includes(app.tool);
  bar.hidden = !wanted;
  if (wanted && shown !== app.loose) fillBar();
  shown = wanted ? app.loose : null;
  if (wanted) placeBar();
}

function fillBar() {
  bar.replaceChildren();
  for (const role of DIRECTIONS) {
    button(WORDS[role][0], WORDS[role][1], () => dropLoose(role), `role-${role}`);
  }
  if (group) button('∥ new', 'The first line of another parallel group (Shift+P)', () => dropLoose('free', true), 'role-free');
  button('X axis', 'The image of the X axis, in this sense', () => dropLoose('x_axis'), 'role-x');
  button('Y axis', 'The image of the Y axis, in this sense', () => dropLoose('y_axis'), 'role-y');
  const length = document.createElement('input');
  Object.assign(length, {type: 'number', step: 'any', min: '0', placeholder: 'length',
                         title: 'Its known length on the plane (Enter)'});
  length.addEventListener('keydown', (event) => {
    event.stopPropagation();
    if (event.key === 'Enter' && Number(length.value) > 0) dropLength(Number(length.value));
  });
  bar.append(length);
  const size = restOfGroup(app.loose).length;
  if (size > 1) button(`all ${size}`, 'This line and all that were found parallel to it', dropGroup);
  button('✕', 'Drop it (Esc)', () => { app.loose = null; changed('view'); });
}

function placeBar() {
  const [x0, y0, x1, y1] = app.loose.points, end = toScreen([Math.max(x0, x1), (y0 + y1) / 2]);
  bar.style.left = `${Math.max(8, Math.min(end[0] + 14, canvas.clientWidth - bar.offsetWidth - 8))}px`;
  bar.style.top = `${Math.max(8, Math.min(end[1] - 18, canvas.clientHeight - bar.offsetHeight - 8))}px`;
}
