// SPDX-License-Identifier: Apache-2.0
// Pictures of all cameras, with saturated pixels in red and the marks found by detect.
import {act, ask, cameraView, command, figure, h, markDrawings, table, takeButtons, verdict} from './dom.js';

let chosen = '';
let red = true, marks = true;
const shots = new Map();  // of each camera: the figure's parts, kept from one drawing to the next

export function nextSet(state) {
  return state.sets.find(set => !set.taken && set.takeable)?.name ?? '';
}

const LIVE = 'live';
let showsLive = false;

const STILL_S = 0.8;  // as for the poses that are taken by themselves

function stillWords(still_s) {
  if (still_s === undefined) return '';
  return still_s < STILL_S ? ', moving' : `, still for ${still_s.toFixed(1)} s`;
}

let marksOf = '';  // surface whose marks are drawn over live pictures

/// Sets whether the page shows live pictures, and the surface whose marks overlay them.
export function showLive(shows, surface = '') {
  showsLive = shows;
  marksOf = shows ? surface : '';
}

/// Draws the marks that detect finds in the live pictures shown.
async function drawMarks() {
  const surface = marksOf;
  const none = {cameras: {}, still_s: {}};
  const found = surface ? await ask('live-marks', {surface}).catch(() => none) : none;
  if (surface !== marksOf) return;
  for (const [name, shot] of shots) {
    const seen = marks ? found.cameras[name] : null;
    shot.over.replaceChildren(...markDrawings(seen));
    shot.counts.textContent = (seen ? `, ${seen.measured} of ${found.printed} marks, ${seen.tags} tags, ${found.printed - seen.measured} missing` : '') +
      stillWords(found.still_s[name]);
  }
  const still = document.getElementById('still');
  if (!still) return;
  const times = Object.values(found.still_s);
  still.textContent = times.length === 0 ? '' : Math.min(...times) < STILL_S
    ? `${Object.keys(found.still_s).filter(name => found.still_s[name] < STILL_S).join(', ')}: something moves.`
    : `Still for ${Math.min(...times).toFixed(1)} s in all pictures.`;
}
setInterval(drawMarks, 1000);

/// Loads a live picture if the server has a newer one; the next is requested after this one arrived.
export async function frame(camera) {
  const shot = shots.get(camera);
  if (!shot || !showsLive || shot.busy || !shot.img.isConnected) return;
  shot.busy = true;
  try {
    const response = await fetch(`api/live?${new URLSearchParams({camera, width: 640, red: red ? 1 : 0})}`);
    if (!response.ok) return;
    const before = shot.img.src;
    shot.img.src = URL.createObjectURL(await response.blob());
    const facts = JSON.parse(response.headers.get('X-Facts'));
    shot.words.textContent = `${camera}: ${liveWords(facts)}`;
    await shot.img.decode().catch(() => {});
    shot.count += 1;
    shot.at = Date.now();
    shot.img.dataset.count = shot.count;
    shot.img.dataset.delay = shot.at - facts.arrived_ns / 1e6;
    if (before.startsWith('blob:')) URL.revokeObjectURL(before);
  } finally {
    shot.busy = false;
  }
}

/// A setting as reported by the camera, and the value in cameras.toml if different.
function setting(facts, name, unit) {
  const raw = name === 'gain_db' ? facts.settings.gain_camera_units : undefined;
  const is = facts.settings[name] ?? raw;
  if (is === undefined) return '';
  if (raw !== undefined) unit = 'of the camera';
  const asked = facts.asked[name];
  return `, ${name.split('_')[0]} ${is} ${unit}${asked !== null && Number(is) !== asked ? ` (asked: ${asked})` : ''}`;
}

function liveWords(facts) {
  const focus = facts.dot_sigma_px === null ? 'no contrast' : `a dot's centre to ${facts.dot_sigma_px.toFixed(4)} px (predicted)`;
  return `${facts.saturated_percent.toFixed(3)} % saturated, ${focus}${setting(facts, 'exposure_us', 'us')}${setting(facts, 'gain_db', 'dB')}`;
}

const NO_PICTURE = 'No picture now. ';

/// Reports a camera without pictures for two seconds.
setInterval(() => {
  for (const shot of shots.values()) {
    const late = shot.at && Date.now() - shot.at > 2000;
    shot.img.classList.toggle('late', Boolean(late));
    const words = shot.words.textContent.replace(NO_PICTURE, '');
    shot.words.textContent = late ? NO_PICTURE + words : words;
  }
}, 500);

/// A field and its button, which are kept when the page is redrawn.
function lightField(camera, name, words) {
  const input = h('input', {type: 'number', min: 0, step: 'any', id: `${name}-${camera}`, size: 8});
  return h('span', {class: 'light'}, h('label', {for: input.id}, `${camera} ${words} `), input, ' ',
    h('button', {type: 'button', id: `set-${name}-${camera}`, click: () => act({do: 'light', camera, [name]: input.value === '' ? null : Number(input.value)})},
      `Set ${words.split(',')[0]} of ${camera}`));
}

/// Exposure and gain of every live camera; the resulting values are shown under its picture.
function lightFields(state) {
  return [h('h2', {}, 'Exposure and gain'), h('div', {class: 'acts'}, state.cameras.map(camera => {
    const shot = shots.get(camera.name);  // liveView() made it; a second view would take its picture
    shot.light ??= [lightField(camera.name, 'exposure_us', 'exposure, us'), lightField(camera.name, 'gain_db', 'gain, dB')];
    return shot.light;
  }).flat()), h('p', {}, 'They hold until the cameras are closed; cameras.toml has those of every session.')];
}

