// SPDX-License-Identifier: Apache-2.0
#include "compare/viewer.hpp"

#include <fmt/format.h>

#include <cmath>

#include "compare/figures.hpp"
#include "compare/obstacle_mesh.hpp"
#include "core/json_file.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Tenths of a millimetre are finer than any screen shows.
void append_point(Json& list, const Eigen::Vector3d& point_m) {
  for (int k = 0; k < 3; ++k) list.push_back(std::round(point_m[k] / mm * 10) / 10 + 0.0);
}

Json sheet_json(const Sheet& sheet) {
  // Sheets of other simulators may be fine: every point of a 41 x 41 grid is enough to look at.
  const int step = std::max(1, std::max(sheet.rows, sheet.cols) / 40);
  Json quads = Json::array();
  for (int row = 0; row + step < sheet.rows; row += step) {
    for (int col = 0; col + step < sheet.cols; col += step) {
      const SheetMark *a = sheet.find({row, col}), *b = sheet.find({row + step, col}),
                      *c = sheet.find({row + step, col + step}), *d = sheet.find({row, col + step});
      if (!a || !b || !c || !d) continue;
      for (const SheetMark* corner : {a, b, c, d}) append_point(quads, corner->point_in_world);
    }
  }
  return quads;
}

}  // namespace

std::string viewer_figure(const std::string& drape, const DrapeInput& input,
                          const RealVirtual& comparison) {
  const ErrorScale scale = scale_of(comparison);
  Json json;
  json["cloth"] = sheet_json(input.simulations[comparison.simulation].sheet.sheet);
  json["object"] = Json::array();
  if (input.scene) {
    for (const auto& quad : obstacle_quads(*input.scene))
      for (const Eigen::Vector3d& corner : quad) append_point(json["object"], corner);
  }
  json["marks"] = Json::array();
  for (const MarkError& mark : comparison.marks.marks) {
    Json item = Json::array();
    append_point(item, mark.real_in_world);
    append_point(item, mark.virtual_in_world);
    item.push_back(scale.colour(mark.distance_m / mm));
    item.push_back(fmt::format("row {}, col {}: {:.2f} mm", mark.mark.row, mark.mark.col,
                               mark.distance_m / mm));
    json["marks"].push_back(std::move(item));
  }
  const std::string name = xml(drape);
  return fmt::format(
      "<figure class=\"turn\" hidden=\"hidden\" data-view=\"view-{0}\"><canvas width=\"1000\" "
      "height=\"620\" tabindex=\"0\" role=\"img\" aria-label=\"Drape {0}: object, virtual cloth "
      "and "
      "real marks; arrow keys turn, plus and minus zoom, 0 resets\"></canvas><div "
      "class=\"keys\"><button type=\"button\" data-key=\"cloth\" "
      "aria-pressed=\"true\">cloth</button><button type=\"button\" data-key=\"object\" "
      "aria-pressed=\"true\">object</button><button type=\"button\" data-key=\"marks\" "
      "aria-pressed=\"true\">marks</button><output></output></div><figcaption>Drag or use the "
      "arrow "
      "keys to turn, wheel or + and - to come nearer, 0 to begin again. Colours as in the pictures "
      "below; each line leads from a real mark to its place on the virtual cloth.</figcaption>"
      "</figure>\n<script type=\"application/json\" id=\"view-{0}\">{1}</script>\n",
      name, json.dump());
}

