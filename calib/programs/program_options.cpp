// SPDX-License-Identifier: Apache-2.0
#include "calib/programs/program_options.hpp"

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/program/command.hpp"

namespace drape::calib {

void add_options(Command& app, CalibOptions& options) {
  app.add_option("--max-rms-px", options.max_rms_px, "NO-GO above this RMS of a camera, px");
  app.add_option("--max-centre-sd-px", options.max_centre_sd_px,
                 "NO-GO when the image centre is less certain, px");
  app.add_option("--max-focal-sd-percent", options.max_focal_sd_percent,
                 "NO-GO when the focal length is less certain, %");
  app.add_option("--outlier-sigmas", options.outlier_sigmas,
                 "reject dots farther off than this many robust standard deviations");
  app.add_option("--max-outliers-percent", options.max_outliers_percent,
                 "NO-GO when more dots are rejected, %");
  app.add_option("--max-iterations", options.max_iterations, "of each refinement");
  app.add_flag("!--no-eccentricity", options.correct_eccentricity,
               "take the centroid of a dot's image for the image of its centre");
}

void add_joint_options(Command& app, JointOptions& options) {
  app.add_flag("!--no-bow", options.estimate_bow, "joint: take the target's plate for flat");
  app.add_flag("--free-stages", options.free_stages,
               "joint: believe no stage's height but the first one's");
  app.add_option("--thickness-mm", options.thickness_mm,
                 "joint: how far a two-sided target's back lies behind its front")
      ->capture_default_str();
}

void refuse_joint_options(const Command& app, const std::string& method) {
  if (method == "joint") return;
  for (const std::string option :
       {"--lens", "--lens-from", "--no-bow", "--free-stages", "--thickness-mm"})
    if (app.count(option) > 0)
      throw usage_error(fmt::format("{} does nothing with --method {}", option, method),
                        "add --method joint, or leave " + option + " out");
}

void note_joint_options(RunRecord& record, const JointOptions& options) {
  record.option("bow", options.estimate_bow ? "true" : "false");
  record.option("free_stages", options.free_stages ? "true" : "false");
  record.option("thickness_mm", fmt::format("{}", options.thickness_mm));
}

void note_options(RunRecord& record, const CalibOptions& options, const std::string& method) {
  record.option("method", method);
  record.option("max_rms_px", fmt::format("{}", options.max_rms_px));
  record.option("max_centre_sd_px", fmt::format("{}", options.max_centre_sd_px));
  record.option("max_focal_sd_percent", fmt::format("{}", options.max_focal_sd_percent));
  record.option("outlier_sigmas", fmt::format("{}", options.outlier_sigmas));
  record.option("max_outliers_percent", fmt::format("{}", options.max_outliers_percent));
  record.option("max_iterations", fmt::format("{}", options.max_iterations));
  record.option("correct_eccentricity", options.correct_eccentricity ? "true" : "false");
}

}  // namespace drape::calib
