// SPDX-License-Identifier: Apache-2.0
// Drawn cloths that hang from two or three pins and touch nothing: how low the program's answers
// lie. DRAPE_LONG_TESTS=1 runs the trial of the issue and prints a row for each.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/ensemble/branches.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/start/local_frame.hpp"
#include "simulate/study/study.hpp"
#include "simulate/world.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::simulate {
namespace {

using units::percent;

using Eigen::Vector3d;
namespace fs = std::filesystem;
constexpr double kTurn = 2 * std::numbers::pi;

/// The same numbers with every library.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  double spread(double low, double high) {
    return std::exp(uniform(std::log(low), std::log(high)));
  }
  int below(int count) { return std::min(count - 1, static_cast<int>(uniform(0, count))); }

 private:
  std::mt19937_64 engine_;
};

std::string fabric_text(Draw& draw) {
  const double b = draw.spread(0.03, 0.25), weft = b * draw.spread(0.5, 1.2);
  const double g = draw.spread(0.3, 1.5);
  return fmt::format(
      "schema = \"drapebench/fabric/1\"\nname = \"drawn\"\nareal_density_g_per_m2 = {:.1f}\n"
      "stand_ins = [\"all\"]\n[tensile]\n"
      "warp_kes = {{ emt_percent = {:.2f}, lt = {:.3f}, rt_percent = 60 }}\n"
      "weft_kes = {{ emt_percent = {:.2f}, lt = {:.3f}, rt_percent = 60 }}\n[shear]\n"
      "warp_kes = {{ g_gf_per_cm_deg = {:.3f} }}\nweft_kes = {{ g_gf_per_cm_deg = {:.3f} }}\n"
      "[bending]\nwarp_kes = {{ b_gf_cm2_per_cm = {:.4f} }}\n"
      "weft_kes = {{ b_gf_cm2_per_cm = {:.4f} }}\n",
      draw.spread(80, 300), draw.spread(2, 8), draw.uniform(0.55, 0.85), draw.spread(3, 12),
      draw.uniform(0.55, 0.85), g, g, b, weft);
}

std::string print_text(double side) {
  return fmt::format(
      "schema = \"drapebench/print/1\"\nrows = 11\ncols = 11\npitch_mm = {:.3f}\n"
      "dot_diameter_mm = 4.0\npatch_mm = [{:.3f}, {:.3f}]\nmargin_mm = [0.0, 0.0]\n[tags]\n"
      "family = \"tag36h11\"\nedge_mm = 10.0\nfirst_id = 0\ncells = []\n",
      side / 10, side, side);
}

/// Two or three pins, apart from each other, drawn together and to unequal heights.
std::string pins_text(Draw& draw, double side) {
  const int count = 2 + draw.below(2);
  const bool on_marks = draw.uniform(0, 1) < 0.6;
  const double near = draw.uniform(0.7, 0.98);
  const double uneven = draw.uniform(0, 1) < 0.5 ? 0.1 * side : 0;
  std::vector<Eigen::Vector2d> places;  // fractions of the side
  while (static_cast<int>(places.size()) < count) {
    Eigen::Vector2d p(draw.uniform(0, 1), draw.uniform(0, 1));
    if (on_marks) p = (p * 10).array().round() / 10;
    const bool far = std::all_of(places.begin(), places.end(),
                                 [&](const Eigen::Vector2d& q) { return (p - q).norm() > 0.4; });
    if (far) places.push_back(p);
  }
  std::string text;
  for (const Eigen::Vector2d& p : places) {
    const double height = 300 + draw.uniform(-1, 1) * uneven;
    text += on_marks ? fmt::format("[[pin]]\nrow = {}\ncol = {}\n", std::lround(p.x() * 10),
                                   std::lround(p.y() * 10))
                     : fmt::format("[[pin]]\nat_material_mm = [{:.3f}, {:.3f}]\n", p.x() * side,
                                   p.y() * side);
    text += fmt::format("at_mm = [{:.4f}, {:.4f}, {:.4f}]\n", near * (p.y() - 0.5) * side,
                        near * (0.5 - p.x()) * side, height);
  }
  return text;
}

struct Hang {
  Scene scene;
  Fabric fabric;
  Print print;
};

