// SPDX-License-Identifier: Apache-2.0
// 3D view of object, virtual cloth, real cloth and marks, rotated by mouse, finger or keys. Faces are
// painted from far to near on a 2D canvas, so that it works without WebGL.

import {h} from './dom.js';
import {scaleOf, titleOf} from './pictures.js';

const BEHIND_MM = 3;  // cloth that touches is drawn over the object
const FIRST = {azimuth: -1.05, height: 0.5, zoom: 1};

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => { const n = Math.hypot(...a) || 1; return a.map(x => x / n); };

/// Quads of a grid of points in rows, omitting those with a missing corner.
function cells(rows, cols, point, make) {
  const quads = [];
  for (let row = 0; row + 1 < rows; ++row) for (let col = 0; col + 1 < cols; ++col) {
    const corners = [[row, col], [row + 1, col], [row + 1, col + 1], [row, col + 1]].map(([r, c]) => point(r, c));
    if (corners.every(Boolean)) quads.push(make(corners));
  }
  return quads;
}

/// Faces of a drape of report.json, grouped by the button that shows them.
function facesOf(drape) {
  const {shape} = drape, scale = scaleOf(drape), parts = {cloth: [], real: [], object: []};
  if (shape) {
    const at = (list, i) => list.slice(3 * i, 3 * i + 3);
    parts.cloth = cells(shape.rows, shape.cols, (r, c) => at(shape.cloth_mm, r * shape.cols + c), corners => ({corners, front: [232, 234, 238], back: [188, 180, 172], push: 0}));
    for (let q = 0; 12 * q < shape.object_mm.length; ++q)
      parts.object.push({corners: [0, 1, 2, 3].map(c => at(shape.object_mm, 4 * q + c)), front: [205, 170, 120], back: null, push: BEHIND_MM});
  }
  const marks = new Map(drape.marks.filter(mark => mark.real_mm).map(mark => [`${mark.row},${mark.col}`, mark]));
  const rows = 1 + Math.max(0, ...drape.marks.map(m => m.row)), cols = 1 + Math.max(0, ...drape.marks.map(m => m.col));
  parts.real = cells(rows, cols, (r, c) => marks.get(`${r},${c}`), corners => {
    const known = corners.every(mark => mark.distance_mm !== null);
    const colour = known ? scale.rgb(corners.reduce((sum, mark) => sum + mark.distance_mm / 4, 0)) : [127, 178, 229];
    return {corners: corners.map(mark => mark.real_mm), front: colour, back: colour, push: 0};
  });
  for (const [part, faces] of Object.entries(parts)) for (const face of faces) {
    face.part = part;
    face.middle = [0, 1, 2].map(k => (face.corners[0][k] + face.corners[1][k] + face.corners[2][k] + face.corners[3][k]) / 4);
    face.normal = unit(cross(minus(face.corners[2], face.corners[0]), minus(face.corners[3], face.corners[1])));
  }
  return {faces: Object.values(parts).flat(), marks: [...marks.values()]};
}

