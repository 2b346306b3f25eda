// SPDX-License-Identifier: Apache-2.0
#include "tests/formats/formats.hpp"

#include "synth/synth.hpp"

namespace drape::test {

std::vector<DescribedFormat> all_formats() {
  std::vector<DescribedFormat> all;
  for (const auto& room : {synth::synth_formats()}) all.insert(all.end(), room.begin(), room.end());
  return all;
}

}  // namespace drape::test
