// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/recording.hpp"
#include "synth/synth.hpp"

namespace drape::synth {

/// Writes <folder>/<set>/<camera>.png.
[[nodiscard]] RecordedFrame write_picture(const std::filesystem::path& folder,
                                          const std::string& set, const std::string& camera,
                                          const GreyPicture& picture);

/// truth.json, schema drapebench/truth/1.
void write_truth(const std::filesystem::path& file, const Rig& rig,
                 const std::vector<Camera>& cameras, const std::vector<SetTruth>& sets);

/// The cameras as a calibration without error.
void write_true_calibration(const std::filesystem::path& file, const Rig& rig,
                            const std::vector<Camera>& cameras);

}  // namespace drape::synth
