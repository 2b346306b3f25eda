// SPDX-License-Identifier: Apache-2.0
// Runs, two runs side by side, trends with their limits.
import {ask, command, h, number, table, verdict} from './dom.js';

let filter = '', sides = ['', ''], difference = null;

/// Values of one series in the order of the runs, with mean and three standard deviations of those
/// before the last.
function chart(series, rows) {
  const values = rows.map(row => row.value), last = rows[rows.length - 1];
  const limits = last.s_before === null || last.mean_before === null ? [] :
    [last.mean_before - 3 * last.s_before, last.mean_before, last.mean_before + 3 * last.s_before];
  const low = Math.min(...values, ...limits), high = Math.max(...values, ...limits);
  const span = high - low || Math.abs(high) || 1;
  const x = k => values.length === 1 ? 200 : 20 + 360 * k / (values.length - 1);
  const y = value => 105 - 90 * (value - low) / span;
  const words = `${series}: last ${number(last.value, 4)} ${last.unit}`;
  return h('figure', {}, h('svg', {viewBox: '0 0 400 120', class: 'chart', role: 'img', 'aria-label': words},
    limits.map((limit, k) => h('line', {x1: 0, x2: 400, y1: y(limit), y2: y(limit), stroke: k === 1 ? '#4b5560' : '#a15c00', 'stroke-dasharray': k === 1 ? '2 3' : '8 5'})),
    h('polyline', {points: values.map((value, k) => `${x(k)},${y(value)}`).join(' '), fill: 'none', stroke: '#0b4a8f', 'stroke-width': 2}),
    values.map((value, k) => h('circle', {cx: x(k), cy: y(value), r: 4, fill: rows[k].alarm ? '#8a1520' : '#0b4a8f'}))),
    h('figcaption', {}, words, last.alarm ? ` ${last.alarm}` : ''));
}

function bySeries(rows) {
  const all = new Map();
  for (const row of rows ?? []) all.set(row.series, [...all.get(row.series) ?? [], row]);
  return [...all];
}

function sqlTable(caption, rows) {
  const names = Object.keys(rows[0]);
  return table(caption, names, rows.map(row => names.map(name => name === 'verdict' ? h('td', {}, verdict(row[name])) : row[name] === null ? '–' : String(row[name]))));
}

export async function draw(state, redraw) {
  const data = await ask('history');
  const runs = Array.isArray(data.runs) ? data.runs : [];
  const shown = runs.filter(run => JSON.stringify(run).toLowerCase().includes(filter.toLowerCase()));
  const choice = k => h('select', {id: `side-${k}`, 'aria-label': k === 0 ? 'first run' : 'second run', change: event => { sides[k] = event.target.value; }},
    runs.map(run => h('option', {value: run.run, selected: String(run.run) === String(sides[k])}, `run ${run.run}`)));
  for (const k of [0, 1]) if (!sides[k] && runs.length) sides[k] = String(runs[k === 0 ? 0 : runs.length - 1].run);
  const acceptance = state.calibration?.sets ? `Calibration of this bench: ${state.calibration.verdict}, ${state.calibration.sentence}` : 'This bench is not calibrated yet.';
  return [
    h('h1', {}, 'History'),
    h('p', {}, acceptance),
    runs.length === 0 ? h('p', {id: 'runs'}, 'The store holds no run yet.') : null,
    h('div', {class: 'acts'}, h('label', {for: 'filter'}, 'Filter '),
      h('input', {id: 'filter', value: filter, input: event => { filter = event.target.value; redraw(); }})),
    runs.length ? table('runs', ['run', 'date', 'label', 'operator', 'measurement', 'drapes', 'cause'], shown.map(run =>
      [String(run.run), run.date, run.label, run.operator, verdict(run.measurement), run.drapes, run.cause])) : null,
    state.report ? h('p', {}, h('a', {href: 'report.html', target: '_blank', rel: 'noopener', id: 'report'}, 'Report of the last run')) : null,
    runs.length ? h('div', {class: 'acts'}, choice(0), choice(1), h('button', {type: 'button', id: 'diff', click: async () => {
      difference = await ask('diff', {a: Number(sides[0]), b: Number(sides[1])});
      redraw();
    }}, 'Side by side')) : null,
    ...(Array.isArray(difference) ? difference.filter(part => part.rows.length).map(part => [h('h2', {}, part.title),
      table(part.title, Object.keys(part.rows[0]), part.rows.map(row => Object.values(row).map(value => value === null ? '–' : String(value))))]).flat() : []),
    h('h2', {}, 'Calibration health'),
    Array.isArray(data.calibrations) && data.calibrations.length ? sqlTable('calibrations of the runs', data.calibrations) : h('p', {}, 'No run was stored yet.'),
    h('h2', {}, 'Acceptance'),
    Array.isArray(data.acceptances) && data.acceptances.length ? sqlTable('acceptances', data.acceptances)
      : h('p', {id: 'acceptance'}, 'The rig was never accepted: ', h('code', {}, 'drape calib accept'), ' measures lengths, flatness and noise against their limits, with uncertainty.'),
    h('h2', {}, 'Trends'),
    h('p', {}, 'Dashed: mean and three standard deviations of the values before the last, from the fifth on.'),
    h('div', {class: 'views'}, bySeries(data.trend).map(([series, rows]) => chart(series, rows))),
    command(`drape results runs --store ${data.store}`, `drape results trend --store ${data.store}`,
      ...data.commands ?? [],
      `drape results diff ${sides[0] || 1} ${sides[1] || 1} --store ${data.store}`),
  ];
}
