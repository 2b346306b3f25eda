// SPDX-License-Identifier: Apache-2.0
#include "compare/hems/hem_csv.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <regex>

#include "compare/hems/hem_checks.hpp"
#include "core/files/csv.hpp"
#include "core/program/similar.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

const std::regex kRadius("r[0-9]{3}");
/// Columns that identify a hem, its test and its verdict.
const std::vector<std::string> kAbout = {"fabric", "sample",  "face",        "repeat",
                                         "file",   "disc_mm", "specimen_mm", "specimen_area_mm2",
                                         "no_go"};

/// Throws for an unknown column, which may be the one that distinguishes two fabrics.
void require_known_columns(const CsvText& table, const HemReadOptions& options) {
  std::vector<std::string> known = kAbout;
  const Hem any = hem_of_radii(std::vector<double>(36, options.geometry.specimen_m / 2));
  for (const HemNumber& number : numbers_of(any, options.geometry))
    for (const char* before : {"", "u_"}) known.push_back(before + number.name);
  for (auto name = table.names.begin(); name != table.names.end(); ++name) {
    const Where where{.file = table.file.string(), .line = table.head_line, .field = *name};
    if (std::find(table.names.begin(), name, *name) != name)
      throw bad_input(fmt::format("the column `{}` stands there twice", *name), where,
                      "remove one of them");
    if (std::regex_match(*name, kRadius) ||
        std::find(known.begin(), known.end(), *name) != known.end())
      continue;
    std::string small = *name;
    for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    throw bad_input(
        fmt::format("a table of hems has no column `{}`{}", *name, did_you_mean(small, known)),
        where,
        fmt::format("remove it, or name it as hems.csv does: {}, a number or r000 ..",
                    fmt::join(kAbout, ", ")));
  }
}

/// The columns r000 .. of a table, sorted by angle.
std::vector<std::string> columns_of_radii(const CsvText& table) {
  std::vector<std::string> angles;
  for (const std::string& name : table.names)
    if (std::regex_match(name, kRadius)) angles.push_back(name);
  std::sort(angles.begin(), angles.end());
  const std::string asked = "give r000, r005 .. r355 in mm, or other equal steps all round";
  if (angles.size() < 36)
    throw bad_input(fmt::format("{} columns of radii", angles.size()),
                    {.file = table.file.string()}, asked);
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double expected = 360.0 * static_cast<double>(i) / static_cast<double>(angles.size());
    if (std::abs(std::stoi(angles[i].substr(1)) - expected) > 0.5)  // columns: whole degrees
      throw bad_input(
          fmt::format("the {} columns of radii do not go round in equal steps: at {:.1f} "
                      "degrees stands {}",
                      angles.size(), expected, angles[i]),
          {.file = table.file.string(), .field = angles[i]}, asked);
  }
  return angles;
}

/// One row of the table.
class Row {
 public:
  Row(const CsvText& table, std::size_t row) : table_(table), row_(row) {}

  [[nodiscard]] Where where(const std::string& field = {}) const {
    return {.file = table_.file.string(), .line = table_.lines[row_], .field = field};
  }
  [[nodiscard]] std::string text(const std::string& name) const {
    return table_.has(name) ? table_.rows[row_][table_.column(name)] : std::string();
  }
  [[nodiscard]] std::optional<double> number(const std::string& name) const {
    return table_.has(name) ? table_.number(row_, name) : std::nullopt;
  }
  /// Positive value in units of `unit`; nullopt if the cell or column is absent.
  [[nodiscard]] std::optional<double> positive(const std::string& name, double unit) const {
    const auto value = number(name);
    if (!value) return std::nullopt;
    if (*value <= 0)
      throw bad_input(fmt::format("{:g} is not above 0", *value), where(name), "correct it");
    return *value * unit;
  }
  /// Expanded uncertainty of a column; nullopt if not stated.
  [[nodiscard]] std::optional<double> u(const std::string& of) const {
    const auto value = number("u_" + of);
    if (value && *value < 0)
      throw bad_input("an uncertainty is below 0", where("u_" + of), "correct it");
    return value;
  }

 private:
  const CsvText& table_;
  std::size_t row_;
};

