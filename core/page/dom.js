// SPDX-License-Identifier: Apache-2.0
// Elements of a page. Text is inserted only as text, never as markup.

const SVG = 'http://www.w3.org/2000/svg';
const SVG_TAGS = new Set(['svg', 'circle', 'ellipse', 'polygon', 'polyline', 'line', 'rect', 'text', 'g', 'path', 'image', 'title', 'desc']);

/// Creates an element: attributes as given, functions as listeners, strings and nodes as children.
export function h(tag, attributes = {}, ...children) {
  const element = SVG_TAGS.has(tag) ? document.createElementNS(SVG, tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === false || value === null || value === undefined) continue;
    if (typeof value === 'function') element.addEventListener(name, value);
    else element.setAttribute(name, value === true ? '' : value);
  }
  element.append(...children.flat(3).filter(child => child !== null && child !== undefined && child !== false && child !== ''));
  return element;
}

/// Parts of a text in backticks as code.
export const withCode = text => text.split('`').map((part, i) => (i % 2 ? h('code', {}, part) : part));

/// Creates a table of report.json; tables wider than the page scroll separately.
export function tableOf(table) {
  const numbers = new Set(table.numbers);
  const cell = (tag, text, i) => h(tag, {class: numbers.has(i) ? 'n' : null, scope: tag === 'th' ? 'col' : null}, text);
  const headings = table.headings.length ? table.headings : table.columns;
  return h('div', {class: 'scroll', tabindex: 0, role: 'group', 'aria-label': table.title || table.name},
    h('table', {}, table.title ? h('caption', {}, table.title) : null,
      h('thead', {}, h('tr', {}, headings.map((text, i) => cell('th', text, i)))),
      h('tbody', {}, table.rows.map((row, at) => h('tr', {class: at === table.marked_row ? 'best' : null},
        row.map((text, i) => cell('td', text, i)))))));
}
