// What was said of the photo, and how it came about. `doc` is what undo, redo and the draft keep:
//   scene: the image's entry of a scene file (docs/scene_files.md), without file and camera
//   measure: [{kind: length | height | angle, points, sigma_px}], questions, which no scene holds
//   hypothesis: which pose is shown
// All else of `app` is of the moment.

export const app = {
  images: [], image: -1, photo: null, detection: null, estimate: null, estimateError: '',
  doc: emptyDoc(), selection: null, hover: null, tool: 'select',
  loose: null,  // A line that has no role yet: {points, snapped: the found one that it lies along,
                // drawn: as it was drawn, where it then became that one}.
  milliseconds: 0,  // From the last question to its answer.
  answers: 0, firstPose: 0,
};

export function emptyDoc() {
  return {scene: {circles: [], pencils: [], frame: {}, known: {length: []}}, measure: [],
          hypothesis: 0};
}

// A scene's entry as a doc: what it may leave out is there, and empty.
export function docOfEntry(entry) {
  const doc = emptyDoc();
  const {file, camera, ...scene} = entry;
  Object.assign(doc.scene, scene);
  doc.scene.known = {length: [], ...(scene.known || {})};
  return doc;
}

// The entry of a doc: without what is empty.
export function entryOf(doc) {
  const entry = {};
  for (const [key, value] of Object.entries(doc.scene)) {
    if (key === 'known') {
      const known = Object.fromEntries(Object.entries(value).filter(([, list]) => list.length));
      if (Object.keys(known).length) entry.known = known;
    } else if (Object.keys(value).length) {
      entry[key] = value;
    }
  }
  return entry;
}

export const isSaid = (doc) => doc.scene.circles.length + doc.scene.pencils.length > 0;

let savedText = '{}', saved = true;  // The entry of the scene file; whether the doc is that.
export const isSaved = () => saved;
export function setSaved(entry) {
  savedText = JSON.stringify(entry);
  saved = savedText === JSON.stringify(entryOf(app.doc));
}

// What is to be done at once where something was said, and what is to be shown before the next
// frame, however much has changed until then.
let onDoc = () => {}, onFrame = () => {}, frame = 0;
export function listen(doc, show) {
  onDoc = doc;
  onFrame = show;
}

export const isShown = () => !frame;

// `what`: 'doc' where something was said, 'view' for all else.
export function changed(what) {
  if (what === 'doc') {
    saved = savedText === JSON.stringify(entryOf(app.doc));
    onDoc();
  }
  if (!frame) frame = requestAnimationFrame(() => { frame = 0; onFrame(); });
}

let undone = [], done = [];

export function resetHistory() {
  undone = [];
  done = [];
}

// The hypothesis that is shown: its index, itself and its drawing. None: undefined.
export const shownIndex = () =>
  Math.min(app.doc.hypothesis, app.estimate ? app.estimate.hypotheses.length - 1 : 0);
export const shownHypothesis = () => app.estimate ? app.estimate.hypotheses[shownIndex()] : undefined;
export const shownDrawing = () => app.estimate ? app.estimate.drawings[shownIndex()] : undefined;

// Remembers the doc as it is; before a change, or a drag of many.
export function remember() {
  done.push(JSON.stringify(app.doc));
  if (done.length > 500) done.shift();
  undone = [];
}

// Nothing is said of a photo before what was said of it is there.
export function change(mutate) {
  if (!app.photo) return;
  remember();
  mutate(app.doc);
  changed('doc');
}

function step(from, to) {
  if (!from.length) return;
  to.push(JSON.stringify(app.doc));
  app.doc = JSON.parse(from.pop());
  app.selection = app.loose = null;
  changed('doc');
}

export const undo = () => step(done, undone);
export const redo = () => step(undone, done);
export const canUndo = () => done.length > 0;
export const canRedo = () => undone.length > 0;
