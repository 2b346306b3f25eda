// SPDX-License-Identifier: Apache-2.0
// One drape: its marks, its sheet in space, its simulations, the distance.
import {act, ask, cameraView, command, figure, h, markDrawings, number, table, takeButtons, verdict} from './dom.js';
import {liveView, showLive} from './cameras.js';
import {sheetView} from './sheet_view.js';

let chosen = '';

function resultWords(drape) {
  const result = drape.result;
  if (!result) return h('p', {}, 'No simulation was compared yet.');
  return h('p', {id: 'result', class: 'result'}, `Mean distance real to virtual ${number(result.mean_dist_mm, 3)} mm, U (k = 2) ${number(result.expanded_uncertainty_mm, 3)} mm, ${result.grid_size}, ${result.segments} segments. Measurement `,
    verdict(result.measurement), ', match ', verdict(result.match), '.');
}

export async function draw(state, redraw) {
  const names = state.drapes.map(drape => drape.name);
  if (names.length === 0) return [h('h1', {}, 'Drape'), h('p', {}, 'The rig has no drape.')];
  const name = names.includes(chosen) ? chosen : names[0];
  const drape = state.drapes.find(one => one.name === name);
  const set = state.sets.find(one => one.name === drape.set);
  const busy = kind => state.jobs.some(job => job.kind === kind && ['running', 'waiting'].includes(job.state));
  const [found, sheet] = await Promise.all([ask('marks', {set: drape.set}), ask('sheet', {drape: name})]);
  const done = drape.simulations.filter(one => one.there).length;
  const live = Boolean(state.capture?.runs) && !set.taken;
  showLive(live, 'cloth');
  const calibrated = state.calibration && state.calibration.verdict !== '';
  return [
    h('h1', {}, `Drape ${name}`),
    h('div', {class: 'acts'},
      h('label', {for: 'drape'}, 'Drape '),
      h('select', {id: 'drape', change: event => { chosen = event.target.value; redraw(); }},
        names.map(one => h('option', {value: one, selected: one === name}, one))),
      ...takeButtons('take-drape', set.taken ? `Retake ${drape.set}` : `Take ${drape.set}`, !set.takeable, () => act({do: 'take', set: drape.set})),
      h('button', {type: 'button', class: 'main', id: 'measure', disabled: !set.taken || !calibrated || busy('measure'),
        click: () => act({do: 'measure', drape: name})}, 'Measure'),
      h('button', {type: 'button', class: 'main', id: 'run', disabled: !set.taken || !calibrated || busy('run'),
        click: () => act({do: 'run'})}, 'Simulate and compare'),
      state.report ? h('a', {class: 'main', id: 'report', href: 'report.html', target: '_blank', rel: 'noopener'}, 'Report') : null),
    calibrated ? null : h('p', {}, 'Calibrate first: a drape is measured with a calibration.'),
    live ? h('div', {class: 'views'}, state.cameras.map(camera => liveView(camera))) : null,
    set.recorded && !live && h('div', {class: 'views'}, state.cameras.map(camera => {
      const count = set.detected?.cameras.find(one => one.camera === camera.name);
      return cameraView(camera, drape.set, true, markDrawings(found.cameras[camera.name]),
        count ? `${camera.name}: ${count.measured} marks measured, ${count.missing} of ${set.detected.printed} missing, ${count.tags} tags` : camera.name);
    })),
    set.sentence ? h('p', {}, verdict(set.verdict), `: ${set.sentence}`) : null,
    resultWords(drape),
    h('h2', {}, 'Measured sheet'),
    drape.sheet ? h('p', {id: 'sheet'}, verdict(drape.sheet.verdict), `: ${drape.sheet.sentence}`,
      drape.sheet.sd_mm ? `; a mark's place to ${number(drape.sheet.sd_mm, 4)} mm (standard deviation)` : '') : h('p', {}, 'Not measured yet.'),
    sheet.marks.length ? await sheetView(sheet) : null,
    h('h2', {}, 'Simulations'),
    h('p', {}, `${done} of ${drape.simulations.length} are there.`),
    table('simulations', ['particles', 'segments', ''], drape.simulations.map(one =>
      [`${one.grid} x ${one.grid}`, figure(one.segments, 0), one.there ? one.sentence || 'done' : '–'])),
    drape.stand_ins.length ? h('p', {}, `Values that nobody measured: ${drape.stand_ins.join(', ')}.`) : null,
    command(...['measure', 'run'].map(kind => state.jobs.filter(job => job.kind === kind).pop()?.commands.slice(-1)[0])),
  ];
}
