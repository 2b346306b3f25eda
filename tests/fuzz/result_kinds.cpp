// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "compare/hems/hem_files.hpp"
#include "compare/hems/silhouette.hpp"
#include "compare/history/results.hpp"
#include "compare/history/verify.hpp"
#include "compare/store/inputs.hpp"
#include "compare/store/store.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/rig.hpp"
#include "detect/prints/layout.hpp"
#include "simulate/objects/cloth_files.hpp"
#include "simulate/study/study.hpp"
#include "tests/fuzz/kinds.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

/// Writes a row of radii in mm every 10 degrees.
fs::path make_radii(const fs::path& folder) {
  std::string names = "fabric,sample,face,repeat,disc_mm", values = "wool,a,front,b,180";
  for (int degrees = 0; degrees < 360; degrees += 10) {
    names += fmt::format(",r{:03}", degrees);
    values += fmt::format(",{}", 100 + degrees % 40);
  }
  write_durable(folder / "hems.csv", names + "\n" + values + "\n");
  return folder / "hems.csv";
}

/// This reader lists refusals instead of throwing.
void read_radii(const fs::path& file) {
  const compare::HemSet set = compare::read_hems({file}, {});
  if (!set.refused.empty()) throw bad_input(set.refused.front(), {.file = file.string()}, "");
}

/// Draws a dark disc of 16 px.
fs::path make_silhouette(const fs::path& folder) {
  cv::Mat picture(32, 32, CV_8U, cv::Scalar(230));
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x)
      if ((x - 16) * (x - 16) + (y - 16) * (y - 16) < 64) picture.at<unsigned char>(y, x) = 20;
  std::vector<unsigned char> bytes;
  cv::imencode(".png", picture, bytes);
  write_durable(folder / "hem.png", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return folder / "hem.png";
}

fs::path make_plan(const fs::path& folder) {
  for (const char* name : {"scenes", "fabrics"})
    fs::copy(source_root() / "rigs/bench1" / name, folder / name, fs::copy_options::recursive);
  fs::copy(source_root() / "rigs/bench1/print.toml", folder);
  write_durable(folder / "program", "x");
  write_durable(folder / "plan.toml",
                "schema = \"drapebench/plan/1\"\nscenes = [\"scenes/A.toml\"]\nfabrics = "
                "[\"fabrics/A.toml\"]\nmodel = \"paper\"\ngrids = [5, 7]\nspacings_mm = [5]\n"
                "segments = [1]\nseeds = [0, 1]\nmax_steps = 50\nthickness_mm = 0.5\n");
  return folder / "plan.toml";
}

simulate::ClothShape small_shape() {
  return {.material_m = {{0, 0}, {0.01, 0}, {0, 0.01}},
          .triangles = {{0, 1, 2}},
          .sides = {{0, 1}, {0, 2}, {1, 2}},
          .points_m = {{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}},
          .of_sides = {{0, 1, 0}, {-1, 0, 0}, {-0.7, -0.7, 0}}};
}

/// Writes a store without comparisons; its rows are metrics.
fs::path make_store(const fs::path& folder) {
  fs::path store = folder / "results.sqlite";
  compare::Store(store).close();
  return store;
}

void read_store(const fs::path& file) {
  for (const char* more : {"-wal", "-shm"}) fs::remove(file.string() + more);
  const compare::StoreReader reader(file);
  static_cast<void>(compare::list_results(reader, {}));
  static_cast<void>(compare::altered_rows(reader));
  static_cast<void>(compare::dump_sql(reader));
}

fs::path make_plate(const fs::path& folder) {
  write_durable(folder / "target.toml", detect::object_plate_toml(detect::object_plate(0.1, 0)));
  return folder / "target.toml";
}

}  // namespace

std::vector<Kind> result_kinds() {
  return {
      {"radii", make_radii, read_radii, true, "dropped"},  // the disc may be known otherwise
      {"silhouette", make_silhouette,
       [](const fs::path& f) { static_cast<void>(compare::read_silhouette(f)); }},
      {"plan", make_plan,
       [](const fs::path& f) {
         static_cast<void>(simulate::read_plan(f, {}, "out", f.parent_path() / "program"));
       }},
      {"cloth_ply",
       [](const fs::path& folder) {
         simulate::write_cloth_shape(folder / "cloth.ply", small_shape());
         return folder / "cloth.ply";
       },
       [](const fs::path& f) { static_cast<void>(simulate::read_cloth_shape(f)); }},
      {"plate", make_plate, [](const fs::path& f) { static_cast<void>(read_target(f)); }},
      // Pages hold unused bytes; `verify` names what was altered.
      {"store", make_store, read_store, true, "."},
  };
}

}  // namespace drape::test
