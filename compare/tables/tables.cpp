// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "core/error.hpp"
#include "core/files/csv.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Display width: bytes that start a UTF-8 character.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

void add_line(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths,
              const std::vector<bool>& numeric, std::string& text) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t space = widths[i] - std::min(widths[i], width_of(cells[i]));
    text += i == 0 ? "  " : "   ";
    if (numeric[i]) text.append(space, ' ');
    text += cells[i];
    if (!numeric[i]) text.append(space, ' ');
  }
  text.erase(text.find_last_not_of(' ') + 1);
  text += '\n';
}

std::string csv_line(const std::vector<std::string>& cells) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) line += (i == 0 ? "" : ",") + csv_cell(cells[i]);
  return line + '\n';
}

Json json_cell(const std::string& cell, bool numeric) {
  if (!numeric) return cell;
  if (cell.empty()) return nullptr;
  const char* const last = cell.data() + cell.size();
  const auto parsed = [&](auto& number) {
    const auto [end, error] = std::from_chars(cell.data(), last, number);
    return error == std::errc() && end == last;
  };
  std::int64_t whole = 0;
  if (parsed(whole)) return whole;
  double number = 0;
  if (parsed(number)) return number;
  return cell;
}

/// Names of the columns that only matter when simulations differ in them.
bool several_models(const DrapeInput& input) {
  return std::any_of(input.simulations.begin(), input.simulations.end(), [&](const auto& s) {
    return s.other_simulator || s.source().model != input.simulations.front().source().model ||
           s.source().solver != input.simulations.front().source().solver;
  });
}

/// What tells the simulations of the group apart, but model and solver, which have columns.
std::vector<std::string> apart_keys(const DrapeInput& input) {
  std::vector<std::string> keys;
  for (const Simulation& simulation : input.simulations)
    for (const auto& [key, value] : simulation.apart)
      if (key != "model" && key != "solver" &&
          std::find(keys.begin(), keys.end(), key) == keys.end())
        keys.push_back(key);
  return keys;
}

std::string apart_value(const Simulation& simulation, const std::string& key) {
  for (const auto& [name, value] : simulation.apart)
    if (name == key) return value;
  return {};
}

}  // namespace

Table::Table(std::vector<std::string> columns, const std::vector<std::size_t>& numbers)
    : names(std::move(columns)), numeric(names.size(), false) {
  for (const std::size_t at : numbers) numeric[at] = true;
}

std::optional<std::size_t> Table::column(const std::string& name) const {
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? std::nullopt : std::optional<std::size_t>(at - names.begin());
}

std::string text_of(const Table& table) {
  const std::vector<std::string>& headings = table.headings.empty() ? table.names : table.headings;
  std::vector<std::size_t> widths;
  widths.reserve(headings.size());
  for (const std::string& name : headings) widths.push_back(width_of(name));
  for (const auto& row : table.rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
  std::string text = table.title.empty() ? "" : table.title + '\n';
  add_line(headings, widths, table.numeric, text);
  std::vector<std::string> rule;
  rule.reserve(widths.size());
  for (const std::size_t width : widths) rule.emplace_back(width, '-');
  add_line(rule, widths, table.numeric, text);
  for (const auto& row : table.rows) add_line(row, widths, table.numeric, text);
  return text;
}

std::string csv_of(const Table& table) {
  std::string text = csv_line(table.names);
  for (const auto& row : table.rows) text += csv_line(row);
  return text;
}

Json json_of(const Table& table) {
  Json list = Json::array();
  for (const auto& row : table.rows) {
    Json item = Json::object();
    for (std::size_t i = 0; i < row.size(); ++i)
      item[table.names[i]] = json_cell(row[i], table.numeric[i]);
    list.push_back(std::move(item));
  }
  return list;
}

std::string mm_text(double length_m) {
  return fmt::format("{:.3f}", length_m / mm);
}

std::string mm_text(const std::optional<double>& length_m) {
  return length_m ? mm_text(*length_m) : std::string();
}

std::string percent_text(double length_m, const Eigen::Vector2d& patch_m) {
  const Eigen::Vector2d percent = percent_of_patch(length_m, patch_m);
  if (std::abs(patch_m.x() - patch_m.y()) < 1e-9)
    return fmt::format("{:.2f} % of the patch side", percent.x());
  return fmt::format("{:.2f} % of the warp side, {:.2f} % of the weft side", percent.x(),
                     percent.y());
}

Table real_virtual_table(const DrapeInput& input, const Report& report) {
  Table table;
  table.title = fmt::format("Real vs virtual, experiment {}", report.name);
  table.names = {"grid_size",
                 "segments",
                 "mean_dist_mm",
                 "sigma_mean_mm",
                 "median_mm",
                 "rms_mm",
                 "p95_mm",
                 "max_mm",
                 "mean_percent_of_warp_side",
                 "mean_percent_of_weft_side",
                 "marks",
                 "at rest"};
  table.headings = {"grid size",        "segments",         "mean dist (mm)", "± (mm)",
                    "median (mm)",      "RMS (mm)",         "p95 (mm)",       "max (mm)",
                    "mean (% of warp)", "mean (% of weft)", "marks",          "at rest"};
  table.numeric.assign(table.names.size(), true);
  table.numeric.front() = table.numeric.back() = false;
  const bool models = several_models(input);
  if (models) {
    for (const char* name : {"model", "solver"}) {
      table.names.emplace_back(name);
      table.headings.emplace_back(name);
      table.numeric.push_back(false);
    }
  }
  const std::vector<std::string> keys = apart_keys(input);
  for (const std::string& key : keys) {
    table.names.push_back(key);
    table.headings.push_back(key);
    table.numeric.push_back(false);
  }
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    const DistanceStatistics& s = row.statistics;
    const Eigen::Vector2d percent = percent_of_patch(s.mean_m, input.measured.sheet.patch_m);
    table.add({simulation.grid_text(), simulation.segments_text(), mm_text(s.mean_m),
               mm_text(s.sigma_mean_m), mm_text(s.median_m), mm_text(s.rms_m), mm_text(s.p95_m),
               mm_text(s.max_m), fmt::format("{:.2f}", percent.x()),
               fmt::format("{:.2f}", percent.y()), std::to_string(s.marks),
               !simulation.says_its_verdict()            ? "not stated"
               : simulation.source().status == "at rest" ? "yes"
                                                         : "no"});
    if (models) {
      table.rows.back().push_back(simulation.source().model);
      table.rows.back().push_back(simulation.source().solver);
    }
    for (const std::string& key : keys) table.rows.back().push_back(apart_value(simulation, key));
  }
  return table;
}

