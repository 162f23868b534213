// What can be said of a photo, as changes of a doc (store.js). Pixels are those of the photo.

// Standard deviation of the end of a line that was found, pixels: 0.20 on chessboards (README).
const FOUND_SIGMA_PX = 0.2;

export const DIRECTIONS = ['x', 'y', 'z', 'free'];

function freshId(list, stem) {
  const ids = new Set(list.map((item) => item.id));
  for (let i = 1; ; ++i) if (!ids.has(stem + i)) return stem + i;
}

// The entry with contours of fewer points, evenly chosen: what is enough to see where a pose goes.
export function thinned(entry, points) {
  if (!entry.circles) return entry;
  const thin = ({contour, ...rest}) => {
    if (!contour || contour.length <= 2 * points) return {contour, ...rest};
    const step = contour.length / 2 / points;
    const kept = Array.from({length: points}, (_, i) => 2 * Math.floor(i * step));
    return {contour: kept.flatMap((at) => contour.slice(at, at + 2)), ...rest};
  };
  return {...entry, circles: entry.circles.map(thin)};
}

// The sigma of a point that a person sets, pixels: about one pixel of the screen.
export const handSigma = (scale) => Math.max(0.3, Math.round(10 / scale) / 10);

// Whether a said contour is one that is found now: its length and ends tell.
function isSameContour(found, said) {
  const n = found.length;
  return Boolean(said) && n === said.length && n > 0 && [0, 1, n - 2, n - 1].every((i) => found[i] === said[i]);
}

// The ellipse found now that a said circle is, or undefined. Not by the id, which tells nothing of
// circles that were said when the detection or the file was another one.
export const foundOf = (detection, circle) => detection
  ? detection.ellipses.find(({id}) => isSameContour(detection.contours[id], circle.contour)) : undefined;

export function isEllipseSaid(doc, detection, id) {
  return doc.scene.circles.some(({contour}) => isSameContour(detection.contours[id], contour));
}

export function sayCircle(doc, detection, id) {
  const ellipse = detection.ellipses.find((e) => e.id === id), {circles} = doc.scene;
  const isTaken = circles.some((circle) => circle.id === id);
  const circle = {id: isTaken ? freshId(circles, `${id}_`) : id, contour: detection.contours[id]};
  if (detection.contour_sigma_px[id]) circle.sigma_px = detection.contour_sigma_px[id];
  if (ellipse.plane) circle.plane = ellipse.plane;
  if (ellipse.concentric) circle.concentric = ellipse.concentric;
  circles.push(circle);
}

// Whether a segment that was found is a line of some pencil; `segments` of one.
const isAmong = (segments, [x0, y0, x1, y1]) => {
  const is = (i, ...points) => points.every((value, k) => segments[i + k] === value);
  for (let i = 0; i < segments.length; i += 4) if (is(i, x0, y0, x1, y1) || is(i, x1, y1, x0, y0)) return true;
  return false;
};
export const isLineSaid = (doc, points) => doc.scene.pencils.some(({segments}) => isAmong(segments, points));

const directionOf = (pencil) => pencil.direction || 'free';

// The line joins those of its direction; free ones make a new group, unless one is named that is
// one of free lines still.
export function sayLine(doc, points, direction, sigmaPx, group = '') {
  const pencils = doc.scene.pencils;
  let pencil = pencils.find((p) => directionOf(p) === direction && (group ? p.id === group : direction !== 'free'));
  if (!pencil) {
    const stem = direction === 'free' ? 'lines' : direction, isFree = !pencils.some((p) => p.id === group);
    pencil = {id: group && isFree ? group : freshId(pencils, stem), segments: [], direction, sigma_px: 0};
    pencils.push(pencil);
  }
  pencil.segments.push(...points);
  pencil.sigma_px = Math.max(pencil.sigma_px || 0, sigmaPx);
  return {kind: 'line', pencil: pencils.indexOf(pencil), segment: pencil.segments.length / 4 - 1};
}

export const lineSigma = (line, scale) => line.snapped ? FOUND_SIGMA_PX : handSigma(scale);

