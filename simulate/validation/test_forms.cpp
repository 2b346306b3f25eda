// SPDX-License-Identifier: Apache-2.0
#include "simulate/validation/test_forms.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace drape::simulate {

using Eigen::Vector2d;
using Eigen::Vector3d;

FormSheet::FormSheet(const Vector2d& size, double bending_n_m, double spacing_m) : size_m(size) {
  laws.density_kg_per_m2 = kDensity;
  laws.tensile[0] = laws.tensile[1] = {1e4 * kWeight * kLength, {}};
  laws.shear = {10, {}};
  laws.bending[0] = laws.bending[1] = {bending_n_m, {}};
  laws.twist_n_m = bending_n_m;
  scene.file = "scene.toml";
  scene.table_z_m = -2;
  scene.start.mode = StartMode::flat;
  scene.start.centre_in_world = Vector3d::Zero();
  options.spacing_m = options.coarsest_m = spacing_m;
  options.thickness_m = 0;
  options.descent.residual = 1e-4;
}

Vector3d FormSheet::flat_place(const Vector2d& material_m) const {
  return {material_m.y() - size_m.y() / 2, size_m.x() / 2 - material_m.x(), 0};
}

void FormSheet::clamp(double warp_m, const Vector3d& middle, const Vector3d& direction) {
  const Vector3d half(size_m.y() / 2, 0, 0);
  scene.clamps.push_back(
      {{warp_m, 0}, {warp_m, size_m.y()}, middle - half, middle + half, direction});
}

void FormSheet::pin_ends(double warp_m, const Vector3d& middle) {
  for (const double weft_m : {0.0, size_m.y()}) {
    Pin pin;
    pin.at_material_m = {warp_m, weft_m};
    pin.point_in_world = middle + Vector3d(weft_m - size_m.y() / 2, 0, 0);
    scene.pins.push_back(pin);
  }
}

Vector3d FormRest::place(double warp_m, double weft_m) const {
  return level->places(moment, {{warp_m, weft_m}}).row(0).transpose();
}

Vector3d FormRest::reaction_n(double warp_m) const {
  const MeshCloth& cloth = level->cloth();
  MeshCloth::State force(moment.state.size(), Vector3d::Zero());
  cloth.add_forces(moment.state, force);
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < cloth.points(); ++i)
    if (std::abs(cloth.mesh().points_m[i].x() - warp_m) < 1e-9)
      sum -= force[i] + cloth.mass_kg()[i] * drape->local.scene.gravity_m_per_s2;
  return sum;
}

FormRest start_of(const FormSheet& sheet, const FormCurve& curve) {
  Print print;
  print.rows = print.cols = 2;
  print.pitch_m = sheet.size_m.minCoeff();
  print.patch_m = sheet.size_m;
  print.margin_m = {0, 0};
  FormRest rest;
  rest.drape =
      std::make_shared<DrapeCase>(drape_case(sheet.scene, print, std::nullopt, sheet.laws));
  rest.level = std::make_unique<DrapeLevel>(*rest.drape, sheet.options, sheet.options.spacing_m);
  if (!curve) {
    rest.moment = rest.level->start();
    return rest;
  }
  constexpr int kCols = 4;
  const int rows = static_cast<int>(std::ceil(2 * sheet.size_m.x() / sheet.options.spacing_m));
  std::vector<Vector2d> material;
  std::vector<Vector3d> places;
  for (int r = 0; r <= rows; ++r) {
    const Vector2d p = curve(sheet.size_m.x() * r / rows);
    for (int c = 0; c <= kCols; ++c) {
      material.emplace_back(sheet.size_m.x() * r / rows, sheet.size_m.y() * c / kCols);
      places.emplace_back(material.back().y() - sheet.size_m.y() / 2, -p.x(), p.y());
    }
  }
  rest.moment = rest.level->start_at(material, places);
  return rest;
}

FormRest rest_of(const FormSheet& sheet, const FormCurve& curve) {
  FormRest rest = start_of(sheet, curve);
  const RestReport report = rest.level->fall(rest.moment);
  EXPECT_TRUE(report.at_rest) << report.why;
  return rest;
}

void expect_relative(const std::string& what, double exact, double found, double goal) {
  fmt::print("{:<66} exact {:.8g}, found {:.8g}\n", what, exact, found);
  EXPECT_LE(std::abs(found - exact), goal * std::abs(exact)) << what << ": " << found;
}

void expect_at_most(const std::string& what, double found, double goal) {
  fmt::print("{:<66} {:.3g}, at most {:g}\n", what, found, goal);
  EXPECT_LE(found, goal) << what;
}

void expect_at_least(const std::string& what, double found, double goal) {
  fmt::print("{:<66} {:.3g}, at least {:g}\n", what, found, goal);
  EXPECT_GE(found, goal) << what;
}

}  // namespace drape::simulate
