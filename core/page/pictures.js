// SPDX-License-Identifier: Apache-2.0
// Pictures of a drape: photographs with real and virtual cloth, map of its marks, charts.

import {colourScale, roundStep} from './colour.js';
import {h} from './dom.js';
import {figure} from './figure.js';

const tick = value => String(Number(value.toPrecision(6)));
const key = mark => `${mark.row},${mark.col}`;

export function scaleOf(drape) {
  return colourScale(drape.distance?.max_mm ?? 1);
}

/// Describes a mark in words.
export function titleOf(mark) {
  const u = mark.sigma_distance_mm ? 2 * mark.sigma_distance_mm : null;
  return `row ${mark.row}, col ${mark.col}: ${mark.distance_mm === null ? mark.gap || 'no distance' : `${figure(mark.distance_mm, u)} mm from the simulation`}`;
}

/// Draws the photograph with measured marks coloured by distance, the lines of the virtual cloth,
/// faint where its back is seen, and a line from each mark to its virtual position.
export function photograph(drape, view, source, attributes = {}) {
  const [left, top, right, bottom] = view.crop_px, unit = (right - left) / 1000;
  const scale = scaleOf(drape), marks = new Map(drape.marks.map(mark => [key(mark), mark]));
  const path = lines => lines.map(line => `M${line.join(' ')}`).join('');
  const lines = (all, opacity) => h('path', {d: path(all), fill: 'none', stroke: '#ff5fa2', 'stroke-opacity': opacity, 'stroke-width': 1.6 * unit, 'stroke-linejoin': 'round'});
  const dots = view.marks.map(([row, col, u, v, x, y]) => {
    const mark = marks.get(`${row},${col}`), measured = mark && mark.distance_mm !== null;
    const colour = measured ? scale.colour(mark.distance_mm) : 'none';
    return [measured && x !== undefined ? [['#fff', 4.4], [colour, 2.8]].map(([stroke, width]) =>
      h('line', {x1: u, y1: v, x2: x, y2: y, stroke, 'stroke-width': width * unit, 'stroke-linecap': 'round'})) : null,
    h('circle', {cx: u, cy: v, r: 6.5 * unit, fill: colour, stroke: '#fff', 'stroke-width': 1.8 * unit}, mark ? h('title', {}, titleOf(mark)) : null)];
  });
  return h('svg', {viewBox: `${left} ${top} ${right - left} ${bottom - top}`, role: 'img', preserveAspectRatio: 'xMidYMid slice',
    'aria-label': `Drape ${drape.label} in camera ${view.camera}: measured marks, virtual cloth in pink, lines between them`, ...attributes},
  source ? h('image', {href: source, x: -0.5, y: -0.5, width: view.width_px, height: view.height_px, preserveAspectRatio: 'none'})
    : h('rect', {x: left, y: top, width: right - left, height: bottom - top, fill: '#7b828b'}),
  lines(view.back, 0.28), lines(view.front, 0.95), dots);
}

/// Draws the colour scale of the distances.
export function legend(drape) {
  const {top, step, colour} = scaleOf(drape), at = [];
  for (let value = 0; value <= top * (1 + 1e-9); value += step) at.push(value);
  return h('svg', {viewBox: '0 0 320 30', class: 'legend', role: 'img', 'aria-label': `colours from 0 to ${top} mm`},
    [...Array(64).keys()].map(i => h('rect', {x: 10 + 300 * i / 64, y: 2, width: 5, height: 9, fill: colour(top * (i + 0.5) / 64)})),
    at.map(value => h('text', {x: 10 + 300 * value / top, y: 25, 'text-anchor': 'middle'}, `${tick(value)}${value === 0 ? ' mm' : ''}`)));
}

/// Draws the flat patch, printed side up: one tile per mark with its distance in mm, dashed for a gap.
export function markMap(drape) {
  const scale = scaleOf(drape), rows = 1 + Math.max(...drape.marks.map(m => m.row)), cols = 1 + Math.max(...drape.marks.map(m => m.col));
  const side = 440 / Math.max(rows, cols);
  return h('svg', {viewBox: `0 0 ${50 + side * cols} ${34 + side * rows}`, role: 'img', 'aria-label': `Drape ${drape.label}: distance of each mark`},
    h('text', {x: 40, y: 12, class: 'axis'}, 'col, along the weft →'), h('text', {x: 12, y: 34, class: 'axis', transform: 'rotate(90 12 34)'}, 'row, along the warp →'),
    drape.marks.map(mark => {
      const x = 40 + side * mark.col, y = 26 + side * mark.row, known = mark.distance_mm !== null;
      return h('g', {}, h('title', {}, titleOf(mark)),
        h('rect', {x, y, width: side - 2, height: side - 2, rx: 3, ...(known ? {fill: scale.colour(mark.distance_mm)} : mark.real_mm ? {fill: '#7fb2e5'} : {fill: '#f4f5f7', stroke: '#9aa3ad', 'stroke-dasharray': '3 3'})}),
        known ? h('text', {x: x + side / 2 - 1, y: y + side / 2 + 3, 'text-anchor': 'middle', 'font-size': 0.3 * side, fill: scale.isDark(mark.distance_mm) ? '#fff' : '#111'}, mark.distance_mm.toFixed(1)) : null);
    }));
}

