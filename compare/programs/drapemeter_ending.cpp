// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "compare/programs/drapemeter_options.hpp"

namespace drape::compare {
namespace {

std::string with_u(const HemNumber& number) {
  return number.u ? fmt::format("{:.2f}, U {:.2f} (k = 2)", number.value, *number.u)
                  : fmt::format("{:.2f}", number.value);
}

std::string text_of(const EnsembleBand& band) {
  std::string text = fmt::format("{:.1f} %, U {:.1f} (95 %)", band.mean, band.mean_u);
  if (band.samples > 1) text += fmt::format(" by the means of {} samples", band.samples);
  if (band.next)
    text += fmt::format("; 95 of 100 drapes lie from {:.1f} to {:.1f} %", band.next->first,
                        band.next->second);
  return text + fmt::format("; n {}", band.drapes);
}

void add_numbers(const std::vector<HemRecord>& hems, Ending& ending) {
  if (hems.size() == 1) {
    for (const HemNumber& number : hems.front().numbers)
      ending.numbers.emplace_back(number.name, with_u(number));
    return;
  }
  std::vector<std::string> fabrics;
  for (const HemRecord& hem : hems)
    if (std::find(fabrics.begin(), fabrics.end(), hem.fabric) == fabrics.end())
      fabrics.push_back(hem.fabric);
  for (const std::string& fabric : fabrics) {
    std::vector<RepeatKey> keys;
    std::vector<double> values;
    std::map<std::string, std::vector<const HemRecord*>> faces;
    for (const HemRecord& hem : hems) {
      if (hem.fabric != fabric) continue;
      faces[hem.face].push_back(&hem);
      keys.push_back(hem.key());
      values.push_back(hem.drape_coefficient());
    }
    const VarianceComponents found = variance_components(keys, values);
    std::string text = fmt::format("n {}", found.drapes);
    for (const auto& [face, mean] : found.face_means)
      text += fmt::format(", face {} {:.1f} %", face.empty() ? "-" : face, mean);
    if (found.repeat_sd) text += fmt::format(", repeat sd {:.2f}", *found.repeat_sd);
    if (found.sample_sd) text += fmt::format(", sample sd {:.2f}", *found.sample_sd);
    ending.numbers.emplace_back("drape coefficient " + fabric, text);
    for (const auto& [face, of_face] : faces)
      if (const auto band = band_of(of_face))
        ending.numbers.emplace_back(fmt::format("mean{} {}{}", band->next ? " and band" : "",
                                                fabric, face.empty() ? "" : " face " + face),
                                    text_of(*band));
  }
}

void add_matches(const std::vector<HemMatch>& matches, Ending& ending) {
  for (const HemMatch& match : matches) {
    std::string text = fmt::format("{}, p {}, {} repeats", name_of(match.verdict),
                                   match.p ? fmt::format("{:.3f}", *match.p) : "-", match.repeats);
    if (match.drape_coefficient.detectable)
      text += fmt::format("; {:.1f} points would be found", *match.drape_coefficient.detectable);
    if (!match.reason.empty()) text += "; " + match.reason;
    ending.numbers.emplace_back(
        fmt::format("{} against {} {}", match.virtual_file, match.fabric, match.face), text);
  }
}

}  // namespace

Ending ending_of(const HemSet& real, const HemSet& compared, const std::vector<HemMatch>& matches) {
  Ending ending;
  std::vector<std::string> causes;
  for (const HemSet* set : {&real, &compared}) {
    for (const std::string& reason : set->refused) ending.rejected.push_back(reason);
    causes.insert(causes.end(), set->refused.begin(), set->refused.end());
    for (const HemRecord& hem : set->hems) {
      for (const std::string& warning : hem.warnings)
        ending.rejected.push_back(hem.file + ": " + warning);
      if (!hem.go) causes.push_back(ending.rejected.back());
    }
  }
  ending.go = causes.empty();
  if (!ending.go) ending.verdict = causes.front() + "; ";
  ending.verdict += fmt::format("{} hems measured, {} files refused", real.hems.size(),
                                real.refused.size() + compared.refused.size());
  add_numbers(real.hems, ending);
  add_matches(matches, ending);
  return ending;
}

}  // namespace drape::compare
