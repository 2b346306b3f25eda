// SPDX-License-Identifier: Apache-2.0
// Frictionless drapes with known parameters computed by another solver: the scenes of
// tests/data/independent-drapes, three of them converged in tests/data/converged-drapes.
#include <gtest/gtest.h>
#include <cstdio>
#include <tuple>

#include "simulate/simulate.hpp"
#include "simulate/study/sensitivity.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using units::mm;

struct Found {
  bool at_rest = false;
  double distance_m = 0;  ///< mean over the marks
};

/// Drapes `name` with the default options from the scene's flat start.
Found found_of(const std::string& name, const std::string& data, const Fabric& fabric) {
  const Scene scene = read_scene(test::test_data("independent-drapes") / (name + ".toml"));
  SimulateOptions options;
  options.segments = 1;
  const SimulateResult result =
      simulate(scene, fabric, read_print(scene.print_file), std::nullopt, options);
  const Csv other = read_csv(test::test_data(data) / (name + ".csv"),
                             {"warp_mm", "weft_mm", "x_mm", "y_mm", "z_mm"});
  std::vector<Eigen::Vector2d> material_m;
  for (std::size_t k = 0; k < other.columns[0].size(); ++k)
    material_m.emplace_back(mm * other.columns[0][k], mm * other.columns[1][k]);
  const Eigen::MatrixX3d places = result.drape->level->places(result.drape->rest, material_m);
  Found found{result.at_rest(), 0};
  for (std::size_t k = 0; k < material_m.size(); ++k) {
    const Eigen::Vector3d there(other.columns[2][k], other.columns[3][k], other.columns[4][k]);
    const Eigen::Vector3d here =
        result.drape_case->local.to_world(places.row(static_cast<Eigen::Index>(k)).transpose());
    found.distance_m += (here - mm * there).norm() / static_cast<double>(material_m.size());
  }
  return found;
}

Fabric twin() {
  return read_fabric(test::test_data("independent-drapes") / "fab" / "twinA.toml");
}

double stiffness_of(const KawabataCurve& bending) {
  return bending.loading.back() / bending.x.back();
}

/// The fabric with bending stiffnesses times `bending` and twist stiffness times `twist`.
Fabric changed(double bending, double twist) {
  Fabric fabric = twin();
  const double before = stiffness_of(fabric.bending[0]) + stiffness_of(fabric.bending[1]);
  const double twist_n_m = 4 * *fabric.bias_bending_n_m - before;
  for (KawabataCurve& curve : fabric.bending) {
    for (double& moment : curve.loading) moment *= bending;
    for (double& moment : curve.unloading) moment *= bending;
  }
  fabric.bias_bending_n_m = 0.25 * (twist * twist_n_m + bending * before);
  return fabric;
}

constexpr double kHang_mm = 0.05;

TEST(IndependentDrapes, AreMetByDefault) {
  for (const auto& [name, data, limit_mm] : {std::tuple("hang", "converged-drapes", kHang_mm),
                                             std::tuple("sphere", "converged-drapes", 0.15),
                                             std::tuple("cube", "converged-drapes", 0.25),
                                             std::tuple("bias", "independent-drapes", 0.10)}) {
    const Found found = found_of(name, data, twin());
    EXPECT_TRUE(found.at_rest) << name;
    EXPECT_LE(found.distance_m / mm, limit_mm) << name;
    std::printf("%s: %.4f mm from %s\n", name, found.distance_m / mm, data);
  }
}

TEST(IndependentDrapes, TellWrongParametersApart) {
  Fabric exchanged = twin();
  std::swap(exchanged.bending[0], exchanged.bending[1]);
  const std::pair<const char*, Fabric> wrong[] = {{"bending + 10 %", changed(1.1, 1)},
                                                  {"bending - 10 %", changed(0.9, 1)},
                                                  {"twist halved", changed(1, 0.5)},
                                                  {"bending exchanged", exchanged}};
  for (const auto& [what, fabric] : wrong) {
    const double distance_m = found_of("hang", "converged-drapes", fabric).distance_m;
    EXPECT_GT(distance_m / mm, kHang_mm) << what;
    std::printf("hang, %s: %.4f mm\n", what, distance_m / mm);
  }
}

