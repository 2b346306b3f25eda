// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/tables.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "compare/folds/folds.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

using units::deg;
using units::mm;
using units::percent;

constexpr double kMicrojoule = 1e-6;
constexpr std::size_t kFabricFiles = 7;  // the fabric file, and two curves of each of three kinds

/// Writes a row cell by cell; the first row of a table also names its columns.
class Row {
 public:
  explicit Row(Table& table) : table_(table) { table.rows.emplace_back(); }
  void number(const std::string& name, const std::string& heading, std::string cell,
              bool numeric = true) {
    if (table_.rows.size() == 1) {
      table_.names.push_back(name);
      table_.headings.push_back(heading);
      table_.numeric.push_back(numeric);
    }
    table_.rows.back().push_back(std::move(cell));
  }
  void word(const std::string& name, const std::string& heading, std::string cell) {
    number(name, heading, std::move(cell), false);
  }

 private:
  Table& table_;
};

Table titled(std::string title) {
  Table table;
  table.title = std::move(title);
  return table;
}

/// A value in `unit` as text; empty if absent.
std::string text_in(double unit, const char* format, const std::optional<double>& value) {
  return value ? fmt::format(fmt::runtime(format), *value / unit) : std::string();
}

/// A length in millimetres with three decimals; empty if absent.
std::string mm_text(const std::optional<double>& length_m) {
  return text_in(mm, "{:.3f}", length_m);
}

std::string fine_mm(const std::optional<double>& length_m) {
  return text_in(mm, "{:.4f}", length_m);
}

std::string csv_line(const std::vector<std::string>& cells) {
  return fmt::format("{}\n", fmt::join(cells | std::views::transform(csv_cell), ","));
}

Json json_cell(const std::string& cell, bool numeric) {
  if (!numeric) return cell;
  if (cell.empty()) return nullptr;
  Json number = Json::parse(cell, nullptr, false);
  return number.is_number() ? number : Json(cell);
}

bool several_models(const DrapeInput& input) {
  return std::ranges::any_of(input.simulations, [&](const auto& s) {
    return s.other_simulator || s.source().model != input.simulations.front().source().model;
  });
}

/// Keys that distinguish the simulations of the group, except the model, which has its own column.
std::set<std::string> apart_keys(const DrapeInput& input) {
  std::set<std::string> keys;
  for (const Simulation& simulation : input.simulations)
    for (const auto& [key, value] : simulation.apart)
      if (key != "model") keys.insert(key);
  return keys;
}

std::string apart_value(const Simulation& simulation, const std::string& key) {
  const auto found = simulation.apart.find(key);
  return found == simulation.apart.end() ? std::string() : found->second;
}

/// One row per mark without a distance, with its reason.
Table gap_table(const DrapeInput& input, const RealVirtual& headline) {
  Table table({"row", "col", "reason"}, {0, 1});
  std::vector<Gap> gaps = input.measured.sheet.gaps;
  gaps.insert(gaps.end(), headline.marks.excluded.begin(), headline.marks.excluded.end());
  std::ranges::sort(gaps, {}, &Gap::mark);
  for (const Gap& gap : gaps)
    table.add({std::to_string(gap.mark.row), std::to_string(gap.mark.col), gap.reason});
  return table;
}

/// Further statistics of one comparison: each with its standard deviation from the marks and its
/// bootstrap interval, the mean along the normal, and the remainder after a rigid alignment.
Table trust_table(const DrapeInput& input, const RealVirtual& compared) {
  Table table = titled("Trust in the numbers, " + input.simulations[compared.simulation].label());
  const auto add = [&](const std::string& name, double value_m, const Trust& trust) {
    Row row(table);
    row.word("measure", "measure", name);
    row.number("value_mm", "value (mm)", mm_text(value_m));
    row.number("sigma_mm", "± from the marks (mm)", fine_mm(trust.sigma_m));
    const auto& range = trust.bootstrap;
    row.number("low_mm", "95 % over marks, from (mm)", range ? mm_text(range->low) : "");
    row.number("high_mm", "to (mm)", range ? mm_text(range->high) : "");
  };
  const DistanceStatistics& s = compared.statistics;
  add("mean (the paper's)", s.mean_m, s.mean);
  add("median", s.median_m, s.median);
  add("RMS", s.rms_m, s.rms);
  add("95th percentile", s.p95_m, s.p95);
  add("largest", s.max_m, s.max);
  add("mean along the normal, signed", compared.normal.mean_m, compared.normal.mean);
  add("mean to the nearest point of the surface", compared.to_surface.mean_m,
      compared.to_surface.mean);
  if (const auto& move = compared.aligned)
    add(fmt::format("mean left after one rigid move ({:.2f} mm, {:.2f} deg; not applied anywhere "
                    "else)",
                    move->centroid_shift_m / mm, move->turn_rad / deg),
        move->after.mean_m, move->after.mean);
  return table;
}

