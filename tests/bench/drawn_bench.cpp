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
constexpr double kLinearity = 0.7;    // LT
constexpr double kGravity = 9.80665;  // m/s2

void must(const std::string& line) {
  const Outcome outcome = run_line(line);
  if (outcome.exit_code != 0) throw std::runtime_error(line + "\n" + outcome.text);
}

/// Rounded to a micrometre, as on a drawing: the marks are then points of the simulated sheets.
double in_um(double mm) {
  return 1e-3 * std::round(1e3 * mm);
}

std::string drape_name(std::size_t drape) {
  return fmt::format("D{}", drape);
}

}  // namespace

std::string DrawnFabric::text() const {
  std::string text = fmt::format(
      "schema = \"drapebench/fabric/1\"\nname = \"drawn\"\nareal_density_g_per_m2 = "
      "{:.2f}\n[tensile]\nwarp_kes = {{ emt_percent = {:.3f}, lt = {} }}\nweft_kes = "
      "{{ emt_percent = {:.3f}, lt = {} }}\n[shear]\nwarp_kes = {{ g_gf_per_cm_deg = "
      "{:.4f} }}\nweft_kes = {{ g_gf_per_cm_deg = {:.4f} }}\n[bending]\nwarp_kes = {{ "
      "b_gf_cm2_per_cm = {:.5f} }}\nweft_kes = {{ b_gf_cm2_per_cm = {:.5f} }}\n",
      density, emt_warp, kLinearity, emt_weft, kLinearity, shear, shear, bending_warp,
      bending_weft);
  if (bias_bending) text += fmt::format("bias_stiffness_gf_cm2_per_cm = {:.6f}\n", *bias_bending);
  return text;
}

DrawnBench::DrawnBench(std::uint64_t seed, BenchKind kind) : seed_(seed), kind_(kind) {
  true_.table_z_mm = any(-8, -3);
  true_.pitch_mm = in_um(any(17.5, 21));
  if (kind_ != BenchKind::all_values || seed % 3 != 2) draw_object(seed % 2 == 0);
  if (kind_ == BenchKind::plates) draw_object(seed % 2 != 0);
  draw_cameras();
  draw_cloth();
  if (true_.objects.empty()) draw_pins();
  draw_statement();
  if (kind_ == BenchKind::all_values) draw_unknown_values();
}

double DrawnBench::any(double from, double to) {
  return from + (to - from) * synth::uniform(seed_ + 4000, next_++);
}

double DrawnBench::error(double uncertainty) {
  const double normal = synth::normal(seed_ + 4000, 10'000 + next_++);
  return uncertainty * (kind_ == BenchKind::all_values ? normal : std::clamp(normal, -2.0, 2.0));
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
    object.depth_mm = (kind_ == BenchKind::plates ? 1 : any(0.7, 1.2)) * object.width_mm;
    object.height_mm = any(50, 125);
    object.edge_radius_mm = any(0.8, 4);
    object.yaw_deg = any(-45, 45);
  } else if (kind_ == BenchKind::plates) {
    object.hole_mm = 0.5 * object.width_mm;
    object.z_bottom_mm += any(20, 40);
  }
  true_.objects.push_back(object);
}

