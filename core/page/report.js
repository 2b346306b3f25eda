// SPDX-License-Identifier: Apache-2.0
// The page of a report.json: first the drapes as cards, then notes that require an action, the
// certificate, and all details of each drape.

import {bestView, card, matchWord} from './card.js';
import {h, tableOf, withCode} from './dom.js';
import {figure, figuresOf} from './figure.js';
import {hemChart, histogram, legend, markMap, photograph} from './pictures.js';
import {spaceView} from './space.js';

const plural = (count, word) => `${count} ${word}${count === 1 ? '' : 's'}`;
const folded = (summary, ...children) => h('details', {}, h('summary', {}, summary), children);

function facts(pairs) {
  return h('dl', {class: 'facts'}, pairs.filter(([, value]) => value).map(([name, value]) => [h('dt', {}, name), h('dd', {}, value)]));
}

function median(report) {
  const all = report.drapes.map(drape => drape.sigma_median_mm).filter(Boolean);
  return all.length ? `cloth seen to ${figure(Math.max(...all), Math.max(...all))} mm` : '';
}

export function header(report) {
  const {calibration} = report, words = report.drapes.map(matchWord);
  const counted = [...new Set(words)].map(word => `${words.filter(one => one === word).length} ${{'NO-GO': word, 'No limit': 'without a limit'}[word] ?? word.toLowerCase()}`);
  return h('header', {class: report.go ? 'go' : 'stop'}, h('h1', {}, report.rig || 'drapebench'),
    h('span', {}, [report.run && `run ${report.run}`, report.label, report.date.slice(0, 10), calibration && plural(calibration.cameras.length, 'camera'), median(report)].filter(Boolean).join(' · ')),
    h('span', {class: 'state'}, report.go ? 'Measurement GO' : 'Measurement NO-GO', counted.length ? ` · Match: ${counted.join(', ')}` : ''),
    report.go ? null : h('ul', {class: 'reasons'}, report.reasons.map(reason => h('li', {}, reason))));
}

/// Groups notes of one kind under one expandable line; notes that stop are first, those that inform last.
export function notes(report) {
  const kinds = new Map();
  for (const note of report.notes) {
    const key = `${note.severity} ${note.kind}`;
    kinds.set(key, [...(kinds.get(key) ?? []), note]);
  }
  if (!kinds.size) return null;
  const count = severity => report.notes.filter(note => note.severity === severity).length;
  const said = [['stops', 'make the measurement NO-GO'], ['asks', 'ask for something'], ['informs', 'only inform']]
    .filter(([severity]) => count(severity)).map(([severity, words]) => `${plural(count(severity), 'note')} ${words}`);
  return h('section', {id: 'notes'}, h('h2', {}, 'Notes'), h('p', {class: 'soft'}, said.join(' · ')),
    [...kinds.values()].map(same => (same.length === 1 ? h('p', {class: same[0].severity}, same[0].text)
      : h('details', {class: same[0].severity}, h('summary', {}, `${same.length} × ${same[0].kind.replace(/\bN\b/g, '…')}${same.some(note => note.drape) ? ` (${[...new Set(same.map(note => note.drape))].join(', ')})` : ''}`),
        same.map(note => h('p', {}, note.text))))));
}