/// Meshes without material coordinates: distances to surfaces, which are not distances of marks.
Table surface_table(const DrapeInput& input, const Report& report) {
  Table table = titled(fmt::format(
      "Real vs surface, experiment {}: no material correspondence exists, so no mark has a place",
      report.name));
  for (const RealSurface& one : report.real_surface) {
    const OtherSurface& surface = input.surfaces[one.surface];
    const DistanceStatistics& s = one.to_surface;
    const auto& both = one.both_directions;
    Row row(table);
    row.word("simulator", "mesh", surface.simulator);
    row.number("to_surface_mean_mm", "marks to surface, mean (mm)", mm_text(s.mean_m));
    row.number("sigma_of_to_surface_mean_mm", "± (mm)", fine_mm(s.mean.sigma_m));
    row.number("to_surface_p95_mm", "p95 (mm)", mm_text(s.p95_m));
    row.number("to_surface_max_mm", "max (mm)", mm_text(s.max_m));
    const auto way = [&](const std::string& name, const char* heading, auto direction) {
      row.number(name + "_mean_mm", heading, both ? mm_text(((*both).*direction).mean_m) : "");
      row.number(name + "_max_mm", "Hausdorff (mm)",
                 both ? mm_text(((*both).*direction).hausdorff_m) : "");
    };
    way("real_to_mesh", "real surface to mesh, mean (mm)", &SurfaceDistance::first_to_second);
    way("mesh_to_real", "mesh to real surface, mean (mm)", &SurfaceDistance::second_to_first);
    row.number("marks", "marks", std::to_string(s.marks));
    row.number("triangles", "triangles", std::to_string(surface.mesh.triangles.size()));
  }
  return table;
}

/// Visits the measured sheet and every simulation of the paper's table with its drapemeter.
template <class Visit>
void visit_drapemeters(const DrapeInput& input, const Report& report, const Visit& visit) {
  visit("measured marks", report.measured_drapemeter);
  for (const RealVirtual& row : report.real_virtual)
    visit(input.simulations[row.simulation].label(), report.drapemeters[row.simulation]);
}

/// Covered area, drape coefficient, folds and their depth of every sheet that has them.
Table drapemeter_table(const DrapeInput& input, const Report& report) {
  Table table = titled("Drapemeter: the shadow from straight above");
  visit_drapemeters(input, report, [&](const std::string& sheet, const DrapemeterResult& result) {
    const auto& value = result.value;
    const auto cell = [&](double unit, const char* format, auto member) {
      return value ? text_in(unit, format, (*value).*member) : "";
    };
    Row row(table);
    row.word("sheet", "sheet", sheet);
    row.number("covered_area_mm2", "covered (mm²)",
               cell(mm * mm, "{:.0f}", &Drapemeter::covered_area_m2));
    row.number(
        "covered_percent_of_flat", "of the flat cloth (%)",
        value ? text_in(percent, "{:.1f}", value->covered_area_m2 / value->flat_area_m2) : "");
    row.number("drape_coefficient_percent", "drape coefficient (%)",
               cell(percent, "{:.1f}", &Drapemeter::drape_coefficient));
    row.number("folds", "folds", cell(1, "{:.0f}", &Drapemeter::folds));
    row.number("fold_depth_mm", "fold depth (mm)", cell(mm, "{:.1f}", &Drapemeter::fold_depth_m));
    row.word("remark", "remark",
             !value                     ? result.reason
             : value->drape_coefficient ? ""
                                        : "no coefficient: the object has no flat top");
  });
  return table;
}

/// Fourier amplitudes of the radius of each shadow's hem.
Table hem_table(const DrapeInput& input, const Report& report) {
  Table table({"sheet", "order", "amplitude_mm"}, {1, 2});
  table.title = "Waves around the hem";
  visit_drapemeters(input, report, [&](const std::string& sheet, const DrapemeterResult& result) {
    if (!result.value) return;
    for (const Harmonic& one : result.value->spectrum)
      table.add({sheet, std::to_string(one.order), mm_text(one.amplitude_m)});
  });
  return table;
}