/// Hang `seed` of a fixed sequence: fabrics by KES numbers over the range of woven apparel fabrics,
/// pins on marks or anywhere.
Hang draw_hang(const fs::path& folder, int seed) {
  Draw draw(static_cast<std::uint64_t>(seed) + 1);
  const double side = 10 * std::round(draw.uniform(15, 30));
  fs::create_directories(folder);
  write_durable(folder / "fabric.toml", fabric_text(draw));
  write_durable(folder / "print.toml", print_text(side));
  write_durable(folder / "scene.toml",
                fmt::format("schema = \"drapebench/scene/1\"\nname = \"H{}\"\n"
                            "fabric = \"fabric.toml\"\nprint = \"print.toml\"\ntable_z_mm = -400\n"
                            "friction = 0.3\nstand_ins = [\"friction\"]\n[start]\nmode = \"flat\"\n"
                            "centre_mm = [0.0, 0.0, 300.0]\nyaw_deg = 0\n{}",
                            seed, pins_text(draw, side)));
  Hang hang;
  hang.scene = read_scene(folder / "scene.toml");
  hang.fabric = read_fabric(hang.scene.fabric_file);
  hang.print = read_print(hang.scene.print_file);
  return hang;
}

/// A rest of a hang.
struct HangRest {
  double energy_j = 0;   ///< against the start's height, where the pins are
  bool crosses = false;  ///< it passes through itself
  double longest_trial_m = 0;
};

constexpr int kWithLayers = 13;  // particles per side; beyond, a crumpled sheet takes minutes

SimulateOptions by_the_fall(int particles) {
  SimulateOptions options;
  options.rows = options.cols = particles;
  options.solver = Solver::fall;
  return options;
}

struct HangCase {
  HangCase(int seed, int particles)
      : hang(draw_hang(folder.path(), seed)), options(by_the_fall(particles)) {}

  drape::test::TemporaryFolder folder;
  Hang hang;
  SimulateOptions options;
  std::optional<Sheet> nothing;
  SimulateReport report;
  GridSpec grid{options.rows, options.cols, hang.print.patch_m};
  LocalScene local = local_scene(hang.scene, nothing, Surroundings(hang.scene).top_z_m());
  ClothLaws laws = make_laws(hang.fabric, options.segments, report);
  Surroundings surroundings = Surroundings(local.scene);
  StaticCase the_case{local.scene, hang.print, nothing, surroundings, laws, options.mass};
  StaticOptions by_fall = static_options(local.scene, options);
};

/// Where random start `index` ends: bent, turned and crumpled sheets, by the fall or the static
/// solver in turns; on finer grids without contact with themselves. Nothing where it does not rest.
std::optional<HangRest> rest_of_random_start(const HangCase& hang, int index) {
  Draw draw(1000003ULL * (index + 1));
  StaticOptions how = hang.by_fall;
  how.threads = 1;
  if (hang.grid.rows > kWithLayers) how.cloth_thickness_m = 0;
  how.falls = index % 2 == 0 ? Falls::first : Falls::never;
  const bool turns = index % 4 >= 2;
  const Vector3d axis(draw.uniform(-1, 1), draw.uniform(-1, 1), draw.uniform(-1, 1));
  const double angle = turns ? draw.uniform(0, kTurn / 2) : 0;
  const double high = draw.spread(1e-3, 40e-3);
  struct Wave {
    double u, v, phase;
    Vector3d height;
  };
  std::vector<Wave> waves;
  for (int k = 0; k < 8; ++k) {
    const double u = draw.uniform(-3, 3), v = draw.uniform(-3, 3);
    const Vector3d along(0.3 * draw.uniform(-1, 1), 0.3 * draw.uniform(-1, 1), draw.uniform(-1, 1));
    waves.push_back({u, v, draw.uniform(0, kTurn), along * high / (1 + std::hypot(u, v))});
  }
  const StaticDrape drape =
      drape_statically(hang.the_case, hang.grid, how, [&](const GridSpec& here, Field& x) {
        const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
        for (int i = 0; i < here.count(); ++i) {
          const double u = int{i / here.cols} / (here.rows - 1.0);
          const double v = (i % here.cols) / (here.cols - 1.0);
          Vector3d p = at(x, i);
          for (const Wave& wave : waves)
            p += wave.height * std::sin(kTurn / 2 * (wave.u * u + wave.v * v) + wave.phase);
          put_at(x, i, turn * p);
        }
      });
  if (drape.report.status != StaticStatus::at_rest) return std::nullopt;
  return HangRest{drape.report.history.back().sum_j(),
                  self_distance(hang.grid, drape.position).crossings > 0,
                  drape.report.longest_trial_m};
}