/// Draws bars over an axis from 0, with `series` of {label, colour, values: [[x, y], ...]} side by side.
function bars(label, xLabel, yLabel, series, width, lines = []) {
  const xs = series.flatMap(one => one.values.map(([x]) => x)), low = Math.min(...xs) - width / 2, high = Math.max(...xs) + width / 2;
  const most = Math.max(...series.flatMap(one => one.values.map(([, y]) => y)), 1e-9), step = roundStep(most / 4), top = step * Math.ceil(most / step - 1e-9);
  const px = x => 50 + 440 * (x - low) / (high - low), py = y => 190 - 160 * y / top, bar = 0.9 * width / series.length;
  const ticks = [], xStep = roundStep((high - low) / 8);
  for (let y = 0; y <= top * (1 + 1e-9); y += step) ticks.push(y);
  const marks = [];
  for (let x = Math.ceil(low / xStep) * xStep; x <= high + 1e-9; x += xStep) marks.push(x);
  return h('svg', {viewBox: '0 0 500 235', role: 'img', 'aria-label': label, class: 'chart'},
    ticks.map(y => [h('line', {x1: 50, x2: 490, y1: py(y), y2: py(y), stroke: '#dfe4ea'}), h('text', {x: 44, y: py(y) + 4, 'text-anchor': 'end'}, tick(y))]),
    marks.map(x => h('text', {x: px(x), y: 206, 'text-anchor': 'middle'}, tick(x))),
    series.map((one, i) => one.values.map(([x, y]) => h('rect', {x: px(x - 0.45 * width + bar * i), y: py(y), width: Math.max(0.5, px(bar) - px(0)), height: 190 - py(y), fill: one.colour(x)},
      h('title', {}, `${one.label}: ${tick(x)}: ${tick(y)}`)))),
    lines.map(([x, text], i) => [h('line', {x1: px(x), x2: px(x), y1: 12 + 14 * i, y2: 190, stroke: '#8c1d18', 'stroke-dasharray': '5 3'}),
      h('text', {x: px(x) + (px(x) > 340 ? -4 : 4), y: 20 + 14 * i, 'text-anchor': px(x) > 340 ? 'end' : 'start', fill: '#8c1d18'}, text)]),
    h('text', {x: 270, y: 228, 'text-anchor': 'middle', class: 'axis'}, xLabel), h('text', {x: 4, y: 12, class: 'axis'}, yLabel));
}

export function histogram(drape) {
  const d = drape.distance, width = roundStep((d.max_mm > 1e-6 ? d.max_mm : 1) / 12), counts = Array(Math.floor(d.max_mm / width) + 1).fill(0);
  for (const mark of drape.marks) if (mark.distance_mm !== null) ++counts[Math.min(counts.length - 1, Math.floor(mark.distance_mm / width))];
  const u = drape.budget?.expanded_mm;
  return bars(`Drape ${drape.label}: histogram of distances`, 'distance real to virtual (mm)', 'marks',
    [{label: 'marks', colour: x => scaleOf(drape).colour(x), values: counts.map((count, i) => [width * (i + 0.5), count])}], width,
    [[d.median_mm, `median ${figure(d.median_mm, u)}`], [d.mean_mm, `mean ${figure(d.mean_mm, u)}`], [d.p95_mm, `95 % below ${figure(d.p95_mm, u)}`]]);
}

/// Draws the hem spectra of the measured sheet and of the virtual sheet that represents the drape.
export function hemChart(drape) {
  const table = drape.tables.find(one => one.name === 'hem');
  if (!table) return null;
  const series = [['measured marks', '#16202b'], [drape.simulation, '#ff5fa2']].map(([label, colour]) => ({
    label, colour: () => colour, values: table.rows.filter(row => row[0] === label).map(row => [Number(row[1]), Number(row[2])]),
  })).filter(one => one.values.length);
  if (!series.length) return null;
  return [bars(`Drape ${drape.label}: waves around the hem`, 'waves around the hem', 'amplitude (mm)', series, 1),
    h('p', {class: 'soft'}, series.length > 1 ? 'Dark: measured, pink: virtual. ' : `Only ${series[0].label}: the other hem is not whole. `, 'A square patch has its own 4, 8, 12.')];
}