namespace {

Table pair_table(const std::string& name, const std::vector<VirtualVirtual>& pairs) {
  Table table;
  table.title = fmt::format("Virtual vs virtual, experiment {}", name);
  table.names = {"pair", "mean_dist_mm", "max_mm", "surface_mean_mm", "hausdorff_mm", "points"};
  table.headings = {"",      "mean dist (mm)", "max (mm)", "surfaces, mean (mm)", "Hausdorff (mm)",
                    "points"};
  table.numeric = {false, true, true, true, true, true};
  for (const VirtualVirtual& row : pairs) {
    table.add({row.label + row.apart, mm_text(row.statistics.mean_m), mm_text(row.statistics.max_m),
               mm_text(row.surface.mean_m()), mm_text(row.surface.hausdorff_m()),
               std::to_string(row.statistics.marks)});
  }
  return table;
}

}  // namespace

Table virtual_virtual_table(const Report& report) {
  return pair_table(report.name, report.virtual_virtual);
}

Table virtual_group_table(const VirtualGroup& group) {
  return pair_table(group.name, group.pairs);
}

Table mark_table(const DrapeInput& input, const Report& report) {
  Table table;
  const bool models = several_models(input);
  const std::vector<std::string> keys = apart_keys(input);
  table.names = {"row", "col", "x_mm", "y_mm", "z_mm", "sigma_mm", "views"};
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    std::string name = fmt::format("dist_{}_{}", simulation.grid(), simulation.segments_text());
    if (models || simulation.other_simulator)
      name += fmt::format("_{}_{}", simulation.source().model, simulation.source().solver);
    for (const std::string& key : keys)
      if (const std::string value = apart_value(simulation, key); !value.empty())
        name += fmt::format("_{}_{}", key, value);
    if (simulation.branch) name += fmt::format("_branch_{}", simulation.branch->number);
    table.names.push_back(name + "_mm");
  }
  table.numeric.assign(table.names.size(), true);
  for (const SheetMark& mark : input.measured.sheet.marks) {
    std::vector<std::string> cells = {
        std::to_string(mark.mark.row),
        std::to_string(mark.mark.col),
        mm_text(mark.point_in_world.x()),
        mm_text(mark.point_in_world.y()),
        mm_text(mark.point_in_world.z()),
        mark.covariance_m2 ? fmt::format("{:.4f}", worst_sigma_m(*mark.covariance_m2) / mm)
                           : std::string(),
        mark.views ? std::to_string(*mark.views) : std::string()};
    for (const RealVirtual& row : report.real_virtual) {
      const auto found =
          std::lower_bound(row.marks.marks.begin(), row.marks.marks.end(), mark.mark,
                           [](const MarkError& error, MarkId id) { return error.mark < id; });
      const bool has = found != row.marks.marks.end() && found->mark == mark.mark;
      cells.push_back(has ? mm_text(found->distance_m) : std::string());
    }
    table.add(std::move(cells));
  }
  return table;
}

Table gap_table(const DrapeInput& input, const Report& report) {
  Table table;
  table.names = {"row", "col", "reason"};
  table.numeric = {true, true, false};
  std::vector<Gap> gaps = input.measured.sheet.gaps;
  if (report.headline) {
    const auto& excluded = report.real_virtual[*report.headline].marks.excluded;
    gaps.insert(gaps.end(), excluded.begin(), excluded.end());
  }
  std::sort(gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) { return a.mark < b.mark; });
  for (const Gap& gap : gaps)
    table.add({std::to_string(gap.mark.row), std::to_string(gap.mark.col), gap.reason});
  return table;
}

std::string kind_of_gap(const std::string& reason) {
  return reason.substr(0, std::min({reason.find(" ("), reason.find(':'), reason.find(';')}));
}

}  // namespace drape::compare
