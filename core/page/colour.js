// SPDX-License-Identifier: Apache-2.0
// Viridis (van der Walt & Smith 2015): uniform in lightness, suitable for colour-blind readers and
// greyscale print.

const PLACES = [[68, 1, 84], [72, 36, 117], [65, 68, 135], [53, 95, 141], [42, 120, 142], [33, 145, 140],
  [34, 168, 132], [68, 191, 112], [122, 209, 81], [189, 223, 38], [253, 231, 37]];

/// A length of 1, 2, 2.5 or 5 times a power of ten, at least `part`.
export function roundStep(part) {
  const ten = 10 ** Math.floor(Math.log10(part));
  return ten * [1, 2, 2.5, 5, 10].find(step => step * ten >= part * (1 - 1e-9));
}

/// Colour scale from 0 to a round number at or above `largest`.
export function colourScale(largest) {
  const step = roundStep((largest > 1e-6 ? largest : 1) / 5), top = step * Math.ceil((largest > 1e-6 ? largest : 1) / step * (1 - 1e-9));
  const rgb = value => {
    const place = Math.min(Math.max(value / top, 0), 1) * (PLACES.length - 1), below = Math.min(Math.floor(place), PLACES.length - 2);
    return PLACES[below].map((low, k) => Math.round(low + (place - below) * (PLACES[below + 1][k] - low)));
  };
  return {top, step, rgb, colour: value => `rgb(${rgb(value).join(' ')})`, isDark: value => value / top < 0.55};
}
