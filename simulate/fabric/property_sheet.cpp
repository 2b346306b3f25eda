// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/property_sheet.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/files/csv.hpp"

namespace drape::simulate {
namespace {

/// Spelling of a unit without what people write differently: spaces, dots, brackets, carets.
std::string plain(const std::string& unit) {
  std::string text;
  for (std::size_t i = 0; i < unit.size(); ++i) {
    static const std::vector<std::pair<std::string, std::string>> signs = {
        {"\u00b2", "2"}, {"\u00b7", ""}, {"\u00b0", "deg"}, {"\u00b5", "u"}, {"\u03bc", "u"}};
    const auto sign = std::find_if(signs.begin(), signs.end(), [&](const auto& known) {
      return unit.compare(i, known.first.size(), known.first) == 0;
    });
    if (sign != signs.end()) {
      text += sign->second;
      i += sign->first.size() - 1;
    } else if (std::string(" .*()^").find(unit[i]) == std::string::npos) {
      text += unit[i];
    }
  }
  return text;
}

}  // namespace

double factor_of(const UnitTable& table, const std::string& unit, const Where& where) {
  std::string known;
  for (const auto& [name, factor] : table) {
    if (name == plain(unit)) return factor;
    known += (known.empty() ? "" : ", ") + (name.empty() ? std::string("none") : name);
  }
  throw bad_input(fmt::format("`{}` is no unit of this property", unit), where, "known: " + known);
}

PropertySheet::PropertySheet(const std::filesystem::path& file,
                             const std::map<std::string, UnitTable>& known)
    : file_(file) {
  const CsvText table = read_csv_text(file);
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const std::string property = table.rows[row][table.column("property")];
    const Where where{.file = file.string(), .line = table.lines[row], .field = property};
    const auto found = known.find(property);
    if (found == known.end()) {
      std::string names;
      for (const auto& [name, units] : known) names += (names.empty() ? "" : ", ") + name;
      throw bad_input("an unknown property", where, "known: " + names);
    }
    if (has(property)) throw bad_input("a property twice", where, "keep one row");
    const double factor = factor_of(found->second, table.rows[row][table.column("unit")], where);
    Row read{table.lines[row], {table.number(row, "warp"), table.number(row, "weft")}};
    for (auto& value : read.values)
      if (value) *value *= factor;
    rows_[property] = read;
  }
}

Where PropertySheet::where(const std::string& property) const {
  Where where{.file = file_.string(), .field = property};
  if (has(property)) where.line = rows_.at(property).line;
  return where;
}

double PropertySheet::along(const std::string& property, int direction) const {
  if (has(property))
    if (const auto value = rows_.at(property).values[direction]) return *value;
  throw bad_input(
      fmt::format("{} is missing along the {}", property, direction == 0 ? "warp" : "weft"),
      where(property), "warp and weft are never merged: give both");
}

std::optional<double> PropertySheet::whole(const std::string& property) const {
  if (!has(property)) return std::nullopt;
  const auto& [warp, weft] = rows_.at(property).values;
  if (warp && weft && *warp != *weft)
    throw bad_input(fmt::format("{} has two values, but the whole cloth has one", property),
                    where(property), "keep the right one, or the mean of two specimens");
  return warp ? warp : weft;
}

}  // namespace drape::simulate