/// One printed page: both verdicts of each drape with distance and U, and the basis of the run.
export function certificate(report) {
  const {calibration, provenance} = report;
  const rows = report.drapes.map(drape => {
    const shown = figuresOf(drape);
    return [drape.label, drape.no_go.length ? 'NO-GO' : 'GO', plural(drape.measured_marks, 'mark') + (drape.sigma_median_mm ? ` to ${figure(drape.sigma_median_mm, drape.sigma_median_mm)} mm` : ''),
      drape.simulation, shown.mean, shown.expanded, shown.shape, shown.limit, matchWord(drape)];
  });
  const table = {name: 'certificate', title: '', columns: ['drape', 'measurement', 'measured', 'simulation', 'mean distance (mm)', 'U, 95 % (mm)', 'shape (mm)', 'limit (mm)', 'match'], headings: [], numbers: [4, 5, 6, 7], rows, marked_row: null};
  return h('section', {id: 'certificate'}, h('h2', {}, 'Certificate'),
    h('p', {class: 'paper'}, `Measurement ${report.go ? 'GO' : 'NO-GO'}: ${report.go ? report.sentence : report.reasons[0]}.`), tableOf(table),
    report.drapes.map(drape => h('p', {}, h('b', {}, `${drape.label}: ${matchWord(drape)}. `), drape.why)),
    facts([['run', report.run && `${report.run} of ${report.store}, stored ${report.date}`], ['label', report.label], ['operator', report.operator], ['rig', report.rig],
      ['recording', provenance.recordings.join('; ')],
      ['calibration', calibration ? `${plural(calibration.cameras.length, 'camera')}, ${calibration.method}, ${plural(calibration.sets, 'set')}, ${calibration.no_go ? `NO-GO: ${calibration.no_go}` : 'GO'}; SHA-256 ${calibration.sha256.slice(0, 12)}` : 'not given'],
      ['not measured (stand-ins)', provenance.stand_ins.join('; ') || 'none'], ['program', report.program]]),
    h('p', {class: 'soft'}, 'GO says that the marks were measured within their stated uncertainties; it says nothing of the simulation. Match says whether the simulation could be one more laying of the real drape, or, where it was laid fewer than three times, how far it is from it, against the total uncertainty. The simulation was chosen before any distance was known: the scene’s own start on the finest mesh with five segments.'),
    h('p', {class: 'signed'}, h('span', {}, 'date'), h('span', {}, 'name'), h('span', {}, 'signature')));
}

function tables(drape, names) {
  return drape.tables.filter(table => names.includes(table.name.replace(/-\d+$/, ''))).map(table => [tableOf(table), table.note ? h('p', {class: 'soft'}, table.note) : null]);
}

function foldedTables(drape, summary, names) {
  const made = tables(drape, names);
  return made.length ? folded(summary, made) : null;
}

