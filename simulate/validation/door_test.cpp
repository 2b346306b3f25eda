// SPDX-License-Identifier: Apache-2.0
// Closed forms by the files that a user writes, with both solvers.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "simulate/validation/test_door.hpp"
#include "simulate/validation/test_exact.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using Runs = std::vector<DoorRun>;
constexpr double kSheetLength = 0.1;
constexpr double kDensity = 0.15;
constexpr double kWeight = kDensity * kGravity;  // N/m2
// Tensile modulus over a strip's weight: its stretch then is below a tenth of the goals, and
// Runge-Kutta's steps are as long as that allows.
constexpr double kStretchPerLoad = 1e4;
constexpr double kMu = 0.4;

std::vector<int> rows_of(const DoorCase& c, std::initializer_list<int> rows) {
  std::vector<int> particles;
  for (const int row : rows) {
    for (int col = 0; col < c.cols; ++col) particles.push_back(row * c.cols + col);
  }
  return particles;
}

Vector3d at_row(const DoorRun& run, const DoorCase& c, int row) {
  return at(run.position, row * c.cols + c.cols / 2);
}

/// A strip whose first two rows are held; the clamp is half a cell before the second one, whose
/// hinge stands for half a cell on each side of it.
DoorCase clamped_strip(int rows, double gamma, double length = kSheetLength) {
  DoorCase c;
  c.rows = rows;
  c.spacing_m = length / (rows - 1.5);
  c.density_kg_per_m2 = kDensity;
  c.bending_n_m = kWeight * std::pow(length, 3) / gamma;
  c.tensile.slope = kStretchPerLoad * kWeight * length;
  c.pinned = rows_of(c, {0, 1});
  return c;
}

DoorCase cantilever(int rows, double gamma) {
  DoorCase c = clamped_strip(rows, gamma);
  c.starts_flat = true;
  c.start = [c](double u, double v) { return c.flat_place(u, v); };
  return c;
}

/// Height over width of a cantilever's shape.
double ratio_of(const DoorRun& run, const DoorCase& c) {
  const Vector3d tip = at_row(run, c, c.rows - 1);
  return -tip.z() / (c.flat_place(0.5 * c.spacing_m, 0).y() - tip.y());
}

TEST(FormsByFiles, Cantilevers) {
  for (const double gamma : {1.0, 10.0}) {
    const DoorCase c = cantilever(41, gamma);
    const exact::Cantilever shape = exact::cantilever(gamma);
    expect_form({fmt::format("cantilever H/W, Gamma {:g}", gamma),
                 shape.height / shape.width,
                 1e-3,
                 {c},
                 [c](const Runs& runs) { return ratio_of(runs[0], c); }});
  }
  const DoorCase coarse = cantilever(21, 100), fine = cantilever(41, 100);
  const exact::Cantilever deep = exact::cantilever(100);
  const double finer = std::pow(coarse.spacing_m / fine.spacing_m, 2);
  expect_form({"cantilever H/W, Gamma 100, 21 and 41",
               deep.height / deep.width,
               1e-3,
               {coarse, fine},
               [=](const Runs& runs) {
                 const double last = ratio_of(runs[1], fine);
                 return last + (last - ratio_of(runs[0], coarse)) / (finer - 1);
               }});
  const exact::Cantilever peirce = exact::cantilever_at_chord_angle(41.5 * kPi / 180);
  const DoorCase hung = cantilever(41, peirce.gamma);
  expect_form(
      {"B from Peirce's 41.5 degrees, over the B put in", 1, 5e-3, {hung}, [=](const Runs& runs) {
         const double chord = std::atan(ratio_of(runs[0], hung));
         return peirce.gamma / exact::cantilever_at_chord_angle(chord).gamma;
       }});
}