/// Visits the measured sheet and the simulations that are complete grids, with their shapes.
template <class Visit>
void visit_shapes(const DrapeInput& input, const Visit& visit) {
  if (const auto shape = shape_of(input.measured.sheet)) visit("measured marks", *shape);
  for (const Simulation& simulation : input.simulations)
    if (const auto shape = shape_of(simulation.sheet.sheet)) visit(simulation.label(), *shape);
}

/// Folds and waves of every sheet that is a complete grid, in one number each.
Table shape_table(const DrapeInput& input) {
  constexpr const char* kHeadings[] = {"RMS curvature (1/m)", "height, sd (mm)", "wavelength (mm)",
                                       "folds", "length of folds (mm)"};
  Table table = titled("Folds and waves");
  visit_shapes(input, [&](const std::string& label, const SheetShape& shape) {
    Row row(table);
    row.word("sheet", "sheet", label);
    std::size_t k = 0;
    for (const Descriptor& one : descriptors_of(shape))
      row.number(one.name, kHeadings[k++], fmt::format("{:.5g}", one.value));
  });
  return table;
}

/// Power of height and curvature of the same sheets by wavelength.
Table wave_table(const DrapeInput& input) {
  Table table({"sheet", "from_mm", "to_mm", "height_mm2", "curvature_per_m2"}, {1, 2, 3, 4});
  visit_shapes(input, [&](const std::string& label, const SheetShape& shape) {
    for (const WaveBand& band : shape.bands)
      table.add({label, text_in(mm, "{:.5g}", band.from_m), text_in(mm, "{:.5g}", band.to_m),
                 text_in(mm * mm, "{:.5g}", band.height_m2),
                 text_in(1, "{:.5g}", band.curvature_per_m2)});
  });
  return table;
}

/// Edges and cells of the measured lattice with the strain of both sheets, per cent.
Table strain_table(const RealVirtual& row) {
  Table table({"kind", "row", "col", "to_row", "to_col", "real_percent", "simulated_percent"},
              {1, 2, 3, 4, 5, 6});
  for (const Strain& s : row.strain.strains)
    table.add({s.kind, std::to_string(s.from.row), std::to_string(s.from.col),
               std::to_string(s.to.row), std::to_string(s.to.col),
               text_in(percent, "{:.4f}", s.real), text_in(percent, "{:.4f}", s.simulated)});
  return table;
}

/// Errors by direction, with warp and weft separate.
Table direction_table(const DrapeInput& input, const Report& report) {
  Table table({"simulation", "mean_warp_mm", "mean_weft_mm", "mean_normal_mm", "rms_warp_mm",
               "rms_weft_mm", "rms_normal_mm"},
              {1, 2, 3, 4, 5, 6});
  table.title = "Where the real marks lie, seen from the virtual sheet";
  for (const RealVirtual& row : report.real_virtual) {
    const std::vector<MarkError>& marks = row.marks.marks;
    Eigen::Matrix3Xd errors(3, marks.size());
    for (std::size_t i = 0; i < marks.size(); ++i)
      errors.col(static_cast<Eigen::Index>(i)) = marks[i].warp_weft_normal_m / mm;
    const Eigen::Vector3d average = errors.rowwise().mean(),
                          rms = errors.rowwise().norm() /
                                std::sqrt(static_cast<double>(marks.size()));
    std::vector<std::string> cells = {input.simulations[row.simulation].label()};
    // Adding zero turns a rounded -0.00 into +0.00.
    for (int k = 0; k < 3; ++k)
      cells.push_back(fmt::format("{:+.2f}", std::round(average[k] * 100) / 100 + 0.0));
    for (int k = 0; k < 3; ++k) cells.push_back(fmt::format("{:.2f}", rms[k]));
    table.add(std::move(cells));
  }
  table.marked_row = report.headline;
  return table;
}

