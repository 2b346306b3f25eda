// SPDX-License-Identifier: Apache-2.0
#include "core/program/words.hpp"

#include <algorithm>

namespace drape {
namespace {

std::size_t corrections(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> least(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        least[i][j] = i + j;
        continue;
      }
      least[i][j] = std::min({least[i - 1][j] + 1, least[i][j - 1] + 1,
                              least[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        least[i][j] = std::min(least[i][j], least[i - 2][j - 2] + 1);
    }
  }
  return least[a.size()][b.size()];
}

}  // namespace

std::string most_similar(const std::string& word, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t least = word.size() + 1;
  for (const std::string& candidate : candidates) {
    // The difference in length bounds the distance from below, so huge words are rejected cheaply.
    const std::size_t longer = std::max(candidate.size(), word.size());
    if (3 * (longer - std::min(candidate.size(), word.size())) >
        std::max<std::size_t>(candidate.size(), 3))
      continue;
    const std::size_t count = corrections(word, candidate);
    if (count >= least || 3 * count > std::max<std::size_t>(candidate.size(), 3)) continue;
    least = count;
    best = candidate;
  }
  return best;
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates) {
  const std::string best = most_similar(word, candidates);
  return best.empty() ? std::string() : ": did you mean `" + best + "`?";
}

}  // namespace drape
