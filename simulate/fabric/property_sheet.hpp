// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"

namespace drape::simulate {

/// Units of a quantity and what one of them is in the unit that fabric.toml has.
using UnitTable = std::vector<std::pair<std::string, double>>;

/// Refuses an unknown unit by name.
[[nodiscard]] double factor_of(const UnitTable& table, const std::string& unit, const Where& where);

/// A sheet of property,unit,warp,weft with its values in the units of fabric.toml.
class PropertySheet {
 public:
  PropertySheet(const std::filesystem::path& file, const std::map<std::string, UnitTable>& known);

  [[nodiscard]] bool has(const std::string& property) const { return rows_.contains(property); }
  /// Along 0 warp or 1 weft. Refuses a property that has no value there.
  [[nodiscard]] double along(const std::string& property, int direction) const;
  /// Of a property that the whole cloth has: its value stands under warp or weft, or is the same
  /// under both. Absent: no row, or no value in it.
  [[nodiscard]] std::optional<double> whole(const std::string& property) const;
  /// File, line and property.
  [[nodiscard]] Where where(const std::string& property) const;

 private:
  struct Row {
    int line = 0;
    std::array<std::optional<double>, 2> values;
  };
  std::filesystem::path file_;
  std::map<std::string, Row> rows_;
};

}  // namespace drape::simulate
