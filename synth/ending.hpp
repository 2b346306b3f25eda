// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/program/program.hpp"
#include "synth/synth.hpp"

namespace drape::synth {

[[nodiscard]] Ending ending_of(const SynthReport& report, const Rig& rig,
                               const std::filesystem::path& out);

/// The table of a prediction and its verdict.
[[nodiscard]] Ending ending_of(const Prediction& prediction, const PredictOptions& options);

}  // namespace drape::synth
