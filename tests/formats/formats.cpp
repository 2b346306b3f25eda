// SPDX-License-Identifier: Apache-2.0
#include "tests/formats/formats.hpp"

#include "core/branch_list.hpp"
#include "core/files/files.hpp"
#include "core/recording.hpp"
#include "core/scene.hpp"
#include "synth/synth.hpp"
#include "tests/fuzz/kinds.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

BranchList small_branches() {
  BranchList list;
  list.branches.emplace_back();
  ListedBranch& branch = list.branches.back();
  branch.number = 1;
  branch.sheet = "branch-01/sheet.ply";
  branch.starts = {0, 1};
  branch.spacing_m = 5e-3;
  branch.polish_m = 1e-4;
  list.starts = 8;
  list.unseen = UnseenBranches{.rests = 8, .seen_once = 0, .fraction = 0, .upper95 = 0.31};
  list.members_at_rest = 8;
  return list;
}

/// Files edited by people and the recording's list from rigs/bench1, the others from small records.
std::vector<DescribedFormat> core_formats() {
  const auto bench = [](const char* name) {
    return read_text(source_root() / "rigs/bench1" / name);
  };
  return {described<Rig>(bench("rig.toml")),
          described<Target>(bench("target.toml")),
          described<Print>(bench("print.toml")),
          described<Scene>(bench("scenes/C.toml")),
          described<Recording>(bench("recording/recording.json")),
          described(small_branches()),
          described(small_sheet()),
          described(small_certificate()),
          described(small_levels()),
          described(small_sensitivity()),
          described(small_cusick()),
          described(small_detections()),
          described(small_calibration())};
}

}  // namespace

std::vector<DescribedFormat> all_formats() {
  std::vector<DescribedFormat> all;
  for (const auto& room : {core_formats(), stage_formats(), synth::synth_formats()})
    all.insert(all.end(), room.begin(), room.end());
  return all;
}

}  // namespace drape::test
