// SPDX-License-Identifier: Apache-2.0
// Overview of the bench: cameras, calibration and drapes, each with its next action.
import {act, ask, cameraView, h, number, verdict, withCode} from './dom.js';
import {bestView, card as reportCard} from './page/card.js';
import {liveView, showLive} from './cameras.js';

/// The next action, as a button if the page can perform it.
function nextStep(id, next, busy) {
  if (!next) return null;
  return h('p', {class: 'next'}, next.action
    ? h('button', {type: 'button', class: 'main', id, disabled: busy, click: () => act(next.action)}, next.words) : h('strong', {}, next.words),
  next.why ? withCode(` ${next.why}`) : null);
}

/// Progress of a drape: taken, measured, simulated, reported; each done, not done, or superseded.
function stages(drape) {
  const word = (name, done, superseded) => h('li', {class: superseded ? 'old' : done ? 'done' : null},
    `${name}${superseded ? ', superseded' : done ? '' : ': not yet'}`);
  return h('ul', {class: 'stages'}, word('taken', drape.taken), word('measured', drape.sheet, drape.sheet_superseded),
    word('simulated', drape.simulations.every(one => one.there), drape.simulations.some(one => one.superseded)),
    word('reported', drape.result, drape.result_superseded));
}

let report = null, reportOf = '';

/// The last report, asked for once for each content.
export async function lastReport(state) {
  if (reportOf !== state.report_stamp) report = state.report_stamp ? await ask('report').catch(() => null) : null;
  reportOf = state.report_stamp;
  return report;
}

/// Address of the picture that its card shows.
export function pictureOf(state, drape, reported) {
  const view = bestView(reported), set = state.sets.find(one => one.name === drape.set);
  return view ? `api/picture?${new URLSearchParams({set: drape.set, camera: view.camera, width: 1280, red: 0, pictures: set.pictures})}` : '';
}

export function reportLink(state) {
  return state.report ? h('a', {id: 'report', href: `../${state.report_token}/report.html`, target: '_blank', rel: 'noopener'}, state.report_superseded ? 'Report of the last run, superseded in part' : 'Report') : null;
}

/// Shows the drape from the last report if that used the current pictures, else its progress.
function card(state, drape, found, busy) {
  const set = state.sets.find(one => one.name === drape.set), link = `#drape/${encodeURIComponent(drape.name)}`;
  const next = nextStep(`next-${drape.name}`, drape.next, busy), reported = drape.result && found?.drapes.find(one => one.name === drape.name);
  if (reported) {
    const shown = reportCard(reported, pictureOf(state, drape, reported), link);
    if (next) shown.lastElementChild.append(next);
    return shown;
  }
  const why = drape.sheet_superseded ?? drape.result_superseded;
  return h('article', {class: 'card undone', id: `card-${drape.name}`},
    set.recorded && drape.taken ? h('a', {class: 'picture', href: link}, cameraView(state.cameras[0], set, false, [], '')) : null,
    h('div', {class: 'words'},
      h('h2', {}, h('span', {class: 'name'}, drape.name), h('span', {class: 'match'}, drape.sheet ? 'Measured' : drape.taken ? 'Taken' : 'Not taken')),
      h('p', {class: 'about'}, `fabric ${drape.fabric}`), drape.sheet ? h('p', {class: 'number'}, `${drape.sheet.marks} `, h('small', {}, 'marks measured')) : null,
      stages(drape), why ? h('p', {class: 'why'}, withCode(`Superseded: ${why}.`)) : null, next));
}

function calibrationWords(calibration) {
  if (!calibration) return null;
  const worst = Math.max(...calibration.cameras.map(one => one.rms_mm));
  return h('p', {}, verdict(calibration.verdict), `: ${calibration.sets.length} sets, residual in space up to ${number(worst, 3)} mm (RMS of a camera)`);
}

export async function draw(state) {
  const busy = state.jobs.some(job => ['running', 'waiting'].includes(job.state));
  const live = Boolean(state.capture?.runs), shown = state.sets.filter(set => set.recorded && set.taken).pop() ?? state.sets.find(set => set.recorded);
  showLive(live, '');
  const runs = state.drapes.filter(drape => drape.sheet && !drape.result), found = await lastReport(state);
  return [
    h('h1', {}, state.rig),
    h('div', {class: 'cards'}, state.drapes.map(drape => card(state, drape, found, busy))),
    runs.length > 1 ? h('p', {}, h('button', {type: 'button', id: 'run-all', disabled: busy, click: () => act({do: 'run'})}, 'Simulate and compare all')) : null,
    state.report ? h('p', {}, reportLink(state)) : null,
    h('h2', {}, h('a', {href: '#calibration'}, 'Calibration')),
    calibrationWords(state.calibration) ?? (state.calibration_superseded ? null : h('p', {}, 'The cameras are not calibrated yet.')),
    nextStep('next-calibration', state.next, busy),
    h('h2', {}, h('a', {href: '#cameras'}, 'Cameras')),
    h('div', {class: 'views small'}, live ? state.cameras.map(camera => liveView(camera))
      : shown ? state.cameras.map(camera => cameraView(camera, shown, false, [], camera.name, 'row')) : null),
    h('p', {}, state.replay ? `A recording of ${state.sets.filter(set => set.recorded).length} sets.` : live ? 'The cameras are open.' : 'The cameras are closed.'),
  ];
}
