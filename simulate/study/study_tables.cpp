// SPDX-License-Identifier: Apache-2.0
// Our virtual-virtual distances beside those of the paper's even tables.
#include <fmt/format.h>

#include <array>
#include <map>
#include <tuple>

#include "core/files/csv.hpp"
#include "core/units.hpp"
#include "simulate/study/study.hpp"

namespace drape::simulate {
namespace {

struct Side {
  int grid, segments;
};

/// The pairs of the paper's even tables, in their order.
constexpr std::array<std::pair<Side, Side>, 6> kPairs = {{{{11, 5}, {11, 1}},
                                                          {{21, 5}, {21, 1}},
                                                          {{11, 1}, {21, 1}},
                                                          {{11, 5}, {21, 5}},
                                                          {{11, 5}, {31, 5}},
                                                          {{21, 5}, {31, 5}}}};

/// Printed mean distances in mm by experiment, grid, segments, other grid, other segments.
using Printed = std::map<std::tuple<std::string, int, int, int, int>, double>;

Printed read_printed(const std::filesystem::path& file) {
  Printed printed;
  const CsvText csv = read_csv_text(file);
  for (std::size_t row = 0; row < csv.rows.size(); ++row) {
    const auto mean_mm = csv.number(row, "mean_distance_mm");
    if (!mean_mm || csv.rows[row][csv.column("kind")] != "virtual-virtual") continue;
    const auto whole = [&](const char* name) {
      return static_cast<int>(csv.number(row, name).value_or(0));
    };
    printed[{csv.rows[row][csv.column("experiment")], whole("grid"), whole("segments"),
             whole("against_grid"), whole("against_segments")}] = *mean_mm;
  }
  return printed;
}

class Tables {
 public:
  Tables(const std::vector<StudyOutcome>& outcomes, Printed printed)
      : printed_(std::move(printed)) {
    for (const StudyOutcome& o : outcomes) {
      found_[{o.the_case.scene, o.the_case.model, o.the_case.grid, o.the_case.segments}] = &o;
      const StudyCase*& coarsest = coarsest_[o.the_case.scene];
      if (coarsest == nullptr || o.the_case.grid < coarsest->grid) coarsest = &o.the_case;
    }
  }

  std::string row(const std::string& scene, const std::string& model) const {
    std::string text = fmt::format("| {} | {} |", scene, model);
    for (const auto& [a, b] : kPairs) {
      const std::string cell = this->cell(scene, model, a, b);
      const auto print = printed_.find({scene, a.grid, a.segments, b.grid, b.segments});
      text += " " + cell + (print == printed_.end() ? "" : fmt::format(" ({:g})", print->second)) +
              " |";
    }
    return text + "\n";
  }

 private:
  /// The mean distance in mm; "*" marks a sheet that is not at rest, "-" a run that is missing.
  std::string cell(const std::string& scene, const std::string& model, Side a, Side b) const {
    const auto first = found_.find({scene, model, a.grid, a.segments});
    const auto second = found_.find({scene, model, b.grid, b.segments});
    if (first == found_.end() || second == found_.end()) return "-";
    const std::optional<double> distance =
        mean_distance_m(read_sheet(first->second->the_case.folder / "sheet.ply"),
                        read_sheet(second->second->the_case.folder / "sheet.ply"),
                        read_sheet(coarsest_.at(scene)->folder / "sheet.ply"));
    if (!distance) return "-";
    return fmt::format("{:.2f}{}", *distance / units::mm,
                       first->second->at_rest && second->second->at_rest ? "" : "*");
  }

  Printed printed_;
  std::map<std::tuple<std::string, std::string, int, int>, const StudyOutcome*> found_;
  std::map<std::string, const StudyCase*> coarsest_;
};

}  // namespace

std::string study_tables(const std::vector<StudyOutcome>& outcomes,
                         const std::optional<std::filesystem::path>& published) {
  std::string text =
      "Mean distance in mm at the particles of the scene's coarsest grid (in brackets: as the "
      "paper "
      "prints it; *: not at rest)\n\n| scene | model |";
  for (const auto& [a, b] : kPairs) {
    text += a.grid == b.grid ? fmt::format(" {}: {} vs {} seg |", a.grid, a.segments, b.segments)
                             : fmt::format(" {} seg: {} vs {} |", a.segments, a.grid, b.grid);
  }
  text += "\n|---|---|---|---|---|---|---|---|\n";
  const Tables tables(outcomes, published ? read_printed(*published) : Printed{});
  std::pair<std::string, std::string> last;
  for (const StudyOutcome& o : outcomes) {
    const std::pair<std::string, std::string> now{o.the_case.scene, o.the_case.model};
    if (now != last) text += tables.row(now.first, now.second);
    last = now;
  }
  return text;
}

}  // namespace drape::simulate