/// A strut pinned at both ends, its weight too small to matter.
TEST(FormsByFiles, Struts) {
  for (const double degrees : {20.0, 60.0}) {
    DoorCase c;
    c.rows = 41;
    c.spacing_m = kSheetLength / (c.rows - 1);
    c.bending_n_m = 1e-3;
    c.tensile.slope = 2e5 * c.bending_n_m / (kSheetLength * kSheetLength);
    constexpr double kLight = 5e-3;  // relative to gravity
    c.gravity_m_per_s2 *= kLight;
    c.motion_tolerance = 1e-3;
    c.static_tolerance /= kLight;
    c.pinned = rows_of(c, {0, c.rows - 1});
    const double alpha = degrees * kPi / 180;
    const exact::Elastica strut = exact::elastica(alpha);
    const double k = std::sin(0.5 * alpha);
    const double rise = k / std::comp_ellint_1(k);
    c.start = [=](double u, double v) {
      return Vector3d(u * strut.chord, v, rise * kSheetLength * std::sin(kPi * u / kSheetLength));
    };
    expect_form({fmt::format("strut's rise over its length, end slope {:g} deg", degrees),
                 rise,
                 2e-3,
                 {c},
                 [=](const Runs& runs) {
                   return std::abs(at_row(runs[0], c, c.rows / 2).z()) / kSheetLength;
                 }});
  }
}

TEST(FormsByFiles, AHangingStrip) {
  DoorCase c;
  c.rows = 41;
  const double length = 0.2;
  c.spacing_m = length / (c.rows - 1);
  c.density_kg_per_m2 = kDensity;
  c.tensile.slope = 400;
  c.gravity_m_per_s2 = {0, -kGravity, 0};
  c.starts_flat = true;
  c.start = [=](double u, double v) { return c.flat_place(u, v); };
  c.pinned = rows_of(c, {0});
  c.motion_tolerance = 1e-6;
  expect_form({"hanging strip: drop of its end (m)",
               kWeight * length * length / 800,
               1e-6,
               {c},
               [=](const Runs& runs) {
                 return c.flat_place(length, 0).y() - at_row(runs[0], c, c.rows - 1).y();
               }});
}

TEST(FormsByFiles, Chains) {
  for (const double chord : {0.775, 0.9}) {
    DoorCase c;
    c.rows = 41;
    const double length = 0.2;
    c.spacing_m = length / (c.rows - 1);
    c.density_kg_per_m2 = kDensity;
    c.bending_n_m = 1e-7;
    c.twist_n_m = 1e-5;  // a chain cannot twist
    c.tensile.slope = kStretchPerLoad * kWeight * length;
    c.pinned = rows_of(c, {0, c.rows - 1});
    const double sag = exact::catenary_sag(chord);
    c.start = [=](double u, double v) {
      const double t = 2 * u / length - 1;
      return Vector3d(0.5 * chord * length * t, v, sag * length * (t * t - 1));
    };
    expect_form({fmt::format("catenary sag over length, chord {:g}", chord),
                 sag,
                 1e-3,
                 {c},
                 [=](const Runs& runs) { return -at_row(runs[0], c, c.rows / 2).z() / length; }});
  }
}

/// Sheets held all round or at two ends, so stiff against bending and so light that they stay flat.
DoorCase flat_patch(int rows, double edge) {
  DoorCase c;
  c.rows = c.cols = rows;
  c.spacing_m = edge / (rows - 1);
  c.bending_n_m = c.twist_n_m = 1e-3;
  constexpr double kLight = 1e-2;  // relative to gravity
  c.gravity_m_per_s2 *= kLight;
  c.motion_tolerance = 1e-3;
  c.static_tolerance /= kLight;
  return c;
}

