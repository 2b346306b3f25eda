// SPDX-License-Identifier: Apache-2.0
// Plates of object tags in random poses: rendered, detected, posed, and compared with the truth.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"
#include "tests/support/small_bench.hpp"
#include "tests/support/trials.hpp"
#include "triangulate/plate/plate.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using units::deg;
using units::mm;

constexpr int kPoses = 34;  ///< poses in one rendered recording

void must(const std::string& line) {
  const Outcome outcome = run_line(line);
  if (outcome.exit_code != 0) throw std::runtime_error(line + "\n" + outcome.text);
}

std::string pose_name(int pose) {
  return fmt::format("pose_{:02}", pose);
}

/// Writes a rig whose target is a plate of 80 mm, in random free poses facing the planned cameras.
void write_rig(const fs::path& folder, int poses) {
  std::string rig =
      "schema = \"drapebench/rig/1\"\nname = \"plates\"\ntarget = \"plate.toml\"\n"
      "recording = \"recording\"\n[calibration]\nfree_poses = [";
  for (int pose = 0; pose < poses; ++pose) rig += fmt::format("\"{}\", ", pose_name(pose));
  rig += "]\n[[calibration.stage]]\nset = \"stage\"\nz_mm = 0.0\n";
  for (int camera = 0; camera < 3; ++camera)
    rig += fmt::format(
        "[[camera]]\nname = \"cam{}\"\nwidth_px = 1600\nheight_px = 1200\n"
        "pixel_pitch_um = [3.45, 3.45]\n",
        camera);
  write_durable(folder / "rig.toml", rig);
  must(fmt::format("{} object-tags --size-mm 80 --out {}", program("drape-detect print").string(),
                   (folder / "plate.pdf").string()));
}

/// The rigid motion from the plate's dots to the renderer's.
WorldFromObject true_pose(const Json& marks, const MarkLattice& lattice) {
  const auto count = static_cast<Eigen::Index>(marks.size());
  Eigen::Matrix3Xd on_plate(3, count), in_world(3, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Json& mark = marks.at(static_cast<std::size_t>(k));
    on_plate.col(k) =
        lattice.pitch_m * Vector3d(mark.at("col").get<int>() - (lattice.cols - 1) / 2.0,
                                   mark.at("row").get<int>() - (lattice.rows - 1) / 2.0, 0);
    for (int axis = 0; axis < 3; ++axis)
      in_world(axis, k) = mark.at("xyz_mm").at(static_cast<std::size_t>(axis)).get<double>() * mm;
  }
  const Eigen::Matrix4d fit = Eigen::umeyama(on_plate, in_world, false);
  WorldFromObject pose;
  pose.rotation = fit.topLeftCorner<3, 3>();
  pose.translation_m = fit.topRightCorner<3, 1>();
  return pose;
}

TEST(RenderedPlates, IntervalsOfTheirPosesHold) {
  const int recordings = trial_count(1, 2), poses = trial_count(4, kPoses);
  int inside = 0, values = 0;
  double squares = 0, worst_mm = 0, worst_deg = 0;
  for (int seed = first_trial() + 1; seed <= first_trial() + recordings; ++seed) {
    const TemporaryFolder folder;
    write_rig(folder.path(), poses);
    const std::string rig = folder.path().string();
    must(fmt::format("{} {} --cameras {} --out {}/recording --seed {}",
                     program("drape-synth").string(), rig,
                     (source_root() / "rigs/plans/three-cameras.toml").string(), rig, seed));
    must(fmt::format("{0} {1}/recording --rig {1} --surface target --out {1}/found.json",
                     program("drape-detect").string(), rig));
    const Detections found = read_detections(folder.path() / "found.json");
    const Calibration cameras = read_calibration(folder.path() / "recording/true_calibration.json");
    const Json truth = parse_json(read_text(folder.path() / "recording/truth.json"));
    for (const Json& set : truth.at("sets")) {
      const std::string name = set.at("set");
      if (name == "stage") continue;
      const triangulate::PlatePose plate = triangulate::plate_pose(found, cameras, name, 0);
      const WorldFromObject true_one = true_pose(set.at("marks"), found.lattice);
      const Eigen::AngleAxisd turn(
          Matrix3d(true_one.rotation * plate.world_from_plate.rotation.transpose()));
      Eigen::Matrix<double, 6, 1> error;
      error << true_one.translation_m - plate.world_from_plate.translation_m,
          turn.angle() * turn.axis();
      for (int k = 0; k < 6; ++k) {
        const double z = error[k] / std::sqrt(plate.covariance(k, k));
        inside += std::abs(z) <= 1.959964;
        squares += z * z;
        ++values;
      }
      worst_mm = std::max(worst_mm, error.head<3>().norm() / mm);
      worst_deg = std::max(worst_deg, error.tail<3>().norm() / deg);
    }
  }
  fmt::print(
      "{} of {} values inside their 95 % intervals, rms z {:.2f}; largest error {:.4f} mm, {:.4f} "
      "degrees\n",
      inside, values, std::sqrt(squares / values), worst_mm, worst_deg);
  EXPECT_EQ(values, 6 * recordings * poses);
  EXPECT_LT(worst_mm, 0.1);
  EXPECT_LT(worst_deg, 0.1);
  // A few poses cannot distinguish 93 from 97 %: of 24 values fewer than 18 are inside once in
  // 5,000 draws.
  const bool whole = recordings * poses == 2 * kPoses;
  EXPECT_GE(inside, whole ? 0.93 * values : 18);
  EXPECT_LE(inside, whole ? 0.97 * values : values);
}

}  // namespace
}  // namespace drape::test
