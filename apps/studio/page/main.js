// Puts the parts together: opens photos, keeps the estimate up to date and the draft kept, keys.
import * as api from './api.js';
import {app, canRedo, canUndo, change, changed, docOfEntry, emptyDoc, entryOf, isSaid, isSaved, isShown,
        listen, redo, resetHistory, setSaved, undo} from './store.js';
import {dropSelected, sayAllFound, thinned} from './scene.js';
import {draw, fit, view, zoom} from './view.js';
import {forgetDrag, isDragging, setTool} from './pointer.js';
import {dropLoose, forgetGroup, showRoles} from './roles.js';
import {showPanel} from './panel.js';

const byId = (id) => document.getElementById(id);
const DRAFT_DELAY_MS = 400;
// Between two of the panel while a handle is dragged: it takes longer than the photo, where the eyes
// are. Its last state is shown when the handle is let go.
const PANEL_INTERVAL_MS = 250;
// Of a contour, while a handle is dragged: where the camera is guessed an estimate takes a core 24 ms
// from so many, 83 ms from 260 (circles-discocal-rgb). From all points when the handle is let go.
const DRAG_POINTS = 32;

const HINTS = {
  select: 'Click a circle or a line that was found to say that it counts · drag a circle’s centre to where it is · wheel zooms, dragging the photo moves it',
  line: 'Drag along a line (it snaps to one that was found; Alt: it does not), then drop it on x, y, z, an axis or a length',
  origin: 'Click where the world’s origin is; on a circle’s centre it becomes that centre',
  length: 'Drag from one end to the other, both on the plane',
  height: 'Drag from the foot, on the plane, to the top over it',
  angle: 'Drag along one line of the plane, then along another',
};

function toast(text, bad = false) {
  const element = byId('toast');
  element.textContent = text;
  element.className = bad ? 'bad' : '';
  element.hidden = false;
  clearTimeout(toast.timer);
  toast.timer = setTimeout(() => { element.hidden = true; }, bad ? 8000 : 3500);
}

// ---- The estimate follows what was said: one request at a time, the last one counts. ----

let asking = false, askAgain = false;

// The pose that was chosen may be gone with what was said since: then the most probable one counts.
async function estimateOf(request) {
  try {
    return await api.estimate(request);
  } catch (error) {
    if (!request.hypothesis) throw error;
    const estimate = await api.estimate({...request, hypothesis: 0});
    if (request.image === app.image) app.doc.hypothesis = 0;
    return estimate;
  }
}

async function askEstimate() {
  if (!app.photo) return;
  if (asking) { askAgain = true; return; }
  asking = true;
  const image = app.image, started = performance.now(), entry = entryOf(app.doc);
  const scene = isDragging() ? thinned(entry, DRAG_POINTS) : entry;
  try {
    const estimate = await estimateOf({image, scene, hypothesis: app.doc.hypothesis,
                                       measure: app.doc.measure});
    if (image === app.image) Object.assign(app, {estimate, estimateError: ''});
  } catch (error) {
    if (image === app.image) Object.assign(app, {estimate: null, estimateError: error.message});
  }
  app.milliseconds = performance.now() - started;
  ++app.answers;
  asking = false;
  app.firstPose = app.firstPose || performance.now();
  if (askAgain) { askAgain = false; askEstimate(); }
  changed('view');
}

// For tests: the state, and whether all that was said has been answered and kept.
Object.assign(window, {
  circlineApp: app, circlineView: view, circlineAnswers: () => app.answers,
  circlineIdle: () => !asking && !draftTimer && app.photo !== null && isShown(),
});

// ---- The draft ----

let draftTimer = 0, keeping = Promise.resolve();

function keepDraft(leaving = false) {
  if (!draftTimer) return;
  clearTimeout(draftTimer);
  draftTimer = 0;
  if (!app.photo) return;  // Its doc is not there yet.
  const {measure, hypothesis} = app.doc;
  // The scene file has what is saved, and another hand may change that.
  const state = !isSaved() ? app.doc : measure.length || hypothesis ? {measure, hypothesis} : null;
  keeping = api.draft(app.image, state, leaving)
    .catch((error) => toast(`The draft is not kept: ${error.message}`, true));
}

function draftSoon() {
  clearTimeout(draftTimer);
  draftTimer = setTimeout(keepDraft, DRAFT_DELAY_MS);
}

window.addEventListener('pagehide', () => keepDraft(true));

// ---- Photos ----

async function open(image) {
  keepDraft();
  Object.assign(app, {image, photo: null, detection: null, estimate: null, estimateError: '',
                      doc: emptyDoc(), selection: null, hover: null, loose: null});
  history.replaceState(null, '', `#${image}`);
  resetHistory();
  setSaved({});
  forgetDrag();
  forgetGroup();
  changed('view');
  try {
    // Not before the draft that was just sent, which may be of this photo.
    const [photo, session] = await Promise.all([api.photo(image), keeping.then(() => api.session(image))]);
    if (image !== app.image) return;
    const saved = session.saved ? docOfEntry(session.saved) : emptyDoc();
    app.doc = {...saved, ...session.draft};
    setSaved(entryOf(saved));
    app.images[image].draft = !isSaved();
    app.photo = photo;
    fit();
    changed('view');
    askEstimate();
    const detection = await api.detect(image);
    if (image === app.image) app.detection = detection;
  } catch (error) {
    if (image !== app.image) return;
    app.estimateError = error.message;
  }
  changed('view');
}

function step(by) {
  const image = app.image + by;
  if (image >= 0 && image < app.images.length) open(image);
}