using Eigen::Vector3d;

constexpr double kSpacing_m = 20 * mm;
constexpr double kOnCube_m = 10 * mm;  // coarser meshes penetrate its edges
constexpr double kResidual = 1e-8;     // for rests compared with first-order responses

/// Bench1's cloth A hung by two marks of its upper hem.
Scene hanging_scene() {
  Scene scene = read_scene(test::source_root() / "rigs/bench1/scenes/A.toml");
  scene.obstacles.clear();
  scene.start = {StartMode::flat, 0, Vector3d(0, 0, 0.3), 0};
  scene.pins = {{{0, 0}, Vector3d(-0.0775, 0.1, 0.3)}, {{0, 10}, Vector3d(0.0775, 0.1, 0.3)}};
  return scene;
}

/// Bench1's cube with its own flat start, 3 mm above it and beside its centre.
Scene cube_scene() {
  Scene scene = read_scene(test::source_root() / "rigs/bench1/scenes/C.toml");
  scene.start = {StartMode::flat, 0, Vector3d(0.005, -0.004, Surroundings(scene).top_z_m() + 0.003),
                 0.2};
  return scene;
}

SimulateOptions coarse(double spacing_m = kSpacing_m) {
  SimulateOptions options;
  options.segments = 1;
  options.drape.spacing_m = spacing_m;
  return options;
}

/// The flat start as a sheet, as a reference for distances.
Sheet flat_reference(const Print& print, double z_m) {
  Sheet sheet;
  sheet.rows = sheet.cols = 5;
  sheet.patch_m = print.patch_m;
  for (int k = 0; k < 25; ++k) {
    SheetMark mark;
    mark.mark = {k / 5, k % 5};
    mark.material_m =
        Eigen::Vector2d(int{k / 5} * 0.25, (k % 5) * 0.25).cwiseProduct(print.patch_m);
    mark.point_in_world = Vector3d(mark.material_m.y() - 0.1, 0.1 - mark.material_m.x(), z_m);
    sheet.marks.push_back(mark);
  }
  return sheet;
}

SensitivityFile found(const Scene& scene, const Fabric& fabric, double reference_z_m,
                      const SensitivityOptions& options) {
  const Print print = read_print(scene.print_file);
  return sensitivities_of(simulate(scene, fabric, print, std::nullopt, options.simulate), fabric,
                          flat_reference(print, reference_z_m), options);
}

double norm(const MeshCloth::State& state) {
  double squares = 0;
  for (const Vector3d& one : state) squares += one.squaredNorm();
  return std::sqrt(squares);
}

/// The hanging cloth at rest on one mesh.
class HangingCloth : public ::testing::Test {
 protected:
  HangingCloth() {
    Drape found = drape_cloth(case_, how_);
    level_ = found.level;
    rest_ = found.rest;
    EXPECT_TRUE(level_->rest(rest_, kResidual).at_rest);
  }
  MeshCloth::State rested_with(FabricValue value, double factor) const {
    DrapeCase changed = case_;
    changed.laws = scaled(changed.laws, value, factor);
    DrapeLevel level(changed, how_, kSpacing_m);
    ClothMoment moment = rest_;
    EXPECT_TRUE(level.rest(moment, kResidual).at_rest) << name_of(value);
    return moment.state;
  }

  Scene scene_ = hanging_scene();
  DrapeOptions how_ = coarse().drape;
  DrapeCase case_ = drape_case(scene_, read_print(scene_.print_file), std::nullopt,
                               fit_laws(read_fabric(scene_.fabric_file), 1).laws);
  std::shared_ptr<DrapeLevel> level_;
  ClothMoment rest_;
};

