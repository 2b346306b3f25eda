// SPDX-License-Identifier: Apache-2.0
// Runs, two runs side by side, one chart per question.
import {ask, command, h, rounded, table, verdict} from './dom.js';

const COLOURS = ['#0b4a8f', '#a15c00', '#14632b', '#8a1520', '#6b3fa0', '#4b5560'];
let page = 1, sides = ['', ''], difference = null;

/// Draws the lines of one chart over the runs, with error bars of U, each labelled at its last point. With
/// a single run its values are printed instead.
function chart({question, unit, lines}) {
  const shown = lines.filter(line => line.points.some(point => typeof point.value === 'number'));
  if (!shown.length) return null;
  const last = line => line.points[line.points.length - 1];
  const say = line => `${line.label} ${rounded(last(line).value, last(line).u)} ${unit}${last(line).u ? `, U ${rounded(last(line).u, last(line).u)}` : ''}`;
  const long = Math.max(...shown.map(line => line.points.length));
  const words = h('p', {}, 'Last: ', shown.map(say).join('; '), '.');
  if (long < 2) return h('section', {}, h('h2', {}, question), words, h('p', {class: 'soft'}, 'One run so far: the chart begins with the second.'));
  const points = shown.flatMap(line => line.points);
  const low = Math.min(0, ...points.map(p => p.value - (p.u ?? 0))), high = Math.max(...points.map(p => p.value + (p.u ?? 0)));
  const x = (line, k) => 44 + 400 * (k + long - line.points.length) / (long - 1), y = value => 170 - 155 * (value - low) / (high - low || 1);
  let free = 1e9;
  const labels = shown.map((line, i) => ({line, i, at: y(last(line).value)})).sort((a, b) => b.at - a.at).map(one => {
    free = Math.min(one.at, free - 13);
    return h('text', {x: 452, y: free + 4, fill: COLOURS[one.i % COLOURS.length]}, one.line.label);
  });
  return h('section', {}, h('h2', {}, question), h('svg', {viewBox: '0 0 600 195', class: 'chart', role: 'img', 'aria-label': `${question} ${shown.map(say).join('; ')}`},
    [low, (low + high) / 2, high].map(value => [h('line', {x1: 44, x2: 444, y1: y(value), y2: y(value), stroke: '#dfe4ea'}),
      h('text', {x: 40, y: y(value) + 4, 'text-anchor': 'end'}, rounded(value, (high - low) / 20))]).flat(),
    shown.map((line, i) => h('g', {stroke: COLOURS[i % COLOURS.length], fill: COLOURS[i % COLOURS.length]},
      h('polyline', {points: line.points.map((point, k) => `${x(line, k)},${y(point.value)}`).join(' '), fill: 'none', 'stroke-width': 2}),
      line.points.map((point, k) => [point.u ? h('line', {x1: x(line, k), x2: x(line, k), y1: y(point.value - point.u), y2: y(point.value + point.u)}) : null,
        h('circle', {cx: x(line, k), cy: y(point.value), r: 3.5}, h('title', {}, `${line.label}: ${rounded(point.value, point.u)} ${unit} ${point.says ?? ''}`))]).flat().filter(Boolean))),
    labels, h('text', {x: 44, y: 190}, `${unit}; runs, the last at the right`)), words);
}

function runsTable(data, redraw) {
  const turn = (by, words, id) => h('button', {type: 'button', id, disabled: page + by < 1 || page + by > data.pages, click: () => { page += by; redraw(); }}, words);
  return [
    table('runs', ['run', 'date', 'label', 'operator', 'measurement', 'drapes', 'cause'], data.runs.map(run =>
      [String(run.run), run.date, run.label, run.operator, verdict(run.measurement), run.drapes, run.cause])),
    data.pages > 1 ? h('div', {class: 'acts'}, turn(-1, 'Newer', 'newer'), `page ${data.page} of ${data.pages}, ${data.total} runs`, turn(1, 'Older', 'older')) : null,
  ];
}

export async function draw(state, redraw) {
  const data = await ask('history', {page});
  page = data.page;
  if (!data.runs.length) return [h('h1', {}, 'History'), h('p', {id: 'runs'}, 'No run is stored yet: measure a drape, simulate and compare.')];
  for (const k of [0, 1]) sides[k] ||= String(data.runs[k === 0 ? data.runs.length - 1 : 0].run);
  const choice = k => h('input', {id: `side-${k}`, type: 'number', min: 1, value: sides[k], 'aria-label': k === 0 ? 'first run' : 'second run', input: event => { sides[k] = event.target.value; }});
  const accepted = Array.isArray(data.acceptances) && data.acceptances.length > 0;
  return [
    h('h1', {}, 'History'),
    h('div', {class: 'charts'}, data.charts.map(chart)),
    h('h2', {}, 'Is the rig accepted?'),
    accepted ? table('acceptances', ['date', 'verdict', 'valid until', 'positions', 'cause'], data.acceptances.map(one => [one.date, verdict(one.verdict), one.valid_until, String(one.positions ?? '–'), one.cause]))
      : h('p', {id: 'acceptance'}, 'The rig was never accepted: ', h('code', {}, 'drape calib accept'), ' measures lengths, flatness and noise against their limits, with uncertainty.'),
    h('h2', {}, 'Runs'),
    ...runsTable(data, redraw),
    h('div', {class: 'acts'}, 'Runs ', choice(0), choice(1), h('button', {type: 'button', id: 'diff', click: async () => {
      difference = await ask('diff', {a: Number(sides[0]), b: Number(sides[1])});
      redraw();
    }}, 'Side by side')),
    ...(Array.isArray(difference) ? difference.filter(part => part.rows.length).map(part => [h('h2', {}, part.title),
      table(part.title, Object.keys(part.rows[0]), part.rows.map(row => Object.values(row).map(value => value === null ? '–' : String(value))))]).flat() : []),
    command(`drape results runs --store ${data.store}`, `drape results trend --by fabric --store ${data.store}`, `drape results diff ${sides[0]} ${sides[1]} --store ${data.store}`),
  ];
}