/// One column per simulation and one row per entry of the certificates, except options and fits.
Table certificate_table(const DrapeInput& input, const Report& report) {
  Table table = titled("What each simulation states about itself");
  table.names = {"certificate entry"};
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    if (!simulation.certificate) continue;
    table.names.push_back(simulation.label());
    for (auto& cells : table.rows) cells.emplace_back();
    for (const auto& [name, value] : simulation.certificate->entries) {
      if (name.starts_with("options.") || name.starts_with("curves.")) continue;
      auto cells =
          std::ranges::find_if(table.rows, [&](const auto& one) { return one.front() == name; });
      if (cells == table.rows.end()) {
        table.add(std::vector<std::string>(table.names.size()));
        cells = table.rows.end() - 1;
        cells->front() = name;
      }
      cells->back() = value;
    }
  }
  table.numeric.assign(table.names.size(), false);
  return table;
}

/// One row per contribution, largest first, and the total.
Table budget_table(const Budget& budget) {
  Table table;
  double squares = 0;
  for (const BudgetLine& line : budget.lines) squares += line.u_m * line.u_m;
  const auto add = [&](const std::string& what, const std::string& u, const std::string& share,
                       const std::string& origin) {
    Row row(table);
    row.word("contribution", "contribution", what);
    row.number("u_mm", "standard uncertainty of the mean, alone (mm)", u);
    row.number("share_percent", "part of the squares (%)", share);
    row.word("origin", "from", origin);
  };
  for (const BudgetLine& line : budget.lines)
    add(line.what, fine_mm(line.u_m),
        squares > 0 ? fmt::format("{:.1f}", 100 * line.u_m * line.u_m / squares) : "", line.origin);
  for (const std::string& what : budget.missing) add(what, "", "", "missing");
  add("U, which holds 95 of 100", fine_mm(budget.expanded_m), "", "");
  return table;
}

/// One row per criterion of the match.
Table basis_table(const Report& report) {
  Table table({"judged by", "verdict", "value", "limit", "p", "why"}, {2, 3, 4});
  for (const MatchBasis& basis : report.match.bases) {
    const std::string number = "{:.3f} " + basis.unit;
    table.add({basis.what, std::string(name_of(basis.verdict)),
               text_in(1, number.c_str(), basis.value), text_in(1, number.c_str(), basis.limit),
               text_in(1, "{:.3f}", basis.p), basis.reason});
  }
  return table;
}

/// One row per laying of the drape; empty if it was laid once.
Table repeats_table(const Report& report) {
  Table table({"repeat", "set", "face", "RMS from the drape's own (mm)", "left out because"}, {3});
  for (const RepeatLine& line : report.repeats)
    table.add({line.repeat, line.set, line.face, mm_text(line.from_own_m), line.left_out});
  return table;
}

const Branch& facts_of(const DrapeInput& input, const BranchComparison& one) {
  return *input.simulations[one.as_placed.simulation].branch;
}

/// The first branch given need not be the first of its list.
double least_j_of(const DrapeInput& input, const BranchSet& set) {
  const Branch& first = facts_of(input, set.branches.front());
  return first.least_j.value_or(first.energy_j);
}

/// Index of the largest change among the variants at rest.
std::optional<std::size_t> greatest(const std::vector<VariantEffect>& variants) {
  std::optional<std::size_t> best;
  for (std::size_t k = 0; k < variants.size(); ++k)
    if (variants[k].at_rest &&
        (!best || std::abs(variants[k].change_m) > std::abs(variants[*best].change_m)))
      best = k;
  return best;
}

bool holds(const HashedFiles& inputs, const std::string& sha256) {
  return std::ranges::any_of(inputs, [&](const auto& input) { return input.second == sha256; });
}

/// True if the inputs contain the fabric: sheets hash its files jointly, records singly.
bool hold_fabric(const HashedFiles& inputs, const std::string& sha256) {
  for (std::size_t first = 0; first < inputs.size(); ++first) {
    std::string all;
    for (std::size_t i = first; i < std::min(inputs.size(), first + kFabricFiles); ++i) {
      all += inputs[i].second + "\n";
      if (sha256_of(std::string_view(all)) == sha256) return true;
    }
  }
  return false;
}

}  // namespace

std::string in_words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
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

