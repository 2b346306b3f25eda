// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include "compare/history/verify.hpp"
#include "compare/store/outcome.hpp"
#include "tests/support/paths.hpp"

namespace drape::compare::test {

/// A shape over material coordinates (warp, weft), metres.
using Shape = std::function<Eigen::Vector3d(const Eigen::Vector2d&)>;

/// Flat in the plane z = 0: x along the weft, y against the warp, printed side up.
[[nodiscard]] Eigen::Vector3d flat(const Eigen::Vector2d& material_m);

/// The same, higher by `height_m`.
[[nodiscard]] Shape raised(double height_m);

/// 11x11 marks, pitch 20 mm, margin 10 mm, on a 220 mm patch; covariance (0.03 mm)^2 I.
[[nodiscard]] Sheet measured_sheet(const Shape& shape = flat);

/// n x n particles over the whole patch, at rest.
[[nodiscard]] Sheet simulated_sheet(int n, int segments, const Shape& shape = flat);

/// A cloth at rest on a mesh with that finest spacing, sampled every 10 mm.
[[nodiscard]] Sheet mesh_sheet(double spacing_m, int segments, const Shape& shape = flat);

/// levels.json of a mesh sheet with a mesh error of `left_m` at each mark of `measured`.
[[nodiscard]] LevelsFile levels_of(const Sheet& measured, double left_m);

/// Writes the sheet to folder/name and returns what read_session would, including hashes.
/// A stable branch with four folds that `starts` starts reach.
[[nodiscard]] Branch branch(const std::string& list_sha256, int number, int of, double energy_j,
                            int starts = 1, bool round = false);
[[nodiscard]] SheetFile file_of(const Sheet& sheet);
[[nodiscard]] DrapeInput drape_of(const Sheet& measured, const std::vector<Sheet>& simulated);

/// Adds what was compared in one transaction.
ImportCounts add(Store& store, const auto& what, const auto&... more) {
  ImportCounts counts;
  store.write([&](Writer& writer) { counts = compare::add(writer, what, more...); });
  return counts;
}

/// Compares a measured sheet with simulations and adds it to a store.
ImportCounts add_drape(const std::filesystem::path& store, const Sheet& measured,
                       const std::vector<Sheet>& simulated);

/// Compares what was read and adds it to a store as one run.
Outcome import_run(const std::filesystem::path& store, const Session& session,
                   const RunLabel& label = {});

/// First cell of the first row of a query.
[[nodiscard]] std::string one(const StoreReader& store, const std::string& sql);

/// A measured sheet at <folder>/sheet.ply with two gaps and simulations 11-1, 11-5, 21-1, 21-5 in
/// <folder>/simulations/, each with certificate.json and history.csv. Returns all sheet files.
[[nodiscard]] std::vector<std::filesystem::path> write_example(const std::filesystem::path& folder);

/// The same with everything behind it in a real run: photographs, recording.json, a scene, a fabric
/// with a curve, and run records of the steps that made detections and sheets.
[[nodiscard]] std::vector<std::filesystem::path> write_recorded_example(
    const std::filesystem::path& folder);

/// A folder with a store of a recorded example in it, imported as one run.
class StoredExample : public testing::Test {
 protected:
  StoredExample() { import(); }
  void import(const RunLabel& label = {}) {
    counts_ = *import_run(store(), read_session(sheets_, {}), label).stored;
  }
  [[nodiscard]] std::filesystem::path store() const { return folder_.path() / "results.sqlite"; }
  [[nodiscard]] std::vector<std::string> findings(bool recompute = false) const {
    return verify_store(store(), recompute).findings;
  }

  drape::test::TemporaryFolder folder_;
  std::vector<std::filesystem::path> sheets_ = write_recorded_example(folder_.path());
  ImportCounts counts_;
};

}  // namespace drape::compare::test