TEST_F(HangingCloth, FirstOrderAnswersAreCentralDifferences) {
  constexpr double kChange = 3e-3;
  for (std::size_t v = 0; v < std::size(names_of<FabricValue>); ++v) {
    const auto value = static_cast<FabricValue>(v);
    const auto found = level_->first_order(rest_, {force_change(*level_, rest_, value)});
    ASSERT_TRUE(found) << name_of(value);
    MeshCloth::State difference = rested_with(value, 1 + kChange);
    const MeshCloth::State lower = rested_with(value, 1 - kChange);
    MeshCloth::State error = found->front();
    for (std::size_t i = 0; i < error.size(); ++i) {
      difference[i] = (difference[i] - lower[i]) / (2 * kChange);
      error[i] -= difference[i];
    }
    EXPECT_LT(norm(error), 1e-3 * norm(difference)) << name_of(value);
  }
}

TEST_F(HangingCloth, AllStiffnessesAndTheWeightTogetherMoveNothing) {
  MeshCloth::State sum(rest_.state.size(), Vector3d::Zero());
  double largest = 0;
  for (std::size_t v = 0; v < std::size(names_of<FabricValue>); ++v) {
    const auto found =
        level_->first_order(rest_, {force_change(*level_, rest_, static_cast<FabricValue>(v))});
    ASSERT_TRUE(found);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += found->front()[i];
    largest = std::max(largest, norm(found->front()));
  }
  EXPECT_LT(norm(sum), 1e-4 * largest);
}

const SceneEffect* effect_of(const SensitivityFile& file, const std::string& value) {
  const auto one = std::find_if(file.scene.begin(), file.scene.end(),
                                [&](const SceneEffect& effect) { return effect.value == value; });
  return one == file.scene.end() ? nullptr : &*one;
}

TEST(Sensitivities, HoldPinsAndLevelOfAHangingCloth) {
  const Scene scene = hanging_scene();
  const SensitivityFile file = found(scene, read_fabric(scene.fabric_file), 0.3, {coarse()});
  ASSERT_EQ(file.status, "at rest");
  EXPECT_EQ(file.values.size(), std::size(names_of<FabricValue>));
  ASSERT_EQ(file.spacing_m, kSpacing_m);
  // Raising both pins raises the cloth by the same amount.
  Eigen::MatrixX3d lifted = Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(file.marks), 3);
  double step_m = 0;
  for (const char* pin : {"pin_1_z_mm", "pin_2_z_mm"}) {
    const SceneEffect* effect = effect_of(file, pin);
    ASSERT_TRUE(effect != nullptr && effect->moves) << pin;
    lifted += 0.5 * (effect->moves->up_m - effect->moves->down_m);
    step_m = effect->moves->step * mm;
  }
  EXPECT_LT((lifted.rowwise() - Eigen::RowVector3d(0, 0, step_m)).rowwise().norm().maxCoeff(),
            1e-3 * step_m);
  // Tilting the bench about the line of the pins rotates the cloth with gravity.
  const SceneEffect* level = effect_of(file, "level_x_deg");
  ASSERT_TRUE(level != nullptr && level->moves);
  const double turn_rad = level->moves->step * units::deg;
  const double lowest_m = 0.3 - 0.1;  // about the patch's height below the pins
  const double swung_m = level->moves->up_m.col(1).cwiseAbs().maxCoeff();
  EXPECT_GT(swung_m, 0.3 * turn_rad * lowest_m);
  EXPECT_LT(swung_m, 3 * turn_rad * lowest_m);
}