Table real_virtual_table(const DrapeInput& input, const Report& report) {
  Table table = titled(fmt::format("Real vs virtual, experiment {}", report.name));
  const bool models = several_models(input);
  const std::set<std::string> keys = apart_keys(input);
  for (const RealVirtual& compared : report.real_virtual) {
    const Simulation& one = input.simulations[compared.simulation];
    const DistanceStatistics& s = compared.statistics;
    const Eigen::Vector2d part = percent_of_patch(s.mean_m, input.measured.sheet.patch_m);
    Row row(table);
    row.word(
        "discretisation", "discretisation",
        one.discretisation() + (one.branch ? fmt::format(", branch {}", one.branch->number) : ""));
    row.number("segments", "segments", one.segments_text());
    row.number("mean_dist_mm", "mean dist (mm)", mm_text(s.mean_m));
    row.number("sigma_mean_mm", "noise of the marks in it (mm)", mm_text(s.sigma_mean_m));
    row.number("shape_mm", "shape: after a rigid move (mm)", mm_text(s.shape_m));
    row.number("place_mm", "place: the move (mm)", mm_text(s.place_m));
    row.number("place_deg", "and turn (°)", text_in(deg, "{:.2f}", s.turn_rad));
    row.number("median_mm", "median (mm)", mm_text(s.median_m));
    row.number("rms_mm", "RMS (mm)", mm_text(s.rms_m));
    row.number("p95_mm", "p95 (mm)", mm_text(s.p95_m));
    row.number("max_mm", "max (mm)", mm_text(s.max_m));
    row.number("mean_percent_of_warp_side", "mean (% of warp)", text_in(1, "{:.2f}", part.x()));
    row.number("mean_percent_of_weft_side", "mean (% of weft)", text_in(1, "{:.2f}", part.y()));
    row.number("marks", "marks", std::to_string(s.marks));
    row.word("at rest", "at rest",
             one.other_simulator                ? "not stated"
             : one.source().status == "at rest" ? "yes"
                                                : "no");
    if (models) row.word("model", "model", one.source().model);
    for (const std::string& key : keys) row.word(key, key, apart_value(one, key));
  }
  return table;
}

Table pair_table(const std::string& name, const std::vector<VirtualVirtual>& pairs) {
  Table table = titled(fmt::format("Virtual vs virtual, experiment {}", name));
  const auto add = [&](const VirtualVirtual& pair) {
    Row row(table);
    row.word("pair", "pair", pair.label + pair.apart);
    row.number("mean_dist_mm", "mean dist (mm)", mm_text(pair.statistics.mean_m));
    row.number("max_mm", "max (mm)", mm_text(pair.statistics.max_m));
    row.number("surface_mean_mm", "surfaces, mean (mm)", mm_text(pair.surface.mean_m()));
    row.number("hausdorff_mm", "Hausdorff (mm)", mm_text(pair.surface.hausdorff_m()));
    row.number("points", "points", std::to_string(pair.statistics.marks));
  };
  for (const VirtualVirtual& pair : pairs) add(pair);
  if (!pairs.empty()) return table;
  add({});  // names the columns
  table.rows.clear();
  return table;
}

Table mark_table(const DrapeInput& input, const Report& report) {
  Table table;
  std::vector<std::string> names;
  for (const RealVirtual& compared : report.real_virtual) {
    const Simulation& one = input.simulations[compared.simulation];
    std::string name = fmt::format("dist_{}_{}", one.discretisation(), one.segments_text());
    if (several_models(input)) name += "_" + one.source().model;
    for (const std::string& key : apart_keys(input))
      if (const std::string value = apart_value(one, key); !value.empty())
        name += fmt::format("_{}_{}", key, value);
    if (one.branch) name += fmt::format("_branch_{}", one.branch->number);
    std::erase(name, ' ');
    names.push_back(name + "_mm");
  }
  for (const SheetMark& mark : input.measured.sheet.marks) {
    Row row(table);
    const auto number = [&](const std::string& name, std::string cell) {
      row.number(name, name, std::move(cell));
    };
    number("row", std::to_string(mark.mark.row));
    number("col", std::to_string(mark.mark.col));
    number("x_mm", mm_text(mark.point_in_world.x()));
    number("y_mm", mm_text(mark.point_in_world.y()));
    number("z_mm", mm_text(mark.point_in_world.z()));
    number("sigma_mm", fine_mm(worst_sigma_m(mark)));
    number("views", mark.views ? std::to_string(*mark.views) : "");
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto& marks = report.real_virtual[k].marks.marks;
      const auto found = std::ranges::lower_bound(marks, mark.mark, {}, &MarkError::mark);
      const bool known = found != marks.end() && found->mark == mark.mark;
      number(names[k], known ? mm_text(found->distance_m) : "");
    }
  }
  return table;
}