/// Four pins at the corner marks, closer than the marks lie apart: the cloth sags between them.
void DrawnBench::draw_pins() {
  const double height_mm = any(60, 90), part = any(0.93, 0.98), yaw = cloth_yaw_deg_ * units::deg;
  for (const int row : {0, marks_ - 1})
    for (const int col : {0, marks_ - 1}) {
      const double along_mm = part * true_.pitch_mm * (col - 0.5 * (marks_ - 1)),
                   across_mm = -part * true_.pitch_mm * (row - 0.5 * (marks_ - 1));
      true_.pins.push_back({row,
                            col,
                            {cloth_x_mm_ + std::cos(yaw) * along_mm - std::sin(yaw) * across_mm,
                             cloth_y_mm_ + std::sin(yaw) * along_mm + std::cos(yaw) * across_mm,
                             height_mm + any(-3, 3)}});
    }
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
  DrawnFabric& fabric = true_.fabric;
  fabric.density = any(90, 300);
  fabric.bending_warp = 0.045 * std::pow(5, any(0, 1));
  fabric.bending_weft = std::max(0.045, fabric.bending_warp * any(0.6, 1.5));
  fabric.shear = any(0.3, 1.2);
  fabric.emt_warp = any(2, 8);
  fabric.emt_weft = 1.3 * fabric.emt_warp;
  true_.friction = any(0.2, 0.6);
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
  if (kind_ == BenchKind::plates) {
    // A position read from a ruler; a size by caliper, since a plate measures only its own face.
    states_uncertainties_ = true;
    place_u_mm_ = 0.5;
    size_u_mm_ = 0.02;
  }
  stated_.table_z_mm += error(0.2);
  // Over all marks except one, with a caliper.
  stated_.pitch_mm = in_um(true_.pitch_mm + error(0.02) / (marks_ - 1));
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

/// Errors of fabric, friction, level and pins. The stated values stay as drawn, the true ones move:
/// 5 % of a measured value, half of the twist stiffness, half to twice an unmeasured friction, 0.06
/// degrees of level (the program's assumptions where nothing is stated), pins to 0.5 mm.
void DrawnBench::draw_unknown_values() {
  constexpr double kMeasured = 0.05, kTwistRatio = 0.86;  // of 2 sqrt(B_warp B_weft)
  for (DrawnPin& pin : stated_.pins)
    for (double& value_mm : pin.at_mm) value_mm += error(0.5);
  friction_measured_ = seed_ / 3 % 2 == 0;
  true_.friction *= friction_measured_ ? 1 + error(kMeasured) : any(0.5, 2);
  for (double& level_deg : true_.level_deg) level_deg = error(0.06);
  DrawnFabric& fabric = true_.fabric;
  for (double* value : {&fabric.density, &fabric.bending_warp, &fabric.bending_weft, &fabric.shear})
    *value *= 1 + error(kMeasured);
  // Force grows as the strain to the power of 2 / LT - 1.
  for (double* emt : {&fabric.emt_warp, &fabric.emt_weft})
    *emt *= std::pow(1 + error(kMeasured), -1 / (2 / kLinearity - 1));
  const double twist =
      any(0.5, 1.5) * kTwistRatio * 2 * std::sqrt(fabric.bending_warp * fabric.bending_weft);
  fabric.bias_bending = (twist + fabric.bending_warp + fabric.bending_weft) / 4;
  stiffer_ = seed_ % 9 < 3 ? 1 : 2 * std::pow(4, any(0, 1));
}

std::string DrawnBench::scene_text(const BenchValues& values, std::size_t drape,
                                   bool is_true) const {
  std::string text = fmt::format(
      "schema = \"drapebench/scene/1\"\nname = \"{0}\"\nset = \"drape_{0}\"\n"
      "fabric = \"../fabric.toml\"\nprint = \"../print.toml\"\ntable_z_mm = {1:.6f}\n",
      drape_name(drape), values.table_z_mm);
  const bool held = values.objects.empty();
  const DrawnObject object = held ? DrawnObject() : values.objects[drape];
  text += friction_measured_
              ? fmt::format("friction = {0:.4f}\nfriction_uncertainty = {1:.4f}\n", values.friction,
                            0.05 * stated_.friction)
              : fmt::format("friction = {:.4f}\nstand_ins = [\"friction\"]\n", values.friction);
  const auto [about_x, about_y] = values.level_deg;
  if (about_x != 0 || about_y != 0)
    text += fmt::format(
        "gravity_m_per_s2 = [{:.8f}, {:.8f}, {:.8f}]\n", -kGravity * std::sin(about_y * units::deg),
        kGravity * std::sin(about_x * units::deg) * std::cos(about_y * units::deg),
        -kGravity * std::cos(about_x * units::deg) * std::cos(about_y * units::deg));
  const double top_mm =
      held ? values.pins.front().at_mm[2] - 3
           : object.z_bottom_mm + (object.is_box ? object.height_mm : object.width_mm);
  text += is_true ? fmt::format(
                        "\n[start]\nmode = \"flat\"\ncentre_mm = [{:.6f}, {:.6f}, "
                        "{:.6f}]\nyaw_deg = {:.4f}\n",
                        object.x_mm + cloth_x_mm_, object.y_mm + cloth_y_mm_, top_mm + 3,
                        cloth_yaw_deg_)
                  : std::string("\n[start]\nmode = \"flat-from-measured\"\nclearance_mm = 3.0\n");
  for (const DrawnPin& pin : values.pins)
    text += fmt::format("\n[[pin]]\nrow = {}\ncol = {}\nat_mm = [{:.4f}, {:.4f}, {:.4f}]\n",
                        pin.row, pin.col, pin.at_mm[0], pin.at_mm[1], pin.at_mm[2]);
  if (held) return text;
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
  if (kind_ == BenchKind::plates)
    text += fmt::format("tags_set = \"object_{0}\"\ntags_target = \"../plate_{0}.toml\"\n",
                        drape_name(drape));
  return text;
}

void DrawnBench::write_rig(const fs::path& folder, const BenchValues& values, bool is_true) const {
  std::string rig = fmt::format(
      "schema = \"drapebench/rig/1\"\nname = \"drawn{}\"\ntarget = \"target.toml\"\n"
      "print = \"print.toml\"\nrecording = \"recording\"\n{}scenes = [",
      seed_,
      kind_ == BenchKind::all_values ? "spacing_mm = 5\nsegments = [5]\n"
                                     : "spacing_mm = 10\nsegments = [1]\n");
  for (std::size_t drape = 0; drape < drapes(); ++drape)
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

  write_durable(folder / "fabric.toml", values.fabric.text());
  for (std::size_t drape = 0; drape < drapes(); ++drape) {
    write_durable(folder / "scenes" / (drape_name(drape) + ".toml"),
                  scene_text(values, drape, is_true));
    if (kind_ != BenchKind::plates) continue;
    // As wide as the top of the box, or around the hole.
    const DrawnObject& object = true_.objects[drape];
    const double side_mm = object.is_box ? object.width_mm : 2 * object.hole_mm;
    must(fmt::format("{} object-tags --size-mm {:.4f} --first-id {} --out {}",
                     program("drape-detect print").string(), side_mm, 500 + 10 * drape,
                     (folder / fmt::format("plate_{}.pdf", drape_name(drape))).string()));
  }
}

/// Sheet of a drape by drape-simulate.
fs::path DrawnBench::simulated(const fs::path& scene, const fs::path& out,
                               const std::string& more) const {
  const Outcome outcome =
      run_line(fmt::format("{} {} {} --out {} --threads 2", program("drape-simulate").string(),
                           scene.string(), more, out.string()));
  if (outcome.exit_code > 1) throw std::runtime_error(outcome.text);
  if (outcome.exit_code == 1) fmt::print("true drape {}: {}\n", scene.string(), outcome.text);
  return out / "sheet.json";
}

void DrawnBench::make(const fs::path& folder) const {
  write_rig(folder / "true", true_, true);
  write_rig(folder / "rig", stated_, false);
  write_durable(folder / "true/cameras-plan.toml", cameras_);
  std::string sheets;
  for (std::size_t drape = 0; drape < drapes(); ++drape) {
    const std::string name = drape_name(drape);
    const fs::path scene = folder / "true/scenes" / (name + ".toml");
    fs::path sheet;
    if (kind_ == BenchKind::all_values)
      sheet = simulated(scene, folder / "true/model", "--spacing-mm 2.5 --segments 20");
    if (sheet.empty() || stiffer_ != 1) {
      DrawnFabric fabric = true_.fabric;
      for (double* value : {&fabric.bending_warp, &fabric.bending_weft, &fabric.shear})
        *value *= stiffer_;
      if (fabric.bias_bending) *fabric.bias_bending *= stiffer_;
      write_durable(folder / "true/fabric.toml", fabric.text());
      sheet = simulated(scene, folder / "true/out" / name, "--spacing-mm 5 --segments 5");
    }
    sheets += fmt::format(" --sheet drape_{}={}", name, sheet.string());
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
  if (!true_.pins.empty()) text += fmt::format(", {} pins", true_.pins.size());
  if (stiffer_ != 1) text += fmt::format(", real cloth {:.1f} times as stiff", stiffer_);
  return text + fmt::format(
                    "; {0} x {0} marks {1:.2f} mm apart; {2:.0f} g/m2, B {3:.3f} and {4:.3f}, "
                    "friction {5:.2f}; place to {6:g} mm{7}",
                    marks_, true_.pitch_mm, true_.fabric.density, true_.fabric.bending_warp,
                    true_.fabric.bending_weft, true_.friction, place_u_mm_,
                    states_uncertainties_ ? "" : " (not stated)");
}

}  // namespace drape::test