/// Radii are outermost: if folds overhang, the covered area is smaller than they suggest.
void take_areas(const Row& row, Hem& hem) {
  hem.flat_area_m2 = row.positive("specimen_area_mm2", mm * mm);
  const auto area_m2 = row.positive("area_mm2", mm * mm);
  if (!area_m2) return;
  if (std::abs(std::sqrt(*area_m2 / hem.area_m2) - 1) > kLengthTolerance)
    throw bad_input(fmt::format("the area is {:.4g} mm2, that of the radii {:.4g} mm2",
                                *area_m2 / (mm * mm), hem.area_m2 / (mm * mm)),
                    row.where("area_mm2"), "correct one of them, or remove the column");
  hem.area_m2 = *area_m2;
}

/// Adds U of the measurement to any uncertainty given on the command line.
void add_u(const Row& row, std::vector<HemNumber>& numbers) {
  for (HemNumber& number : numbers) {
    if (const auto u = row.u(number.name)) number.u = std::hypot(*u, number.u.value_or(0));
  }
}

std::string why_no_go(const HemRecord& hem) {
  if (hem.go) return {};
  return hem.warnings.empty() ? "NO-GO" : fmt::format("{}", fmt::join(hem.warnings, "; "));
}

/// Quotes a cell, so that no reader takes it for a comment or the end of the line.
std::string quoted(const std::string& text) {
  std::string line = text;
  for (char& c : line)
    if (c == '\n' || c == '\r') c = ' ';
  const std::string cell = csv_cell(line);
  const bool plain = cell.find('#') == std::string::npos || cell.front() == '"';
  return plain ? cell : '"' + cell + '"';
}

}  // namespace

std::vector<HemRecord> read_hems_csv(const fs::path& file, const HemReadOptions& options) {
  const CsvText table = read_csv_text(file);
  require_known_columns(table, options);
  const std::vector<std::string> angles = columns_of_radii(table);
  if (table.rows.empty())
    throw bad_input("the table has no row", {.file = file.string()}, "give a row per hem");
  std::vector<HemRecord> records;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const Row row(table, i);
    HemRecord record;
    record.file = fmt::format("{}:{}", file.string(), table.lines[i]);
    record.fabric = row.text("fabric");
    record.sample = row.text("sample");
    record.face = row.text("face");
    record.repeat = row.text("repeat");
    require_geometry(row.positive("disc_mm", mm), row.positive("specimen_mm", mm), options.geometry,
                     row.where());
    std::vector<double> radius_m;
    for (const std::string& name : angles) {
      const std::optional<double> r = row.positive(name, mm);
      if (!r)
        throw bad_input("a hem's radius is missing", row.where(name), "give every radius in mm");
      radius_m.push_back(*r);
    }
    record.hem = hem_of_radii(radius_m);
    take_areas(row, record.hem);
    record.own_specimen = record.hem.flat_area_m2 && !row.number("specimen_mm");
    evaluate(record, {}, options, row.u("area_mm2").value_or(0) * mm * mm);
    add_u(row, record.numbers);
    if (const std::string reason = row.text("no_go"); !reason.empty()) {
      record.go = false;
      record.warnings.push_back(reason);
    }
    records.push_back(std::move(record));
  }
  return records;
}

std::string hems_csv(const DrapemeterGeometry& geometry, const std::vector<HemRecord>& hems) {
  constexpr int kAngles = 72;
  std::string text = fmt::format("{}", fmt::join(kAbout, ","));
  if (!hems.empty())
    for (const HemNumber& number : hems.front().numbers)
      text += fmt::format(",{0},u_{0}", number.name);
  for (int i = 0; i < kAngles; ++i) text += fmt::format(",r{:03d}", 360 / kAngles * i);
  text += '\n';
  for (const HemRecord& hem : hems) {
    for (const std::string& name : {hem.fabric, hem.sample, hem.face, hem.repeat, hem.file})
      text += quoted(name) + ',';
    const auto& flat_m2 = hem.hem.flat_area_m2;
    text += fmt::format("{:.10g},{},{},{}", geometry.disc_m / mm,
                        hem.own_specimen ? "" : fmt::format("{:.10g}", geometry.specimen_m / mm),
                        flat_m2 ? fmt::format("{:.6g}", *flat_m2 / (mm * mm)) : "",
                        quoted(why_no_go(hem)));
    for (const HemNumber& number : hem.numbers)
      text +=
          fmt::format(",{:.6g},{}", number.value, number.u ? fmt::format("{:.3g}", *number.u) : "");
    const std::size_t step = hem.hem.radius_m.size() / kAngles;
    for (std::size_t i = 0; i < kAngles; ++i)
      text += fmt::format(",{:.4f}", hem.hem.radius_m[i * step] / mm);
    text += '\n';
  }
  return text;
}

}  // namespace drape::compare
