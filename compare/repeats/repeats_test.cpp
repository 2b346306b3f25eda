// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "compare/hems/test_published.hpp"
#include "compare/repeats/test_prior.hpp"

namespace drape::compare {
namespace {

TEST(Variance, ComponentsOfANestedTableEqualThoseByHand) {
  // One face, samples {1, 3} and {7, 9}: within 2 with 1 + 1 degrees, MS 2; between 36, MS 36.
  const std::vector<RepeatKey> keys = {{"a", "1"}, {"a", "1"}, {"b", "1"}, {"b", "1"}};
  const VarianceComponents found = variance_components(keys, {1, 3, 7, 9});
  EXPECT_NEAR(*found.repeat_sd, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(*found.sample_sd, std::sqrt((36 - 2) / 2.0), 1e-12);
  EXPECT_FALSE(variance_components({{"a", "1"}}, {5}).repeat_sd);
}

TEST(Judge, TestsAValueByTheTDistribution) {
  const std::vector<double> repeats = {48, 50, 52};  // sd 2
  const Judgement found = judge_value(repeats, 60, {}, 0.05);
  EXPECT_NEAR(found.t, 10 / (2 * std::sqrt(4.0 / 3)), 1e-12);
  EXPECT_NEAR(*found.p, 2 * student_cdf(-found.t, 2), 1e-15);
  // With a prior: s^2 = (6 * 1 + 2 * 4) / 8.
  EXPECT_NEAR(judge_value(repeats, 60, {6, 1}, 0.05).sd, std::sqrt(14.0 / 8), 1e-12);
  EXPECT_FALSE(judge_value({50}, 60, {}, 0.05).p) << "one drape alone says nothing of its repeats";
  EXPECT_TRUE(judge_value({50}, 60, {6, 1}, 0.05).p);
}

/// Hems of one fabric and face.
using Groups = std::map<std::pair<std::string, std::string>, std::vector<const HemRecord*>>;

Groups groups_of(const HemSet& set) {
  Groups groups;
  for (const HemRecord& hem : set.hems) groups[{hem.fabric, hem.face}].push_back(&hem);
  return groups;
}

using Table = std::vector<std::vector<double>>;

Table distances_of(const std::vector<const HemRecord*>& hems) {
  Table table(hems.size(), std::vector<double>(hems.size(), 0.0));
  for (std::size_t i = 0; i < hems.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      table[i][j] = table[j][i] = hem_distance_m(hems[i]->hem, hems[j]->hem);
  return table;
}

GroupVariance variance_of(const std::vector<double>& values) {
  double mean = 0, sum = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (const double v : values) sum += (v - mean) * (v - mean);
  const int dof = static_cast<int>(values.size()) - 1;
  return {sum / dof, dof};
}

std::vector<double> scores_of(const Table& distances) {
  std::vector<double> scores;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    double sum = 0;
    for (std::size_t j = 0; j < distances.size(); ++j)
      if (j != i) sum += std::log(distances[i][j]);
    scores.push_back(sum / static_cast<double>(distances.size() - 1));
  }
  return scores;
}

struct Library {
  HemSet set;
  Groups groups;
  std::map<std::pair<std::string, std::string>, Table> distances;

  Library() : set(published_hems()), groups(groups_of(set)) {
    for (const auto& [name, hems] : groups) distances[name] = distances_of(hems);
  }
  /// From all fabrics except one, so that no fabric judges itself.
  [[nodiscard]] RepeatPriors priors(const std::string& without) const {
    std::vector<GroupVariance> coefficients, scores, radii;
    for (const auto& [name, hems] : groups) {
      if (name.first == without) continue;
      std::vector<double> values, covered;
      for (const HemRecord* hem : hems) {
        values.push_back(hem->drape_coefficient());
        // The disc's radius is 0.6 of the specimen's.
        covered.push_back(std::sqrt(0.36 + 0.64 * 0.01 * values.back()));
      }
      coefficients.push_back(variance_of(values));
      radii.push_back(variance_of(covered));
      scores.push_back(variance_of(scores_of(distances.at(name))));
    }
    return {variance_prior(coefficients), variance_prior(scores), variance_prior(radii)};
  }
};

TEST(Repeats, ThePublishedPriorsAreThoseOfTheData) {
  const RepeatPriors found = Library().priors("");
  const RepeatPriors& kept = published_priors();
  EXPECT_NEAR(kept.drape_coefficient.dof / found.drape_coefficient.dof, 1, 0.02);
  EXPECT_NEAR(kept.drape_coefficient.variance / found.drape_coefficient.variance, 1, 0.02);
  EXPECT_NEAR(kept.hem_score.dof / found.hem_score.dof, 1, 0.02);
  EXPECT_NEAR(kept.hem_score.variance / found.hem_score.variance, 1, 0.02);
  EXPECT_NEAR(kept.covered_radius.dof / found.covered_radius.dof, 1, 0.1);
  EXPECT_NEAR(kept.covered_radius.variance / found.covered_radius.variance, 1, 0.02);
}

/// Judges each repeat by the others, with `shift` points added to its coefficient.
std::array<std::optional<double>, 3> left_out_p(const Library& library,
                                                const std::pair<std::string, std::string>& name,
                                                std::size_t out, const RepeatPriors& priors,
                                                double shift) {
  const auto& hems = library.groups.at(name);
  const Table& all = library.distances.at(name);
  std::vector<double> values;
  Distances distances;
  for (std::size_t i = 0; i < hems.size(); ++i) {
    if (i == out) continue;
    values.push_back(hems[i]->drape_coefficient());
    distances.virtual_to_real.push_back(all[out][i]);
    distances.real_to_real.emplace_back();
    for (std::size_t j = 0; j < hems.size(); ++j)
      if (j != out) distances.real_to_real.back().push_back(all[i][j]);
  }
  const Judgement value =
      judge_value(values, hems[out]->drape_coefficient() + shift, priors.drape_coefficient, 0.05);
  const Judgement hem = judge_distance(distances, priors.hem_score, 1e-6, 0.05);
  return {value.p, hem.p, joint_p({value, hem})};
}

TEST(Repeats, ALeftOutRepeatIsOutsideAsOftenAsTheSignificanceSays) {
  const Library library;
  std::array<int, 3> alarms{};
  int n = 0, found = 0;
  for (const auto& [name, hems] : library.groups) {
    const RepeatPriors priors = library.priors(name.first);
    for (std::size_t i = 0; i < hems.size(); ++i, ++n) {
      const auto p = left_out_p(library, name, i, priors, 0);
      for (int k = 0; k < 3; ++k) alarms[k] += *p[k] < 0.05;
      for (const double shift : {-10.0, 10.0})
        found += *left_out_p(library, name, i, priors, shift)[0] < 0.05;
    }
  }
  ASSERT_EQ(n, 304);
  const auto percent = [&](int count) { return 100.0 * count / n; };
  RecordProperty("coefficient_alarms_percent", std::to_string(percent(alarms[0])));
  RecordProperty("hem_alarms_percent", std::to_string(percent(alarms[1])));
  RecordProperty("joint_alarms_percent", std::to_string(percent(alarms[2])));
  RecordProperty("ten_points_found_percent", std::to_string(percent(found) / 2));
  EXPECT_NEAR(percent(alarms[0]), 5, 1.5);
  EXPECT_NEAR(percent(alarms[1]), 5, 1.5);
  EXPECT_NEAR(percent(alarms[2]), 5, 1.5);
  EXPECT_GE(percent(found) / 2, 90) << "ten points away, by the coefficient alone";
}

TEST(Repeats, AnotherFabricTenPointsAwayIsFound) {
  const Library library;
  int n = 0, near = 0, found = 0, near_found = 0;
  const auto mean = [](const std::vector<const HemRecord*>& hems) {
    double sum = 0;
    for (const HemRecord* hem : hems) sum += hem->drape_coefficient();
    return sum / static_cast<double>(hems.size());
  };
  for (const auto& [name, hems] : library.groups) {
    std::vector<HemRecord> real, others;
    std::vector<double> apart;
    for (const HemRecord* hem : hems) real.push_back(*hem);
    for (const auto& [other, candidates] : library.groups) {
      const double difference = std::abs(mean(candidates) - mean(hems));
      if (other.first == name.first || difference < 10) continue;
      for (const HemRecord* hem : candidates) {
        others.push_back(*hem);
        apart.push_back(difference);
      }
    }
    MatchOptions options;
    options.priors = library.priors(name.first);
    const auto matches = match_hems(real, others, options);
    ASSERT_EQ(matches.size(), others.size());
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const bool outside = matches[i].verdict == Match::outside;
      ++n;
      found += outside;
      near += apart[i] < 15;
      near_found += outside && apart[i] < 15;
    }
  }
  RecordProperty("pairs", n);
  RecordProperty("found_percent", std::to_string(100.0 * found / n));
  RecordProperty("ten_to_fifteen_pairs", near);
  RecordProperty("ten_to_fifteen_found_percent", std::to_string(100.0 * near_found / near));
  ASSERT_GT(near, 100);
  EXPECT_GE(100.0 * near_found / near, 90);
}

/// The hem as a cloth of 19 x 19 marks whose outermost 72 are on it, the others on rays to its
/// centre, as input of `drape run` and `drape compare repeats`.
Sheet cloth_of(const Hem& hem) {
  constexpr int kSide = 19, kHalf = kSide / 2;
  Sheet sheet;
  sheet.rows = sheet.cols = kSide;
  sheet.patch_m = {0.3, 0.3};
  for (int row = 0; row < kSide; ++row) {
    for (int col = 0; col < kSide; ++col) {
      const int y = row - kHalf, x = col - kHalf, ring = std::max(std::abs(x), std::abs(y));
      // Along the square ring from the middle of its right side, 8 * ring steps per circuit.
      double along = 0;
      if (ring > 0) {
        if (x == ring && y > -ring)
          along = y;
        else if (y == ring)
          along = 2 * ring - x;
        else if (x == -ring)
          along = 4 * ring - y;
        else
          along = 6 * ring + x;
        along /= 8.0 * ring;
      }
      const auto rays = static_cast<double>(hem.radius_m.size());
      const auto ray = static_cast<std::size_t>(std::lround((along - std::floor(along)) * rays)) %
                       hem.radius_m.size();
      const double radius = hem.radius_m[ray] * ring / kHalf, angle = 2 * std::numbers::pi * along;
      sheet.marks.push_back({{row, col},
                             {0.016 * row, 0.016 * col},
                             {radius * std::cos(angle), radius * std::sin(angle), 0},
                             {},
                             {},
                             {}});
    }
  }
  return sheet;
}

// The same statistics by the path of `drape run`: sheets in, marks, hem and spectrum judged.
TEST(Repeats, OfSheetsAreOutsideAsOftenAsTheSignificanceSays) {
  const Library library;
  std::map<std::string, int> alarms;
  int n = 0;
  for (const auto& [name, hems] : library.groups) {
    std::vector<SheetFile> all;
    for (const HemRecord* hem : hems) all.push_back({hem->file, {}, {}, cloth_of(hem->hem)});
    for (std::size_t out = 0; out < all.size(); ++out, ++n) {
      std::vector<SheetFile> others = all;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(out));
      const MarkRepeats::SheetMatch match = mark_repeats(others, {all[out]}, 0.05).matches.at(0);
      alarms["joint"] += match.verdict == Match::outside;
      for (const RepeatBasis& basis : match.bases)
        alarms[basis.what] += basis.judgement.p && *basis.judgement.p < 0.05;
    }
  }
  ASSERT_EQ(n, 304);
  for (const auto& [what, count] : alarms)
    RecordProperty(what + "_alarms_percent", std::to_string(100.0 * count / n));
  EXPECT_NEAR(100.0 * alarms["joint"] / n, 5, 1.5);
}

TEST(Repeats, ASheetOfAnotherFabricTenPointsAwayIsFound) {
  const Library library;
  const auto mean = [](const std::vector<const HemRecord*>& hems) {
    double sum = 0;
    for (const HemRecord* hem : hems) sum += hem->drape_coefficient();
    return sum / static_cast<double>(hems.size());
  };
  const auto cloths_of = [](const std::vector<const HemRecord*>& hems) {
    std::vector<SheetFile> cloths;
    cloths.reserve(hems.size());
    for (const HemRecord* hem : hems) cloths.push_back({hem->file, {}, {}, cloth_of(hem->hem)});
    return cloths;
  };
  int n = 0, found = 0, near = 0, near_found = 0, three = 0, three_found = 0, own = 0,
      own_inside = 0;
  for (const auto& [name, hems] : library.groups) {
    const std::vector<SheetFile> repeats = cloths_of(hems);
    // Three layings, each time the next three of the fabric; its others are the true fabric.
    const auto three_from = [&](std::size_t first) {
      return std::vector<SheetFile>(repeats.begin() + static_cast<std::ptrdiff_t>(first),
                                    repeats.begin() + static_cast<std::ptrdiff_t>(first) + 3);
    };
    for (std::size_t first = 0; first + 6 <= repeats.size(); first += 3)
      for (const MarkRepeats::SheetMatch& match :
           mark_repeats(three_from(first), three_from(first + 3), 0.05).matches) {
        ++own;
        own_inside += match.verdict == Match::inside;
      }
    for (const auto& [other, candidates] : library.groups) {
      const double apart = std::abs(mean(candidates) - mean(hems));
      if (other.first == name.first || apart < 10) continue;
      for (const MarkRepeats::SheetMatch& match :
           mark_repeats(repeats, cloths_of(candidates), 0.05).matches) {
        const bool outside = match.verdict == Match::outside;
        ++n;
        found += outside;
        near += apart < 15;
        near_found += outside && apart < 15;
      }
      if (apart >= 15) continue;
      for (const MarkRepeats::SheetMatch& match :
           mark_repeats(three_from(0), cloths_of(candidates), 0.05).matches) {
        ++three;
        three_found += match.verdict == Match::outside;
      }
    }
  }
  std::printf(
      "10 to 15 points away: outside %d of %d beside all layings, %d of %d beside three; the "
      "true fabric inside %d of %d beside three\n",
      near_found, near, three_found, three, own_inside, own);
  ASSERT_GT(near, 100);
  ASSERT_GT(three, 100);
  EXPECT_GE(100.0 * near_found / near, 90);
  EXPECT_GE(100.0 * three_found / three, 90);
  EXPECT_GE(100.0 * own_inside / own, 80);
}

/// A sheet of 6 x 6 marks whose height is a sum of a few waves of random amplitudes, like one
/// branch of one cloth laid repeatedly, with noise of the marks.
Sheet laid_sheet(std::mt19937_64& lots, double shift_m) {
  std::normal_distribution<double> normal;
  const double a = 2e-3 * normal(lots), b = 1e-3 * normal(lots), c = 1e-3 * normal(lots);
  Sheet sheet;
  sheet.rows = sheet.cols = 6;
  sheet.patch_m = {0.1, 0.1};
  for (int row = 0; row < 6; ++row) {
    for (int col = 0; col < 6; ++col) {
      const double u = 0.02 * row, v = 0.02 * col;
      const double z = a * std::sin(40 * u) + b * std::cos(30 * v) + c * std::sin(50 * (u + v)) +
                       3e-5 * normal(lots) + shift_m;
      sheet.marks.push_back({{row, col}, {u, v}, {v, u, z}, {}, {}, {}});
    }
  }
  return sheet;
}

TEST(MarkRepeats, AFurtherRepeatIsOutsideAsOftenAsTheSignificanceSays) {
  std::mt19937_64 lots(26);
  constexpr int kTrials = 3000;
  for (const int repeats : {3, 8, 16}) {
    int alarms = 0, alarms_of_marks = 0, found = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      std::vector<SheetFile> real;
      real.reserve(repeats);
      for (int i = 0; i < repeats; ++i) real.push_back({"real", {}, {}, laid_sheet(lots, 0)});
      const auto result = mark_repeats(
          real, {{"virtual", {}, {}, laid_sheet(lots, 0)}, {"far", {}, {}, laid_sheet(lots, 0.02)}},
          0.05);
      alarms += result.matches[0].verdict == Match::outside;
      const std::optional<double> p = result.matches[0].bases.front().judgement.p;
      alarms_of_marks += p && *p < 0.05;
      found += result.matches[1].verdict == Match::outside;
    }
    RecordProperty("alarms_of_marks_percent_" + std::to_string(repeats),
                   std::to_string(100.0 * alarms_of_marks / kTrials));
    RecordProperty("alarms_percent_" + std::to_string(repeats),
                   std::to_string(100.0 * alarms / kTrials));
    RecordProperty("found_percent_" + std::to_string(repeats),
                   std::to_string(100.0 * found / kTrials));
    // Below six repeats the number of modes is taken as one: fewer alarms, never more. Marks, hem
    // and spectrum together give fewer than requested here (README, limits).
    EXPECT_LE(100.0 * alarms / kTrials, 6.5) << repeats;
    if (repeats >= 6) {
      EXPECT_NEAR(100.0 * alarms_of_marks / kTrials, 5, 1.5) << repeats;
    }
    EXPECT_GE(100.0 * found / kTrials, 90) << repeats;
  }
}

TEST(MarkRepeats, FewRepeatsAreUndecidedAndSayWhy) {
  std::mt19937_64 lots(1);
  const SheetFile real{"real", {}, {}, laid_sheet(lots, 0)};
  const auto result = mark_repeats({real}, {{"virtual", {}, {}, laid_sheet(lots, 0)}}, 0.05);
  EXPECT_EQ(result.matches.at(0).verdict, Match::undecided);
  EXPECT_FALSE(result.matches.at(0).reason.empty());
  EXPECT_EQ(result.marks, 36);
}

}  // namespace
}  // namespace drape::compare
