// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/branches.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulate/ensemble/test_ensemble.hpp"

namespace drape::simulate {
namespace {

using Eigen::MatrixX3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

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

}  // namespace
}  // namespace drape::simulate
