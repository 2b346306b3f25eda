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

std::string fine_mm(const std::optional<double>& length_m) {
  return length_m ? fmt::format("{:.4f}", *length_m / mm) : std::string();
}

bool several_models(const DrapeInput& input) {
  return std::any_of(input.simulations.begin(), input.simulations.end(), [&](const auto& s) {
    return s.other_simulator || s.source().model != input.simulations.front().source().model;
  });
}

/// Keys that distinguish the simulations of the group, except the model, which has its own column.
std::vector<std::string> apart_keys(const DrapeInput& input) {
  std::vector<std::string> keys;
  for (const Simulation& simulation : input.simulations)
    for (const auto& [key, value] : simulation.apart)
      if (key != "model" && std::find(keys.begin(), keys.end(), key) == keys.end())
        keys.push_back(key);
  return keys;
}

std::string apart_value(const Simulation& simulation, const std::string& key) {
  for (const auto& [name, value] : simulation.apart)
    if (name == key) return value;
  return {};
}

}  // namespace

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

Table real_virtual_table(const DrapeInput& input, const Report& report) {
  using R = const RealVirtual&;
  TableOf<RealVirtual> table(fmt::format("Real vs virtual, experiment {}", report.name));
  const auto of = [&](R row) -> const Simulation& { return input.simulations[row.simulation]; };
  const auto length = [&](const char* name, const char* heading, auto value) {
    table.number(name, heading, [=](R row) { return mm_text(row.statistics.*value); });
  };
  const auto percent = [&](const char* name, const char* heading, int side) {
    table.number(name, heading, [&input, side](R row) {
      return fmt::format(
          "{:.2f}", percent_of_patch(row.statistics.mean_m, input.measured.sheet.patch_m)[side]);
    });
  };
  using S = DistanceStatistics;
  const auto moved = [](R row, auto value, const char* format) {
    return row.aligned ? fmt::format(fmt::runtime(format), value(*row.aligned)) : std::string();
  };
  table.word("discretisation", "discretisation", [=](R row) {
    const auto& branch = of(row).branch;
    return of(row).discretisation() + (branch ? fmt::format(", branch {}", branch->number) : "");
  });
  table.number("segments", "segments", [=](R row) { return of(row).segments_text(); });
  length("mean_dist_mm", "mean dist (mm)", &S::mean_m);
  length("sigma_mean_mm", "noise of the marks in it (mm)", &S::sigma_mean_m);
  table.number("shape_mm", "shape: after a rigid move (mm)", [=](R row) {
    return moved(
        row, [](const RigidAlignment& a) { return a.after.mean_m / mm; }, "{:.3f}");
  });
  table.number("place_mm", "place: the move (mm)", [=](R row) {
    return moved(
        row, [](const RigidAlignment& a) { return a.centroid_shift_m / mm; }, "{:.3f}");
  });
  table.number("place_deg", "and turn (°)", [=](R row) {
    return moved(
        row, [](const RigidAlignment& a) { return a.turn_rad / units::deg; }, "{:.2f}");
  });
  length("median_mm", "median (mm)", &S::median_m);
  length("rms_mm", "RMS (mm)", &S::rms_m);
  length("p95_mm", "p95 (mm)", &S::p95_m);
  length("max_mm", "max (mm)", &S::max_m);
  percent("mean_percent_of_warp_side", "mean (% of warp)", 0);
  percent("mean_percent_of_weft_side", "mean (% of weft)", 1);
  table.number("marks", "marks", [](R row) { return std::to_string(row.statistics.marks); });
  table.word("at rest", "at rest", [=](R row) {
    return of(row).other_simulator                ? "not stated"
           : of(row).source().status == "at rest" ? "yes"
                                                  : "no";
  });
  if (several_models(input))
    table.word("model", "model", [=](R row) { return of(row).source().model; });
  for (const std::string& key : apart_keys(input))
    table.word(key, key, [=](R row) { return apart_value(of(row), key); });
  return table.of(report.real_virtual);
}

namespace {

Table pair_table(const std::string& name, const std::vector<VirtualVirtual>& pairs) {
  using P = const VirtualVirtual&;
  TableOf<VirtualVirtual> table(fmt::format("Virtual vs virtual, experiment {}", name));
  table.word("pair", "", [](P pair) { return pair.label + pair.apart; });
  table.number("mean_dist_mm", "mean dist (mm)",
               [](P pair) { return mm_text(pair.statistics.mean_m); });
  table.number("max_mm", "max (mm)", [](P pair) { return mm_text(pair.statistics.max_m); });
  table.number("surface_mean_mm", "surfaces, mean (mm)",
               [](P pair) { return mm_text(pair.surface.mean_m()); });
  table.number("hausdorff_mm", "Hausdorff (mm)",
               [](P pair) { return mm_text(pair.surface.hausdorff_m()); });
  table.number("points", "points", [](P pair) { return std::to_string(pair.statistics.marks); });
  return table.of(pairs);
}

}  // namespace

