// SPDX-License-Identifier: Apache-2.0
#include "simulate/refine/refine_json.hpp"

#include <fmt/format.h>

#include "core/files/files.hpp"
#include "core/units.hpp"

namespace drape::simulate {

using units::mm;

std::string folder_of(const RefinedGrid& grid) {
  return fmt::format("{}x{}", grid.result.sheet.rows, grid.result.sheet.cols);
}

Json refinement_json(const Refinement& refinement, const Print& print, const RefineOptions& how,
                     const std::string& rest_sha256, const std::filesystem::path& folder) {
  Json json;
  json["schema"] = "drapebench/refinement/1";
  json["rest_sha256"] = rest_sha256;
  json["finest_allowed"] = how.finest;
  json["goal_mm"] = how.goal_m / mm;
  json["grids"] = Json::array();
  for (const RefinedGrid& grid : refinement.grids) {
    const std::string sheet = folder_of(grid) + "/sheet.ply";
    json["grids"].push_back(
        {{"rows", grid.result.sheet.rows},
         {"cols", grid.result.sheet.cols},
         {"sheet", sheet},
         {"sheet_sha256", sha256_of_file(folder / folder_of(grid) / "sheet.json")},
         {"at_rest", grid.at_rest()},
         {"status", grid.result.report.sentence},
         {"steps", grid.result.report.steps},
         {"mean_distance_from_coarser_mm", grid.apart_m ? Json(*grid.apart_m / mm) : Json()}});
  }
  const auto finest = refinement.finest_at_rest();
  json["used"] = finest ? Json(*finest) : Json();
  json["order"] =
      refinement.left && refinement.left->order ? Json(*refinement.left->order) : Json();
  json["mean_left_mm"] = refinement.left ? Json(refinement.left->mean_m() / mm) : Json();
  json["sentence"] = left_sentence(refinement);
  json["marks"] = Json::array();
  if (!finest || !refinement.left) return json;
  for (int k = 0; k < print.rows * print.cols; ++k) {
    const Eigen::Vector3d place = refinement.grids[*finest].places_m.row(k) / mm;
    const Eigen::Vector3d left = refinement.left->moves_m.row(k) / mm;
    json["marks"].push_back({{"row", k / print.cols},
                             {"col", k % print.cols},
                             {"place_mm", to_json_vector(place)},
                             {"left_mm", to_json_vector(left)}});
  }
  return json;
}

std::string left_sentence(const Refinement& refinement) {
  const auto finest = refinement.finest_at_rest();
  if (!finest || !refinement.left) return "no finer grid came to rest";
  const GridLeft& left = *refinement.left;
  const RefinedGrid& grid = refinement.grids[*finest];
  const std::string coarse = fmt::format("{}x{}", refinement.coarse.rows, refinement.coarse.cols);
  std::string text = fmt::format(
      "{:.3f} mm may be left to a grid without end: {} moves the marks by {:.3f} mm from {}",
      left.mean_m() / mm, folder_of(grid), *grid.apart_m / mm,
      *finest > 0 ? folder_of(refinement.grids[*finest - 1]) : coarse);
  if (left.order)
    text += fmt::format(", and over three grids the error falls by order {:.1f}{}", *left.order,
                        *left.order > kModelOrder ? ", of which the model's 2 is relied on" : "");
  else
    text += fmt::format(", and the error is taken to fall by order 1, for {}",
                        *finest > 0 ? "three grids show none of 1 to 3" : "two grids show none");
  if (*finest > 0)
    text += fmt::format("; {} lies {:.3f} mm away", coarse,
                        (grid.places_m - refinement.coarse_places_m).rowwise().norm().mean() / mm);
  if (*finest + 1 < refinement.grids.size())
    text += fmt::format("; {} is {}", folder_of(refinement.grids.back()),
                        refinement.grids.back().result.report.sentence);
  if (left.mean_m() > refinement.goal_m)
    text += fmt::format("; the goal of {:g} mm is missed", refinement.goal_m / mm);
  return text;
}

}  // namespace drape::simulate
