// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "synth/synth.hpp"

namespace drape::synth {

/// What the command line of drape-synth says.
struct ProgramOptions {
  std::filesystem::path rig, out, calibration, cameras;
  bool predict = false;
  double accuracy_mm = 0.05, height_mm = 100;
  double gradient_percent_per_px = 0, weave_percent = 0;
  std::vector<std::string> sheets;  ///< SET=FILE
  SynthOptions synth;
  PredictOptions prediction;
};

void add_options(Command& app, ProgramOptions& options);

/// Carries people's units over and checks what belongs together. Throws Error(usage).
void resolve(ProgramOptions& options);

/// The cameras that were given, in the rig's order.
[[nodiscard]] std::vector<Camera> cameras_for(const ProgramOptions& options, const Rig& rig);

}  // namespace drape::synth