Table virtual_virtual_table(const Report& report) {
  return pair_table(report.name, report.virtual_virtual);
}

Table virtual_group_table(const VirtualGroup& group) {
  return pair_table(group.name, group.pairs);
}

Table mark_table(const DrapeInput& input, const Report& report) {
  using M = const SheetMark&;
  TableOf<SheetMark> table;
  const auto number = [&](const std::string& name, TableOf<SheetMark>::Cell cell) {
    table.number(name, name, std::move(cell));
  };
  number("row", [](M mark) { return std::to_string(mark.mark.row); });
  number("col", [](M mark) { return std::to_string(mark.mark.col); });
  number("x_mm", [](M mark) { return mm_text(mark.point_in_world.x()); });
  number("y_mm", [](M mark) { return mm_text(mark.point_in_world.y()); });
  number("z_mm", [](M mark) { return mm_text(mark.point_in_world.z()); });
  number("sigma_mm", [](M mark) {
    return mark.covariance_m2 ? fine_mm(worst_sigma_m(*mark.covariance_m2)) : "";
  });
  number("views", [](M mark) { return mark.views ? std::to_string(*mark.views) : ""; });
  const std::vector<std::string> keys = apart_keys(input);
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    std::string name =
        fmt::format("dist_{}_{}", simulation.discretisation(), simulation.segments_text());
    if (several_models(input)) name += "_" + simulation.source().model;
    for (const std::string& key : keys)
      if (const std::string value = apart_value(simulation, key); !value.empty())
        name += fmt::format("_{}_{}", key, value);
    if (simulation.branch) name += fmt::format("_branch_{}", simulation.branch->number);
    std::erase(name, ' ');
    number(name + "_mm", [&row](M mark) -> std::string {
      const auto& marks = row.marks.marks;
      const auto found =
          std::lower_bound(marks.begin(), marks.end(), mark.mark,
                           [](const MarkError& error, MarkId id) { return error.mark < id; });
      return found != marks.end() && found->mark == mark.mark ? mm_text(found->distance_m) : "";
    });
  }
  return table.of(input.measured.sheet.marks);
}

