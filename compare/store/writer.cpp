// SPDX-License-Identifier: Apache-2.0
#include "compare/store/writer.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "compare/schema/schema.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"

namespace drape::compare {

Writer::Writer(SQLite::Database& database)
    : database_(database),
      transaction_(database, SQLite::TransactionBehavior::IMMEDIATE),
      manifest_(last_manifest(database).number + 1) {}

void Writer::add(const ListedTable& table, const std::string& key) {
  if (!known_.emplace(&table, key).second) return;
  added_.emplace_back(&table, key);
  for (const ListedTable& hanging : listed_tables())
    if (hanging.parent == table.name) add(hanging, key);
}

bool Writer::insert_row(const std::string& table, const Cells& row) {
  auto found = statements_.find(table);
  if (found == statements_.end()) {
    std::string names, marks;
    for (const RelationColumn& column : relation(table).columns) {
      names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", column.name);
      marks += marks.empty() ? "?" : ", ?";
    }
    found = statements_
                .try_emplace(table, database_,
                             fmt::format("INSERT INTO {} ({}) VALUES ({}) ON CONFLICT DO NOTHING",
                                         table, names, marks))
                .first;
  }
  SQLite::Statement& statement = found->second;
  bind_all(statement, row);
  const bool is_new = statement.exec() > 0;
  statement.reset();
  statement.clearBindings();
  const ListedTable& listed = listed_table(table);
  if (!listed.parent.empty()) return is_new;  // listed with its parent
  const std::string& key = std::get<std::string>(row[listed.key_column]);
  is_new ? add(listed, key) : void(known_.emplace(&listed, key));
  return is_new;
}

void Writer::insert_listed(const ListedTable& table, const std::string& key,
                           const std::vector<Cells>& rows) {
  auto found = statements_.find(">" + table.name);
  if (found == statements_.end())
    found =
        statements_
            .try_emplace(">" + table.name, database_,
                         fmt::format("INSERT INTO {} ({}) VALUES ({})", table.name,
                                     fmt::join(table.columns, ", "), fmt::join(table.places, ", ")))
            .first;
  for (const Cells& row : rows) {
    found->second.reset();
    found->second.clearBindings();
    bind_all(found->second, row);
    found->second.exec();
  }
  found->second.reset();
  if (known_.emplace(&table, key).second) added_.emplace_back(&table, key);
}

void Writer::insert_blob(const std::string& sha256, std::string_view content) {
  if (add_blob(database_, sha256, content)) add(listed_table("blob"), sha256);
}

void Writer::insert_file(const std::string& sha256, const std::string& path) {
  if (execute(database_, "INSERT INTO file VALUES (?, ?, ?) ON CONFLICT DO NOTHING",
              {sha256, path, manifest_}) > 0)
    add(listed_table("file"), std::to_string(manifest_));
}

bool Writer::has(const std::string& table, const std::string& sha256) {
  if (!value<int>("SELECT 1 FROM " + table + " WHERE sha256 = ?", {sha256})) return false;
  known_.emplace(&listed_table(table), sha256);
  return true;
}

std::vector<std::string> Writer::texts(const std::string& sql, const Cells& parameters) {
  std::vector<std::string> all;
  for (const auto& [text] : rows_of<std::string>(database_, sql, parameters)) all.push_back(text);
  return all;
}

void Writer::commit() {
  statements_.clear();
  RowReader reader(database_);
  const std::set<ListedKey> added(added_.begin(), added_.end());
  for (const ListedKey& one : known_)
    if (!added.contains(one))
      if (const std::string altered = reader.alteration(*one.first, one.second); !altered.empty())
        throw not_as_written(database_.getFilename(), altered);
  write_manifest(database_, added_);
  transaction_.commit();
}

namespace {

using units::mm;

constexpr double kMicrojoule = 1e-6;

Cell in_percent(const std::optional<double>& ratio) {
  return ratio ? Cell(*ratio / units::percent) : Cell();
}
Cell low_mm(const Trust& trust) {
  return trust.bootstrap ? Cell(trust.bootstrap->low / mm) : Cell();
}
Cell high_mm(const Trust& trust) {
  return trust.bootstrap ? Cell(trust.bootstrap->high / mm) : Cell();
}

std::optional<std::string> certificate_json(const Simulation& simulation) {
  if (!simulation.certificate) return std::nullopt;
  Json json = Json::object();
  for (const auto& [name, value] : simulation.certificate->entries) json[name] = value;
  return json.dump();
}

void insert_mark(Writer& writer, int id, const MarkError& mark) {
  const Eigen::Vector3d real = mark.real_in_world / mm, simulated = mark.virtual_in_world / mm;
  const Eigen::Vector3d parts = mark.warp_weft_normal_m / mm;
  writer.insert("mark_error", id, mark.mark.row, mark.mark.col, mark.material_m.x() / mm,
                mark.material_m.y() / mm, real.x(), real.y(), real.z(), simulated.x(),
                simulated.y(), simulated.z(), mark.distance_m / mm, parts.x(), parts.y(), parts.z(),
                in_mm(mark.sigma_mark_m), in_mm(mark.sigma_distance_m), mark.views);
}

void insert_comparison(Writer& writer, const std::string& key, const DrapeInput& input,
                       const RealVirtual& row) {
  const DistanceStatistics& s = row.statistics;
  const NormalStatistics& n = row.normal;
  const Eigen::Vector2d percent = percent_of_patch(s.mean_m, input.measured.sheet.patch_m);
  Cells cells;
  const auto add = [&](const auto&... values) { (cells.emplace_back(values), ...); };
  add(std::nullopt, key, input.measured.sha256, input.simulations[row.simulation].sheet.sha256);
  add(metrics_version(), s.marks, row.marks.excluded.size());
  add(s.mean_m / mm, in_mm(s.sigma_mean_m), s.median_m / mm, s.rms_m / mm, s.p95_m / mm);
  add(s.max_m / mm, s.worst_mark.row, s.worst_mark.col, percent.x(), percent.y());
  add(low_mm(s.mean), high_mm(s.mean));
  for (const Trust* trust : {&s.median, &s.rms, &s.p95, &s.max})
    add(in_mm(trust->sigma_m), low_mm(*trust), high_mm(*trust));
  add(n.mean_m / mm, in_mm(n.mean.sigma_m), low_mm(n.mean), high_mm(n.mean), n.rms_m / mm);
  add(row.to_surface.mean_m / mm, row.to_surface.max_m / mm);
  const RigidAlignment move = row.aligned.value_or(RigidAlignment());
  for (const double value : {move.after.mean_m / mm, move.after.rms_m / mm, move.after.max_m / mm,
                             move.centroid_shift_m / mm, move.turn_rad / units::deg})
    add(row.aligned ? Cell(value) : Cell());
  for (const auto& ratio :
       {row.strain.difference.warp, row.strain.difference.weft, row.strain.difference.area})
    add(in_percent(ratio));
  writer.insert_row("comparison", cells);
  const int id = writer.last_id();
  for (const MarkError& mark : row.marks.marks) insert_mark(writer, id, mark);
}

void insert_calibration(Writer& writer, const std::string& sha256, const std::string& rig) {
  writer.insert("rig", rig);
  writer.insert("calibration", sha256, rig);
}

void insert_drapemeter(Writer& writer, const std::string& sheet, const DrapemeterResult& result) {
  if (!result.value) return;
  constexpr double mm2 = mm * mm;
  const Drapemeter& d = *result.value;
  if (!writer.insert("drapemeter", sheet, d.centre_in_world.x() / mm, d.centre_in_world.y() / mm,
                     d.covered_area_m2 / mm2, d.flat_area_m2 / mm2, in_percent(d.drape_coefficient),
                     d.mean_radius_m / mm, d.folds, d.fold_depth_m / mm))
    return;
  for (const Harmonic& harmonic : d.spectrum)
    writer.insert("hem_harmonic", sheet, harmonic.order, harmonic.amplitude_m / mm,
                  harmonic.phase_rad / units::deg);
}

void insert_measured(Writer& writer, const SheetFile& file, const Measurement& measurement,
                     const std::optional<RecordingId>& recording) {
  const Sheet& sheet = file.sheet;
  const auto& source = std::get<MeasuredSource>(sheet.source);
  insert_calibration(writer, source.calibration_sha256, source.rig);
  if (recording) writer.insert("recording", recording->sha256, recording->recorded_on);
  if (!writer.insert("sheet", file.sha256, "measured", sheet.rows, sheet.cols,
                     sheet.patch_m.x() / mm, sheet.patch_m.y() / mm, measurement.marks,
                     measurement.gaps, source.rig, source.set, source.calibration_sha256,
                     source.detections_sha256, recording ? Cell(recording->sha256) : Cell(),
                     in_mm(measurement.sigma_median_m), in_mm(measurement.sigma_max_m)))
    return;
  for (const Gap& gap : sheet.gaps)
    writer.insert("gap", file.sha256, gap.mark.row, gap.mark.col, gap.reason);
}

bool insert_simulated(Writer& writer, const Simulation& simulation) {
  const Sheet& sheet = simulation.sheet.sheet;
  const SimulatedSource& source = simulation.source();
  const bool own = !simulation.other_simulator;
  const auto if_own = [&](Cell value) { return own ? std::move(value) : Cell(); };
  const auto if_grid = [&](int size) { return simulation.is_grid() ? Cell(size) : Cell(); };
  if (own) writer.insert("fabric", source.fabric_sha256, source.fabric);
  const std::string& key = simulation.sheet.sha256;
  const bool fresh =
      writer.insert("sheet", key, "simulated", sheet.rows, sheet.cols, sheet.patch_m.x() / mm,
                    sheet.patch_m.y() / mm, sheet.marks.size(), sheet.gaps.size());
  writer.insert("simulation", key, simulation.other_simulator.value_or("drapebench"), source.scene,
                if_own(source.scene_sha256), if_own(source.fabric_sha256),
                own ? Cell() : Cell(source.fabric), source.start_sha256, if_grid(sheet.rows),
                if_grid(sheet.cols), simulation.segments(), source.model,
                source.solver.empty() ? Cell() : Cell(source.solver), source.status,
                if_own(source.status == "at rest"),
                simulation.certificate ? Cell(simulation.certificate->sha256) : Cell(),
                certificate_json(simulation), in_mm(source.spacing_m),
                source.from_measured ? Cell(1) : Cell());
  if (const auto& b = simulation.branch)
    writer.insert("branch", key, b->set_sha256, b->number, b->of, b->energy_j / kMicrojoule,
                  b->residual, b->stable, b->starts, b->hem_nodes, b->round);
  return fresh;
}

bool add_comparison(Writer& writer, const DrapeInput& input, const RealVirtual& row,
                    const std::optional<TurnedDistance>& turned = {}) {
  const std::string key =
      comparison_key({input.measured.sha256, input.simulations[row.simulation].sheet.sha256});
  const bool fresh = !writer.has("comparison", key);
  if (fresh) insert_comparison(writer, key, input, row);
  if (turned)
    writer.insert("branch_turn", key, turned->axis_in_world.x() / mm,
                  turned->axis_in_world.y() / mm, turned->mean_m / mm,
                  turned->turn_rad / units::deg, turned->half_turn);
  return fresh;
}

bool insert_surface(Writer& writer, const DrapeInput& input, const RealSurface& row) {
  const OtherSurface& surface = input.surfaces[row.surface];
  const DistanceStatistics& s = row.to_surface;
  const auto& both = row.both_directions;
  const OneDirection there = both ? both->first_to_second : OneDirection(),
                     back = both ? both->second_to_first : OneDirection();
  const auto known = [&](double length_m) { return both ? Cell(length_m / mm) : Cell(); };
  return writer.insert(
      "surface_comparison",
      comparison_key({input.measured.sha256, "surface without marks", surface.sha256}),
      input.measured.sha256, surface.sha256, surface.simulator, surface.scene, surface.fabric,
      metrics_version(), surface.mesh.points.size(), surface.mesh.triangles.size(), s.marks,
      s.mean_m / mm, in_mm(s.mean.sigma_m), low_mm(s.mean), high_mm(s.mean), s.rms_m / mm,
      s.p95_m / mm, s.max_m / mm, known(there.mean_m), known(there.hausdorff_m), known(back.mean_m),
      known(back.hausdorff_m));
}

bool insert_pair(Writer& writer, const std::optional<std::string>& measured,
                 const std::vector<Simulation>& simulations, bool gaps_filled,
                 const VirtualVirtual& row) {
  const std::string &first = simulations[row.first].sheet.sha256,
                    &second = simulations[row.second].sheet.sha256;
  const DistanceStatistics& s = row.statistics;
  return writer.insert(
      "simulation_pair", comparison_key({measured.value_or("no real cloth"), first, second}),
      measured, first, second, row.label, row.paper_order, metrics_version(), s.marks, gaps_filled,
      s.mean_m / mm, s.median_m / mm, s.rms_m / mm, s.p95_m / mm, s.max_m / mm, low_mm(s.mean),
      high_mm(s.mean), row.surface.mean_m() / mm, row.surface.hausdorff_m() / mm);
}

}  // namespace

std::string comparison_key(const std::vector<std::string>& sheet_hashes) {
  std::string text = fmt::format("drapebench/comparison/{}\n", metrics_version());
  for (const std::string& hash : sheet_hashes) text += hash + '\n';
  return sha256_of(std::string_view(text));
}

void Store::add(const Calibration& calibration, const std::string& sha256) {
  write([&](Writer& writer) {
    insert_calibration(writer, sha256, calibration.rig);
    if (!writer.insert("calibration_file", sha256, calibration.method)) return;
    for (const CalibratedCamera& camera : calibration.cameras) {
      const CalibrationResiduals& residuals = camera.residuals;
      writer.insert("calibration_camera", sha256, camera.camera.name, residuals.points,
                    residuals.rms_px, residuals.max_px, residuals.object_rms_mm);
    }
  });
}

ImportCounts Store::add(const DrapeInput& input, const Report& report,
                        const std::optional<RecordingId>& recording) {
  ImportCounts counts;
  const auto count = [&](bool added) { ++(added ? counts.added : counts.present); };
  write([&](Writer& writer) {
    insert_measured(writer, input.measured, report.measurement, recording);
    insert_drapemeter(writer, input.measured.sha256, report.measured_drapemeter);
    for (const SheetFile& repeat : input.repeats)
      insert_measured(writer, repeat, measurement_of(repeat.sheet), recording);
    for (std::size_t i = 0; i < input.simulations.size(); ++i) {
      insert_simulated(writer, input.simulations[i]);
      insert_drapemeter(writer, input.simulations[i].sheet.sha256, report.drapemeters[i]);
    }
    for (const RealVirtual& row : report.real_virtual)
      if (!input.simulations[row.simulation].branch) count(add_comparison(writer, input, row));
    for (const BranchSet& set : report.branch_sets)
      for (const BranchComparison& one : set.branches)
        count(add_comparison(writer, input, one.as_placed, one.turned));
    for (const RealSurface& row : report.real_surface) count(insert_surface(writer, input, row));
    for (const VirtualVirtual& row : report.virtual_virtual)
      count(insert_pair(writer, input.measured.sha256, input.simulations,
                        report.lattice_has_gaps_filled, row));
  });
  return counts;
}

ImportCounts Store::add(const VirtualGroup& group) {
  ImportCounts counts;
  write([&](Writer& writer) {
    for (const Simulation& simulation : group.simulations) insert_simulated(writer, simulation);
    for (const VirtualVirtual& row : group.pairs) {
      const bool added = insert_pair(writer, std::nullopt, group.simulations, true, row);
      ++(added ? counts.added : counts.present);
    }
  });
  return counts;
}

ImportCounts Store::add(const std::vector<Simulation>& simulations) {
  ImportCounts counts;
  write([&](Writer& writer) {
    for (const Simulation& simulation : simulations)
      ++(insert_simulated(writer, simulation) ? counts.added : counts.present);
  });
  return counts;
}

}  // namespace drape::compare
