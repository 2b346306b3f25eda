// SPDX-License-Identifier: Apache-2.0
#include "compare/drape_input.hpp"

#include <fmt/format.h>

namespace drape::compare {

const SimulatedSource& Simulation::source() const {
  return std::get<SimulatedSource>(sheet.sheet.source);
}

std::string Simulation::grid() const {
  return fmt::format("{}x{}", sheet.sheet.rows, sheet.sheet.cols);
}

std::string Simulation::grid_text() const {
  if (branch) return fmt::format("{}, branch {}", grid(), branch->number);
  return refined ? grid() + ", refined" : grid();
}

std::string Simulation::run_label() const {
  if (other_simulator) return fmt::format("{}, {}", *other_simulator, grid());
  const int count = source().segments;
  return fmt::format("{}{}, {} segment{}", grid(), refined ? " refined" : "", count,
                     count == 1 ? "" : "s");
}

std::string Simulation::label() const {
  return branch ? fmt::format("{}, branch {}", run_label(), branch->number) : run_label();
}

std::optional<int> Simulation::segments() const {
  return other_simulator ? std::nullopt : std::optional(source().segments);
}

std::string Simulation::segments_text() const {
  return other_simulator ? std::string() : std::to_string(source().segments);
}

std::tuple<bool, bool, int, bool, int> Simulation::rank() const {
  constexpr int kSegments = 5;  // as far as the paper goes
  const int count = segments().value_or(0);
  return {!other_simulator, !branch, sheet.sheet.rows, count == kSegments, count};
}

std::string DrapeInput::name() const {
  if (!simulations.empty()) return simulations.front().source().scene;
  if (!surfaces.empty()) return surfaces.front().scene;
  if (scene) return scene->name;
  return measured.asked ? measured.asked->name
                        : std::get<MeasuredSource>(measured.sheet.source).set;
}

}  // namespace drape::compare
