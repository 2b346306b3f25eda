// SPDX-License-Identifier: Apache-2.0
// Summary card of a drape: picture, match, distance with U, shape and position, reason, next action.

import {roundStep} from './colour.js';
import {h, withCode} from './dom.js';
import {figuresOf} from './figure.js';
import {photograph} from './pictures.js';

export const matchOf = drape => (drape.no_go.length ? 'no-go' : drape.match.verdict);
const WORDS = {inside: 'Inside', outside: 'Outside', undecided: 'Undecided', none: 'No limit', 'no-go': 'NO-GO'};
export const matchWord = drape => WORDS[matchOf(drape)];

/// The view with the most marks.
export function bestView(drape) {
  return drape.views.reduce((best, view) => (!best || view.marks.length > best.marks.length ? view : best), null);
}

/// Draws the distance as a bar from 0: grey up to the limit, a band for U with its bounds added in full, a tick at the distance.
function bar(drape, shown) {
  const value = drape.match.value_mm ?? drape.distance.mean_mm, open = drape.budget ? drape.budget.inputs_mm + drape.budget.own_mm : 0;
  const limit = drape.match.limit_mm ?? 0, most = 1.02 * Math.max(value + open, limit), step = roundStep(most / 4), top = step * Math.ceil(most / step), x = mm => 300 * Math.max(0, mm) / top;
  return [h('svg', {viewBox: '0 0 300 22', preserveAspectRatio: 'none', class: 'bar', role: 'img',
    'aria-label': `distance ${shown.mean} mm${shown.expanded ? `, U ${shown.expanded} mm` : ''}${shown.limit ? `, limit ${shown.limit} mm` : ''}`},
  h('rect', {x: 0, y: 9, width: 300, height: 4, fill: '#e6eaef'}), limit ? h('rect', {x: 0, y: 7, width: x(limit), height: 8, fill: '#c6ced8'}) : null,
  h('rect', {x: x(value - open), y: 6, width: Math.max(1, x(value + open) - x(value - open)), height: 10, class: 'open'}),
  h('rect', {x: x(value) - 1.5, y: 2, width: 3, height: 18, class: 'tick'})),
  h('p', {class: 'scale'}, h('span', {}, '0'), h('span', {}, `${Number(top.toPrecision(6))} mm`))];
}

/// `source`: address of the picture of bestView(drape); `link`: address of the drape's details.
export function card(drape, source, link) {
  const shown = figuresOf(drape), view = bestView(drape), match = matchOf(drape);
  const about = [drape.object, drape.fabric && `fabric ${drape.fabric}`].filter(Boolean).join(', ');
  return h('article', {class: `card ${match}`, id: `card-${drape.name}`},
    view ? h('a', {class: 'picture', href: link}, photograph(drape, view, source)) : null,
    h('div', {class: 'words'},
      h('h2', {}, h('span', {class: 'name'}, link ? h('a', {href: link}, drape.label) : drape.label), ' ', h('span', {class: 'match'}, matchWord(drape))),
      h('p', {class: 'about'}, about),
      shown.mean ? h('p', {class: 'number'}, `${shown.mean} mm`, h('small', {}, 'from the cloth', shown.expanded ? `, U ${shown.expanded.replace('at least', '≥')} mm` : '')) : null,
      shown.shape ? h('p', {class: 'parts'}, [`shape ${shown.shape} mm`, `place ${shown.place} mm, ${shown.turn}°`, shown.limit && `limit ${shown.limit} mm`].filter(Boolean).join(' · ')) : null,
      drape.distance ? bar(drape, shown) : null,
      h('p', {class: 'why'}, withCode(drape.why)), h('p', {class: 'next'}, h('b', {}, 'Next: '), withCode(drape.next || 'nothing to do.')),
      link ? h('p', {class: 'more'}, h('a', {href: link}, `All of ${drape.label}`)) : null));
}