const photoText = ({image, name, saved, draft}) =>
  `${draft ? '● ' : saved ? '✓ ' : ''}${name}  (${image + 1} of ${app.images.length})`;

function showPhotos() {
  const list = byId('photos');
  if (list.length !== app.images.length) {
    list.replaceChildren(...app.images.map((photo) => new Option(photoText(photo), photo.image)));
  }
  if (app.image < 0) return;
  list.options[app.image].text = photoText(app.images[app.image]);
  list.selectedIndex = app.image;
}

// ---- What is done by buttons and keys ----

async function save() {
  if (!app.photo || isSaved()) return;
  const {image} = app, entry = entryOf(app.doc);
  try {
    const {file} = await api.save(image, entry);
    const isOpen = image === app.image && app.photo;  // Another photo may be, by now.
    if (isOpen) {
      setSaved(entry);
      draftSoon();
    }
    app.images[image].saved = true;
    if (isOpen) app.images[image].draft = !isSaved();
    toast(`Saved in ${file}`);
  } catch (error) {
    toast(error.message, true);
  }
  changed('view');
}

async function exportAs(format) {
  try {
    const {files, note} = await api.exportPose({
      image: app.image, scene: entryOf(app.doc), hypothesis: app.doc.hypothesis,
      measure: app.doc.measure, format});
    toast(note || `Written: ${files.join(', ')}`, Boolean(note));
  } catch (error) {
    toast(error.message, true);
  }
}

function forget() {
  if (app.loose) { app.loose = null; changed('view'); return; }
  if (!app.selection || !app.selection.kind) return;
  const selection = app.selection;
  app.selection = null;
  change((doc) => dropSelected(doc, selection));
}

const TOOL_KEYS = {v: 'select', l: 'line', o: 'origin', m: 'length', h: 'height', a: 'angle'};
const ROLE_KEYS = {x: 'x', y: 'y', z: 'z', p: 'free'};

window.addEventListener('keydown', (event) => {
  const key = event.key.toLowerCase(), typing = ['INPUT', 'SELECT'].includes(event.target.tagName);
  if (event.ctrlKey || event.metaKey) {
    const work = {z: event.shiftKey ? redo : undo, y: redo, s: save}[key];
    if (work) { event.preventDefault(); work(); }
  } else if (typing || event.altKey) {
    return;
  } else if (app.loose && ROLE_KEYS[key]) {
    dropLoose(ROLE_KEYS[key], event.shiftKey);
  } else if (TOOL_KEYS[key]) {
    setTool(TOOL_KEYS[key]);
  } else if (key >= '1' && key <= '6') {
    const index = Number(key) - 1;
    if (app.estimate && index < app.estimate.hypotheses.length) change((doc) => { doc.hypothesis = index; });
  } else {
    const work = {delete: forget, backspace: forget, pageup: () => step(-1), pagedown: () => step(1),
                  escape: () => { app.loose = app.selection = null; setTool('select'); },
                  0: () => { fit(); draw(); }, '+': () => { zoom(1.25, center()); draw(); },
                  '-': () => { zoom(0.8, center()); draw(); }}[key];
    if (work) { event.preventDefault(); work(); }
  }
});

const center = () => [byId('photo').clientWidth / 2, byId('photo').clientHeight / 2];

byId('previous').onclick = () => step(-1);
byId('next').onclick = () => step(1);
byId('photos').onchange = (event) => { open(Number(event.target.value)); byId('photo').focus(); };
byId('undo').onclick = undo;
byId('redo').onclick = redo;
byId('save').onclick = save;
byId('fit').onclick = () => { fit(); draw(); };
byId('clear').onclick = () => change((doc) => { doc.scene = emptyDoc().scene; app.selection = null; });
byId('take-all').onclick = () => change((doc) => { sayAllFound(doc, app.detection); app.selection = null; });
byId('export').onchange = (event) => { exportAs(event.target.value); event.target.value = ''; };
for (const button of document.querySelectorAll('[data-tool]')) {
  button.onclick = () => setTool(button.dataset.tool);
}
new ResizeObserver(() => { fit(); draw(); showRoles(); }).observe(byId('photo'));

function showState() {
  byId('undo').disabled = !canUndo();
  byId('redo').disabled = !canRedo();
  byId('previous').disabled = app.image <= 0;
  byId('next').disabled = app.image >= app.images.length - 1;
  byId('take-all').disabled = !app.detection;
  byId('clear').disabled = !app.photo || (!isSaid(app.doc) && isSaved());
  byId('export').disabled = !app.estimate || !app.estimate.hypotheses.length;
  byId('save').disabled = !app.photo || isSaved();
  for (const button of document.querySelectorAll('[data-tool]')) {
    button.setAttribute('aria-pressed', button.dataset.tool === app.tool);
  }
  byId('hint').textContent = HINTS[app.tool];
  document.title = `${isSaved() ? '' : '● '}circline studio`;
}

let panelShown = 0;

listen(() => {
  if (app.doc.hypothesis && !isSaid(app.doc)) app.doc.hypothesis = 0;
  app.images[app.image].draft = !isSaved();
  draftSoon();
  askEstimate();
}, () => {
  showPhotos();
  showState();
  draw();
  showRoles();
  const now = performance.now();
  if (isDragging() && now - panelShown < PANEL_INTERVAL_MS) return;
  panelShown = now;
  showPanel();
});

async function start() {
  try {
    const {images, problem} = await api.images();
    app.images = images;
    if (problem) toast(`Not used, nor written: ${problem}`, true);
    const wanted = Number(location.hash.slice(1));
    await open(wanted < images.length ? wanted : 0);
  } catch (error) {
    toast(error.message, true);
  }
}

start();