export function spaceView(drape) {
  const {faces, marks} = facesOf(drape), scale = scaleOf(drape);
  if (!faces.length && !marks.length) return null;
  const points = [...faces.flatMap(face => face.corners), ...marks.map(mark => mark.real_mm)];
  const low = [0, 1, 2].map(k => points.reduce((least, p) => Math.min(least, p[k]), Infinity)), high = [0, 1, 2].map(k => points.reduce((most, p) => Math.max(most, p[k]), -Infinity));
  const middle = low.map((x, k) => (x + high[k]) / 2), size = Math.hypot(...minus(high, low)) || 1;
  const shown = {cloth: true, real: true, object: true, marks: true, bands: false}, bands = drape.marks.filter(mark => mark.band_mm);
  let view = {...FIRST};
  const canvas = h('canvas', {width: 1000, height: 620, tabindex: 0, role: 'img',
    'aria-label': `Drape ${drape.label}: object, virtual cloth and real cloth; arrow keys turn, plus and minus zoom, 0 resets`});
  const output = h('output'), pen = canvas.getContext('2d');
  let place = () => [0, 0];
  function draw() {
    const ratio = Math.min(2, window.devicePixelRatio || 1), wide = canvas.width = 1000 * ratio, tall = canvas.height = 620 * ratio;
    const [ca, sa, ce, se] = [Math.cos(view.azimuth), Math.sin(view.azimuth), Math.cos(view.height), Math.sin(view.height)];
    const toward = [ca * ce, sa * ce, se], right = [-sa, ca, 0], up = cross(toward, right), zoom = 1.4 * tall * view.zoom / size;
    const light = unit([toward[0] + 0.3, toward[1] - 0.2, toward[2] + 0.6]);
    place = p => { const d = minus(p, middle); return [wide / 2 + zoom * dot(right, d), tall / 2 - zoom * dot(up, d)]; };
    const items = faces.filter(face => shown[face.part] && (face.back || dot(face.normal, toward) > 0)).map(face => ({face, near: dot(face.middle, toward) - face.push}));
    if (shown.marks) for (const mark of marks) items.push({mark, near: Math.max(dot(mark.real_mm, toward), dot(mark.virtual_mm ?? mark.real_mm, toward)) + 6});
    if (shown.bands) for (const mark of bands) items.push({band: mark, near: dot(mark.band_mm, toward) + 6});
    items.sort((a, b) => a.near - b.near);
    pen.fillStyle = '#f5f7f9';
    pen.fillRect(0, 0, wide, tall);
    pen.lineWidth = 0.8 * ratio;
    for (const {face, mark, band} of items) {
      pen.beginPath();
      if (band) {
        const inside = band.real_mm && Math.hypot(...minus(band.real_mm, band.band_mm)) <= band.band_radius_mm;
        pen.fillStyle = inside === false ? '#b3261e40' : '#4c78a840';
        pen.arc(...place(band.band_mm), zoom * band.band_radius_mm, 0, 7);
        pen.fill();
        continue;
      }
      if (face) {
        const side = dot(face.normal, toward) > 0, shade = 0.5 + 0.5 * Math.abs(dot(face.normal, light));
        pen.fillStyle = pen.strokeStyle = `rgb(${(side ? face.front : face.back).map(x => Math.round(x * shade)).join(' ')})`;
        face.corners.forEach((corner, i) => { const [x, y] = place(corner); i ? pen.lineTo(x, y) : pen.moveTo(x, y); });
        pen.closePath();
        pen.fill();
        pen.stroke();
        continue;
      }
      const [x, y] = place(mark.real_mm), [u, v] = place(mark.virtual_mm ?? mark.real_mm);
      pen.fillStyle = mark.distance_mm === null ? '#0b4a8f' : scale.colour(mark.distance_mm);
      for (const [colour, width] of [['#1d2733', 3.4], [pen.fillStyle, 2]]) {
        pen.beginPath();
        pen.strokeStyle = colour;
        pen.lineWidth = width * ratio;
        pen.moveTo(x, y);
        pen.lineTo(u, v);
        pen.stroke();
      }
      pen.beginPath();
      pen.arc(x, y, 4.5 * ratio, 0, 7);
      pen.fill();
      pen.lineWidth = 0.8 * ratio;
      pen.strokeStyle = '#1d2733';
      pen.stroke();
    }
    canvas.dataset.drawn = items.length;
  }
  const turn = (a, b) => { view.azimuth += a; view.height = Math.max(-1.55, Math.min(1.55, view.height + b)); draw(); };
  const zoom = factor => { view.zoom = Math.max(0.4, Math.min(8, view.zoom * factor)); draw(); };
  const keys = {
    ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
    '+': () => zoom(1.15), '-': () => zoom(1 / 1.15), '0': () => { view = {...FIRST}; draw(); },
  };
  canvas.addEventListener('keydown', event => { if (keys[event.key]) { keys[event.key](); event.preventDefault(); } });
  let last = null;
  canvas.addEventListener('pointerdown', event => { last = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { last = null; });
  function tell(event) {
    const edge = canvas.getBoundingClientRect(), x = (event.clientX - edge.left) / edge.width * canvas.width, y = (event.clientY - edge.top) / edge.height * canvas.height;
    const off = mark => { const [u, v] = place(mark.real_mm); return Math.hypot(u - x, v - y); };
    const nearest = shown.marks ? marks.reduce((best, mark) => (!best || off(mark) < off(best) ? mark : best), null) : null;
    output.textContent = nearest && off(nearest) < 20 ? titleOf(nearest) : '';
  }
  canvas.addEventListener('pointermove', event => {
    if (!last) return tell(event);
    turn((last[0] - event.clientX) * 0.008, (event.clientY - last[1]) * 0.008);
    last = [event.clientX, event.clientY];
  });
  // The wheel scrolls the page as usual; with Ctrl, or with two fingers, it zooms.
  canvas.addEventListener('wheel', event => {
    if (!event.ctrlKey) return;
    zoom(event.deltaY < 0 ? 1.1 : 1 / 1.1);
    event.preventDefault();
  }, {passive: false});
  const button = ([part, words]) => h('button', {type: 'button', 'data-key': part, 'aria-pressed': String(shown[part]), click: event => {
    shown[part] = !shown[part];
    event.currentTarget.setAttribute('aria-pressed', shown[part]);
    draw();
  }}, words);
  draw();
  return h('figure', {class: 'turn'}, canvas,
    h('div', {class: 'keys'}, [['cloth', 'virtual cloth'], ['real', 'real cloth'], ['object', 'object'], ['marks', 'marks'], ...(bands.length ? [['bands', '95 % bands']] : [])].map(button), output),
    h('figcaption', {}, 'Virtual cloth grey, real cloth between its marks in the colours of their distances. Drag or use the arrow keys to turn, + and - (or Ctrl and the wheel) to come nearer, 0 to begin again.', bands.length ? ' Bands: where 95 % of the ensemble’s drapes have each mark, red where the real one is outside.' : ''));
}
