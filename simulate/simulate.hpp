// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/certificate.hpp"
#include "core/fields/fields.hpp"
#include "core/levels.hpp"
#include "core/program/run_record.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/drape/drape.hpp"
#include "simulate/fabric/fitted_laws.hpp"
#include "simulate/paper/paper.hpp"

namespace drape::simulate {

/// `triangles`: the cloth on a mesh in nested levels (drape/drape.hpp). `paper`: the particle grid
/// of paper section 4 (paper/paper.hpp), for the paper's tables.
enum class ClothModel { triangles, paper };

/// Range over which the Kawabata curves are fitted: where a first run strains the cloth, or all
/// that was measured, as the paper.
enum class CurveFit { drape, whole };

/// Options of a simulation; SI. The defaults are those of the program.
struct SimulateOptions {
  ClothModel model = ClothModel::triangles;
  int segments = 5;  ///< line segments per Kawabata curve; 1: G, B, first slope
  /// Range of the fitted curves, see find_reach(); absent: wherever measured.
  std::optional<CurveReach> reach = {};
  bool internal_friction = false;       ///< both branches of bending and shear; triangles only
  bool from_measured = false;           ///< starts from the measured shape, whatever the scene says
  DrapeOptions drape;                   ///< triangles only
  std::optional<ClothOutline> outline;  ///< cut of the cloth; absent: the whole patch
  PaperOptions paper;
  /// Called now and then with the fraction of the work that is done.
  std::function<void(double fraction)> progress = {};

  /// Throws Error(usage) for values that cannot be simulated.
  void check() const;
};

struct SimulateResult {
  /// Triangles: the surface at the print's marks and, between them, at equal steps of about the
  /// finest spacing. Of the paper: the particles.
  Sheet sheet;
  Certificate certificate;
  std::optional<LevelsFile> levels;             ///< triangles only
  std::shared_ptr<const DrapeCase> drape_case;  ///< triangles only; `drape` refers to it
  std::optional<Drape> drape;                   ///< triangles only, in the frame of its case
  std::vector<HistoryRow> history;              ///< paper's model only

  [[nodiscard]] bool at_rest() const { return certificate.at_rest; }
};

/// Drapes the fabric over the scene's objects (paper section 4) and has the rest of a mesh judged
/// by the checker. `measured` places the start and the pins. Throws Error for wrong input; a cloth
/// that does not come to rest is a verdict of the certificate.
[[nodiscard]] SimulateResult simulate(const Scene& scene, const Fabric& fabric, const Print& print,
                                      const std::optional<Sheet>& measured,
                                      const SimulateOptions& options);

/// Result of a drape of `drape_case`, which is the scene's in the world: judged, with its sheet,
/// certificate and levels. For whoever drapes by himself, as an ensemble does.
[[nodiscard]] SimulateResult result_of(const Scene& scene, const Fabric& fabric,
                                       const FittedLaws& fitted, const SimulateOptions& options,
                                       std::shared_ptr<const DrapeCase> drape_case, Drape drape);

/// The surface of a moment in the world, as SimulateResult::sheet has it; `step_m`: the finest
/// spacing. Without its source.
[[nodiscard]] Sheet sheet_of(const DrapeLevel& level, const ClothMoment& moment, double step_m);

/// Reach of a drape's strains: four times as far as a first run of the scene's own start on a
/// coarse mesh, with the curves fitted wherever they are measured. All meshes, grids and numbers of
/// segments of a scene are thereby fitted over the same range. Absent where that run does not come
/// to rest.
[[nodiscard]] std::optional<CurveReach> find_reach(const Scene& scene, const Fabric& fabric,
                                                   const Print& print,
                                                   const std::optional<Sheet>& measured);

/// Files that write_outputs() may write, sheet.json first.
[[nodiscard]] std::vector<std::filesystem::path> output_files(const std::filesystem::path& folder);

/// Writes sheet, certificate, of triangles levels, cloth and contact forces, of the paper its
/// history; removes what an earlier run left beside them.
void write_outputs(const std::filesystem::path& out, const SimulateResult& result,
                   RunRecord& record);

}  // namespace drape::simulate

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::ClothModel>[] = {"triangles",
                                                                                    "paper"};
template <>
inline constexpr std::string_view drape::names_of<drape::simulate::CurveFit>[] = {"drape", "whole"};
