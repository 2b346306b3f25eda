// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/store/store.hpp"
#include "compare/store/writer.hpp"

namespace drape::compare {

// Each writes the rows of one thing, and enters it into the ledger, unless it is there already;
// those that return a bool return false then. Lengths go in as mm, angles as degrees.

void insert_calibration(Writer& writer, const std::string& sha256, const std::string& rig);
void insert_drapemeter(Writer& writer, const std::string& sheet, const DrapemeterResult& result);
void insert_measured(Writer& writer, const SheetFile& file, const Measurement& measurement,
                     const std::optional<RecordingId>& recording);
bool insert_simulated(Writer& writer, const Simulation& simulation);
bool add_comparison(Writer& writer, const DrapeInput& input, const RealVirtual& row,
                    const std::optional<TurnedDistance>& turned = {});
bool insert_surface(Writer& writer, const DrapeInput& input, const RealSurface& row);
/// `measured` is absent for simulations without a real cloth.
bool insert_pair(Writer& writer, const std::optional<std::string>& measured,
                 const std::vector<Simulation>& simulations, bool gaps_filled,
                 const VirtualVirtual& row);

}  // namespace drape::compare
