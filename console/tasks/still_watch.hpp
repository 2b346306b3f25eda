// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

namespace drape::console {

/// When a target that a hand holds is still, and where no set of it was taken yet.
struct StillOptions {
  double still_s = 0.8;  ///< time without motion; a hand that holds a board pauses longer
  int pictures = 3;      ///< per camera in that time, at least
  /// A pixel has changed by more than this part of the picture's contrast, and by so many standard
  /// deviations of its noise: an edge that moved by a tenth of a pixel of the picture.
  double changed_contrast = 0.1, changed_sigmas = 6;
  double moving_fraction =
      5e-4;  ///< share of the pixels that changed since the last picture: it moves
  /// Means of blocks tell a new place from a tremor: a dot must leave its block.
  int block_px = 16;
  double new_fraction =
      0.02;           ///< share of the blocks that changed since the last set, in so many views:
  int new_views = 2;  ///< it is a new pose
};

/// Looks at the scaled pictures that the cameras send while they wait. One thread at a time.
class StillWatch {
 public:
  explicit StillWatch(std::vector<std::string> cameras, StillOptions options = {});

  /// A picture (8 bits, any format that OpenCV reads) of a camera at a time in s.
  void see(const std::string& camera, std::span<const unsigned char> bytes, double at_s);
  /// A set is due; the pictures seen last are then those of the set.
  [[nodiscard]] bool is_due(double at_s);
  /// For how long nothing has moved in the pictures of each camera; those without some are left
  /// out.
  [[nodiscard]] std::map<std::string, double> still_s(double at_s) const;
  /// The set was refused: the same pose is due again.
  void forget_last_set();

 private:
  struct Grey {
    int width_px = 0, height_px = 0;
    std::vector<unsigned char> pixels;
  };
  struct View {
    Grey last, of_set;
    double still_since_s = 0, seen_s = 0;
    int still_pictures = 0;
  };
  [[nodiscard]] bool moved(const Grey& before, const Grey& now) const;
  [[nodiscard]] bool is_new(const Grey& before, const Grey& now) const;

  std::vector<std::string> cameras_;
  StillOptions options_;
  std::map<std::string, View> views_;
};

}  // namespace drape::console