TEST(FormsByFiles, Patches) {
  const double edge = 0.05;
  for (const double g : {0.02, 0.1}) {
    DoorCase c = flat_patch(11, edge);
    c.shear_n_per_m = 20;
    for (int i = 0; i < 121; ++i) {
      if (i / 11 % 10 == 0 || i % 11 % 10 == 0) c.pinned.push_back(i);
    }
    c.start = [g](double u, double v) {
      return Vector3d(u * std::cos(g / 2) + v * std::sin(g / 2),
                      u * std::sin(g / 2) + v * std::cos(g / 2), 0);
    };
    expect_form({fmt::format("work (J) of a picture frame sheared by {:g} rad", g),
                 0.5 * edge * edge * c.shear_n_per_m * g * g,
                 1e-3,
                 {c},
                 [](const Runs& runs) { return runs[0].shear_j; }});
  }
  DoorCase c = flat_patch(11, edge);
  c.tensile = {4000, {{0.006, 2500}, {0.012, 6000}}};
  c.pinned = rows_of(c, {0, 10});
  const double strain = 0.02;
  c.start = [strain](double u, double v) { return Vector3d((1 + strain) * u, v, 0); };
  expect_form({"work (J) of a patch pulled to 2 %, knotted curve",
               edge * edge * c.tensile.energy(strain),
               1e-6,
               {c},
               [](const Runs& runs) { return runs[0].stretch_j; }});
}

/// Threshold below which a sheet holds and above which it slides: the middle of the two, else the
/// one that is wrong.
double threshold(const Runs& runs, double exact, double margin) {
  if (!runs[0].rests) return (1 - 2 * margin) * exact;
  return runs[1].rests ? (1 + 2 * margin) * exact : exact;
}

TEST(FormsByFiles, TheSlopeAtWhichASheetSlides) {
  constexpr double kMargin = 5e-3;
  constexpr long kSliding = 20000;  // steps after which a sheet that still slides will not stop
  std::vector<DoorCase> slopes;
  for (const double fraction : {1 - kMargin, 1 + kMargin}) {
    DoorCase c;
    c.rows = 3;
    c.spacing_m = 0.01;
    c.friction = kMu;
    c.table_z_m = 0;
    const double angle = std::atan(fraction * kMu);
    c.gravity_m_per_s2 = kGravity * Vector3d(std::sin(angle), 0, -std::cos(angle));
    c.starts_flat = true;
    c.start = [c](double u, double v) { return c.flat_place(u, v); };
    c.motion_steps = kSliding;
    slopes.push_back(c);
  }
  expect_form({"slope at which a sheet starts to slide, tangent", kMu, kMargin, slopes,
               [](const Runs& runs) { return threshold(runs, kMu, kMargin); }, false});
}

/// The cloth that the files of a case describe.
Cloth cloth_of(const DoorCase& c) {
  ClothLaws laws =
      linear_laws(c.density_kg_per_m2, c.tensile.slope, c.shear_n_per_m, c.bending_n_m);
  laws.twist_n_m = c.twist_n_m;
  return {c.grid(), laws, MassRule::area};
}

/// A strip clamped pointing down whose tip stands on the table: from the rest that it has with its
/// tip held, so that nothing but friction decides whether it stays.
DoorCase pressed_case(const exact::PressedStrip& strip) {
  constexpr double kStripLength = 0.25;  // m; friction's springs yield by micrometres
  DoorCase c = clamped_strip(41, strip.gamma, kStripLength);
  c.twist_n_m = c.bending_n_m;
  c.table_z_m = 0;
  c.damping_per_s = 3000;  // else the tip rings when it lands, and slips whenever it presses less
  c.motion_tolerance = 1e-3;
  c.motion_steps = 10000;
  const double height = strip.at(1).drop;
  Field x = shaped(c.grid(), [&](double u, double v) {
    const double arc = (u - 0.5 * c.spacing_m) / kStripLength;
    // The held cell is straight.
    const exact::PressedStrip::Place place =
        u < 1.5 * c.spacing_m ? exact::PressedStrip::Place{0, arc} : strip.at(arc);
    return Vector3d(kStripLength * place.sideways, v, kStripLength * (height - place.drop));
  });
  Cloth cloth = cloth_of(c);
  (void)Equilibrium(cloth, weight(cloth, c.gravity_m_per_s2),
                    held_rows(c.grid(), {0, 1, c.rows - 1}))
      .find(x, 0.5 * c.spacing_m);
  c.start = [x, c](double u, double v) {
    const auto row = static_cast<int>(std::lround(u / c.spacing_m));
    return at(x, row * c.cols + static_cast<int>(std::lround(v / c.spacing_m)));
  };
  return c;
}

