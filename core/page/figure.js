// SPDX-License-Identifier: Apache-2.0
// Numbers formatted for people, by the same rule as drape::figure() in core/run_report.cpp.

const times = (x, places) => (places < 0 ? x / 10 ** -places : x * 10 ** places);

/// Rounds a number to the second significant digit of its uncertainty, both in one
/// unit; without an uncertainty to three significant digits. Ties are rounded away from zero.
export function figure(value, uncertainty = null) {
  if (typeof value !== 'number' || !Number.isFinite(value)) return 'not known';
  const known = uncertainty > 0, scale = known ? uncertainty : Math.abs(value), least = known ? 9.95 : 99.5;
  let places = known ? -9 : 0;
  while (places < 9 && times(scale, places) < least) ++places;
  if (!(scale > 0)) places = 0;
  const whole = Math.floor(times(Math.abs(value), places) + 0.5), sign = value < 0 && whole > 0 ? '-' : '';
  if (places <= 0) return sign + (whole === 0 ? '0' : whole + '0'.repeat(-places));
  const digits = String(whole).padStart(places + 1, '0');
  return `${sign}${digits.slice(0, -places)}.${digits.slice(-places)}`;
}

/// Texts of mean distance, U, shape, position, rotation and limit of a drape of report.json;
/// empty for absent values.
export function figuresOf(drape) {
  const d = drape.distance, {budget} = drape, u = budget && !budget.missing.length ? budget.expanded_mm : null;
  const length = value => (value === null || value === undefined ? '' : figure(value, u));
  if (!d) return {mean: '', expanded: '', shape: '', place: '', turn: '', limit: ''};
  return {
    mean: length(d.mean_mm), expanded: budget ? (u === null ? 'at least ' : '') + figure(budget.expanded_mm, budget.expanded_mm) : '',
    shape: length(d.shape_mm), place: length(d.place_mm), turn: d.place_deg === null ? '' : figure(d.place_deg, 1),
    limit: length(drape.match.limit_mm),
  };
}
