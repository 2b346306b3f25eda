// SPDX-License-Identifier: Apache-2.0
// A report or a history as one file: the data are in the page itself.

import {showHistory} from './history.js';
import {showReport} from './report.js';

const data = id => JSON.parse(document.getElementById(id)?.textContent || 'null');
const root = document.getElementById('page'), history = data('history'), report = data('report');
if (history) showHistory(root, history);
if (report) {
  const pictures = data('pictures') ?? {};
  showReport(root, report, name => pictures[name] ?? null);
  if (location.hash) document.getElementById(location.hash.slice(1))?.scrollIntoView();
}