function details(drape, source) {
  const shown = figuresOf(drape), gaps = drape.marks.filter(mark => mark.gap);
  const kinds = new Map();
  for (const mark of gaps) {
    const kind = mark.gap.split(/ \(|[:;]/)[0];
    kinds.set(kind, (kinds.get(kind) ?? 0) + 1);
  }
  const section = h('section', {id: `drape-${drape.name}`, class: 'drape'}, h('h2', {}, `Drape ${drape.label}`),
    h('p', {class: 'soft'}, `Set ${drape.set} of rig ${drape.rig}${drape.simulation ? `; pictures and marks belong to the simulation ${drape.simulation}` : ''}.`),
    shown.mean ? h('p', {}, h('b', {}, `${matchWord(drape)}: ${shown.mean} mm apart${shown.expanded ? `, U ${shown.expanded} mm` : ''}. `), withCode(drape.why), withCode(drape.next ? ` Next: ${drape.next}` : '')) : null,
    spaceView(drape));
  if (drape.views.length)
    section.append(h('h3', {}, 'Photographs'), h('p', {class: 'soft'}, 'Dots: measured marks in the colour of their distance; hollow ones were seen here but not measured in space. Pink: the virtual cloth, faint where its back is seen; a line leads from each mark to its virtual place.'),
      h('div', {class: 'photos'}, drape.views.map(view => h('figure', {}, photograph(drape, view, source(view.picture)), h('figcaption', {}, `Camera ${view.camera}: ${plural(view.marks.length, 'mark')} found.`)))), legend(drape));
  if (drape.distance)
    section.append(h('h3', {}, 'Distances'), h('div', {class: 'columns'}, h('figure', {}, markMap(drape), h('figcaption', {}, 'The patch laid flat, printed side up: distance of each mark in mm; dashed: a gap.')),
      h('figure', {}, histogram(drape), hemChart(drape))), tables(drape, ['real-vs-virtual', 'branches']).flat(2).filter(Boolean).reduce((all, one) => (all.append(one), all), h('div')));
  for (const one of [h('h3', {}, 'Behind the numbers'), h('ul', {}, drape.facts.map(fact => h('li', {}, withCode(fact)))),
    kinds.size ? h('p', {}, `${plural(gaps.length, 'mark')} without a distance: ${[...kinds].map(([kind, count]) => `${count} ${kind}`).join(', ')}.`) : null,
    foldedTables(drape, 'Uncertainty, line by line', ['budget', 'judged-by', 'repeats', 'trust', 'direction']),
    foldedTables(drape, 'Where the millimetres come from', ['fabric-values', 'model-changes']),
    foldedTables(drape, 'Marks and gaps', ['marks', 'gaps']), foldedTables(drape, 'Shape: shadow, folds, waves, strain', ['drapemeter', 'folds', 'waves', 'strain']),
    foldedTables(drape, 'Simulations against each other and other meshes', ['virtual-vs-virtual', 'real-vs-surface']),
    foldedTables(drape, 'Scene, fabric, certificates', ['values', 'certificates'])]) if (one) section.append(one);
  return section;
}

function calibrationSection({calibration}) {
  if (!calibration) return null;
  const range = (low, high, of) => `${low.toFixed(0)} to ${high.toFixed(0)} of ${of}`;
  const rows = calibration.cameras.map(camera => [camera.name, String(camera.points), camera.rms_px.toFixed(4), camera.max_px.toFixed(4), camera.rms_mm.toFixed(4),
    range(camera.covered_px[0], camera.covered_px[2], camera.width_px), range(camera.covered_px[1], camera.covered_px[3], camera.height_px)]);
  return h('section', {id: 'calibration'}, h('h2', {}, 'Calibration'),
    tableOf({name: 'calibration', title: '', columns: ['camera', 'points', 'RMS (px)', 'largest (px)', 'RMS (mm)', 'covered u (px)', 'covered v (px)'], headings: [], numbers: [1, 2, 3, 4], rows, marked_row: null}),
    facts(Object.entries(calibration.findings)), calibration.warnings.map(warning => h('p', {class: 'soft'}, warning)));
}

function provenanceSection({provenance}) {
  return h('section', {id: 'provenance'}, h('h2', {}, 'Provenance'),
    h('p', {}, `Made by ${provenance.programs.join(', ')}. Clock times are in the run records (*.run.json) beside each file, not here: the same input gives the same report, byte for byte.`),
    folded('Commands that make everything again, in the folder of this report', h('pre', {}, provenance.commands.join('\n'))),
    Object.entries(provenance.trees).map(([drape, tree]) => folded(`Drape ${drape}: from its sheets back to photographs and curves`, h('pre', {}, tree))),
    folded(plural(provenance.inputs.length, 'file') + ' read', tableOf({name: 'files', title: '', columns: ['file', 'SHA-256'], headings: [], numbers: [], rows: provenance.inputs.map(input => [input.file, input.sha256]), marked_row: null})));
}

/// Fills `root` with the page of a report; `source` returns the address of a picture.
export function showReport(root, report, source) {
  const link = (target, words) => h('a', {href: `#${target}`}, words);
  root.replaceChildren(header(report),
    h('main', {}, h('div', {class: 'cards'}, report.drapes.map(drape => card(drape, source(bestView(drape)?.picture), `#drape-${drape.name}`))),
      h('nav', {}, report.notes.length ? link('notes', plural(report.notes.length, 'note')) : null, link('certificate', 'Certificate'),
        report.drapes.map(drape => link(`drape-${drape.name}`, `Drape ${drape.label}`)), report.calibration ? link('calibration', 'Calibration') : null, link('provenance', 'Provenance'), report.drapes.some(drape => drape.views.length) ? h('span', {class: 'soft'}, 'Distance: mean over the marks, from the simulation to the cloth; U: its uncertainty (95 %). Bar: grey up to the limit, tick at the distance, coloured band: U with the bounds of mesh, segments and marks without a distance added in full. Pictures: dots are the real marks, in the colour of their distance; pink is the virtual cloth.') : null),
      notes(report), certificate(report), report.drapes.map(drape => details(drape, source)),
      report.virtual_groups.map(group => h('section', {}, tableOf(group))), calibrationSection(report), provenanceSection(report)));
}
