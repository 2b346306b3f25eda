// SPDX-License-Identifier: Apache-2.0
// Pages, state and events. The state is requested from the server whenever an event reports
// a change; the page itself stores nothing of importance.
import {act, ask, h, takeSoon, tone} from './dom.js';
import * as bench from './bench.js';
import * as cameras from './cameras.js';
import * as calibration from './calibration.js';
import * as drape from './drape.js';
import * as history from './history.js';
import * as log from './log.js';

const pages = {bench, cameras, calibration, drape, history, log};
const names = Object.keys(pages);
const main = document.getElementById('main');
let state = null;
let drawn = '', drawings = 0;
let asking = false, again = false;

function current() {
  const name = location.hash.slice(1).split('/')[0];
  return names.includes(name) ? name : 'bench';
}

function drawPages() {
  document.getElementById('pages').replaceChildren(...names.map((name, k) => h('a', {
    href: `#${name}`, id: `page-${name}`, 'aria-current': name === current() ? 'page' : null,
    'aria-keyshortcuts': k + 1,
  }, h('kbd', {'aria-hidden': 'true'}, k + 1), name[0].toUpperCase() + name.slice(1))));
}

/// Redraws what changed, and keeps the keyboard focus.
async function draw(forced = false) {
  if (!state) return;
  const page = current();
  const text = page + JSON.stringify(state);
  if (!forced && text === drawn) return;
  drawn = text;
  const mine = drawings += 1;
  cameras.showLive(false);
  const content = await pages[page].draw(state, () => draw(true));
  if (page !== current() || mine !== drawings) return;  // another drawing began meanwhile
  const {id: focused, selectionStart: from, selectionEnd: to} = document.activeElement ?? {};
  main.replaceChildren(...content.filter(part => part));
  if (focused && document.activeElement?.id !== focused) {
    const field = document.getElementById(focused);
    field?.focus();
    if (typeof from === 'number') field?.setSelectionRange?.(from, to);
  }
  main.dataset.page = page;
}

// The elements are reused for all jobs, so that a key or click between two updates hits the intended button.
const bar = h('progress', {max: 1});
const doing = h('span');
let running = null;
const cancel = h('button', {type: 'button', id: 'cancel', click: () => act({do: 'cancel', job: running})}, 'Cancel');

function drawStatus() {
  const status = document.getElementById('status');
  const job = state.jobs.find(one => one.state === 'running');
  const waiting = state.jobs.filter(one => one.state === 'waiting').length;
  const last = state.jobs.filter(one => !['running', 'waiting'].includes(one.state)).pop();
  const words = last ? `${last.kind} ${last.what}: ${last.sentence || last.state}` : 'Ready.';
  const said = document.getElementById('said');
  status.dataset.idle = !job && waiting === 0;
  if (!job && said.textContent !== words) said.textContent = words;
  if (job) {
    bar.value = job.fraction;
    bar.setAttribute('aria-label', `progress of ${job.kind}`);
    doing.textContent = ` ${job.kind} ${job.what}${job.now ? ': ' + job.now : ''}${waiting ? `, ${waiting} waiting` : ''} `;
    running = job.id;
    if (!cancel.isConnected) status.replaceChildren(bar, doing, cancel);
  } else {
    status.replaceChildren(words);
  }
}

/// Progress changes only one line; a finished step can change any page.
function takeJob(job) {
  const k = state ? state.jobs.findIndex(one => one.id === job.id) : -1;
  const steps = one => `${one.state} ${/\(\d+ of \d+ done\)/.exec(one.now)}`;
  if (k < 0 || steps(state.jobs[k]) !== steps(job)) return refresh();
  state.jobs[k] = job;
  drawStatus();
}

async function refresh() {
  if (asking) { again = true; return; }
  asking = true;
  try {
    do {
      again = false;
      state = await ask('state');
      document.getElementById('rig').textContent = `${state.rig}${state.replay ? ', replay' : ''}`;
      if (state.trouble) document.getElementById('trouble').textContent = state.trouble;
      drawStatus();
      await draw();
      main.dataset.ready = 'true';
    } while (again);
  } catch (error) {
    document.getElementById('trouble').textContent = `The server does not answer (${error.message}). What was stored is whole.`;
  }
  asking = false;
}

const SAID_MS = 8000;
let fading = 0;

/// Shows the outcome of the last set for some seconds, large enough to be read from the bench.
function say(words, how, pitches) {
  const banner = document.getElementById('banner');
  banner.textContent = words;
  banner.className = how;
  tone(...pitches);
  clearTimeout(fading);
  fading = setTimeout(() => { if (banner.textContent === words) banner.textContent = ''; }, SAID_MS);
}

function listen() {
  const events = new EventSource('api/events');
  const trouble = document.getElementById('trouble');
  const on = (name, does) => events.addEventListener(name, event => does(JSON.parse(event.data)));
  events.addEventListener('open', () => { trouble.textContent = ''; refresh(); });
  on('state', refresh);
  on('job', takeJob);
  on('shot', ({set}) => say(`${set} is taken`, 'good', [880]));
  on('refused', ({set, why}) => {
    say(`${set} is not taken`, 'bad', [330, 220]);
    trouble.textContent = `${set} is not taken: ${why}`;
  });
  on('ended', ({words, good}) => say(words, good ? 'good' : 'bad', good ? [660, 880, 1100] : [330, 220]));
  on('camera', ({camera, back, words}) => {
    say(back ? `${camera} is back` : `${camera} is lost`, back ? 'good' : 'bad', back ? [660, 880] : [330, 220]);
    trouble.textContent = back ? '' : words;
  });
  on('frame', ({camera}) => cameras.frame(camera));
  events.addEventListener('error', () => {
    trouble.textContent = 'The server does not answer; the page tries again. What was stored is whole.';
  });
}

document.addEventListener('keydown', event => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
  if (event.target.closest('input, textarea, select')) return;
  const name = names[Number(event.key) - 1];
  if (name) location.hash = name;
  if (event.key === 't') document.querySelector('#main .take')?.click();
  if (event.key === 's') takeSoon();
  if (event.key === 'a') document.getElementById('automatic')?.click();
});
window.addEventListener('hashchange', () => {
  drawPages();
  document.getElementById('trouble').textContent = '';
  draw(true).then(() => main.focus());
});
drawPages();
listen();