/// A picture with an overlay in sensor pixels.
export function liveView(camera, drawings = []) {
  if (!shots.has(camera.name)) {
    const img = h('img', {width: 640, height: Math.round(640 * camera.height_px / camera.width_px), alt: `${camera.name}, live`, id: `live-${camera.name}`});
    shots.set(camera.name, {img, words: h('span', {}, `${camera.name}: no picture yet`), counts: h('span', {id: `seen-${camera.name}`}),
      over: h('g'), busy: false, count: 0});
  }
  const shot = shots.get(camera.name);
  return h('figure', {}, h('div', {class: 'view'}, shot.img,
    h('svg', {viewBox: `0 0 ${camera.width_px} ${camera.height_px}`, 'aria-hidden': 'true'}, shot.over, drawings)),
  h('figcaption', {}, shot.words, shot.counts));
}

function captureWords(capture) {
  if (!capture) return [];
  return [h('p', {id: 'capture'}, capture.taking ? `Taking ${capture.taking}.` : capture.ready ? 'The cameras are ready.' : capture.runs ? 'The cameras are being opened.' : 'The cameras are closed.'),
    capture.runs
      ? h('button', {type: 'button', id: 'close', click: () => act({do: 'close'})}, 'Close the cameras')
      : [h('button', {type: 'button', class: 'main', id: 'open', click: () => act({do: 'open'})}, 'Open the cameras'), ' ',
        h('button', {type: 'button', id: 'doctor', click: () => act({do: 'doctor'})}, 'Ask the doctor')],
    h('ul', {class: 'log'}, capture.words.filter(line => !line.startsWith('next: ')).slice(-5).map(line => h('li', {}, line))),
    capture.doctor?.length ? table('what the doctor says', ['check', '', 'found', 'to do'], capture.doctor.map(one =>
      [one.check, h('td', {}, verdict(one.verdict)), one.found, one.to_do ?? ''])) : null].flat();
}

function tools(state, known, shown, next, redraw) {
  return [
    ...takeButtons('take', next ? `Take ${next}` : 'Every set is taken', !next || (state.capture && !state.capture.ready),
      () => { if (!state.capture) chosen = next; act({do: 'take', set: next}); }),
    h('label', {for: 'shown'}, 'Show '),
    h('select', {id: 'shown', change: event => { chosen = event.target.value; redraw(); }},
      known.map(name => h('option', {value: name, selected: name === shown}, name))),
    h('button', {type: 'button', id: 'red', 'aria-pressed': String(red), click: () => { red = !red; redraw(); }}, 'Saturation in red'),
    h('button', {type: 'button', id: 'marks', 'aria-pressed': String(marks), click: () => { marks = !marks; redraw(); }}, 'Marks'),
  ];
}

export async function draw(state, redraw) {
  const known = state.sets.filter(set => set.recorded).map(set => set.name);
  if (state.capture) known.unshift(LIVE);
  const shown = known.includes(chosen) ? chosen : state.capture ? LIVE : nextSet(state) || known[0];
  const set = state.sets.find(one => one.name === (shown === LIVE ? nextSet(state) : shown));
  showLive(shown === LIVE, set?.drape && !set.plate ? 'cloth' : 'target');
  const next = nextSet(state), words = captureWords(state.capture);
  const tool = [h('h1', {}, 'Cameras'), h('div', {class: 'acts'}, ...tools(state, known, shown, next, redraw))];
  if (showsLive) {
    return [...tool, h('div', {class: 'views'}, state.cameras.map(camera => liveView(camera))), ...words,
      ...state.capture.ready ? lightFields(state) : [],
      command(state.capture.command, state.capture.ready ? 'exposure_us 3000 cam0 (a line typed to it)' : '')];
  }
  const [facts, found] = await Promise.all([ask('frame', {set: shown}), ask('marks', {set: shown})]);
  const views = state.cameras.map(camera => {
    const fact = facts.cameras[camera.name] ?? {};
    const sigma = fact.sigma_px ? `, a dot's centre to ${fact.sigma_px.toFixed(4)} px` : '';
    return cameraView(camera, set, red, marks ? markDrawings(found.cameras[camera.name]) : [],
      `${camera.name}: ${(fact.saturated_percent ?? 0).toFixed(3)} % saturated${sigma}`);
  });
  const rows = (set?.detected?.cameras ?? []).map(one => [one.camera, figure(one.measured, 0), figure(one.missing, 0),
    figure(one.tags, 0), figure(one.sigma_px, 4),
    Object.entries(one.rejected).map(([reason, count]) => `${count} x ${reason}`).join('; ') || 'none']);
  return [...tool, ...words,
    state.replay ? h('p', {id: 'exposed'}, 'A recording is exposed already: exposure and gain are set with live cameras only.') : null,
    h('div', {class: 'views'}, views),
    set?.detected
      ? table('marks of the set', ['camera', 'measured', 'missing', 'tags', 'sigma of a dot, px', 'not used'], rows)
      : h('p', {}, set?.taken ? 'Its marks are being measured.' : 'Take the set, then its marks are measured.'),
    set?.sentence ? h('p', {}, `${set.verdict}: ${set.sentence}`) : null,
    command(state.jobs.filter(job => job.kind === 'detect').pop()?.commands[0]),
  ];
}
