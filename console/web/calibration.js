// SPDX-License-Identifier: Apache-2.0
// Coverage of images and space, residuals, and the pose that would improve the calibration most.
import {act, ask, cameraView, command, figure, h, number, table, takeButtons, undoButton, verdict, withCode} from './dom.js';
import {liveView, showLive} from './cameras.js';

let ghost = true;

/// Draws points in space from above and from the side.
function projection(points, axes, words) {
  if (points.length === 0) return null;
  const values = axes.map(axis => points.map(point => point[axis]));
  const low = values.map(list => Math.min(...list)), high = values.map(list => Math.max(...list));
  const size = Math.max(high[0] - low[0], high[1] - low[1], 1);
  const box = `${low[0] - 0.05 * size} ${-high[1] - 0.05 * size} ${high[0] - low[0] + 0.1 * size} ${high[1] - low[1] + 0.1 * size}`;
  return h('figure', {}, h('svg', {viewBox: box, class: 'chart', role: 'img', 'aria-label': words},
    points.map(point => h('circle', {cx: point[axes[0]], cy: -point[axes[1]], r: 0.006 * size, fill: '#0b4a8f'}))),
    h('figcaption', {}, `${words}: x ${number(low[0], 0)} to ${number(high[0], 0)} mm, ${axes[1] === 1 ? 'y' : 'z'} ${number(low[1], 0)} to ${number(high[1], 0)} mm`));
}

function coachWords(coach) {
  if (coach.advice) return [h('p', {id: 'coach'}, coach.advice)];
  return [h('p', {id: 'coach'},
    `Predicted error of a measured point: ${number(coach.calibration_mm, 4)} mm from the calibration, ${number(coach.marks_mm, 4)} mm from the marks' own noise. `,
    coach.reached
      ? `Goal reached (a third of the marks' noise, ${number(coach.goal_mm, 4)} mm): more poses change a measured point by less than 5 %.`
      : `Goal: ${number(coach.goal_mm, 4)} mm, a third of the marks' noise.`),
  h('p', {}, coach.next
    ? `Next pose that helps most: target ${coach.next.words}, seen by ${coach.next.views.length} cameras: ${number(coach.calibration_mm, 4)} to ${number(coach.next.calibration_mm, 4)} mm. Its outline is dashed in the pictures.`
    : 'No further pose within the cameras\' view would help.')];
}

/// Numbers, rejected data, warnings and advice of a step's ending.
function endingLines(ending) {
  return [...Object.entries(ending.numbers ?? {}), ...[['rejected', 'rejected'], ['warning', 'warnings'], ['advice', 'advice']].flatMap(([word, kind]) =>
    (ending[kind] ?? []).map(line => [word, line]))].map(([name, value]) => `${name}: ${value}`);
}

function setRows(state, sets) {
  return sets.map(set => [set.name, set.z_mm === undefined ? 'free pose' : `stage, z = ${set.z_mm} mm`,
    (set.taken ? 'taken' : '') + (set.earlier.length ? `; superseded: ${set.earlier.join(', ')}` : ''), (set.detected?.cameras ?? []).map(one => `${one.camera} ${one.measured}`).join(', '),
    h('td', {class: 'number'}, set.held_out ? number(set.held_out.rms_mm, 4) : ''),
    h('td', {}, set.taken ? [
      h('button', {type: 'button', id: `again-${set.name}`, click: () => act({do: 'take', set: set.name})}, `Retake ${set.name}`), ' ', undoButton(state, set), ' ',
      h('button', {type: 'button', id: `drop-${set.name}`, click: () => act({do: 'drop', set: set.name})}, `Leave out ${set.name}`)] : '')]);
}

