// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "core/files/files.hpp"

namespace drape::test {

using namespace capture;

/// An image file (".png", ".jpg", ".tif") whose pixels depend on `seed`.
inline std::vector<unsigned char> image_bytes(const std::string& ending, int seed = 0,
                                              int width_px = 64, int height_px = 48) {
  cv::Mat image(height_px, width_px, CV_8UC1);
  cv::RNG random(static_cast<std::uint64_t>(seed) + 1);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  std::vector<unsigned char> bytes;
  if (!cv::imencode(ending, image, bytes)) throw std::runtime_error("imencode " + ending);
  return bytes;
}

inline void write_bytes(const std::filesystem::path& file,
                        const std::vector<unsigned char>& bytes) {
  write_durable(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

/// Writes `folder`/<set>/<camera>.png for every pair, all images different.
inline void write_sets(const std::filesystem::path& folder, const std::vector<std::string>& sets,
                       const std::vector<std::string>& cameras) {
  int seed = 0;
  for (const std::string& set : sets) {
    for (const std::string& camera : cameras) {
      write_bytes(folder / set / (camera + ".png"), image_bytes(".png", ++seed));
    }
  }
}

}  // namespace drape::test
