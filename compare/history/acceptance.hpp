// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/store/store.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {

/// acceptance.json of a rig ("drapebench/acceptance/1"), as `drape accept` wrote it.
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
};

[[nodiscard]] RigAcceptance read_acceptance(const std::filesystem::path& file);

/// Why it does not speak for what this session measured: of another calibration, or expired on the
/// day of the recording. Empty when it does.
[[nodiscard]] std::vector<std::string> doubts_of(const RigAcceptance& acceptance,
                                                 const Session& session);

/// Why what this session measured is NO-GO: the calibration that it rests on was not accepted.
[[nodiscard]] std::optional<std::string> reason_against(const RigAcceptance& acceptance,
                                                        const Session& session);

/// The same of the last acceptance of that calibration that the store keeps, where there is a
/// store.
[[nodiscard]] std::optional<std::string> reason_in_store(const std::filesystem::path& store,
                                                         const Session& session);

/// Reads it, where a file is given, as an input of `record`, before anything is compared: a reason
/// against the session goes to the outcome, doubts become warnings.
[[nodiscard]] std::optional<RigAcceptance> look_at_acceptance(const std::filesystem::path& file,
                                                              const Session& session,
                                                              Outcome& outcome, RunRecord& record);

/// Keeps it in the store, once.
void store_acceptance(const std::filesystem::path& store, const RigAcceptance& acceptance);

}  // namespace drape::compare
