// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"

namespace drape {

/// One acceptance test: its figure of merit and the limit it must meet.
struct AcceptanceRow {
  std::string name, unit, where;
  std::optional<double> value, expanded, limit;  ///< absent if not measured
  bool limit_stated = false;
  std::optional<double> smallest_fault;  ///< smallest calibration fault that this figure detects
  std::optional<std::string> smallest_fault_unit, not_measured;
  bool go = false;
};

/// acceptance.json: the last acceptance test of a rig.
struct AcceptanceFile {
  Document document;
  std::string rig, calibration_sha256;
  std::optional<std::string> date, valid_until, cause;  ///< ISO dates
  int positions = 0;
  bool go = false;
  std::vector<std::string> warnings;
  std::vector<std::string> lacks;  ///< missing parts of a full acceptance; any make it interim
  std::vector<AcceptanceRow> figures;
};
template <>
inline constexpr Format format_of<AcceptanceFile>{"acceptance", Syntax::json, 1,
                                                  "acceptance of a rig's calibration"};
void fields(Fields& f, AcceptanceFile& acceptance);

}  // namespace drape