Table gap_table(const DrapeInput& input, const Report& report) {
  Table table({"row", "col", "reason"}, {0, 1});
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

namespace {

void add_trusted(Table& table, const std::string& name, double value_m, const Trust& trust) {
  table.add({name, mm_text(value_m), fine_mm(trust.sigma_m),
             trust.bootstrap ? mm_text(trust.bootstrap->low) : "",
             trust.bootstrap ? mm_text(trust.bootstrap->high) : ""});
}

}  // namespace

Table trust_table(const DrapeInput& input, const RealVirtual& row) {
  Table table({"measure", "value_mm", "sigma_mm", "low_mm", "high_mm"}, {1, 2, 3, 4});
  table.title = "Trust in the numbers, " + input.simulations[row.simulation].label();
  table.headings = {"measure", "value (mm)", "± from the marks (mm)", "95 % over marks, from (mm)",
                    "to (mm)"};
  const DistanceStatistics& s = row.statistics;
  add_trusted(table, "mean (the paper's)", s.mean_m, s.mean);
  add_trusted(table, "median", s.median_m, s.median);
  add_trusted(table, "RMS", s.rms_m, s.rms);
  add_trusted(table, "95th percentile", s.p95_m, s.p95);
  add_trusted(table, "largest", s.max_m, s.max);
  add_trusted(table, "mean along the normal, signed", row.normal.mean_m, row.normal.mean);
  add_trusted(table, "mean to the nearest point of the surface", row.to_surface.mean_m,
              row.to_surface.mean);
  if (row.aligned) {
    add_trusted(table,
                fmt::format("mean left after one rigid move ({:.2f} mm, {:.2f} deg; not applied "
                            "anywhere else)",
                            row.aligned->centroid_shift_m / mm, row.aligned->turn_rad / units::deg),
                row.aligned->after.mean_m, row.aligned->after.mean);
  }
  return table;
}

Table surface_table(const DrapeInput& input, const Report& report) {
  using S = const RealSurface&;
  TableOf<RealSurface> table(fmt::format(
      "Real vs surface, experiment {}: no material correspondence exists, so no mark has a place",
      report.name));
  const auto of = [&](S row) -> const OtherSurface& { return input.surfaces[row.surface]; };
  const auto way = [&](const char* name, const char* heading, auto direction, auto value) {
    table.number(name, heading, [=](S row) {
      return row.both_directions ? mm_text((*row.both_directions).*direction.*value) : "";
    });
  };
  using D = SurfaceDistance;
  table.word("simulator", "mesh", [=](S row) { return of(row).simulator; });
  table.number("to_surface_mean_mm", "marks to surface, mean (mm)",
               [](S row) { return mm_text(row.to_surface.mean_m); });
  table.number("sigma_of_to_surface_mean_mm", "± (mm)",
               [](S row) { return fine_mm(row.to_surface.mean.sigma_m); });
  table.number("to_surface_p95_mm", "p95 (mm)",
               [](S row) { return mm_text(row.to_surface.p95_m); });
  table.number("to_surface_max_mm", "max (mm)",
               [](S row) { return mm_text(row.to_surface.max_m); });
  way("real_to_mesh_mean_mm", "real surface to mesh, mean (mm)", &D::first_to_second,
      &OneDirection::mean_m);
  way("real_to_mesh_max_mm", "Hausdorff (mm)", &D::first_to_second, &OneDirection::hausdorff_m);
  way("mesh_to_real_mean_mm", "mesh to real surface, mean (mm)", &D::second_to_first,
      &OneDirection::mean_m);
  way("mesh_to_real_max_mm", "Hausdorff (mm)", &D::second_to_first, &OneDirection::hausdorff_m);
  table.number("marks", "marks", [](S row) { return std::to_string(row.to_surface.marks); });
  table.number("triangles", "triangles",
               [=](S row) { return std::to_string(of(row).mesh.triangles.size()); });
  return table.of(report.real_surface);
}

Table drapemeter_table(const DrapeInput& input, const Report& report) {
  using Named = std::pair<std::string, const DrapemeterResult*>;
  std::vector<Named> rows = {{"measured marks", &report.measured_drapemeter}};
  for (const RealVirtual& row : report.real_virtual)
    rows.emplace_back(input.simulations[row.simulation].label(),
                      &report.drapemeters[row.simulation]);
  TableOf<Named> table("Drapemeter: the shadow from straight above");
  const auto number = [&](const char* name, const char* heading, auto cell) {
    table.number(name, heading, [cell](const Named& row) {
      return row.second->value ? cell(*row.second->value) : std::string();
    });
  };
  using D = const Drapemeter&;
  const auto share = [](double ratio) { return fmt::format("{:.1f}", ratio / units::percent); };
  table.word("sheet", "sheet", [](const Named& row) { return row.first; });
  number("covered_area_mm2", "covered (mm²)",
         [](D d) { return fmt::format("{:.0f}", d.covered_area_m2 / (mm * mm)); });
  number("covered_percent_of_flat", "of the flat cloth (%)",
         [=](D d) { return share(d.covered_area_m2 / d.flat_area_m2); });
  number("drape_coefficient_percent", "drape coefficient (%)",
         [=](D d) { return d.drape_coefficient ? share(*d.drape_coefficient) : std::string(); });
  number("folds", "folds", [](D d) { return std::to_string(d.folds); });
  number("fold_depth_mm", "fold depth (mm)",
         [](D d) { return fmt::format("{:.1f}", d.fold_depth_m / mm); });
  table.word("remark", "", [](const Named& row) -> std::string {
    if (!row.second->value) return row.second->reason;
    return row.second->value->drape_coefficient ? "" : "no coefficient: the object has no flat top";
  });
  return table.of(rows);
}

Table strain_table(const RealVirtual& row) {
  Table table({"kind", "row", "col", "to_row", "to_col", "real_percent", "simulated_percent"},
              {1, 2, 3, 4, 5, 6});
  const auto add = [&](const char* kind, MarkId from, MarkId to, double real, double simulated) {
    table.add({kind, std::to_string(from.row), std::to_string(from.col), std::to_string(to.row),
               std::to_string(to.col), fmt::format("{:.4f}", real / units::percent),
               fmt::format("{:.4f}", simulated / units::percent)});
  };
  for (const EdgeStrain& e : row.strain.edges)
    add(e.along_warp ? "warp" : "weft", e.from, e.to, e.real, e.simulated);
  for (const AreaStrain& c : row.strain.cells)
    add("area", c.corner, {c.corner.row + 1, c.corner.col + 1}, c.real, c.simulated);
  return table;
}

namespace {

constexpr double kMicrojoule = 1e-6;

const Branch& facts_of(const DrapeInput& input, const BranchComparison& one) {
  return *input.simulations[one.as_placed.simulation].branch;
}

/// The first branch given need not be the first of its list.
double least_j_of(const DrapeInput& input, const BranchSet& set) {
  const Branch& first = facts_of(input, set.branches.front());
  return first.least_j.value_or(first.energy_j);
}

}  // namespace

Table branch_table(const DrapeInput& input, const Report& report, const BranchSet& set) {
  using B = const BranchComparison&;
  TableOf<BranchComparison> table(
      fmt::format("Branches, experiment {}: equilibria of {}, by energy", report.name, set.label));
  const auto fact = [&](B one) -> const Branch& { return facts_of(input, one); };
  const auto length = [&](const char* name, const char* heading, auto value) {
    table.number(name, heading, [=](B one) { return mm_text(one.as_placed.statistics.*value); });
  };
  const double least_j = least_j_of(input, set);
  table.number("branch", "branch", [=](B one) { return std::to_string(fact(one).number); });
  table.number("energy_uJ", "energy (µJ)",
               [=](B one) { return fmt::format("{:.2f}", fact(one).energy_j / kMicrojoule); });
  table.number("above_least_uJ", "above least (µJ)", [=](B one) {
    return fmt::format("{:.2f}", (fact(one).energy_j - least_j) / kMicrojoule);
  });
  table.number("starts", "starts", [=](B one) { return std::to_string(fact(one).starts); });
  table.number("share_percent", "share of starts (%)", [=](B one) {
    return fact(one).share ? fmt::format("{:.0f}", 100 * *fact(one).share) : std::string();
  });
  table.number("hem_nodes", "folds of the hem",
               [=](B one) { return std::to_string(fact(one).hem_nodes); });
  table.word("stable", "stable", [=](B one) { return fact(one).stable ? "yes" : "no, a saddle"; });
  length("mean_dist_mm", "mean dist (mm)", &DistanceStatistics::mean_m);
  table.number("shape_mm", "shape (mm)", [](B one) {
    return one.as_placed.aligned ? mm_text(one.as_placed.aligned->after.mean_m) : std::string();
  });
  length("max_mm", "max (mm)", &DistanceStatistics::max_m);
  if (set.branches.front().turned) {
    table.number("turned_mean_mm", "mean after best turn (mm)",
                 [](B one) { return mm_text(one.turned->mean_m); });
    table.number("turn_deg", "turn (°)",
                 [](B one) { return fmt::format("{:.1f}", one.turned->turn_rad / units::deg); });
    table.word("half_turn", "sheet half turned",
               [](B one) { return one.turned->half_turn ? "yes" : "no"; });
  }
  table.word("role", "", [&, fact](B one) {
    std::string role = fact(one).number == 1 ? "least energy" : "";
    if (&one == &set.branches[set.nearest]) role += role.empty() ? "nearest" : ", nearest";
    return role;
  });
  Table made = table.of(set.branches);
  made.marked_row = set.nearest;
  return made;
}

std::string branch_sentence(const DrapeInput& input, const BranchSet& set) {
  const BranchComparison &nearest = set.branches[set.nearest], &first = set.branches.front();
  const Branch& taken = facts_of(input, nearest);
  const bool whole = set.branches.size() >= static_cast<std::size_t>(taken.of);
  const char* turn = nearest.turned ? " after the best turn" : "";
  std::string text =
      fmt::format("nearest{} is branch {} of {}, {:.3f} mm{}", whole ? "" : " of those given",
                  taken.number, taken.of, nearest.match_m() / mm, turn);
  if (taken.number == 1) {
    text += ", which also has the least energy";
  } else {
    text += fmt::format("; branch 1 of least energy, {:.2f} µJ below, ",
                        (taken.energy_j - least_j_of(input, set)) / kMicrojoule);
    text += facts_of(input, first).number == 1
                ? fmt::format("{:.3f} mm{}", first.match_m() / mm, turn)
                : "is not given";
  }
  if (set.runner_up && facts_of(input, set.branches[*set.runner_up]).number != 1) {
    const BranchComparison& next = set.branches[*set.runner_up];
    text += fmt::format("; next nearest branch {}, {:.3f} mm", facts_of(input, next).number,
                        next.match_m() / mm);
  }
  return text;
}

}  // namespace drape::compare
