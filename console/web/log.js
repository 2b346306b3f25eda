// SPDX-License-Identifier: Apache-2.0
// Log of actions: who did what and when, with the result.
import {act, command, h, verdict} from './dom.js';

let draft = '', name = null;

function words(entry) {
  const parts = [` ${entry.who}: ${entry.what}`];
  if (entry.note) parts.push(`: ${entry.note}`);
  if (entry.ended) parts.push(': ', verdict(entry.ended), ` ${entry.sentence ?? ''}`);
  if (entry.rms_mm !== undefined) parts.push(` of ${entry.held_out}: ${entry.rms_mm.toFixed(4)} mm, ${entry.points} points`);
  for (const line of entry.commands ?? []) parts.push(h('br'), h('code', {}, line));
  return parts;
}

export async function draw(state) {
  return [
    h('h1', {}, 'Log'),
    h('div', {class: 'acts'},
      h('label', {for: 'operator'}, 'Who is at the bench '),
      h('input', {id: 'operator', value: name ?? state.operator, maxlength: 80, input: event => { name = event.target.value; }}),
      h('button', {type: 'button', id: 'save-operator', click: async () => { if (await act({do: 'operator', text: name ?? state.operator})) name = null; }}, 'Save name')),
    h('div', {}, h('label', {for: 'note'}, 'Note'), h('textarea', {id: 'note', rows: 3, maxlength: 2000, input: event => { draft = event.target.value; }}, draft)),
    h('div', {class: 'acts'}, h('button', {type: 'button', class: 'main', id: 'save-note', click: async () => {
      const text = draft;
      draft = '';
      if (!await act({do: 'note', text})) draft = text;
    }}, 'Add note')),
    h('p', {}, `${state.log_entries} entries, the newest first.`, state.log_torn ? ` ${state.log_torn} lines were torn by a crash.` : ''),
    h('ol', {class: 'log', id: 'log'}, [...state.log].reverse().map(entry => h('li', {}, h('time', {datetime: entry.at}, entry.at), words(entry)))),
    command(`cat ${state.out}/console/session.jsonl`),
  ];
}
