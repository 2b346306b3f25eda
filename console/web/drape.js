// SPDX-License-Identifier: Apache-2.0
// One drape: its marks, its sheet in space, its simulations, the distance.
import {act, ask, cameraView, command, figure, h, markDrawings, number, table, takeButtons, verdict} from './dom.js';
import {liveView, showLive} from './cameras.js';
import {sheetView} from './sheet_view.js';

let chosen = '', laying = '';
const faces = new Map();  // of a set: what was typed and not taken yet

function resultWords(drape) {
  const result = drape.result;
  if (!result) return h('p', {}, drape.result_superseded ? `The comparison is superseded: ${drape.result_superseded}. Simulate and compare again.` : 'No simulation was compared yet.');
  return h('p', {id: 'result', class: 'result'}, `Mean distance real to virtual ${number(result.mean_dist_mm, 3)} mm, U (k = 2) ${number(result.expanded_uncertainty_mm, 3)} mm, ${result.discretisation}, ${result.segments} segments. Measurement `,
    verdict(result.measurement), ', match ', verdict(result.match), '.');
}

/// Of the objects, over a picture: as their plates show them, or dashed as the scene states them.
function outlineDrawings(outlines, camera) {
  return (outlines?.cameras[camera] ?? []).map(line => h('polyline', {points: line.map(point => point.join(',')).join(' '), fill: 'none',
    stroke: '#ff4fd8', 'stroke-width': 4, 'stroke-dasharray': outlines.measured ? null : '16 12'}));
}

function plateRows(state, drape) {
  return drape.plates.map(plate => {
    const set = state.sets.find(one => one.name === plate.set);
    return [`object ${plate.object}`, plate.set, plate.sentence ? h('td', {}, verdict(plate.verdict), `: ${plate.sentence}`) : set.taken ? 'taken' : 'put its plate of tags on it',
      h('td', {}, h('button', {type: 'button', id: `plate-${plate.object}`, disabled: !set.takeable, click: () => act({do: 'take', set: plate.set})},
        `${set.taken ? 'Retake' : 'Take'} ${plate.set}`))];
  });
}

function layingRows(state, drape) {
  return drape.layings.map(laying => {
    const set = state.sets.find(one => one.name === laying.set);
    return [laying.repeat, laying.set, laying.face || 'not stated', set.taken ? 'taken' : '',
      (set.detected?.cameras ?? []).map(one => `${one.camera} ${one.measured}`).join(', '), set.earlier.join(', ')];
  });
}

const LEAST_LAYINGS = 3;  // that a match rests on

function layingWords(state, drape) {
  const count = drape.layings.filter(one => state.sets.find(set => set.name === one.set).taken).length;
  return count >= LEAST_LAYINGS ? `The match rests on ${count} layings.`
    : `The match rests on ${count} of at least ${LEAST_LAYINGS} layings: take the cloth off, lay it on again, and take it as a further laying. State which face lies up.`;
}