export async function draw(state, redraw) {
  const sets = state.sets.filter(set => set.drape === undefined);
  const taken = sets.filter(set => set.taken);
  const next = sets.find(set => !set.taken && set.takeable)?.name;
  const [coverage, coach] = await Promise.all([ask('coverage'), ask('coach')]);
  const shown = taken.length > 0 ? taken[taken.length - 1].name : next ?? sets[0]?.name;
  const calibration = state.calibration;
  const shownSet = sets.find(set => set.name === shown);
  const pictured = shownSet?.recorded;
  const live = Boolean(state.capture?.runs);
  showLive(live, 'target');
  const views = !pictured && !live ? [] : state.cameras.map(camera => {
    const points = coverage.cameras[camera.name] ?? [];
    const drawings = points.map(([x, y]) => h('circle', {cx: x, cy: y, r: 7, fill: '#19a5ff', 'fill-opacity': 0.55}));
    const outline = ghost ? coach.next?.views.find(view => view.camera === camera.name) : null;
    if (outline) drawings.push(h('polygon', {points: outline.outline_px.map(point => point.join(',')).join(' '), fill: 'none',
      stroke: '#ffb000', 'stroke-width': 6, 'stroke-dasharray': '24 14'}));
    return live ? liveView(camera, drawings) :
      cameraView(camera, shownSet, false, drawings, `${camera.name}: ${points.length} points of ${taken.length} sets`);
  });
  const busy = state.jobs.some(job => job.kind === 'calibrate' && ['running', 'waiting'].includes(job.state));
  return [
    h('h1', {}, 'Calibration'),
    h('div', {class: 'acts'},
      ...takeButtons('take-target', next ? `Take ${next}` : 'Every set is taken', !next, () => act({do: 'take', set: next})),
      state.capture ? h('button', {type: 'button', id: 'automatic', 'aria-pressed': String(state.capture.automatic), 'aria-keyshortcuts': 'a',
        disabled: !state.capture.ready && !state.capture.automatic, click: () => act({do: 'automatic', on: !state.capture.automatic})},
      h('kbd', {'aria-hidden': 'true'}, 'a'), 'Poses by themselves') : null,
      state.replay ? h('button', {type: 'button', id: 'take-all', disabled: !next, click: async () => {
        for (const set of sets.filter(one => !one.taken && one.takeable)) if (!await act({do: 'take', set: set.name})) break;
      }}, 'Take all') : null,
      h('button', {type: 'button', class: 'main', id: 'calibrate', disabled: taken.length < 3 || busy,
        click: () => act({do: 'calibrate'})}, `Calibrate with ${taken.length} sets`),
      h('button', {type: 'button', id: 'ghost', 'aria-pressed': String(ghost), click: () => { ghost = !ghost; redraw(); }}, 'Next pose')),
    h('div', {class: 'views'}, views),
    state.calibration_superseded ? h('p', {id: 'superseded'}, withCode(`The calibration is superseded: ${state.calibration_superseded}. Calibrate again.`)) : null,
    h('h2', {}, 'Coach'), ...coachWords(coach),
    calibration ? h('section', {id: 'calibration'},
      h('h2', {}, 'Residuals'),
      h('p', {}, verdict(calibration.verdict), `: ${calibration.sentence ?? ''}`),
      table('residuals', ['camera', 'points', 'RMS, px', 'largest, px', 'RMS in space, mm'], calibration.cameras.map(camera =>
        [camera.name, figure(camera.points, 0), figure(camera.rms_px, 4), figure(camera.max_px, 4), figure(camera.rms_mm, 4)])),
      h('ul', {}, endingLines(calibration).map(line => h('li', {}, line)))) : null,
    coverage.points_mm.length ? h('h2', {}, 'Covered space') : null,
    h('div', {class: 'views'}, [projection(coverage.points_mm, [0, 1], 'from above'), projection(coverage.points_mm, [0, 2], 'from the side')].filter(Boolean)),
    h('h2', {}, 'Sets'),
    table('sets of the calibration', ['set', 'target', '', 'points', 'held-out, mm', ''], setRows(state, sets)),
    h('p', {}, 'Held-out: the target measured in space by the calibration that did not know the set, against its drawing; root mean square.'),
    command(state.jobs.filter(job => job.kind === 'calibrate').pop()?.commands.slice(-1)[0]),
  ];
}