/// Force of the table on the last row, from what the sheet does to it: along x over along z.
double friction_used(const DoorRun& run, const DoorCase& c) {
  Cloth cloth = cloth_of(c);
  Field force = weight(cloth, c.gravity_m_per_s2);
  cloth.add_forces(run.position, nullptr, force);
  Vector3d sum = Vector3d::Zero();
  for (const int i : rows_of(c, {c.rows - 1})) sum += at(force, i);
  return std::abs(sum.x() / sum.z());
}

/// The middle of the largest coefficient with which the tip slips and the least with which it
/// stays, of those tried in rising order; beyond them when it does the same with all. The farther a
/// tip slips, the more friction it needs, so it does not stop nearby.
double slip_threshold(const Runs& runs, const DoorCase& c, const std::vector<double>& tried) {
  constexpr double kFar = 1e-3;  // relative to the strip; friction's springs yield by less
  constexpr double kBeyond = 1.2;
  double slips = tried.front() / kBeyond, stays = kBeyond * tried.back();
  for (std::size_t k = 0; k < tried.size(); ++k) {
    const double moved = std::abs(at_row(runs[k], c, c.rows - 1).x());
    if (runs[k].rests && moved < kFar * c.grid().patch_m.x()) {
      stays = tried[k];
      break;
    }
    slips = tried[k];
  }
  return 0.5 * (slips + stays);
}

/// Elastic stick-slip (Romero et al. 2021): a strip clamped above the table and pressed on it by
/// `lowered` of its length. The friction that it needs to stay, by the force at its tip (one
/// `tried`) or by whether it slips with those tried, as parts of the right coefficient. The files
/// state `friction_error` times as much.
DoorForm pressed_form(double lowered, std::vector<double> tried, double goal,
                      double friction_error = 1) {
  constexpr double kGamma = 20;
  const exact::PressedStrip strip =
      exact::pressed_strip(kGamma, 1 / (kGamma * kStretchPerLoad), lowered);
  const DoorCase pressed = pressed_case(strip);
  const bool one = tried.size() == 1;
  DoorForm form{fmt::format("strip pressed down by {:g} L: {}", lowered, one ? "T/N" : "slips"),
                strip.friction(),
                goal,
                {},
                {},
                one};
  for (double& friction : tried) {
    friction *= form.exact;
    form.cases.push_back(pressed);
    form.cases.back().friction = friction_error * friction;
  }
  form.measure = [pressed, tried, one](const Runs& runs) {
    return one ? friction_used(runs[0], pressed) : slip_threshold(runs, pressed, tried);
  };
  return form;
}

constexpr double kGoal = 1e-2;
const std::vector<double> kAround = {1 - kGoal, 1 + kGoal};

TEST(FormsByFiles, StickSlipOfAPressedStrip) {
  for (const double lowered : {0.05, 0.1, 0.2}) {
    expect_form(pressed_form(lowered, {1.2}, kGoal));
    expect_form(pressed_form(lowered, kAround, kGoal));
  }
}

TEST(FormsByFiles, StickSlipTellsATenthOfFrictionApart) {
  const DoorForm form = pressed_form(0.1, kAround, kGoal, 1.1);
  for (const Solver solver : {Solver::fall, Solver::rk4})
    EXPECT_GT(worst_error(form, solver), kGoal) << drape::name_of(solver);
}

}  // namespace
}  // namespace drape::simulate
