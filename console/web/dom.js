// SPDX-License-Identifier: Apache-2.0
// Requests, keys and pictures of the pages; elements and numbers are those of the report's page.

export {h, withCode} from './page/dom.js';
export {figure as rounded} from './page/figure.js';
import {h} from './page/dom.js';

async function answer(response) {
  const body = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(body.error || `the server answers ${response.status}`);
  return body;
}

export async function ask(route, query = {}) {
  return answer(await fetch(`api/${route}?${new URLSearchParams(query)}`));
}

export async function act(what) {
  const trouble = document.getElementById('trouble');
  try {
    await answer(await fetch('api/do', {
      method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify(what),
    }));
    trouble.textContent = '';
    return true;
  } catch (error) {
    trouble.textContent = error.message;
    return false;
  }
}

/// Plays tones for an operator occupied with the cloth; browsers allow them after the first key or click.
export function tone(...pitches) {
  if (!navigator.userActivation?.hasBeenActive) return;
  const audio = new AudioContext();
  pitches.forEach((pitch, k) => {
    const note = audio.createOscillator();
    note.frequency.value = pitch;
    note.connect(audio.destination);
    note.start(audio.currentTime + 0.2 * k);
    note.stop(audio.currentTime + 0.2 * k + 0.12);
    if (k + 1 === pitches.length) note.addEventListener('ended', () => audio.close());
  });
}

const SOON_S = 5;
let countdown = null;

/// Takes the offered set after a delay in which the operator can return to the cloth; a second press cancels it.
export function takeSoon() {
  const banner = document.getElementById('banner');
  const stop = () => {
    clearInterval(countdown);
    countdown = null;
  };
  banner.className = '';
  banner.textContent = '';
  if (countdown) return stop();
  let left = SOON_S;
  const tick = () => {
    banner.textContent = left ? `in ${left}` : '';
    left -= 1;
    if (left >= 0) return tone(440);
    stop();
    document.querySelector('#main .take')?.click();
  };
  countdown = setInterval(tick, 1000);
  tick();
}

/// The button that takes a set, and the one that takes it after a delay.
export function takeButtons(id, words, off, click, main = true) {
  return [h('button', {type: 'button', class: main ? 'main take' : 'take', id, disabled: off, 'aria-keyshortcuts': 't', click},
    h('kbd', {'aria-hidden': 'true'}, 't'), words),
  h('button', {type: 'button', id: `${id}-soon`, disabled: off, 'aria-keyshortcuts': 's', click: takeSoon},
    h('kbd', {'aria-hidden': 'true'}, 's'), `In ${SOON_S} s`)];
}

/// Formats a number with a given number of decimals, or a dash.
export function number(value, digits = 2) {
  return typeof value === 'number' ? value.toFixed(digits) : '–';
}

export function table(caption, header, rows) {
  return h('div', {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': caption},
    h('table', {}, h('thead', {}, h('tr', {}, header.map(cell => (cell ? h('th', {scope: 'col'}, cell) : h('td'))))),
      h('tbody', {}, rows.map(row => h('tr', {}, row.map(cell =>
        cell instanceof Node && cell.tagName === 'TD' ? cell : h('td', {}, cell ?? '–')))))));
}

export function figure(value, digits) {
  return h('td', {class: 'number'}, number(value, digits));
}

export function verdict(word) {
  return h('span', {class: (word || '').replace(/[^A-Za-z-]/g, '')}, word || '–');
}

/// Undoes a retake; only possible live, since the capture holds the recording.
export function undoButton(state, set) {
  return set.earlier.length && state.capture?.ready ? h('button', {type: 'button', id: `undo-${set.name}`, click: () => act({do: 'undo', set: set.name})}, `Undo the retake of ${set.name}`) : null;
}

export function command(...lines) {
  return h('div', {class: 'command'}, 'The same as a command: ',
    lines.filter(line => line).map((line, k) => [k > 0 ? h('br') : null, h('code', {}, line)]).flat());
}

const views = new Map();

/// A camera's picture with an overlay. The picture's element is kept when the page is
/// redrawn, so that it is loaded once per take.
export function cameraView(camera, set, red, drawings, caption, place = '') {
  const key = `${place} ${camera.name} ${set.name} ${set.pictures} ${red}`;
  if (!views.has(key)) {
    // The address includes the content, since a browser does not request a known address again.
    const query = new URLSearchParams({camera: camera.name, set: set.name, width: 640, red: red ? 1 : 0, pictures: set.pictures});
    views.set(key, h('img', {src: `api/picture?${query}`, width: 640,
      height: Math.round(640 * camera.height_px / camera.width_px), alt: `${camera.name}, set ${set.name}`}));
    if (views.size > 120) views.delete(views.keys().next().value);
  }
  return h('figure', {}, h('div', {class: 'view'}, views.get(key),
    h('svg', {viewBox: `0 0 ${camera.width_px} ${camera.height_px}`, 'aria-hidden': 'true'}, drawings)),
    h('figcaption', {}, caption));
}

/// Draws ellipses for measured marks, and crosses for rejected candidates.
export function markDrawings(found) {
  if (!found) return [];
  const marks = found.marks.map(([x, y, a, b, angle]) => h('ellipse', {cx: x, cy: y, rx: Math.max(a, 6),
    ry: Math.max(b, 6), transform: `rotate(${angle} ${x} ${y})`, fill: 'none', stroke: '#19d25a', 'stroke-width': 3}));
  const missed = found.rejected.map(([x, y, reason]) => h('g', {stroke: '#ff5a3c', 'stroke-width': 3},
    h('title', {}, reason), h('line', {x1: x - 9, y1: y - 9, x2: x + 9, y2: y + 9}),
    h('line', {x1: x - 9, y1: y + 9, x2: x + 9, y2: y - 9})));
  return [...marks, ...missed];
}
