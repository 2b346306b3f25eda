// SPDX-License-Identifier: Apache-2.0
// The history of a store: one chart per series, with the band predicted by the earlier values.

import {roundStep} from './colour.js';
import {h, tableOf} from './dom.js';
import {figure} from './figure.js';

/// `series`: {name, unit, points: [{at, label, value, low, high, alarm}]}; two points or more.
export function trendChart(series) {
  const all = series.points.flatMap(point => [point.value, point.low ?? point.value, point.high ?? point.value]);
  const least = Math.min(...all), most = Math.max(...all), step = roundStep(Math.max(most - least, 1e-3) / 4), low = step * Math.floor(least / step), high = Math.max(step * Math.ceil(most / step), low + step);
  const n = series.points.length, px = i => 60 + 430 * (i + 0.5) / n, py = y => 150 - 130 * (y - low) / (high - low), ticks = [];
  for (let y = low; y <= high + 1e-9; y += step) ticks.push(y);
  return h('figure', {}, h('svg', {viewBox: '0 0 500 180', role: 'img', 'aria-label': series.name, class: 'chart'},
    ticks.map(y => [h('line', {x1: 60, x2: 490, y1: py(y), y2: py(y), stroke: '#dfe4ea'}), h('text', {x: 54, y: py(y) + 4, 'text-anchor': 'end'}, figure(y, step))]),
    series.points.map((p, i) => (p.low === null ? null : h('rect', {x: px(i) - 172 / n, y: py(p.high), width: 344 / n, height: Math.max(1, py(p.low) - py(p.high)), fill: '#dbe6f1'}))),
    h('polyline', {points: series.points.map((p, i) => `${px(i)},${py(p.value)}`).join(' '), fill: 'none', stroke: '#0072b2'}),
    series.points.map((p, i) => h('g', {}, h('title', {}, `${p.label}: ${figure(p.value, p.high === null ? null : (p.high - p.low) / 2)} ${series.unit}`),
      h('circle', {cx: px(i), cy: py(p.value), r: p.alarm ? 5 : 3, fill: p.alarm ? '#a3231c' : '#0072b2'}), p.alarm ? h('text', {x: px(i), y: py(p.value) - 9, 'text-anchor': 'middle', fill: '#a3231c'}, 'alarm') : null)),
    h('text', {x: 275, y: 172, 'text-anchor': 'middle', class: 'axis'}, 'runs, in order')), h('figcaption', {}, `${series.name} (${series.unit})`));
}

export function showHistory(root, history) {
  const charts = history.series.filter(series => series.points.length > 1).map(trendChart);
  root.replaceChildren(h('header', {class: history.go ? 'go' : 'stop'}, h('h1', {}, 'History of the bench'), h('span', {}, history.sentence), h('span', {class: 'state'}, history.go ? 'GO' : 'NO-GO')),
    h('main', {}, h('h2', {}, 'Trends'), h('p', {class: 'soft'}, history.note), charts.length ? h('div', {class: 'columns'}, charts) : h('p', {}, 'No series has two values yet.'),
      history.tables.filter(table => table.rows.length).map(tableOf)));
}
