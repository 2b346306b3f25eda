// SPDX-License-Identifier: Apache-2.0
// One drape: its marks, its sheet in space, its simulations, the distance.
import {act, ask, cameraView, command, figure, h, markDrawings, rounded, table, takeButtons, undoButton, verdict, withCode} from './dom.js';
import {liveView, showLive} from './cameras.js';
import {lastReport, pictureOf, reportLink} from './bench.js';
import {card} from './page/card.js';
import {histogram, legend, markMap} from './page/pictures.js';
import {spaceView} from './page/space.js';

let chosen = '', laying = '', seen = '';
const faces = new Map();  // of a set: what was typed and not taken yet

/// Draws outlines of the objects over a picture, as measured by their plates, or dashed as stated in the scene.
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
      (set.detected?.cameras ?? []).map(one => `${one.camera} ${one.measured}`).join(', '), h('td', {}, set.earlier.join(', '), ' ', undoButton(state, set))];
  });
}

const LEAST_LAYINGS = 3;  // that a match rests on

function layingWords(state, drape) {
  const count = drape.layings.filter(one => state.sets.find(set => set.name === one.set).taken).length;
  return count >= LEAST_LAYINGS ? `The match rests on ${count} layings.`
    : `The match rests on ${count} of at least ${LEAST_LAYINGS} layings: take the cloth off, lay it on again, and take it as a further laying. State which face lies up.`;
}

let kept = {text: '', view: null};

/// The same view in space while what it shows is the same, so that it stays as it was turned.
function space(drape) {
  const text = JSON.stringify(drape);
  if (kept.text !== text) kept = {text, view: drape.marks.length ? spaceView(drape) : null};
  const canvas = kept.view?.querySelector('canvas');
  if (canvas) canvas.id = 'sheet-view';
  return kept.view;
}

export async function draw(state, redraw) {
  const names = state.drapes.map(drape => drape.name);
  if (names.length === 0) return [h('h1', {}, 'Drape'), h('p', {}, 'The rig has no drape.')];
  const [, linked] = location.hash.split('/');
  if (linked && linked !== seen) chosen = decodeURIComponent(linked);
  seen = linked;
  const name = names.includes(chosen) ? chosen : names[0];
  const drape = state.drapes.find(one => one.name === name);
  const layings = drape.layings.map(one => one.set);
  const open = layings.find(one => state.sets.some(set => set.name === one && !set.taken && set.takeable));
  const shown = layings.includes(laying) ? laying : open ?? drape.set;
  const set = state.sets.find(one => one.name === shown);
  const first = state.sets.find(one => one.name === drape.set);
  const face = faces.get(shown) ?? drape.layings.find(one => one.set === shown).face;
  const busy = kind => state.jobs.some(job => job.kind === kind && ['running', 'waiting'].includes(job.state));
  const [found, sheet, report] = await Promise.all([ask('marks', {set: shown}), ask('sheet', {drape: name}), lastReport(state)]);
  const reported = drape.result ? report?.drapes.find(one => one.name === name) : null;
  const live = Boolean(state.capture?.runs) && !set.taken;
  showLive(live, 'cloth');
  const why = state.calibration_superseded ?? drape.sheet_superseded ?? drape.result_superseded;
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
      }, !first.taken),
      h('button', {type: 'button', id: 'lay', disabled: state.replay || !first.taken || Boolean(open), click: async () => {
        if (await act({do: 'lay', drape: name})) laying = '';
      }}, 'Lay it once more'),
      h('button', {type: 'button', class: drape.sheet ? null : 'main', id: 'measure', disabled: !first.taken || !calibrated || busy('measure'),
        click: () => act({do: 'measure', drape: name})}, 'Measure'),
      h('button', {type: 'button', class: drape.sheet && !drape.result ? 'main' : null, id: 'run', disabled: !first.taken || !calibrated || busy('simulate'),
        click: () => act({do: 'run', drape: name})}, 'Simulate and compare'),
      reportLink(state)),
    drape.next ? h('p', {id: 'next'}, h('strong', {}, drape.next.words), drape.next.why ? ` ${drape.next.why}` : '') : null,
    why ? h('p', {id: 'superseded'}, withCode(`Superseded: ${why}.`)) : null,
    reported ? h('div', {class: 'cards one', id: 'result'}, card(reported, pictureOf(state, drape, reported), `#drape/${encodeURIComponent(name)}`)) : null,
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
    drape.sheet ? [h('h2', {}, 'Measured sheet'), h('p', {id: 'sheet'}, verdict(drape.sheet.verdict), `: ${drape.sheet.sentence}`,
      drape.sheet.sd_mm ? `; a mark's place to ${rounded(drape.sheet.sd_mm, drape.sheet.sd_mm)} mm (standard deviation)` : ''),
    space(reported ?? sheet), reported ? [legend(reported), h('div', {class: 'views'}, markMap(reported), histogram(reported))] : null].flat() : null,
    h('h2', {}, 'Layings'),
    h('p', {id: 'layings'}, layingWords(state, drape)),
    table('layings', ['laying', 'set', 'face up', '', 'marks', 'superseded'], layingRows(state, drape)),
    h('h2', {}, 'Simulations'),
    table('simulations', ['mesh', 'segments', ''], drape.simulations.map(one =>
      [`${one.spacing_mm} mm`, figure(one.segments, 0), one.there ? one.sentence || 'done' : one.superseded ? 'superseded' : 'not yet'])),
    drape.stand_ins.length ? h('p', {}, `Values that nobody measured: ${drape.stand_ins.join(', ')}.`) : null,
    command(...['measure', 'simulate'].map(kind => state.jobs.filter(job => job.kind === kind).pop()?.commands.slice(-1)[0])),
  ].flat();
}
