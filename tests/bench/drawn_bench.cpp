// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/drawn_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "synth/render/render.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

constexpr int kFreePoses = 12;

void must(const std::string& line) {
  const Outcome outcome = run_line(line);
  if (outcome.exit_code != 0) throw std::runtime_error(line + "\n" + outcome.text);
}

std::string drape_name(std::size_t drape) {
  return fmt::format("D{}", drape);
}

}  // namespace

DrawnBench::DrawnBench(std::uint64_t seed, bool plates) : seed_(seed), plates_(plates) {
  true_.table_z_mm = any(-8, -3);
  true_.pitch_mm = any(17.5, 21);
  draw_object(seed % 2 == 0);
  if (plates_) draw_object(seed % 2 != 0);
  draw_cameras();
  draw_cloth();
  draw_statement();
}

double DrawnBench::any(double from, double to) {
  return from + (to - from) * synth::uniform(seed_ + 4000, next_++);
}

double DrawnBench::error(double uncertainty) {
  return uncertainty * std::clamp(synth::normal(seed_ + 4000, 10'000 + next_++), -2.0, 2.0);
}

void DrawnBench::draw_object(bool is_box) {
  DrawnObject object;
  object.is_box = is_box;
  object.x_mm = any(-12, 12);
  object.y_mm = any(-12, 12);
  object.z_bottom_mm = true_.table_z_mm;
  object.width_mm = any(60, 125);
  if (is_box) {
    // A plate has the same edges as a square top.
    object.depth_mm = (plates_ ? 1 : any(0.7, 1.2)) * object.width_mm;
    object.height_mm = any(50, 125);
    object.edge_radius_mm = any(0.8, 4);
    object.yaw_deg = any(-45, 45);
  } else if (plates_) {
    object.hole_mm = 0.5 * object.width_mm;
    object.z_bottom_mm += any(20, 40);
  }
  true_.objects.push_back(object);
}

void DrawnBench::draw_cameras() {
  camera_count_ = std::array{3, 2, 3, 4, 3}[seed_ % 5];
  if (any(0, 1) < 0.3) {
    width_px_ = 1280;
    height_px_ = 960;
  }
  const double first_deg = any(0, 360);
  cameras_ = "schema = \"drapebench/cameras-plan/1\"\n";
  for (int k = 0; k < camera_count_; ++k) {
    // Two cameras are as far apart as adjacent ones of three or four.
    const double apart_deg = camera_count_ == 2 ? 80 : 360.0 / camera_count_;
    const double azimuth = (first_deg + apart_deg * k + any(-12, 12)) * units::deg;
    const double tilt = any(28, 43) * units::deg, away_mm = any(650, 850);
    const double focal_mm = 10.7 * away_mm / 780 * any(0.92, 1.05);
    cameras_ += fmt::format(
        "[[camera]]\nname = \"cam{}\"\nfocal_mm = {:.6f}\nposition_mm = [{:.6f}, {:.6f}, {:.6f}]\n"
        "look_at_mm = [{:.6f}, {:.6f}, {:.6f}]\nk1 = {:.6f}\nk2 = {:.6f}\n",
        k, focal_mm, away_mm * std::sin(tilt) * std::cos(azimuth),
        away_mm * std::sin(tilt) * std::sin(azimuth), away_mm * std::cos(tilt) + 30, any(-12, 12),
        any(-12, 12), any(15, 45), any(-0.16, 0.05), any(-0.03, 0.05));
  }
  light_ = fmt::format(
      "--seed {} --white-grey {:.3f} --ink-ratio {:.4f} --blur-px {:.4f} --noise-grey {:.4f} "
      "--weave-percent {:.4f} --gradient-percent-per-px {:.5f}",
      seed_ + 1, any(150, 215), any(0.1, 0.35), any(0.4, 0.9), any(0.6, 2.5), any(0, 1.5),
      any(0, 0.02));
}

void DrawnBench::draw_cloth() {
  if (seed_ % 4 == 3) marks_ = 12;
  dot_part_ = any(0.17, 0.21);
  tag_part_ = any(0.48, 0.6);
  density_ = any(90, 300);
  bending_warp_ = 0.045 * std::pow(5, any(0, 1));
  bending_weft_ = std::max(0.045, bending_warp_ * any(0.6, 1.5));
  shear_ = any(0.3, 1.2);
  emt_ = any(2, 8);
  friction_ = any(0.2, 0.6);
  cloth_x_mm_ = any(-10, 10);
  cloth_y_mm_ = any(-10, 10);
  cloth_yaw_deg_ = any(-180, 180);
}

/// Errors of readings of a ruler, a caliper and a micrometer.
void DrawnBench::draw_statement() {
  true_.stages_mm = {0, 30 + error(0.005), 60 + error(0.005), 90 + error(0.005)};
  stated_ = true_;
  stated_.stages_mm = {0, 30, 60, 90};
  states_uncertainties_ = any(0, 1) < 0.7;
  if (states_uncertainties_) {
    place_u_mm_ = std::array{0.1, 0.2, 0.5, 1.0}[static_cast<std::size_t>(any(0, 4))];
    size_u_mm_ = std::array{0.05, 0.1, 0.3}[static_cast<std::size_t>(any(0, 3))];
  }
  if (plates_) {
    // A position read from a ruler; a size by caliper, since a plate measures only its own face.
    states_uncertainties_ = true;
    place_u_mm_ = 0.5;
    size_u_mm_ = 0.02;
  }
  stated_.table_z_mm += error(0.2);
  // Over all marks except one, with a caliper.
  stated_.pitch_mm += error(0.02) / (marks_ - 1);
  for (DrawnObject& object : stated_.objects) {
    object.x_mm += error(place_u_mm_);
    object.y_mm += error(place_u_mm_);
    object.z_bottom_mm += stated_.table_z_mm - true_.table_z_mm;
    if (object.hole_mm > 0) object.z_bottom_mm += error(place_u_mm_);
    // Rotation from both ends of an edge, each with the uncertainty of a position.
    if (object.is_box)
      object.yaw_deg += error(std::sqrt(2.0) * place_u_mm_ / object.width_mm / units::deg);
    object.width_mm += error(size_u_mm_);
    object.depth_mm += error(size_u_mm_);
    object.height_mm += error(size_u_mm_);
  }
}

std::string DrawnBench::scene_text(const BenchValues& values, std::size_t drape,
                                   bool is_true) const {
  const DrawnObject& object = values.objects[drape];
  std::string text = fmt::format(
      "schema = \"drapebench/scene/1\"\nname = \"{0}\"\nset = \"drape_{0}\"\n"
      "fabric = \"../fabric.toml\"\nprint = \"../print.toml\"\ntable_z_mm = {1:.6f}\n"
      "friction = {2:.4f}\nstand_ins = [\"friction\"]\n\n[start]\n",
      drape_name(drape), values.table_z_mm, friction_);
  const double top_mm = object.z_bottom_mm + (object.is_box ? object.height_mm : object.width_mm);
  text += is_true ? fmt::format(
                        "mode = \"flat\"\ncentre_mm = [{:.6f}, {:.6f}, {:.6f}]\nyaw_deg = {:.4f}\n",
                        object.x_mm + cloth_x_mm_, object.y_mm + cloth_y_mm_, top_mm + 3,
                        cloth_yaw_deg_)
                  : std::string("mode = \"flat-from-measured\"\nclearance_mm = 3.0\n");
  text += "\n[[object]]\n";
  text += object.is_box
              ? fmt::format(
                    "kind = \"box\"\nsize_mm = [{:.6f}, {:.6f}, {:.6f}]\nedge_radius_mm = {:.4f}\n"
                    "yaw_deg = {:.6f}\n",
                    object.width_mm, object.depth_mm, object.height_mm, object.edge_radius_mm,
                    object.yaw_deg)
              : fmt::format("kind = \"sphere\"\ndiameter_mm = {:.6f}\n", object.width_mm);
  text += fmt::format("x_mm = {:.6f}\ny_mm = {:.6f}\nz_bottom_mm = {:.6f}\n", object.x_mm,
                      object.y_mm, object.z_bottom_mm);
  if (states_uncertainties_)
    text += fmt::format("place_uncertainty_mm = {:g}\nsize_uncertainty_mm = {:g}\n", place_u_mm_,
                        size_u_mm_);
  if (object.hole_mm > 0)
    text += fmt::format("on_stand = true\ntags_hole_mm = {:.6f}\n", object.hole_mm);
  if (plates_)
    text += fmt::format("tags_set = \"object_{0}\"\ntags_target = \"../plate_{0}.toml\"\n",
                        drape_name(drape));
  return text;
}

void DrawnBench::write_rig(const fs::path& folder, const BenchValues& values, bool is_true) const {
  std::string rig = fmt::format(
      "schema = \"drapebench/rig/1\"\nname = \"drawn{}\"\ntarget = \"target.toml\"\n"
      "print = \"print.toml\"\nrecording = \"recording\"\nspacing_mm = 10\nsegments = [1]\n"
      "scenes = [",
      seed_);
  for (std::size_t drape = 0; drape < values.objects.size(); ++drape)
    rig += fmt::format("\"scenes/{}.toml\", ", drape_name(drape));
  rig += "]\n[calibration]\nestimate_scale_x = false\nfree_poses = [";
  for (int pose = 0; pose < kFreePoses; ++pose) rig += fmt::format("\"pose_{:02}\", ", pose);
  rig += "]\n";
  for (std::size_t stage = 0; stage < values.stages_mm.size(); ++stage)
    rig += fmt::format("[[calibration.stage]]\nset = \"stage_{}\"\nz_mm = {:.6f}\n", stage,
                       values.stages_mm[stage]);
  const double pixel_um = 3.45 * 1600 / width_px_;
  for (int camera = 0; camera < camera_count_; ++camera)
    rig += fmt::format(
        "[[camera]]\nname = \"cam{}\"\nwidth_px = {}\nheight_px = {}\n"
        "pixel_pitch_um = [{:.6f}, {:.6f}]\n",
        camera, width_px_, height_px_, pixel_um, pixel_um);
  write_durable(folder / "rig.toml", rig);

  fs::copy(source_root() / "rigs/bench1/target.toml", folder);
  const double patch_mm = values.pitch_mm * marks_;
  std::string print = fmt::format(
      "schema = \"drapebench/print/1\"\nrows = {0}\ncols = {0}\npitch_mm = {1:.6f}\n"
      "dot_diameter_mm = {2:.4f}\npatch_mm = [{3:.6f}, {3:.6f}]\nmargin_mm = [{4:.6f}, {4:.6f}]\n"
      "[tags]\nfamily = \"tag36h11\"\nedge_mm = {5:.4f}\nfirst_id = 0\ncells = [\n",
      marks_, values.pitch_mm, dot_part_ * true_.pitch_mm, patch_mm, 0.5 * values.pitch_mm,
      tag_part_ * true_.pitch_mm);
  for (int row = 0; row < marks_ - 1; ++row)
    for (int col = row % 2; col < marks_ - 1; col += 2)
      print += fmt::format("[{}, {}], ", row, col);
  write_durable(folder / "print.toml", print + "]\n");

  write_durable(
      folder / "fabric.toml",
      fmt::format("schema = \"drapebench/fabric/1\"\nname = \"drawn\"\nareal_density_g_per_m2 = "
                  "{:.2f}\n[tensile]\nwarp_kes = {{ emt_percent = {:.3f}, lt = 0.7 }}\nweft_kes = "
                  "{{ emt_percent = {:.3f}, lt = 0.7 }}\n[shear]\nwarp_kes = {{ g_gf_per_cm_deg = "
                  "{:.4f} }}\nweft_kes = {{ g_gf_per_cm_deg = {:.4f} }}\n[bending]\nwarp_kes = {{ "
                  "b_gf_cm2_per_cm = {:.5f} }}\nweft_kes = {{ b_gf_cm2_per_cm = {:.5f} }}\n",
                  density_, emt_, 1.3 * emt_, shear_, shear_, bending_warp_, bending_weft_));
  for (std::size_t drape = 0; drape < values.objects.size(); ++drape) {
    write_durable(folder / "scenes" / (drape_name(drape) + ".toml"),
                  scene_text(values, drape, is_true));
    if (!plates_) continue;
    // As wide as the top of the box, or around the hole.
    const DrawnObject& object = true_.objects[drape];
    const double side_mm = object.is_box ? object.width_mm : 2 * object.hole_mm;
    must(fmt::format("{} object-tags --size-mm {:.4f} --first-id {} --out {}",
                     program("drape-detect print").string(), side_mm, 500 + 10 * drape,
                     (folder / fmt::format("plate_{}.pdf", drape_name(drape))).string()));
  }
}

void DrawnBench::make(const fs::path& folder) const {
  write_rig(folder / "true", true_, true);
  write_rig(folder / "rig", stated_, false);
  write_durable(folder / "true/cameras-plan.toml", cameras_);
  std::string sheets;
  for (std::size_t drape = 0; drape < true_.objects.size(); ++drape) {
    const std::string name = drape_name(drape);
    const fs::path out = folder / "true/out" / name;
    const Outcome simulated =
        run_line(fmt::format("{} {} --spacing-mm 5 --segments 5 --out {} --threads 2",
                             program("drape-simulate").string(),
                             (folder / "true/scenes" / (name + ".toml")).string(), out.string()));
    if (simulated.exit_code > 1) throw std::runtime_error(simulated.text);
    if (simulated.exit_code == 1) fmt::print("true drape {}: {}\n", name, simulated.text);
    sheets += fmt::format(" --sheet drape_{}={}", name, (out / "sheet.json").string());
  }
  must(fmt::format("{} {} --cameras {} --out {} --threads 2 {}{}", program("drape-synth").string(),
                   (folder / "true").string(), (folder / "true/cameras-plan.toml").string(),
                   (folder / "rig/recording").string(), light_, sheets));
}

std::string DrawnBench::describe() const {
  std::string text = fmt::format("{} cameras of {} x {} px", camera_count_, width_px_, height_px_);
  for (const DrawnObject& object : true_.objects)
    text += object.is_box
                ? fmt::format(
                      ", box of {:.0f} x {:.0f} x {:.0f} mm at ({:.1f}, {:.1f}), {:.0f} degrees",
                      object.width_mm, object.depth_mm, object.height_mm, object.x_mm, object.y_mm,
                      object.yaw_deg)
                : fmt::format(", sphere of {:.0f} mm at ({:.1f}, {:.1f})", object.width_mm,
                              object.x_mm, object.y_mm);
  return text + fmt::format(
                    "; {0} x {0} marks {1:.2f} mm apart; {2:.0f} g/m2, B {3:.3f} and {4:.3f}, "
                    "friction {5:.2f}; place to {6:g} mm{7}",
                    marks_, true_.pitch_mm, density_, bending_warp_, bending_weft_, friction_,
                    place_u_mm_, states_uncertainties_ ? "" : " (not stated)");
}

}  // namespace drape::test
