// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/store/store.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {

/// acceptance.json of a rig ("drapebench/acceptance/1"), as `drape calib accept` wrote it.
struct RigAcceptance {
  struct Figure {
    std::string name, unit, where;
    std::optional<double> value, expanded, limit;  ///< absent: not measured
    bool go = false;
  };
  std::string sha256;  ///< of the file
  std::string rig, calibration_sha256;
  std::optional<std::string> date, valid_until, cause;  ///< ISO dates
  int positions = 0;
  bool go = false;
  std::vector<Figure> figures;
  std::vector<std::string> warnings;  ///< of `drape calib accept`
};

[[nodiscard]] RigAcceptance read_acceptance(const std::filesystem::path& file);

/// Why it does not speak for what this session measured: of another calibration, or expired on the
/// day of the recording. Empty when it does.
[[nodiscard]] std::vector<std::string> doubts_of(const RigAcceptance& acceptance,
                                                 const Session& session);

/// Why what rests on a calibration of the session is NO-GO, by the calibration's SHA-256: its last
/// acceptance is, among those in the store (where there is one) and the one that is given, which
/// counts as the later of two of one day.
[[nodiscard]] std::map<std::string, std::string> reason_in_store(
    const std::filesystem::path& store, const Session& session,
    const std::optional<RigAcceptance>& given = {});

/// Reads it, where a file is given, as an input of `record`, before anything is compared; its
/// doubts become warnings. Reasons against it and against those in the outcome's store go to the
/// outcome.
[[nodiscard]] std::optional<RigAcceptance> look_at_acceptance(const std::filesystem::path& file,
                                                              const Session& session,
                                                              Outcome& outcome, RunRecord& record);

/// Keeps it in the store, once.
void store_acceptance(const std::filesystem::path& store, const RigAcceptance& acceptance);

}  // namespace drape::compare