TEST(Sensitivities, SayWhereTheMarksGoWhenAValueErrs) {
  Scene scene = cube_scene();
  scene.stand_ins = {"friction"};
  scene.friction_uncertainty.reset();
  Fabric fabric = read_fabric(scene.fabric_file);
  fabric.stand_ins = {"shear curves"};
  fabric.bias_bending_n_m = 1e-6;
  const SensitivityFile file = found(scene, fabric, 0.15, {coarse(kOnCube_m)});
  ASSERT_EQ(file.status, "at rest");
  for (const ValueEffect& one : file.values) {
    ASSERT_TRUE(one.moves) << one.value;
    EXPECT_EQ(one.moves->up_m.rows(), file.marks);
    EXPECT_EQ(one.moves->down_m, -one.moves->up_m) << one.value;
    EXPECT_EQ(one.moves->half_width.value_or(0), one.value == "shear" ? 50 : 0) << one.value;
  }
  // Cloth that lies on a cube moves up and down with it: the central one of 5 x 5 marks.
  ASSERT_EQ(file.marks, 25);
  const SceneEffect* higher = effect_of(file, "object_1_z_mm");
  ASSERT_TRUE(higher != nullptr && higher->moves);
  const double up_m = higher->moves->step * mm;
  EXPECT_NEAR(higher->moves->up_m(12, 2), up_m, 0.1 * up_m);
  // A turned cube moves the cloth that hangs at its sides, by up to the turn times their half
  // length; friction holds the middle of its top where the cloth fell.
  const SceneEffect* turn = effect_of(file, "object_1_turn_deg");
  ASSERT_TRUE(turn != nullptr && turn->moves);
  const double side_m =
      turn->moves->step * units::deg * 0.5 * std::get<Box>(scene.obstacles[0]).size_m.x();
  EXPECT_LT(turn->moves->up_m.row(12).norm(), 0.1 * side_m);
  EXPECT_GT(turn->moves->up_m.rowwise().norm().maxCoeff(), 0.25 * side_m);
  for (const char* value : {"object_1_x_mm", "object_1_y_mm", "object_1_size_mm",
                            "object_1_turn_deg", "level_x_deg", "level_y_deg", "friction"}) {
    const SceneEffect* effect = effect_of(file, value);
    ASSERT_TRUE(effect != nullptr && effect->moves) << value;
    EXPECT_TRUE(effect->moves->up_m.allFinite()) << value;
    EXPECT_EQ(effect->moves->half_width.value_or(0),
              std::string(value) == "friction" ? kStandInPart * scene.friction : 0);
  }
}

TEST(Sensitivities, TabulateChangedModelsFromRestAndFromStart) {
  const Scene scene = hanging_scene();
  SensitivityOptions options{coarse()};
  options.variants = true;
  const SensitivityFile file = found(scene, read_fabric(scene.fabric_file), 0.3, options);
  ASSERT_EQ(file.status, "at rest");
  ASSERT_EQ(file.variants.size(), 2U * 5 + 1);
  for (const VariantEffect& row : file.variants) {
    EXPECT_TRUE(row.at_rest) << row.what << (row.continued ? " from the base" : "");
    EXPECT_TRUE(std::isfinite(row.distance_m)) << row.what;
  }
  EXPECT_EQ(file.variants.back().what, "spacing 40 mm");
  EXPECT_GT(file.variants.back().moved_m, 0.01 * mm);
}

// ----
// Which values count as not measured, by the words in the file.

TEST(StandIns, AreWhatFilesAndImportsCallThem) {
  Fabric fabric;
  fabric.bias_bending_n_m = 1e-6;
  const auto named = [&](const std::string& text) {
    fabric.stand_ins = {text};
    std::string values;
    for (std::size_t i = 0; i < std::size(names_of<FabricValue>); ++i)
      if (is_stand_in(fabric, static_cast<FabricValue>(i)))
        values += std::string(names_of<FabricValue>[i]) + " ";
    return values;
  };
  EXPECT_EQ(named("tensile curves: EMT 3 %, LT 0.7, RT 60 %"), "tensile_warp tensile_weft ");
  EXPECT_EQ(named("shear: G 0.6 gf/(cm deg)"), "shear ");  // as `drape fabric import` writes it
  EXPECT_EQ(named("bending curves"), "bending_warp bending_weft ");
  EXPECT_EQ(named("areal_density_g_per_m2"), "areal_density ");
  EXPECT_EQ(named("bias bending stiffness"), "twist ");
  EXPECT_EQ(named("bending at 45 degrees"), "twist ");
  EXPECT_EQ(named("bending hysteresis"), "");
  EXPECT_EQ(named("all"),
            "tensile_warp tensile_weft shear bending_warp bending_weft twist areal_density ");
  fabric.bias_bending_n_m.reset();
  EXPECT_EQ(named("nothing"), "twist ");
}

}  // namespace
}  // namespace drape::simulate