std::string viewer_script() {
  return R"js(<script>//<![CDATA[
'use strict';
for (const figure of document.querySelectorAll('figure.turn')) {
  const data = JSON.parse(document.getElementById(figure.dataset.view).textContent);
  const canvas = figure.querySelector('canvas'), pen = canvas.getContext('2d');
  const output = figure.querySelector('output');
  if (!pen) continue;
  figure.hidden = false;
  const shown = {cloth: true, object: true, marks: true};
  const start = {azimuth: -1.05, height: 0.5, zoom: 1};
  let view = {...start}, places = [];
  const quads = [];
  for (const kind of ['object', 'cloth'])
    for (let i = 0; i < data[kind].length; i += 12)
      quads.push({kind, corners: [0, 3, 6, 9].map(k => data[kind].slice(i + k, i + k + 3))});
  let low = [1e9, 1e9, 1e9], high = [-1e9, -1e9, -1e9];
  for (const q of quads) for (const c of q.corners) for (let k = 0; k < 3; ++k) {
    low[k] = Math.min(low[k], c[k]); high[k] = Math.max(high[k], c[k]);
  }
  const middle = low.map((v, k) => (v + high[k]) / 2);
  const size = Math.hypot(...low.map((v, k) => high[k] - v));
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const minus = (a, b) => a.map((v, k) => v - b[k]);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = a => { const n = Math.hypot(...a) || 1; return a.map(v => v / n); };
  function draw() {
    const ca = Math.cos(view.azimuth), sa = Math.sin(view.azimuth);
    const ce = Math.cos(view.height), se = Math.sin(view.height);
    const toward = [ca * ce, sa * ce, se], right = [-sa, ca, 0], up = cross(toward, right);
    const scale = 1.3 * canvas.height / size * view.zoom;
    const place = p => { const q = minus(p, middle); return [canvas.width / 2 + scale * dot(right, q), canvas.height / 2 - scale * dot(up, q), dot(toward, q)]; };
    const light = unit(toward.map((v, k) => v + 0.55 * up[k] - 0.45 * right[k]));
    const items = [];
    for (const q of quads) {
      if (!shown[q.kind]) continue;
      const c = q.corners;
      let n = unit(cross(minus(c[2], c[0]), minus(c[3], c[1])));
      const printed = dot(n, toward) > 0;
      if (q.kind === 'object' && !printed) continue;
      if (!printed) n = n.map(v => -v);
      const shade = 0.55 + 0.45 * Math.max(0, dot(n, light));
      const base = q.kind === 'object' ? [205, 170, 120] : printed ? [236, 239, 243] : [196, 190, 184];
      const p = c.map(place);
      items.push({depth: (p[0][2] + p[1][2] + p[2][2] + p[3][2]) / 4 - (q.kind === 'object' ? 3 : 0), p, colour: 'rgb(' + base.map(v => Math.round(v * shade)) + ')', edge: q.kind === 'cloth'});
    }
    places = [];
    if (shown.marks) for (const m of data.marks) {
      const a = place(m.slice(0, 3)), b = place(m.slice(3, 6));
      items.push({depth: Math.max(a[2], b[2]) + 6, a, b, colour: m[6]});
      places.push({x: a[0], y: a[1], text: m[7]});
    }
    items.sort((x, y) => x.depth - y.depth);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    for (const item of items) {
      pen.beginPath();
      if (item.p) {
        item.p.forEach((p, i) => i ? pen.lineTo(p[0], p[1]) : pen.moveTo(p[0], p[1]));
        pen.closePath();
        pen.fillStyle = item.colour; pen.fill();
        pen.strokeStyle = item.edge ? '#8a94a0' : item.colour; pen.lineWidth = 0.6; pen.stroke();
        continue;
      }
      pen.moveTo(item.a[0], item.a[1]); pen.lineTo(item.b[0], item.b[1]);
      pen.strokeStyle = '#1d2733'; pen.lineWidth = 3.4; pen.stroke();
      pen.strokeStyle = item.colour; pen.lineWidth = 2; pen.stroke();
      pen.beginPath(); pen.arc(item.a[0], item.a[1], 5.5, 0, 7);
      pen.fillStyle = item.colour; pen.fill();
      pen.strokeStyle = '#1d2733'; pen.lineWidth = 1; pen.stroke();
    }
    canvas.dataset.drawn = items.length;
  }
  function turn(a, h) {
    view.azimuth += a;
    view.height = Math.max(-1.57, Math.min(1.57, view.height + h));
    draw();
  }
  function zoom(factor) { view.zoom = Math.max(0.4, Math.min(8, view.zoom * factor)); draw(); }
  const keys = {ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1), '+': () => zoom(1.15), '-': () => zoom(1 / 1.15), '0': () => { view = {...start}; draw(); }};
  canvas.addEventListener('keydown', e => { if (keys[e.key]) { keys[e.key](); e.preventDefault(); } });
  let last = null;
  canvas.addEventListener('pointerdown', e => { last = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener('pointerup', () => { last = null; });
  canvas.addEventListener('pointermove', e => {
    if (last) {
      turn(-(e.clientX - last[0]) * 0.008, (e.clientY - last[1]) * 0.008);
      last = [e.clientX, e.clientY];
      return;
    }
    const box = canvas.getBoundingClientRect(), f = canvas.width / box.width;
    const near = places.map(p => [Math.hypot(p.x - (e.clientX - box.left) * f, p.y - (e.clientY - box.top) * f), p.text]).sort((a, b) => a[0] - b[0])[0];
    output.textContent = near && near[0] < 14 ? near[1] : '';
  });
  canvas.addEventListener('wheel', e => { zoom(e.deltaY < 0 ? 1.1 : 1 / 1.1); e.preventDefault(); }, {passive: false});
  for (const button of figure.querySelectorAll('button')) button.addEventListener('click', () => {
    const key = button.dataset.key;
    shown[key] = !shown[key];
    button.setAttribute('aria-pressed', shown[key]);
    draw();
  });
  draw();
}
//]]></script>
)js";
}

}  // namespace drape::compare
