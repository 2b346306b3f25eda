// SPDX-License-Identifier: Apache-2.0
#include "compare/report/viewer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "compare/meshes/obstacle_mesh.hpp"
#include "compare/report/figures.hpp"
#include "compare/report/view.hpp"
#include "compare/report/viewer_assets.hpp"
#include "core/drawing/svg.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Tenths of a millimetre are finer than any screen shows.
void append_point(Json& list, const Eigen::Vector3d& point_m) {
  for (int k = 0; k < 3; ++k) list.push_back(std::round(point_m[k] / mm * 10) / 10 + 0.0);
}

/// Quads, corner by corner.
Json quads_json(const std::vector<std::array<Eigen::Vector3d, 4>>& cells) {
  Json quads = Json::array();
  for (const auto& cell : cells)
    for (const Eigen::Vector3d& corner : cell) append_point(quads, corner);
  return quads;
}

/// Cells whose four marks were compared: their corners, and the colours of the four errors.
Json real_json(const Sheet& sheet, const RealVirtual& comparison, const ErrorScale& scale) {
  std::map<MarkId, const MarkError*> errors;
  for (const MarkError& mark : comparison.marks.marks) errors[mark.mark] = &mark;
  Json cells = Json::array();
  for (int row = 0; row + 1 < sheet.rows; ++row) {
    for (int col = 0; col + 1 < sheet.cols; ++col) {
      Json cell = Json::array(), colours = Json::array();
      for (const MarkId id : {MarkId{row, col}, MarkId{row + 1, col}, MarkId{row + 1, col + 1},
                              MarkId{row, col + 1}}) {
        const auto found = errors.find(id);
        if (found == errors.end()) break;
        append_point(cell, found->second->real_in_world);
        colours.push_back(scale.colour(found->second->distance_m / mm));
      }
      if (colours.size() != 4) continue;
      for (Json& colour : colours) cell.push_back(std::move(colour));
      cells.push_back(std::move(cell));
    }
  }
  return cells;
}

}  // namespace

std::string viewer_figure(const std::string& drape, const DrapeInput& input,
                          const RealVirtual& comparison) {
  const ErrorScale scale = scale_of(comparison);
  Json json;
  json["cloth"] = quads_json(drawn_cells(input.simulations[comparison.simulation].sheet.sheet));
  json["object"] = Json::array();
  if (input.scene) json["object"] = quads_json(obstacle_quads(*input.scene));
  json["real"] = real_json(input.measured.sheet, comparison, scale);
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
      "height=\"620\" tabindex=\"0\" role=\"img\" aria-label=\"Drape {0}: object, virtual "
      "cloth and real cloth; arrow keys turn, plus and minus zoom, 0 resets\"></canvas><div "
      "class=\"keys\"><button type=\"button\" data-key=\"cloth\" "
      "aria-pressed=\"true\">virtual cloth</button><button type=\"button\" data-key=\"real\" "
      "aria-pressed=\"true\">real cloth</button><button type=\"button\" data-key=\"object\" "
      "aria-pressed=\"true\">object</button><button type=\"button\" data-key=\"marks\" "
      "aria-pressed=\"true\">marks</button><output></output></div><figcaption>Real cloth between "
      "its marks in the "
      "colours of their errors, virtual cloth grey. Drag or use the arrow keys to turn, + and - "
      "(or Ctrl and the wheel) to come nearer, 0 to begin again. Colours as in the pictures "
      "below; each rod leads from a real mark to its place on the virtual cloth.</figcaption>"
      "</figure>\n<script type=\"application/json\" id=\"view-{0}\">{1}</script>\n",
      name, json.dump());
}

std::vector<std::string> viewer_scripts() {
  return {std::string("//<![CDATA[\n") + three_licence() + three_js() + "\n//]]>",
          std::string("//<![CDATA[\n") + viewer_js() + "//]]>"};
}

std::string script_hash(const std::string& script) {
  const std::string hex = sha256_of(std::string_view(script));
  std::vector<unsigned char> bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    bytes.push_back(static_cast<unsigned char>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return "sha256-" + base64(bytes);
}

}  // namespace drape::compare