constexpr double kGoal = 0.01 * percent;  // relative to the energy against the pins' height
constexpr int kReported = 25;             // random starts between two lines of what they found

struct Ends {
  double fall_j = 0, lowest_j = 0, best_start_j = 0, best_random_j = 0;
};

/// Rests that `drape run` (one fall), `drape simulate branches` and random starts find of hang
/// `seed`.
Ends ends_of(int seed, int particles, int kicks, int randoms) {
  const HangCase here(seed, particles);
  const Hang& hang = here.hang;
  const SimulateOptions& options = here.options;
  BranchOptions how;
  how.kicks = kicks;
  const double pins_j = here.local.gravity_offset_j(mass_kg(hang.fabric, hang.print, options));
  Ends ends;
  const StaticDrape fallen = drape_statically(here.the_case, here.grid, here.by_fall);
  ends.fall_j = fallen.report.history.back().sum_j();
  const BranchResult result =
      simulate_branches(hang.scene, hang.fabric, hang.print, here.nothing, options, how);
  if (!result.branches.found.empty())
    ends.lowest_j = result.branches.found.front().energy_j - pins_j;
  const auto note_start = [&](const Branch& rest) {
    if (rest.own_start >= 0)
      ends.best_start_j = std::min(ends.best_start_j, rest.energy_j - pins_j);
  };
  for (const Branch& branch : result.branches.found) {
    note_start(branch);
    for (const Branch& other : branch.others) note_start(other);
  }
  for (int k = 0; k < randoms; ++k) {
    const auto rest = rest_of_random_start(here, k);
    if (rest && !rest->crosses) ends.best_random_j = std::min(ends.best_random_j, rest->energy_j);
    if ((k + 1) % kReported != 0) continue;
    fmt::print(
        "  hang {} at {}, {} random starts: best {:.4f} uJ, lowest branch {:.4f}, one fall "
        "{:.4f}\n",
        seed, particles, k + 1, ends.best_random_j * 1e6, ends.lowest_j * 1e6, ends.fall_j * 1e6);
    std::fflush(stdout);
  }
  const double least_j = std::min(ends.lowest_j, ends.best_random_j);
  const auto gap = [&](double energy_j) {
    return (energy_j - least_j) / std::abs(least_j) / percent;
  };
  fmt::print(
      "hang {} at {}: {} pins, lowest {:.4f} uJ; above it in %: one fall {:.4f}, the best of "
      "32 starts {:.4f}, the lowest branch {:.4f}, the best of {} random starts {:.4f}\n",
      seed, particles, hang.scene.pins.size(), least_j * 1e6, gap(ends.fall_j),
      gap(ends.best_start_j), gap(ends.lowest_j), randoms, gap(ends.best_random_j));
  std::fflush(stdout);
  return ends;
}

/// Issue: within 0.01 % of the best energy that 200 random starts find. Coarse grids first, so that
/// a trial that is broken off says most; DRAPE_FIRST_TRIAL is its first hang. The slice has one
/// hang of three pins and one of two.
TEST(Hangs, TheLowestBranchIsAsLowAsTheBestOfRandomStarts) {
  const bool whole = drape::test::trial_count(1, 2) == 2;
  std::vector<int> hangs{0, 4};
  if (whole) {
    hangs.clear();
    for (int seed = drape::test::first_trial(); seed < 12; ++seed) hangs.push_back(seed);
  }
  const int randoms = drape::test::trial_count(6, 200);
  const std::vector<int> grids = whole ? std::vector<int>{21, 31, 41} : std::vector<int>{9};
  for (const int grid : grids) {
    for (const int seed : hangs) {
      const Ends ends = ends_of(seed, grid, whole ? BranchOptions{}.kicks : 32, randoms);
      // In hangs of the slice no start finds the lowest rest; hang 9 has one rest alone.
      if (!whole) {
        EXPECT_LT(ends.lowest_j, ends.best_start_j - kGoal * std::abs(ends.best_start_j))
            << seed << ", " << grid;
      }
      EXPECT_LE(ends.lowest_j, ends.best_random_j + kGoal * std::abs(ends.best_random_j))
          << seed << ", " << grid;
    }
  }
}

