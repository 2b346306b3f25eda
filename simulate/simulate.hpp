// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/program/run_record.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "core/simulation_files.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/drape/drape.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/paper/paper.hpp"

namespace drape::simulate {

/// Shape of a mesh, in the frame of its state.
[[nodiscard]] ClothShape shape_of(const MaterialMesh& mesh, const MeshCloth::State& state);

/// State of a drape in the world as the checker judges it, with the values of its files. `scene`,
/// in world coordinates, has the friction used for the drape and must outlive the result.
[[nodiscard]] MeshRest rest_of(const DrapeLevel& level, const ClothMoment& moment,
                               const Scene& scene, double residual_tolerance);

/// Verdict of the checker. For `most_strain` see strain_limits() (checker/certify.hpp).
[[nodiscard]] MeshJudgement judge_drape(
    const DrapeLevel& level, const ClothMoment& moment, const Scene& scene,
    double residual_tolerance,
    const Eigen::Vector2d& most_strain =
        Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()));

/// `triangles`: cloth on a triangle mesh in nested levels (drape/drape.hpp). `paper`: particle grid
/// of paper section 4 (paper/paper.hpp), for the paper's tables.
enum class ClothModel { triangles, paper };

/// Range over which the Kawabata curves are fitted: the strains of a first run (drape), or the
/// whole measurement as in the paper (whole).
enum class CurveFit { drape, whole };

/// Options of a simulation, in SI units. The defaults are those of the program.
struct SimulateOptions {
  ClothModel model = ClothModel::triangles;
  int segments = 5;  ///< line segments per Kawabata curve; 1: only G, B and the first slope
  /// Range of the fitted curves, see find_reach(); absent for the whole measurement.
  std::optional<CurveReach> reach = {};
  bool internal_friction = false;  ///< both branches of bending and shear loops; triangles only
  bool from_measured = false;      ///< start from the measured shape instead of the scene's start
  DrapeOptions drape;              ///< triangles only
  std::optional<ClothOutline> outline;  ///< cut of the cloth; absent for the whole patch
  PaperOptions paper;
  /// Called at intervals with the fraction of the work done.
  std::function<void(double fraction)> progress = {};

  /// Throws Error(usage) for values that cannot be simulated.
  void check() const;
};

struct SimulateResult {
  /// Triangles: the surface sampled at the print's marks and in between, at equal steps of about
  /// the finest spacing. Paper: the particles.
  Sheet sheet;
  Certificate certificate;
  std::optional<LevelsFile> levels;             ///< triangles only
  std::shared_ptr<const DrapeCase> drape_case;  ///< triangles only; referred to by `drape`
  std::optional<Drape> drape;                   ///< triangles only, in the frame of its case
  std::vector<HistoryRow> history;              ///< paper only

  [[nodiscard]] bool at_rest() const { return certificate.at_rest; }
};

/// Drapes the fabric over the scene's objects (paper section 4) and has the checker judge the
/// result of a triangle mesh. `measured` positions start and pins. Throws Error for invalid input;
/// a cloth that does not come to rest is a verdict in the certificate.
[[nodiscard]] SimulateResult simulate(const Scene& scene, const Fabric& fabric, const Print& print,
                                      const std::optional<Sheet>& measured,
                                      const SimulateOptions& options);

/// Converts a drape of `drape_case`, which belongs to the scene, to a result: judged, with sheet,
/// certificate and levels. For callers that run the drape themselves, such as an ensemble.
[[nodiscard]] SimulateResult result_of(const Scene& scene, const Fabric& fabric,
                                       const FittedLaws& fitted, const SimulateOptions& options,
                                       std::shared_ptr<const DrapeCase> drape_case, Drape drape);

/// Surface of a state in the world, as in SimulateResult::sheet but without its source; `step_m` is
/// the finest spacing.
[[nodiscard]] Sheet sheet_of(const DrapeLevel& level, const ClothMoment& moment, double step_m);

/// Range of strains for the curve fits: four times the strains of a first run from the scene's
/// own start on a coarse mesh, with curves fitted over the whole measurement. All meshes, grids
/// and segment numbers of a scene thus share one range. nullopt if that run does not come to
/// rest.
[[nodiscard]] std::optional<CurveReach> find_reach(const Scene& scene, const Fabric& fabric,
                                                   const Print& print,
                                                   const std::optional<Sheet>& measured);

/// Files that write_outputs() can write, sheet.json first.
[[nodiscard]] std::vector<std::filesystem::path> output_files(const std::filesystem::path& folder);

/// Writes sheet and certificate; for triangles levels, cloth and contact forces, for the paper's
/// model the history. Removes outputs of an earlier run.
void write_outputs(const std::filesystem::path& out, const SimulateResult& result,
                   RunRecord& record);

}  // namespace drape::simulate

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::ClothModel>[] = {"triangles",
                                                                                    "paper"};
template <>
inline constexpr std::string_view drape::names_of<drape::simulate::CurveFit>[] = {"drape", "whole"};