export async function draw(state, redraw) {
  const names = state.drapes.map(drape => drape.name);
  if (names.length === 0) return [h('h1', {}, 'Drape'), h('p', {}, 'The rig has no drape.')];
  const name = names.includes(chosen) ? chosen : names[0];
  const drape = state.drapes.find(one => one.name === name);
  const layings = drape.layings.map(one => one.set);
  const open = layings.find(one => state.sets.some(set => set.name === one && !set.taken && set.takeable));
  const shown = layings.includes(laying) ? laying : open ?? drape.set;
  const set = state.sets.find(one => one.name === shown);
  const first = state.sets.find(one => one.name === drape.set);
  const face = faces.get(shown) ?? drape.layings.find(one => one.set === shown).face;
  const busy = kind => state.jobs.some(job => job.kind === kind && ['running', 'waiting'].includes(job.state));
  const [found, sheet] = await Promise.all([ask('marks', {set: shown}), ask('sheet', {drape: name})]);
  const done = drape.simulations.filter(one => one.there).length;
  const live = Boolean(state.capture?.runs) && !set.taken;
  showLive(live, 'cloth');
  const calibrated = state.calibration && state.calibration.verdict !== '';
  return [
    h('h1', {}, `Drape ${name}`),
    h('div', {class: 'acts'},
      h('label', {for: 'drape'}, 'Drape '),
      h('select', {id: 'drape', change: event => { chosen = event.target.value; laying = ''; redraw(); }},
        names.map(one => h('option', {value: one, selected: one === name}, one))),
      h('label', {for: 'laying'}, 'Laying '),
      h('select', {id: 'laying', change: event => { laying = event.target.value; redraw(); }},
        layings.map(one => h('option', {value: one, selected: one === shown}, one))),
      h('label', {for: 'face'}, 'Face up '),
      h('input', {id: 'face', value: face, maxlength: 80, size: 10, input: event => { faces.set(shown, event.target.value); }}),
      ...takeButtons('take-drape', set.taken ? `Retake ${shown}` : `Take ${shown}`, !set.takeable, () => {
        laying = shown;
        act({do: 'take', set: shown, face: faces.get(shown) ?? face});
      }),
      h('button', {type: 'button', id: 'lay', disabled: state.replay || !first.taken || Boolean(open), click: async () => {
        if (await act({do: 'lay', drape: name})) laying = '';
      }}, 'Lay it once more'),
      h('button', {type: 'button', class: 'main', id: 'measure', disabled: !first.taken || !calibrated || busy('measure'),
        click: () => act({do: 'measure', drape: name})}, 'Measure'),
      h('button', {type: 'button', class: 'main', id: 'run', disabled: !first.taken || !calibrated || busy('run'),
        click: () => act({do: 'run'})}, 'Simulate and compare'),
      state.report ? h('a', {class: 'main', id: 'report', href: 'report.html', target: '_blank', rel: 'noopener'}, state.report_superseded ? 'Report, superseded' : 'Report') : null),
    calibrated ? null : h('p', {}, state.calibration_superseded ? `Calibrate again: the calibration is superseded: ${state.calibration_superseded}.` : 'Calibrate first: a drape is measured with a calibration.'),
    live ? h('p', {id: 'still'}) : null,
    live ? h('div', {class: 'views'}, state.cameras.map(camera => liveView(camera, outlineDrawings(sheet.outlines, camera.name)))) : null,
    set.recorded && !live && h('div', {class: 'views'}, state.cameras.map(camera => {
      const count = set.detected?.cameras.find(one => one.camera === camera.name);
      return cameraView(camera, set, true, [...markDrawings(found.cameras[camera.name]), ...outlineDrawings(sheet.outlines, camera.name)],
        count ? `${camera.name}: ${count.measured} marks measured, ${count.missing} of ${set.detected.printed} missing, ${count.tags} tags` : camera.name);
    })),
    set.sentence ? h('p', {}, verdict(set.verdict), `: ${set.sentence}`) : null,
    Object.keys(sheet.outlines?.cameras ?? {}).length ? h('p', {}, sheet.outlines.measured ? 'Drawn over the pictures: the objects where their plates of tags show them.' : 'Dashed over the pictures: the objects where the scene states them.') : null,
    drape.plates.length ? table('objects by their plates of tags', ['object', 'set', 'place', ''], plateRows(state, drape)) : null,
    h('h2', {}, 'Layings'),
    h('p', {id: 'layings'}, layingWords(state, drape)),
    table('layings', ['laying', 'set', 'face up', '', 'marks', 'superseded'], layingRows(state, drape)),
    resultWords(drape),
    h('h2', {}, 'Measured sheet'),
    drape.sheet ? h('p', {id: 'sheet'}, verdict(drape.sheet.verdict), `: ${drape.sheet.sentence}`,
      drape.sheet.sd_mm ? `; a mark's place to ${number(drape.sheet.sd_mm, 4)} mm (standard deviation)` : '') : h('p', {id: 'unmeasured'}, drape.sheet_superseded ? `The measured sheet is superseded: ${drape.sheet_superseded}. Measure again.` : 'Not measured yet.'),
    sheet.marks.length ? await sheetView(sheet) : null,
    h('h2', {}, 'Simulations'),
    h('p', {}, `${done} of ${drape.simulations.length} are there.`),
    table('simulations', ['mesh', 'segments', ''], drape.simulations.map(one =>
      [`${one.spacing_mm} mm`, figure(one.segments, 0), one.there ? one.sentence || 'done' : '–'])),
    drape.stand_ins.length ? h('p', {}, `Values that nobody measured: ${drape.stand_ins.join(', ')}.`) : null,
    command(...['measure', 'run'].map(kind => state.jobs.filter(job => job.kind === kind).pop()?.commands.slice(-1)[0])),
  ];
}