export function dropLine(doc, pencil, segment) {
  const list = doc.scene.pencils;
  list[pencil].segments.splice(4 * segment, 4);
  if (!list[pencil].segments.length) dropPencil(doc, pencil);
}

export function dropPencil(doc, index) {
  doc.scene.pencils.splice(index, 1);
  dropDangling(doc);
}

export function dropCircle(doc, index) {
  doc.scene.circles.splice(index, 1);
  dropDangling(doc);
}

// What is said of a circle, lines or a plane that nothing names any longer: no scene may say that.
export function dropDangling(doc) {
  const {circles, pencils, frame, known, truth, solids} = doc.scene;
  const namesOf = (items, key) => new Set(items.map((item) => item[key]));
  const planes = namesOf([...circles, ...pencils], 'plane');
  const circleIds = namesOf(circles, 'id'), pencilIds = namesOf(pencils, 'id');
  if (frame.plane && !planes.has(frame.plane)) delete frame.plane;
  if (frame.origin_is_center && !circleIds.has(frame.origin_is_center)) delete frame.origin_is_center;
  for (const length of known.length) if (!planes.has(length.plane)) delete length.plane;
  if (known.angle_deg) {
    known.angle_deg = known.angle_deg.filter((angle) => angle.pencils.every((id) => pencilIds.has(id)));
  }
  if (truth && truth.directions) {
    truth.directions = truth.directions.filter((direction) => pencilIds.has(direction.pencil));
    if (!truth.directions.length) delete truth.directions;
  }
  if (solids) {
    const isThere = (id) => !id || circleIds.has(id);
    doc.scene.solids = solids.filter((solid) => isThere(solid.base) && isThere(solid.rim));
  }
}

export function planesOf(doc) {
  const {circles, pencils} = doc.scene;
  return [...new Set([...circles, ...pencils].map((item) => item.plane).filter(Boolean))].sort();
}

export function sayAllFound(doc, detection) {
  doc.scene.circles = [];
  doc.scene.pencils = [];
  for (const ellipse of detection.ellipses) {
    if (detection.contours[ellipse.id].length >= 10) sayCircle(doc, detection, ellipse.id);
  }
  for (const pencil of detection.pencils) {
    const segments = detection.segments.filter((s) => s[4] === pencil.id).flatMap((s) => s.slice(0, 4));
    if (segments.length < 4) continue;
    const said = {id: pencil.id, segments, direction: pencil.along, sigma_px: FOUND_SIGMA_PX};
    if (pencil.plane) said.plane = pencil.plane;
    doc.scene.pencils.push(said);
  }
  dropDangling(doc);
}

// Every point that can be dragged: {selection, list, at}: list[at], list[at + 1] are its pixels.
export function handlesOf(doc) {
  const {circles, pencils, frame, known} = doc.scene, handles = [];
  const add = (selection, list) => {
    for (let at = 0; list && at + 1 < list.length; at += 2) handles.push({selection, list, at});
  };
  circles.forEach((circle, index) => add({kind: 'circle', index}, circle.center));
  pencils.forEach((pencil, index) => {
    for (let at = 0; at < pencil.segments.length; at += 2) {
      handles.push({selection: {kind: 'line', pencil: index, segment: Math.floor(at / 4)},
                    list: pencil.segments, at});
    }
  });
  for (const key of ['origin', 'x_axis', 'y_axis']) add({kind: key}, frame[key]);
  known.length.forEach((length, index) => add({kind: 'known', index}, length.points));
  doc.measure.forEach((item, index) => add({kind: 'measure', index}, item.points));
  return handles;
}

export function dropSelected(doc, selection) {
  const {kind, index} = selection;
  if (kind === 'circle') dropCircle(doc, index);
  if (kind === 'line') dropLine(doc, selection.pencil, selection.segment);
  if (kind === 'known') doc.scene.known.length.splice(index, 1);
  if (kind === 'measure') doc.measure.splice(index, 1);
  if (['origin', 'x_axis', 'y_axis'].includes(kind)) delete doc.scene.frame[kind];
}

export const sameSelection = (a, b) => JSON.stringify(a) === JSON.stringify(b);