/// A system that is solved, iterated on thrice and corrected four times in a step is half a spacing
/// long at most each. Corrections of crumpled sheets were many sheets long, and their pairs of
/// layers filled gigabytes.
TEST(Hangs, TrialsOfAStepStayNear) {
  const HangCase hang(8, kWithLayers);
  int rests = 0;
  for (int index = 0; index < 12; ++index) {
    const auto rest = rest_of_random_start(hang, index);
    if (!rest) continue;
    ++rests;
    EXPECT_LE(rest->longest_trial_m, 8 * 0.5 * hang.grid.warp_spacing_m()) << index;
  }
  EXPECT_GT(rests, 6);
}

BranchResult seek(const Hang& hang, SimulateOptions options, int threads) {
  options.threads = threads;
  return simulate_branches(hang.scene, hang.fabric, hang.print, std::nullopt, options,
                           {.starts = 1, .kicks = 32});
}

/// A start that ends on the sheet itself is no reason not to seek.
TEST(Hangs, AreSoughtLowerWhereAStartPressesOnItself) {
  const drape::test::TemporaryFolder folder;
  const Hang hang = draw_hang(folder.path(), 2);
  const SimulateOptions options = by_the_fall(13);
  const BranchResult result = seek(hang, options, 1);
  int pressing = 0, sought = 0;
  const auto count = [&](const Branch& rest) {
    (rest.own_start < 0 ? sought : pressing) += rest.own_start < 0 || rest.report.layers > 0;
  };
  for (const Branch& branch : result.branches.found) {
    count(branch);
    std::for_each(branch.others.begin(), branch.others.end(), count);
  }
  EXPECT_EQ(pressing, 1);  // the case of this test
  EXPECT_GT(sought, 0);
  EXPECT_EQ(branches_json(result.branches).dump(),
            branches_json(seek(hang, options, 2).branches).dump());
}

TEST(Hangs, AreSoughtByKicksAlikeAtAnyNumberOfThreads) {
  const drape::test::TemporaryFolder folder;
  const Hang hang = draw_hang(folder.path(), 0);
  ASSERT_EQ(hang.scene.pins.size(), 3U);
  const SimulateOptions options = by_the_fall(9);
  const BranchResult result = seek(hang, options, 1);
  EXPECT_TRUE(std::any_of(result.branches.found.begin(), result.branches.found.end(),
                          [](const Branch& branch) { return branch.own_start < 0; }));
  EXPECT_EQ(branches_json(result.branches).dump(),
            branches_json(seek(hang, options, 2).branches).dump());
}

/// The lowest branch of the paper's D.
Sheet lowest_of_d(int particles, int starts, int kicks) {
  const Scene scene = read_scene(drape::test::source_root() / "rigs/paper/scenes/D.toml");
  const SimulateOptions options = by_the_fall(particles);
  BranchOptions how;
  how.starts = starts;
  how.kicks = kicks;
  const BranchResult result =
      simulate_branches(scene, read_fabric(scene.fabric_file), read_print(scene.print_file),
                        std::nullopt, options, how);
  EXPECT_FALSE(result.sheets.empty()) << particles;
  return result.sheets.empty() ? Sheet{} : result.sheets.front();
}

/// Mirrored in the plane of its pins, the sheet weighs the same: of both, each grid reports the
/// same one, towards the start's middle.
TEST(PaperD, TheLowestBranchIsTheSameOneOnEveryGrid) {
  const bool whole = drape::test::trial_count(1, 2) == 2;
  const std::vector<int> grids = whole ? std::vector<int>{21, 31, 41} : std::vector<int>{6, 11};
  std::optional<Sheet> coarser;
  for (const int grid : grids) {
    const Sheet finer = lowest_of_d(grid, whole ? 32 : 3, whole ? BranchOptions{}.kicks : 32);
    ASSERT_FALSE(finer.marks.empty());
    if (coarser) {
      Sheet mirrored = finer;
      for (SheetMark& mark : mirrored.marks)
        mark.point_in_world.y() = 2 * 100 * units::mm - mark.point_in_world.y();
      const double apart_m = *mean_distance_m(*coarser, finer, *coarser);
      EXPECT_LT(apart_m, 0.5 * *mean_distance_m(*coarser, mirrored, *coarser)) << grid;
      if (whole) {
        fmt::print("paper's D to {}: {:.4f} mm\n", grid, apart_m / units::mm);
        EXPECT_LE(apart_m, 0.05 * units::mm) << grid;  // issue
      }
    }
    coarser = finer;
  }
}

}  // namespace
}  // namespace drape::simulate
