// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/files/csv.hpp"
#include "core/files/files.hpp"
#include "front/check/check.hpp"
#include "front/process.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

/// A curve named in the fabric file.
struct Curve {
  std::string kind, direction, field;
  fs::path file;
};

std::vector<Curve> curves_of(const Document& fabric) {
  std::vector<Curve> curves;
  for (const char* kind : {"tensile", "shear", "bending"}) {
    const Value* table = fabric.root().find(kind);
    for (const char* direction : {"warp", "weft"}) {
      const Value* name = table == nullptr ? nullptr : table->find(direction);
      const auto* text = name == nullptr ? nullptr : name->get_if<std::string>();
      if (text != nullptr)
        curves.push_back(
            {kind, direction, fmt::format("{}.{}", kind, direction), fabric.beside(*text)});
    }
  }
  return curves;
}

/// True if the fabric file marks curves of this kind as not measured.
bool is_stand_in(const Document& fabric, const std::string& kind) {
  const Value* names = fabric.root().find("stand_ins");
  return names != nullptr && one_line(*names).find(kind + " curves") != std::string::npos;
}

/// Finds curves of another direction or another fabric, and one file used for both directions.
void check_curve_names(const Document& fabric, BenchCheck& check) {
  std::map<fs::path, int> folders;
  std::map<std::pair<std::string, fs::path>, std::string> used;
  std::vector<Curve> curves;
  for (const Curve& curve : curves_of(fabric)) {
    if (is_stand_in(fabric, curve.kind)) continue;
    const std::string other = curve.direction == "warp" ? "weft" : "warp";
    const std::string name = curve.file.filename().string();
    if (name.find(other) != std::string::npos && name.find(curve.direction) == std::string::npos)
      check.add(fabric, curve.field,
                fmt::format("{} names {}, a curve along the {}", curve.field, name, other),
                "are warp and weft exchanged?");
    if (const auto [first, fresh] = used.emplace(std::pair{curve.kind, curve.file}, curve.field);
        !fresh)
      check.add(fabric, curve.field, fmt::format("{} is also {}", name, first->second),
                fmt::format("name the curve along the {}, or list \"{} curves\" in stand_ins",
                            curve.direction, curve.kind));
    ++folders[curve.file.parent_path()];
    curves.push_back(curve);
  }
  if (folders.size() < 2 || curves.size() < 3) return;
  const auto usual =
      std::max_element(folders.begin(), folders.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  if (2 * usual->second <= static_cast<int>(curves.size())) return;
  for (const Curve& curve : curves)
    if (curve.file.parent_path() != usual->first)
      check.add(
          fabric, curve.field,
          fmt::format("{} is not in {}, where most curves of this fabric are", curve.file.string(),
                      usual->first.string()),
          "is it the curve of another fabric? Copy it to the others, or list it in stand_ins");
}

/// Finds a missing curve file, or one that holds only its header.
void check_curve(const Document& fabric, const Curve& curve, BenchCheck& check) {
  if (!fs::is_regular_file(curve.file))
    return check.add(fabric, curve.field, fmt::format("there is no curve {}", curve.file.string()),
                     "correct the name, or put the file there");
  const Where where{.file = curve.file.string(), .field = curve.field};
  const std::string text = read_text(curve.file);
  const bool unix_ends = text.find('\n') != std::string::npos;
  if (text.find('\0') != std::string::npos || (!unix_ends && text.find('\r') != std::string::npos))
    check.problems.push_back(
        bad_input(unix_ends ? "the curve is text of two bytes a letter (UTF-16)"
                            : "the lines end as on an old Macintosh",
                  where, "save it as UTF-8 (CSV) with the line ends of Unix or Windows"));
  else if (std::count(text.begin(), text.end(), '\n') < 3)
    check.problems.push_back(
        bad_input("the curve has no points", where,
                  "fill in what the test measured, below the names of the columns"));
}

/// Checks the largest load: KES-FB1 stops at 500 gf/cm, at 50 for weak fabrics, FAST-3 at 98.
void judge_tensile(const fs::path& file, BenchCheck& check) {
  constexpr double kLeast_gf_per_cm = 20;
  const Csv curve =
      read_csv(file, {"strain_percent", "loading_force_gf_per_cm", "unloading_force_gf_per_cm"});
  if (curve.lines.empty() || curve.columns[1].back() >= kLeast_gf_per_cm) return;
  check.problems.push_back(bad_input(
      fmt::format("the curve ends at {:g} gf/cm; tests go to 50 or 500 (KES) or 98 (FAST)",
                  curve.columns[1].back()),
      {.file = file.string(), .field = "loading_force_gf_per_cm"},
      "is the force in N/cm (1 N/cm is 102 gf/cm), or is the end of the curve missing?"));
}

}  // namespace

void check_fabric(const fs::path& file, const std::vector<int>& segments, BenchCheck& check) {
  const std::size_t before = check.problems.size();
  ++check.files;
  try {
    const Document fabric = Document::read(file);
    for (const Curve& curve : curves_of(fabric)) check_curve(fabric, curve, check);
    check_curve_names(fabric, check);
    if (check.problems.size() > before) return;
    for (const Curve& curve : curves_of(fabric))
      if (curve.kind == "tensile") judge_tensile(curve.file, check);
  } catch (const Error& error) {
    check.add(error.each());
  }
  if (check.problems.size() > before) return;
  for (const int count : segments) {
    const StepResult result =
        result_of_stage("fabric", {file.string(), "--segments", std::to_string(count), "--json"});
    if (const auto error = error_in(result)) {
      check.problems.push_back(*error);
      return;
    }
    // Only warnings that name a place; the others list unmeasured values.
    for (const std::string& warning : warnings_in(result))
      if (count == segments.front() && warning.starts_with(file.string() + ", "))
        check.warnings.push_back(warning);
  }
}

}  // namespace drape