Table branch_table(const DrapeInput& input, const Report& report, const BranchSet& set) {
  Table table = titled(
      fmt::format("Branches, experiment {}: equilibria of {}, by energy", report.name, set.label));
  const double least_j = least_j_of(input, set);
  for (const BranchComparison& one : set.branches) {
    const Branch& branch = facts_of(input, one);
    const RealVirtual& compared = one.as_placed;
    Row row(table);
    row.number("branch", "branch", std::to_string(branch.number));
    row.number("energy_uJ", "energy (µJ)", text_in(kMicrojoule, "{:.2f}", branch.energy_j));
    row.number("above_least_uJ", "above least (µJ)",
               text_in(kMicrojoule, "{:.2f}", branch.energy_j - least_j));
    row.number("starts", "starts", std::to_string(branch.starts.size()));
    row.number("share_percent", "share of starts (%)", text_in(percent, "{:.0f}", branch.fraction));
    row.number("hem_nodes", "folds of the hem", std::to_string(branch.hem_nodes));
    row.word("stable", "stable", branch.stable ? "yes" : "no, a saddle");
    row.number("mean_dist_mm", "mean dist (mm)", mm_text(compared.statistics.mean_m));
    row.number("shape_mm", "shape (mm)", mm_text(compared.statistics.shape_m));
    row.number("max_mm", "max (mm)", mm_text(compared.statistics.max_m));
    if (set.branches.front().turned) {
      row.number("turned_mean_mm", "mean after best turn (mm)", mm_text(one.turned->mean_m));
      row.number("turn_deg", "turn (°)", text_in(deg, "{:.1f}", one.turned->turn_rad));
      row.word("half_turn", "sheet half turned", one.turned->half_turn ? "yes" : "no");
    }
    std::string role = branch.number == 1 ? "least energy" : "";
    if (&one == &set.branches[set.nearest]) role += role.empty() ? "nearest" : ", nearest";
    row.word("role", "role", role);
  }
  table.marked_row = set.nearest;
  return table;
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

std::optional<std::string> other_origin(const HashedFiles& inputs, const DrapeInput& drape) {
  if (!holds(inputs, drape.measured.sha256)) return "was not made from the sheet as it is now";
  const Simulation* first = drape.speaker();
  if (first == nullptr || first->other_simulator) return std::nullopt;
  const SimulatedSource& source = first->source();
  for (const auto& [is_it, what] : {std::pair(holds(inputs, source.scene_sha256), "scene"),
                                    std::pair(hold_fabric(inputs, source.fabric_sha256), "fabric")})
    if (!is_it)
      return fmt::format("was not made from the {} that was simulated ({})", what, first->label());
  return std::nullopt;
}

std::optional<std::string> other_base(const SensitivityFile& split, const DrapeInput& drape) {
  if (!split.spacing_m && !split.rows) return "does not say of which mesh it is";
  const Simulation& speaker = *drape.speaker();
  const SimulatedSource& source = speaker.source();
  const Sheet& sheet = speaker.sheet.sheet;
  const bool same_cloth =
      split.spacing_m && source.spacing_m
          ? std::abs(*split.spacing_m - *source.spacing_m) < 1e-6 * mm
          : !source.spacing_m && sheet.rows == split.rows && sheet.cols == split.cols;
  if (same_cloth && source.segments == split.segments && source.model == split.model)
    return std::nullopt;
  const std::string cloth = split.spacing_m
                                ? fmt::format("{:g} mm", *split.spacing_m / mm)
                                : fmt::format("{}x{}", *split.rows, split.cols.value_or(0));
  return fmt::format("is of {}, {} segment{} ({}), not of {}", cloth, split.segments,
                     split.segments == 1 ? "" : "s", split.model, speaker.label());
}

Table value_effect_table(const SensitivityFile& split) {
  Table table = titled("One per cent more of a fabric value, to first order");
  std::vector<ValueEffect> values = split.values;
  std::ranges::stable_sort(values, std::greater(),
                           [](const ValueEffect& one) { return std::abs(one.change_m); });
  for (const ValueEffect& one : values) {
    Row row(table);
    row.word("value", "fabric value", in_words(one.value));
    row.number("change_mm_per_percent", "mean dist changes (mm per %)",
               text_in(mm, "{:+.4f}", one.change_m));
    row.number("marks_move_mm_per_percent", "marks move (mm per %)", fine_mm(one.moved_m));
  }
  return table;
}

Table variant_effect_table(const SensitivityFile& split) {
  Table table = titled("One part of the model changed");
  for (const VariantEffect& one : split.variants) {
    Row row(table);
    row.word("variant", "changed", one.what);
    row.word("from", "draped again from", one.continued ? "the drape" : "the start");
    row.number("mean_dist_mm", "mean dist (mm)", mm_text(one.distance_m));
    row.number("change_mm", "change (mm)", text_in(mm, "{:+.3f}", one.change_m));
    row.number("marks_move_mm", "marks move (mm)", mm_text(one.moved_m));
    row.word("at_rest", "at rest", one.at_rest ? "yes" : "no");
  }
  table.marked_row = greatest(split.variants);
  return table;
}

std::string error_split_sentence(const SensitivityFile& split) {
  const auto best = greatest(split.variants);
  if (!best) return {};
  const VariantEffect& one = split.variants[*best];
  return fmt::format(
      "of the changes, {} (draped again from {}) moves the mean distance most, by "
      "{:+.3f} mm from {:.3f} mm",
      one.what, one.continued ? "the drape" : "the start", one.change_m / mm,
      split.distance_m / mm);
}

std::vector<ReportedTable> tables_of(const DrapeInput& input, const Report& report,
                                     const std::optional<SensitivityFile>& split) {
  std::vector<ReportedTable> tables;
  const auto add = [&](const std::string& name, Table table, const char* note = "") {
    if (!table.rows.empty()) tables.push_back({name, note, std::move(table)});
  };
  if (!report.real_surface.empty())
    add("real-vs-surface", surface_table(input, report),
        "These meshes do not say which point of the cloth a vertex is. A distance to a surface is "
        "at most the distance of the same material point: cloth that slid along itself has none. "
        "The distance from the mesh contains the hem and the gaps, where nothing was measured.");
  if (!report.headline) return tables;
  const RealVirtual& headline = report.speaks();
  Table real = real_virtual_table(input, report);
  real.marked_row = report.headline;
  add("real-vs-virtual", std::move(real));
  for (std::size_t i = 0; i < report.branch_sets.size(); ++i)
    add(i == 0 ? "branches" : fmt::format("branches-{}", i + 1),
        branch_table(input, report, report.branch_sets[i]));
  add("virtual-vs-virtual", pair_table(report.name, report.virtual_virtual),
      report.lattice_has_gaps_filled
          ? "Simulations are compared at all marks of the lattice, the ones that were not measured "
            "included."
          : "Simulations are compared at the measured marks.");
  add("trust", trust_table(input, headline),
      "± is what the measurement leaves open; the interval is what other marks on the same cloth "
      "might have given (2,000 bootstrap resamples). The rigid move is shown to judge placement; "
      "no other number uses it.");
  add("direction", direction_table(input, report),
      "Real minus virtual along the warp tangent, the weft tangent and the normal (out of the "
      "printed side) of the virtual sheet. Where the cloth shears, the two tangents are not at "
      "right angles and the squares do not add up.");
  if (report.budget)
    add("budget", budget_table(*report.budget),
        "U is the half width that holds 95 of 100 means, the root of the sum of the squares of the "
        "lines with its coverage factor; each line is what its input alone moves. It holds no "
        "repeat of the real drape and no other equilibrium, and what friction leaves open only "
        "where an ensemble was made.");
  add("judged-by", basis_table(report));
  add("repeats", repeats_table(report));
  add("marks", mark_table(input, report));
  add("gaps", gap_table(input, headline));
  add("strain", strain_table(headline),
      "Length of the straight line between neighbouring marks and area between four of them "
      "against the flat print; a fold between two marks makes it shorter.");
  add("drapemeter", drapemeter_table(input, report));
  add("hem", hem_table(input, report),
      "Fourier amplitudes of the radius of the hem's shadow over the angle; a square patch has its "
      "own 4, 8, 12.");
  add("folds", shape_table(input));
  add("waves", wave_table(input));
  add("certificates", certificate_table(input, report),
      "Options and curve fits are in the full certificate.json beside each simulated sheet, and in "
      "the store.");
  if (!split) return tables;
  add("fabric-values", value_effect_table(*split));
  add("model-changes", variant_effect_table(*split),
      "drape simulate sensitivity drapes the scene once more and repeats it with one thing "
      "changed: from the drape itself, which keeps the branch, and from the start, which may end "
      "on another. The changes do not add up.");
  return tables;
}

}  // namespace drape::compare
