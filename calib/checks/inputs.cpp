// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/inputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using units::mm;

double nominal_m(const Target& target, const KnownLength& known) {
  return (target.point_in_target(known.to) - target.point_in_target(known.from)).norm();
}

/// Pictures seen so far. Mark positions that agree to the last digit mean the same picture, however
/// it was copied or encoded; identical files are the same picture, however it was detected.
class Pictures {
 public:
  void add(const PictureSource& source, const std::string& what_to_do) {
    for (const FrameDetections& frame : source.detections.frames) {
      const bool counts = source.sets.empty() || std::find(source.sets.begin(), source.sets.end(),
                                                           frame.set) != source.sets.end();
      const bool finite = std::all_of(frame.detections.begin(), frame.detections.end(),
                                      [](const Detection& d) { return d.centre_px.allFinite(); });
      if (!counts || frame.detections.empty() || !finite) continue;
      std::vector<double> places;
      for (const Detection& d : frame.detections)
        places.insert(places.end(), {d.centre_px.x(), d.centre_px.y()});
      const Owner owner{&frame, source.file};
      refuse(owner, by_places_.emplace(std::move(places), owner), what_to_do);
      if (!frame.image_sha256.empty())
        refuse(owner, by_file_.emplace(frame.image_sha256, owner), what_to_do);
    }
  }

 private:
  struct Owner {
    const FrameDetections* frame = nullptr;
    std::string file;
  };

  template <typename Placed>
  static void refuse(const Owner& owner, const Placed& placed, const std::string& what_to_do) {
    const auto& [at, fresh] = placed;
    const Owner& first = at->second;
    if (fresh || first.frame == owner.frame) return;
    throw bad_input(fmt::format("this picture is also the one of set {}, {}{}", first.frame->set,
                                first.frame->camera, first.file.empty() ? "" : " in " + first.file),
                    {.file = owner.file, .camera = owner.frame->camera, .set = owner.frame->set},
                    what_to_do);
  }

  std::map<std::vector<double>, Owner> by_places_;
  std::map<std::string, Owner> by_file_;
};

}  // namespace

void check_known_lengths(const Target& target, double tolerance) {
  for (const KnownLength& known : target.known_lengths) {
    const double nominal = nominal_m(target, known);
    const double sd_m = std::hypot(known.standard_uncertainty_m, tolerance * nominal);
    const double sigmas = std::abs(known.length_m - nominal) / sd_m;
    if (sigmas <= 3) continue;
    throw bad_input(
        fmt::format("wrong target size: from point ({}, {}) to ({}, {}) the pitch of {:g} mm gives "
                    "{:.3f} mm, the operator measured {:.3f} +- {:.3f} mm, {:.1f} standard "
                    "uncertainties apart; all measured lengths would be wrong by {:+.3f} %",
                    known.from.row, known.from.col, known.to.row, known.to.col, target.pitch_m / mm,
                    nominal / mm, known.length_m / mm, known.standard_uncertainty_m / mm, sigmas,
                    100 * (nominal / known.length_m - 1)),
        {.field = "known_length"},
        fmt::format("set pitch_mm = {:.4f} in the target file, or measure again",
                    target.pitch_m * known.length_m / nominal / mm));
  }
}

double scale_uncertainty(const Target& target) {
  double least = 0;
  for (const KnownLength& known : target.known_lengths) {
    const double own = known.standard_uncertainty_m / known.length_m;
    least = least > 0 ? std::min(least, own) : own;
  }
  return least;
}

std::string print_scale_line(const Target& target) {
  if (target.known_lengths.empty())
    return "not checked: measure two far points of the target and add [known_length] to its file";
  std::string lengths;
  for (const KnownLength& known : target.known_lengths)
    lengths += fmt::format("{}{:.3f} +- {:.3f} mm ({:.3f} as drawn)", lengths.empty() ? "" : ", ",
                           known.length_m / mm, known.standard_uncertainty_m / mm,
                           nominal_m(target, known) / mm);
  return fmt::format("by {}, known to {:.4f} %", lengths, 100 * scale_uncertainty(target));
}

void refuse_pictures_twice(const PictureSource& source) {
  Pictures().add(source, "record each set by itself, or take one of the two out of the rig file");
}

void refuse_pictures_of(const PictureSource& calibrated, const PictureSource& tested) {
  Pictures pictures;
  pictures.add(calibrated, "calibrate again, from sets that were each recorded by themselves");
  pictures.add(tested, "record each set by itself, and other sets than those that calibrated");
}

void refuse_sets_twice(const Rig& rig) {
  std::set<std::string> names;
  const auto add = [&](const std::string& set, const char* field) {
    if (names.insert(set).second) return;
    throw bad_input("a set of the target is named twice, so its views would count twice",
                    {.field = field, .set = set}, "name each set once in rig.toml");
  };
  for (const TargetStage& stage : rig.stages) add(stage.set, "calibration.stage");
  for (const std::string& set : rig.free_poses) add(set, "calibration.free_poses");
}

}  // namespace drape::calib
