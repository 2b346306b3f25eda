// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "simulate/ensemble/bands.hpp"
#include "simulate/ensemble/test_ensemble.hpp"
#include "tests/support/heavy_strip.hpp"

namespace drape::simulate {
namespace {

using Eigen::MatrixX3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

/// Nine marks, 0.1 m apart, at the given height.
MatrixX3d flat_marks(double z_m) {
  MatrixX3d marks(9, 3);
  for (int i = 0; i < 9; ++i) marks.row(i) << 0.1 * int{i / 3}, 0.1 * (i % 3), z_m;
  return marks;
}

/// 41 starts, start k at k - 20 mm, on one branch with a linking distance of 2 mm.
Ensemble spread_by_a_millimetre() {
  Ensemble ensemble;
  ensemble.starts = 41;
  ensemble.linked_m = 2 * mm;
  ensemble.branches.emplace_back();
  for (int i = 0; i < 9; ++i) ensemble.marks.push_back({i / 3, i % 3});
  for (int k = 0; k < 41; ++k) {
    Member member;
    member.start = k;
    member.marks = flat_marks((k - 20) * mm);
    ensemble.members.push_back(member);
    ensemble.branches.front().push_back(k);
  }
  return ensemble;
}

TEST(Band, HoldsNineteenOfTwentyMembers) {
  const std::vector<BandMark> band = band_of(spread_by_a_millimetre(), {});
  ASSERT_EQ(band.size(), 9U);
  for (const BandMark& one : band) {
    EXPECT_NEAR(one.mean_in_world.z(), 0, 1e-12);
    EXPECT_NEAR(one.low_in_world.z() / mm, -19, 1e-9);
    EXPECT_NEAR(one.high_in_world.z() / mm, 19, 1e-9);
    EXPECT_NEAR(one.radius95_m / mm, 19, 1e-9);  // sorted 0, 1, 1, 2, 2 .. 20, 20: position 38
  }
}

TEST(Band, FewMembersHaveNone) {
  Ensemble few = spread_by_a_millimetre();
  for (std::size_t k = kLeastMembers - 1; k < few.members.size(); ++k)
    few.members[k].ending = "it does not come to rest";
  EXPECT_TRUE(band_of(few, {}).empty());
}

/// Nine marks measured at the given height.
EnsembleCase measured_at(double z_m) {
  auto drape = std::make_shared<DrapeCase>();
  Sheet& sheet = drape->local.measured.emplace();
  for (int i = 0; i < 9; ++i) {
    SheetMark mark{};
    mark.mark = {i / 3, i % 3};
    mark.material_m = {0.1 * int{i / 3}, 0.1 * (i % 3)};
    mark.point_in_world = flat_marks(z_m).row(i);
    sheet.marks.push_back(mark);
  }
  EnsembleCase own;
  own.drape = drape;
  return own;
}

/// The ensemble with a second branch of one member, `above_m` above the centre of the first.
PlacedDrape placed(double z_m, std::optional<double> above_m) {
  Ensemble ensemble = spread_by_a_millimetre();
  for (Member& member : ensemble.members)
    member.from_measured_m = std::abs(z_m - member.marks(0, 2));
  std::vector<FinishedBranch> finished(1);
  finished[0].marks = flat_marks(0);
  finished[0].from_measured_m = std::abs(z_m);
  if (above_m) {
    finished.emplace_back().marks = flat_marks(*above_m);
    finished[1].from_measured_m = std::abs(z_m - *above_m);
    ensemble.branches.emplace_back();
  }
  const std::vector<BandMark> band = band_of(ensemble, {});
  return place_measured(ensemble, measured_at(z_m), finished, band);
}

TEST(Band, ADrapeIsOnTheBranchThatItWouldBeLinkedWith) {
  const PlacedDrape near = placed(1.5 * mm, 100 * mm);
  EXPECT_EQ(near.branch, 1);
  EXPECT_EQ(near.nearest, 1);
  EXPECT_EQ(near.marks, 9);
  EXPECT_NEAR(*near.distance_m / mm, 0.5, 1e-9);
  EXPECT_NEAR(*near.apart_m / mm, 100, 1e-9);
  EXPECT_EQ(near.inside_fraction, 1);
  const PlacedDrape far = placed(25 * mm, 100 * mm);
  EXPECT_EQ(far.branch, std::nullopt);
  EXPECT_EQ(far.nearest, 1);
  EXPECT_NEAR(*far.reach_m / mm, 2, 1e-9);
  EXPECT_EQ(far.inside_fraction, 0);
  EXPECT_EQ(placed(99 * mm, 100 * mm).branch, 2);
}

/// Branches closer to each other than the linking distance of their members cannot be told apart.
TEST(Band, NothingIsSaidWhereBranchesAreNoFartherApart) {
  for (const PlacedDrape& one : {placed(0, 1.5 * mm), placed(0, std::nullopt)}) {
    EXPECT_EQ(one.nearest, 1);
    EXPECT_EQ(one.branch, std::nullopt);
    EXPECT_EQ(one.reach_m, std::nullopt);
  }
  EXPECT_EQ(place_measured({}, measured_at(0), {}, {}).nearest, std::nullopt);
}

constexpr double kLength_m = 0.4, kWidth_m = 0.02, kDensity = 0.15, kGravity = 9.80665;
constexpr double kStretch_n_per_m = 50;
constexpr double kHeld = 0.9;    // relative to the limit, before the strip is pushed
constexpr double kSlack = 0.05;  // relative to the limit

/// A strip on a table, pinned at one end, on a negligible print.
DrapeCase strip_on_table(double friction) {
  Print print;
  print.rows = print.cols = 2;
  print.pitch_m = kWidth_m;
  print.patch_m = {kLength_m, kWidth_m};
  print.margin_m.setZero();
  Scene scene;
  scene.file = "strip.toml";
  scene.friction = friction;
  scene.start = {StartMode::flat, 0, Vector3d(0, 0, 1 * mm), 0};
  StartReport ignored;
  const FlatPose flat = flat_start(scene, std::nullopt, 0, ignored);
  for (const double v : {0.0, 0.5 * kWidth_m, kWidth_m}) {
    Vector3d place = flat.point_in_world({0, v}, print.patch_m);
    place.z() = 0;
    scene.pins.push_back({{}, place, Vector2d(0, v)});
  }
  ClothLaws laws;
  laws.density_kg_per_m2 = kDensity;
  for (int k = 0; k < 2; ++k) {
    laws.tensile[k].slope = kStretch_n_per_m;
    laws.bending[k].slope = 1e-5;
  }
  laws.shear.slope = 20;
  return drape_case(scene, print, std::nullopt, laws);
}

/// Pushed by p towards its held end a strip slides where friction has to bear T' + p, and stays
/// there with T' = limit - p. Lifted by p it slides where its weight times 1 - p can bear less than
/// T'. In the other directions nothing exceeds the limit, and it returns. If the gradient of
/// tension falls by dT', the end of the strip moves by dT' L^2 / 2 K.
TEST(FrictionBand, OfAStripOnATableIsThatOfCoulombsLaw) {
  for (const double friction : {0.1, 0.2, 0.4}) {
    const DrapeCase drape = strip_on_table(friction);
    DrapeOptions options;
    options.spacing_m = options.coarsest_m = 10 * mm;
    DrapeLevel level(drape, options, options.spacing_m);
    const Vector3d held = *drape.local.scene.pins[1].point_in_world;
    StartReport ignored;
    const FlatPose flat = flat_start(drape.local.scene, std::nullopt, 0, ignored);
    const Vector3d along = (flat.point_in_world({1, 0}, drape.print.patch_m) -
                            flat.point_in_world({0, 0}, drape.print.patch_m));
    std::vector<Vector3d> places;
    for (const Vector2d& point : level.cloth().mesh().points_m) {
      places.push_back(flat.point_in_world(point, drape.print.patch_m));
      places.back().z() = held.z() - 2e-6;
    }
    ClothMoment rest = level.start_at(level.cloth().mesh().points_m, places);
    const RestReport laid = level.rest(rest);
    ASSERT_TRUE(laid.at_rest) << laid.why;
    // Stretched so far that friction has to bear kHeld of its limit everywhere.
    const RestReport drawn = push(level, rest, (1 + kHeld) * friction * along);
    ASSERT_TRUE(drawn.at_rest) << drawn.why;
    const auto tip_m = [&](const ClothMoment& moment) {
      return (Vector3d(level.places(moment, {{kLength_m, kWidth_m / 2}}).row(0)) - held).dot(along);
    };
    const double per_limit_m =
        kDensity * kGravity * kLength_m * kLength_m / (2 * kStretch_n_per_m) * friction;
    EXPECT_NEAR(tip_m(rest) - kLength_m, kHeld * per_limit_m, kSlack * per_limit_m) << friction;
    const auto moved_m = [&](const Vector3d& per_weight) {
      ClothMoment moment = rest;
      const RestReport end = push(level, moment, 0.5 * friction * per_weight);
      EXPECT_TRUE(end.at_rest) << end.why;
      return tip_m(moment) - tip_m(rest);
    };
    const double inward_m = (kHeld + 0.5 - 1) * per_limit_m;
    const double lifted_m = std::max(kHeld - (1 - 0.5 * friction), 0.0) * per_limit_m;
    EXPECT_NEAR(-moved_m(-along), inward_m, kSlack * per_limit_m) << friction;
    EXPECT_NEAR(moved_m(along), 0, 0.02 * per_limit_m) << friction;
    EXPECT_NEAR(-moved_m(Vector3d::UnitZ()), lifted_m, kSlack * per_limit_m) << friction;
    EXPECT_NEAR(moved_m(-Vector3d::UnitZ()), 0, 0.02 * per_limit_m) << friction;
  }
}

void expect_holds_rest(const std::vector<MarkInterval>& marks) {
  for (const MarkInterval& mark : marks) {
    EXPECT_TRUE((mark.low_in_world.array() <= mark.rest_in_world.array()).all());
    EXPECT_TRUE((mark.high_in_world.array() >= mark.rest_in_world.array()).all());
  }
}

TEST(FrictionBand, HoldsTheRestAndIsTheSameOnTwoThreads) {
  const EnsembleCase own = test::coarse_case(test::on_round_box());
  EnsembleOptions how{.starts = 1};
  const Ensemble ensemble = find_branches(own, how);
  ASSERT_TRUE(ensemble.members.front().rests()) << ensemble.members.front().ending;
  BranchList list;
  list.friction_band = bands_of_own(ensemble, own, own.fitted, how).friction;
  ASSERT_TRUE(list.friction_band);
  EXPECT_FALSE(bands_of_own(ensemble, own, own.fitted, how).memory);
  ASSERT_EQ(list.friction_band->pushes.size(), 6U);
  EXPECT_GE(list.friction_band->counted(), 3);
  EXPECT_EQ(list.friction_band->marks.size(), ensemble.marks.size());
  expect_holds_rest(list.friction_band->marks);
  const LocalScene& local = own.drape->local;
  EXPECT_LT((list.friction_band->marks[0].rest_in_world -
             local.to_world(ensemble.members.front().marks.row(0).transpose()))
                .norm(),
            1e-12);
  how.threads = 2;
  BranchList again;
  again.friction_band = bands_of_own(ensemble, own, own.fitted, how).friction;
  EXPECT_EQ(text_of(again), text_of(list));
}

TEST(FrictionBand, WithoutFrictionThereIsNoPush) {
  Scene scene = test::on_round_box();
  scene.friction = 0;
  const EnsembleCase own = test::coarse_case(scene);
  const Ensemble ensemble = find_branches(own, {.starts = 1});
  ASSERT_TRUE(ensemble.members.front().rests()) << ensemble.members.front().ending;
  const OwnBands bands = bands_of_own(ensemble, own, own.fitted, {});
  ASSERT_TRUE(bands.friction);
  EXPECT_TRUE(bands.friction->pushes.empty());
}

/// The tip of a heavy cantilever after pushes, compared with the boundary-value problem with the
/// same law and the same loads.
TEST(MemoryBand, OfACantileverIsThatOfTheLawsBoundaryValueProblem) {
  constexpr double kStrip_m = 0.08;
  Print print;
  print.rows = print.cols = 2;
  print.pitch_m = kWidth_m;
  print.patch_m = {kStrip_m, kWidth_m};
  print.margin_m.setZero();
  Scene scene;
  scene.file = "strip.toml";
  scene.table_z_m = -1;
  scene.start = {StartMode::flat, 0, Vector3d(0, 0, 0), 0};
  StartReport ignored;
  const FlatPose flat = flat_start(scene, std::nullopt, 0, ignored);
  const Vector3d from = flat.point_in_world({0, 0}, print.patch_m);
  scene.clamps.push_back({{0, 0},
                          {0, kWidth_m},
                          from,
                          flat.point_in_world({0, kWidth_m}, print.patch_m),
                          (flat.point_in_world({kStrip_m, 0}, print.patch_m) - from).normalized()});
  const DrapeCase drape =
      drape_case(scene, print, std::nullopt, test::cotton(kStrip_m, test::kFrictionMoment));
  DrapeOptions options;
  options.spacing_m = options.coarsest_m = 2.5 * mm;
  DrapeLevel level(drape, options, options.spacing_m);
  ClothMoment rest = level.start();
  const RestReport report = level.rest(rest);
  ASSERT_TRUE(report.at_rest) << report.why;
  const auto sag_m = [&](const ClothMoment& moment) {
    return -level.places(moment, {{kStrip_m, kWidth_m / 2}})(0, 2);
  };
  const auto exact_m = [&](const std::vector<double>& loads) {
    test::HeavyStrip exact(kStrip_m, test::kFrictionMoment);
    for (const double load : loads) exact.load(load * test::kDensity * kGravity);
    return -exact.z;
  };
  const double fresh_m = exact_m({1});
  EXPECT_GT(exact_m({1, 1.5, 1}), 1.02 * fresh_m);
  EXPECT_NEAR(sag_m(rest), fresh_m, 0.01 * fresh_m);
  for (const double up : {-0.5, 0.5}) {
    ClothMoment moment = rest;
    const RestReport end = push(level, moment, {0, 0, up});
    ASSERT_TRUE(end.at_rest) << end.why;
    const double exact = exact_m({1, 1 - up, 1});
    EXPECT_NEAR(sag_m(moment), exact, 0.01 * exact) << up;
  }
}

TEST(MemoryBand, HoldsTheRestOfADrapeWithAHistory) {
  Scene scene = test::on_round_box();
  scene.start.history = {"draped 1 times"};
  const EnsembleCase own = test::coarse_case(scene, true);
  const Ensemble ensemble = find_branches(own, {.starts = 1});
  ASSERT_TRUE(ensemble.members.front().rests()) << ensemble.members.front().ending;
  const OwnBands bands = bands_of_own(ensemble, own, fit_laws(own.fabric, 1), {});
  ASSERT_TRUE(bands.memory);
  const MemoryBand& band = *bands.memory;
  ASSERT_EQ(band.ends.size(), 5U) << "elastic, pressed, lifted, once more, without history";
  EXPECT_TRUE(band.ends[0].ending == "at rest" || band.ends[0].ending == "on another branch")
      << "the checker takes the laws without friction: " << band.ends[0].ending;
  expect_holds_rest(band.marks);
  double widest_m = 0;
  for (const MarkInterval& mark : band.marks)
    widest_m = std::max(widest_m, (mark.high_in_world - mark.low_in_world).maxCoeff());
  EXPECT_GT(widest_m, 0.1 * mm);
  ASSERT_TRUE(band.place_of_rest);
  EXPECT_GE(*band.place_of_rest, 0);
  EXPECT_LE(*band.place_of_rest, 1);
}

double mean_mm(const Eigen::MatrixX3d& moves_m) {
  return moves_m.rowwise().norm().mean() / mm;
}

/// Errors of what is stated: a body that is larger stands where it stood, gravity turns by the
/// level, a flat start is laid elsewhere; everything that is stated has an uncertainty.
TEST(StatedErrors, AreThoseOfTheScene) {
  const Scene scene = test::on_round_box();
  const auto& box = std::get<Box>(scene.obstacles.front());
  const ValueErrors errors{{"object_1_x_mm", 2.0},     {"object_1_size_mm", 1.0},
                           {"object_1_turn_deg", 3.0}, {"friction", 0.1},
                           {"level_x_deg", 0.5},       {"start_y_mm", -3.0},
                           {"start_yaw_deg", 2.0}};
  const Scene other = drape::erring(scene, errors);
  const auto& moved_box = std::get<Box>(other.obstacles.front());
  EXPECT_LT((moved_box.size_m - box.size_m - Vector3d::Constant(1 * mm)).norm(), 1e-12);
  EXPECT_LT((moved_box.world_from_box.translation_m - box.world_from_box.translation_m -
             Vector3d(2, 0, 0.5) * mm)
                .norm(),
            1e-12);
  EXPECT_NEAR((moved_box.world_from_box.rotation * box.world_from_box.rotation.transpose() -
               Eigen::AngleAxisd(3 * units::deg, Vector3d::UnitZ()).toRotationMatrix())
                  .norm(),
              0, 1e-12)
      << "turned about the vertical";
  EXPECT_NEAR(other.friction, scene.friction + 0.1, 1e-12);
  EXPECT_NEAR(
      std::acos(other.gravity_m_per_s2.normalized().dot(scene.gravity_m_per_s2.normalized())) /
          units::deg,
      0.5, 1e-6);
  EXPECT_NEAR(other.gravity_m_per_s2.x(), 0, 1e-12) << "turned about x";
  EXPECT_NEAR((*other.start.centre_in_world - *scene.start.centre_in_world).y() / mm, -3, 1e-9);
  EXPECT_NEAR((other.start.yaw_rad - scene.start.yaw_rad) / units::deg, 2, 1e-9);
  const ValueErrors all =
      uncertainties_of(scene, read_fabric(scene.fabric_file), read_print(scene.print_file));
  for (const auto& [name, error] : errors)
    EXPECT_EQ(error_of(all, name) > 0, name != "friction") << name;
}

/// Contact points of coarse meshes lie far apart beside an edge of 2 to 30 mm radius: the checker
/// measures what of the object is between them.
TEST(Branches, CoarseClothOverAnyEdgeIsAccepted) {
  for (const double radius_m : {2.1 * mm, 8 * mm}) {
    Scene scene = test::lying("C");
    std::get<Box>(scene.obstacles.front()).edge_radius_m = radius_m;
    const EnsembleCase own = test::coarse_case(scene);
    const Drape drape = drape_cloth(*own.drape, own.options.drape);
    EXPECT_EQ(own.ending_of(*drape.level, drape.rest, drape.levels.back().rest), "at rest")
        << radius_m / mm;
  }
}

/// Cloth that friction holds where it fell goes another way than its rest would be drawn.
TEST(BeyondFirstOrder, IsTheSameOnTwoThreadsAndNotNothingWhereFrictionHolds) {
  const EnsembleCase own = test::coarse_case(test::on_round_box());
  EnsembleOptions how{.starts = 1};
  how.same_m = 10 * mm;
  const Ensemble ensemble = find_branches(own, how);
  const auto one = beyond_first_order(ensemble, own, std::nullopt, how);
  ASSERT_TRUE(one);
  int counted = 0;
  for (const ErringRest& rest : one->rests) {
    if (!rest.moves_m) continue;
    ++counted;
    EXPECT_GT(mean_mm(one_a_row(*rest.moves_m) - one_a_row(*rest.first_order_m)), 0.01);
  }
  EXPECT_GE(counted, 4);
  how.threads = 2;
  const auto two = beyond_first_order(ensemble, own, std::nullopt, how);
  BranchList first, second;
  first.beyond_first_order = one;
  second.beyond_first_order = two;
  EXPECT_EQ(text_of(first), text_of(second));
}

TEST(Branches, AreRankedAtRestAndTheSameOnTwoThreads) {
  const EnsembleCase own = test::coarse_case(test::lying("A"));
  EnsembleOptions how{.starts = 6};
  const Ensemble one = find_branches(own, how);
  const BranchList list = list_of(one, own);
  EXPECT_TRUE(one.round);
  EXPECT_EQ(one.starts, 6);
  ASSERT_FALSE(list.branches.empty());
  std::size_t starts = list.not_at_rest.size() + list.refused.size();
  for (std::size_t k = 0; k < list.branches.size(); ++k) {
    starts += list.branches[k].starts.size();
    EXPECT_LE(list.branches[k].residual, own.options.drape.descent.residual);
    if (k > 0) {
      EXPECT_GE(list.branches[k].energy_j, list.branches[k - 1].energy_j);
    }
    for (std::size_t j = 0; j < k; ++j)
      EXPECT_GE(mean_distance_m(one.members[one.branches[k].front()].marks,
                                one.members[one.branches[j].front()].marks, true),
                how.same_m);
  }
  EXPECT_EQ(starts, 6U);
  EXPECT_EQ(static_cast<int>(one.marks.size()), own.drape->print.rows * own.drape->print.cols);
  how.threads = 2;
  EXPECT_EQ(text_of(list_of(find_branches(own, how), own)), text_of(list));
}

/// The search ends after 8, 16, 24 or 32 starts, if the last eight gave no new branch.
TEST(Branches, AreSoughtWhileNewOnesCome) {
  const EnsembleCase own = test::coarse_case(test::on_round_box());
  const Ensemble found = find_branches(own, {});
  ASSERT_FALSE(found.branches.empty());
  EXPECT_EQ(found.starts % 8, 0);
  const auto is_new = [&](const std::vector<int>& branch) {
    return std::all_of(branch.begin(), branch.end(),
                       [&](int member) { return member >= found.starts - 8; });
  };
  const auto fresh = std::count_if(found.branches.begin(), found.branches.end(), is_new);
  if (found.starts < 32) {
    EXPECT_EQ(fresh, found.starts == 8 ? 1 : 0);
  }
  const BranchList list = list_of(found, own);
  EXPECT_EQ(list.unseen->rests, *list.members_at_rest);
  EXPECT_GE(list.unseen->upper95, 1 - std::pow(0.05, 1.0 / found.starts) - 1e-12);
}

/// A branch is written on the next finer mesh, near its lowest member.
TEST(Branches, ThatCouldBeRealArePolished) {
  const EnsembleCase own = test::coarse_case(test::on_round_box());
  const Ensemble found = find_branches(own, {.starts = 2});
  ASSERT_FALSE(found.branches.empty());
  EXPECT_EQ(could_be_real(found).size(), found.branches.size()) << "no measured sheet";
  BranchList list = list_of(found, own);
  EXPECT_NEAR(*list.branches[0].spacing_m / mm, 20, 1e-9);
  const FinishedBranch fine = finish_branch(found, 0, own, true, list.branches[0]);
  EXPECT_TRUE(fine.result.at_rest()) << fine.result.certificate.status;
  EXPECT_EQ(list.branches[0].not_polished, "");
  EXPECT_NEAR(*list.branches[0].spacing_m / mm, 10, 1e-9);
  ASSERT_TRUE(list.branches[0].polish_m);
  EXPECT_GT(*list.branches[0].polish_m, 0);
  EXPECT_LT(*list.branches[0].polish_m, 20 * mm) << "a spacing of the coarse mesh";
  const FinishedBranch coarse = finish_branch(found, 0, own, false, list.branches[0]);
  EXPECT_TRUE(coarse.result.at_rest()) << coarse.result.certificate.status;
  EXPECT_EQ(coarse.marks, found.members[found.branches[0].front()].marks);
}

/// Good's estimate, and the bound of Clopper and Pearson: 1 - 0.05^(1/n) if none is seen once.
TEST(Branches, UnseenOnesAreBounded) {
  const UnseenBranches none = unseen_of({8});
  EXPECT_EQ(none.fraction, 0);
  EXPECT_NEAR(none.upper95, 1 - std::pow(0.05, 1.0 / 8), 1e-12);
  const UnseenBranches three = unseen_of({5, 1, 1, 1});
  EXPECT_EQ(three.seen_once, 3);
  EXPECT_EQ(three.fraction, 3.0 / 8);
  EXPECT_NEAR(three.upper95, 0.7107591834981906, 1e-9);
  EXPECT_EQ(unseen_of({1}).upper95, 1);
  EXPECT_EQ(unseen_of({}).fraction, 1);
}

TEST(Branches, ASheetTurnedAboutARoundObjectIsTheSame) {
  MatrixX3d a(49, 3), b(49, 3);
  const Eigen::AngleAxisd turn(1.1, Vector3d::UnitZ());
  for (int i = 0; i < 49; ++i) {
    const double x = 0.03 * int{i / 7} - 0.07, y = 0.02 * (i % 7);
    a.row(i) << x, y, x * y + 3 * x * x;
    b.row(i) = turn * Vector3d(a.row(i)) + Vector3d(0.01, 0.02, 0);
  }
  EXPECT_LT(mean_distance_m(a, b, true), 1e-12);
  EXPECT_LT(mean_distance_m(a, b.colwise().reverse(), true), 1e-12);
  EXPECT_GT(mean_distance_m(a, b, false), 0.01);
  b.col(2).array() += 1e-3;
  EXPECT_NEAR(mean_distance_m(a, b, true), 1e-3, 1e-12) << "height is no symmetry";
}

TEST(Branches, AreWhatGapsSeparate) {
  const auto on_a_line = [](const std::vector<double>& x) {
    return link(
        static_cast<int>(x.size()), [x](int a, int b) { return std::abs(x[a] - x[b]); }, 0.5);
  };
  const Linkage two = on_a_line({0, 10, 1.1, 2, 11, 3.2, 12.1});
  EXPECT_EQ(two.group, (std::vector<int>{0, 1, 0, 0, 1, 0, 1}));
  EXPECT_LT(two.limit, 6.8);
  const Linkage dense = on_a_line({0, 3, 1, 2, 4, 5});
  EXPECT_EQ(dense.group, std::vector<int>(6, 0));
  EXPECT_EQ(on_a_line({0, 0.4}).group, (std::vector<int>{0, 0}));
  EXPECT_EQ(link(0, {}, 0.5).group, std::vector<int>());
}

/// A cloth whose border has a radius with five waves along its length.
TEST(Branches, TheHemsFoldsAreCounted) {
  EnsembleCase own = test::coarse_case(test::lying("A"));
  const DrapeLevel level(*own.drape, own.options.drape, 10 * mm);
  const Vector2d patch_m = own.drape->print.patch_m;
  std::vector<Vector2d> material_m;
  std::vector<Vector3d> places;
  for (int i = 0; i <= 40; ++i)
    for (int j = 0; j <= 40; ++j) {
      const double u = i / 20.0 - 1, v = j / 20.0 - 1;
      const double out = std::max(std::abs(u), std::abs(v));
      double fraction = 0;
      if (u == -out) fraction = (v / out + 1) / 8;
      if (v == out) fraction = (u / out + 1) / 8 + 0.25;
      if (u == out) fraction = (1 - v / out) / 8 + 0.5;
      if (v == -out && u != -out) fraction = (1 - u / out) / 8 + 0.75;
      if (out == 0) fraction = 0;
      const double angle = 2 * std::numbers::pi * fraction;
      const double radius = out * (0.08 + 0.01 * std::cos(5 * angle));
      material_m.push_back(0.5 * Vector2d(1 + u, 1 + v).cwiseProduct(patch_m));
      places.push_back({radius * std::cos(angle), radius * std::sin(angle), 0.3});
    }
  const HemLabel label = label_hem(level, level.start_at(material_m, places));
  EXPECT_EQ(label.nodes, 5);
  EXPECT_NEAR(label.amplitude_m[5] / mm, 10, 1);
  EXPECT_NEAR(label.amplitude_m[0] / mm, 80, 1);
}

/// The paper's D, pinned instead at these fractions of the sheet's sides, 10 % closer than flat.
Scene pinned(const std::vector<Vector2d>& places) {
  Scene scene = read_scene(drape::test::source_root() / "rigs/paper/scenes/D.toml");
  if (places.empty()) return scene;
  const Vector2d patch_m = read_print(scene.print_file).patch_m;
  scene.pins.clear();
  for (const Vector2d& place : places) {
    const Vector2d there = place.cwiseProduct(patch_m);
    scene.pins.push_back({{}, Vector3d(0.9 * there.y(), -0.9 * there.x(), 200 * mm), there});
  }
  return scene;
}

std::size_t starts_of(const Scene& scene) {
  return folded_starts(*test::coarse_case(scene).drape).size();
}

TEST(FoldedStarts, AskForTwoPinsWithSheetOnEitherSide) {
  EXPECT_EQ(starts_of(pinned({})), 0U);  // at two corners
  EXPECT_EQ(starts_of(pinned({{0.2, 0.2}, {0.8, 0.2}, {0.5, 0.8}})), 0U);
  Scene two = pinned({{0.3, 0.2}, {0.4, 0.8}});
  EXPECT_EQ(starts_of(two), 8U);
  two.pins[1].point_in_world = *two.pins[0].point_in_world + Vector3d(0, 0, 0.1);
  EXPECT_EQ(starts_of(two), 0U);  // no horizontal line between pins
}

/// Longer than the cloth only by its waves, without self-contact, and below its pins.
TEST(FoldedStarts, HangDownUnstretchedAndApart) {
  const EnsembleCase own = test::coarse_case(pinned({{0.3, 0.2}, {0.4, 0.8}}));
  const DrapeLevel level(*own.drape, own.options.drape, 5 * mm);
  const MaterialMesh& mesh = level.cloth().mesh();
  const double pins_z_m = own.drape->local.scene.pins[0].point_in_world->z();
  MeshCloth::State before;
  for (const DrapeStart& start : folded_starts(*own.drape)) {
    const ClothMoment moment = start(level);
    EXPECT_NE(moment.state, before);
    before = moment.state;
    EXPECT_FALSE(level.meets_itself(moment));
    double lowest_m = 0, longest = 0, shortest = 2;
    for (int i = 0; i < level.cloth().points(); ++i)
      lowest_m = std::min(lowest_m, moment.state[i].z() - pins_z_m);
    for (const MaterialMesh::Edge& edge : mesh.edges) {
      const double stretch = (moment.state[edge.to] - moment.state[edge.from]).norm() /
                             (mesh.points_m[edge.to] - mesh.points_m[edge.from]).norm();
      longest = std::max(longest, stretch);
      shortest = std::min(shortest, stretch);
    }
    // Half a wave with a height of a tenth of its length rises with a slope of a tenth of pi.
    EXPECT_LT(longest, 1 + 0.1 * std::numbers::pi);
    EXPECT_GT(shortest, 0.7) << "a chord of the fold, sheared by the wave";
    // The narrower side is at least a fifth of the sheet.
    EXPECT_LT(lowest_m, -0.15 * own.drape->print.patch_m.x());
  }
}

}  // namespace
}  // namespace drape::simulate
