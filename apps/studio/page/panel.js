// The panel beside the photo: the pose and its rivals, the camera, what was said, what was measured.
import {app, change, changed, isSaid, shownHypothesis, shownIndex} from './store.js';
import {dropCircle, dropPencil, dropSelected, dropDangling, planesOf, sameSelection} from './scene.js';
import {drawThumbnail, measureText, withSigma} from './view.js';
import {drawOrbit, watchOrbit} from './orbit.js';

const panel = document.getElementById('panel');

// An element with attributes, listeners (on...) and children; texts are never markup.
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith('on')) element.addEventListener(key.slice(2), value);
    else if (key in element && key !== 'list') element[key] = value;
    else element.setAttribute(key, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

const section = (title, ...children) => make('section', {}, make('h2', {}, title), ...children);
const row = (name, value, title = '') =>
  make('div', {className: 'row', title}, make('span', {}, name), make('b', {}, value));

// ---- The pose ----

function card(hypothesis, index) {
  const chosen = index === shownIndex();
  const small = make('canvas', {width: 300, height: 200});
  if (app.photo) drawThumbnail(small, app.estimate.drawings[index]);
  return make('button', {
    className: chosen ? 'card chosen' : 'card', title: 'Show this one (number keys)',
    'data-hypothesis': index, 'aria-pressed': chosen,
    onclick: () => change((doc) => { doc.hypothesis = index; }),
  }, small, make('span', {className: 'bar'}, make('meter', {value: hypothesis.probability})),
  make('b', {}, `${(100 * hypothesis.probability).toFixed(1)} %`),
  make('small', {}, `normal ± ${number(hypothesis.sigma_normal_deg, 2)}°`));
}

const number = (value, digits) =>
  value === null || value === undefined ? '–' : Number(value).toPrecision(digits);

function matrix(hypothesis) {
  const {rotation: r, translation: t} = hypothesis;
  const lines = [0, 1, 2].map((i) =>
    [...r.slice(3 * i, 3 * i + 3).map((v) => v.toFixed(4).padStart(7)), '',
     number(t[i], 5).padStart(8)].join(' '));
  return make('pre', {id: 'pose', title: 'R | t: X_camera = R X_world + t',
                      'data-rotation': JSON.stringify(r), 'data-translation': JSON.stringify(t),
                      'data-probability': hypothesis.probability}, lines.join('\n'));
}

function poseSection() {
  const {estimate} = app;
  if (app.estimateError) return section('Pose', make('p', {className: 'problem'}, app.estimateError));
  if (!estimate) return section('Pose', make('p', {className: 'quiet'}, 'looking …'));
  const from = isSaid(app.doc) ? 'from what was said' : 'from everything found';
  const time = make('small', {className: 'time', title: 'From the last change to this answer'},
                    `${from} · ${Math.round(app.milliseconds)} ms`);
  if (!estimate.hypotheses.length) {
    return section('Pose', time, make('p', {className: 'problem'}, estimate.message || estimate.status));
  }
  const shown = shownHypothesis();
  const cards = make('div', {className: 'cards'}, ...estimate.hypotheses.slice(0, 6).map(card));
  const sigma = shown.sigma_rotation_deg.every((s) => s !== null)
    ? shown.sigma_rotation_deg.map((s) => number(s, 2)).join(', ') + '°' : 'a rotation is free';
  const t = Math.hypot(...shown.translation);
  return section('Pose', time, cards, matrix(shown),
    row('rotation ±', sigma, 'Standard deviations about the camera’s x, y, z'),
    row('distance', shown.metric ? number(t, 6) : '1 d',
        'From the camera to the world’s origin: in the unit of the known radius or length, else d, the unit of what is measured'),
    row('residual', shown.rms_px === null ? '–' : `${number(shown.rms_px, 3)} px rms`),
    cameraRow(shown));
}

function cameraRow(shown) {
  const matrix = app.estimate.camera.camera_matrix;
  const focal = shown.focal_px || matrix[0], sigma = shown.focal_sigma_px;
  const fov = 2 * Math.atan(app.photo.width / 2 / focal) * 180 / Math.PI;
  return make('div', {className: 'row', id: 'focal'}, make('span', {}, 'focal length'),
    make('b', {}, `${sigma ? withSigma(focal, sigma) : focal.toFixed(1)} px`),
    make('small', {}, `${sigma ? 'from this photo' : 'as given'}, ${fov.toFixed(1)}° wide`));
}

// ---- What was said ----

const dropButton = (work) => make('button', {className: 'drop', title: 'Forget it', onclick: (event) => {
  event.stopPropagation();
  app.selection = null;
  change(work);
}}, '✕');

function item(selection, color, name, ...children) {
  const selected = app.selection && sameSelection(app.selection, selection);
  return make('li', {className: selected ? 'selected' : '', onclick: () => {
    app.selection = selection;
    changed('view');
  }}, make('i', {className: `dot ${color}`}), make('span', {className: 'name'}, name), ...children);
}

function field(value, placeholder, title, set) {
  return make('input', {type: 'number', step: 'any', min: '0', value: value || '', placeholder, title,
    onclick: (event) => event.stopPropagation(),
    onkeydown: (event) => {
      event.stopPropagation();
      if (event.key === 'Enter') event.target.blur();
    },
    onblur: () => changed('view'),
    onchange: (event) => {
      const typed = Number(event.target.value);
      change((doc) => set(doc, typed > 0 ? typed : undefined));
    }});
}

function setOrDrop(object, key, value) {
  if (value === undefined || value === '') delete object[key]; else object[key] = value;
}

function planeChoice(circle, index) {
  const planes = planesOf(app.doc);
  const fresh = `p${[...Array(99).keys()].find((i) => !planes.includes(`p${i}`))}`;
  const options = ['', ...planes, ...(planes.includes(fresh) ? [] : [fresh])].map((plane) =>
    make('option', {value: plane, selected: plane === (circle.plane || '')}, plane || 'own'));
  return make('select', {title: 'The plane that it shares with others; own: with none',
    onclick: (event) => event.stopPropagation(),
    onchange: (event) => change((doc) => {
      setOrDrop(doc.scene.circles[index], 'plane', event.target.value);
      dropDangling(doc);
    })}, ...options);
}

function circleItem(circle, index) {
  return item({kind: 'circle', index}, 'circle', circle.id,
    field(circle.radius, 'radius', 'Known radius, in any unit: makes lengths metric',
          ({scene}, value) => {
            setOrDrop(scene.circles[index], 'radius', value);
            if (!value) delete scene.circles[index].radius_sigma;
          }),
    planeChoice(circle, index),
    circle.center ? make('button', {className: 'drop', title: 'Forget its centre', onclick: (event) => {
      event.stopPropagation();
      change(({scene}) => delete scene.circles[index].center);
    }}, '+') : null,
    dropButton((doc) => dropCircle(doc, index)));
}

function pencilItem(pencil, index) {
  const count = pencil.segments.length / 4;
  const choice = make('select', {title: 'What these lines are along',
    onclick: (event) => event.stopPropagation(),
    onchange: (event) => change(({scene}) => { scene.pencils[index].direction = event.target.value; })},
    ...['x', 'y', 'z', 'free'].map((d) =>
      make('option', {value: d, selected: d === (pencil.direction || 'free')}, d === 'free' ? 'parallel' : `along ${d}`)));
  return item({kind: 'line', pencil: index, segment: 0}, pencil.direction || 'free',
    `${count} line${count > 1 ? 's' : ''}`, choice, dropButton((doc) => dropPencil(doc, index)));
}

function saidSection() {
  const {circles, pencils, frame, known} = app.doc.scene;
  const items = [...circles.map(circleItem), ...pencils.map(pencilItem)];
  for (const [key, name, color] of [['origin', 'origin', 'known'], ['x_axis', 'X axis', 'x'], ['y_axis', 'Y axis', 'y']]) {
    if (frame[key]) items.push(item({kind: key}, color, name, dropButton(({scene}) => delete scene.frame[key])));
  }
  if (frame.origin_is_center) {
    items.push(item({}, 'known', `origin: centre of ${frame.origin_is_center}`,
                    dropButton(({scene}) => delete scene.frame.origin_is_center)));
  }
  known.length.forEach((length, index) => {
    items.push(item({kind: 'known', index}, 'known', 'length',
      field(length.value, 'length', 'Its known length', ({scene}, value) => {
        if (value) scene.known.length[index].value = value;
      }), dropButton((doc) => dropSelected(doc, {kind: 'known', index}))));
  });
  const hint = make('p', {className: 'quiet'},
    'Nothing yet: the pose is from everything found. Click a circle or draw a line to say what counts.');
  return section('Said', items.length ? make('ul', {}, ...items) : hint);
}

function measureSection() {
  if (!app.doc.measure.length) return null;
  const items = app.doc.measure.map((asked, index) => {
    const found = app.estimate && app.estimate.measurements[index];
    return item({kind: 'measure', index}, 'measure', asked.kind,
                make('b', {className: 'measured'}, found ? measureText(found) : '…'),
                dropButton((doc) => dropSelected(doc, {kind: 'measure', index})));
  });
  return section('Measured', make('ul', {}, ...items));
}

function notesSection() {
  const notes = app.estimate ? [...app.estimate.notes] : [];
  const shown = shownHypothesis();
  if (shown && shown.left_out.length) notes.unshift(`left out, as it contradicts the rest: ${shown.left_out.join(', ')}`);
  return notes.length ? section('Notes', ...notes.map((note) => make('p', {className: 'note'}, note))) : null;
}

const orbit = make('canvas', {id: 'orbit', title: 'Drag to turn'});
watchOrbit(orbit);

export function showPanel() {
  // A field that is being typed in stays until it is left.
  if (panel.contains(document.activeElement) && document.activeElement.tagName === 'INPUT') return;
  const scrolled = panel.scrollTop;
  const parts = [poseSection(), saidSection(), measureSection(), section('From outside', orbit), notesSection()];
  panel.replaceChildren(...parts.filter(Boolean));
  panel.scrollTop = scrolled;
  drawOrbit(orbit);
}
