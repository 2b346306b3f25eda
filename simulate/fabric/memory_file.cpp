// SPDX-License-Identifier: Apache-2.0
// The internal state of a sheet as a file, so that anybody can judge its rest.
#include <cmath>

#include "core/error.hpp"
#include "core/files/csv.hpp"
#include "simulate/fabric/csv_text.hpp"
#include "simulate/fabric/memory.hpp"

namespace drape::simulate {
namespace {

// law: 0 bending along the warp, 1 along the weft, 2 shear; index: place times elements of the law
// plus element.
const std::vector<std::string>& memory_columns() {
  static const std::vector<std::string> names = {"law", "index", "slip_per_m_or_rad"};
  return names;
}

}  // namespace

std::string memory_csv(const ClothMemory& memory) {
  std::vector<std::vector<double>> columns(3);
  const std::vector<double>* const laws[3] = {&memory.bending[0], &memory.bending[1],
                                              &memory.shear};
  for (int law = 0; law < 3; ++law) {
    for (std::size_t k = 0; k < laws[law]->size(); ++k) {
      columns[0].push_back(law);
      columns[1].push_back(static_cast<double>(k));
      columns[2].push_back((*laws[law])[k]);
    }
  }
  return csv_text(memory_columns(), columns);
}

ClothMemory read_memory(const std::filesystem::path& file) {
  const Csv csv = read_csv(file, memory_columns());
  ClothMemory memory;
  std::vector<double>* const laws[3] = {&memory.bending[0], &memory.bending[1], &memory.shear};
  for (std::size_t i = 0; i < csv.lines.size(); ++i) {
    const double law = csv.columns[0][i];
    if (law != 0 && law != 1 && law != 2) {
      throw bad_input("a law that is not 0, 1 or 2",
                      {.file = file.string(), .line = csv.lines[i], .field = "law"},
                      "simulate again");
    }
    std::vector<double>& slips = *laws[static_cast<int>(law)];
    if (csv.columns[1][i] != static_cast<double>(slips.size())) {
      throw bad_input("the indices of a law are not 0, 1, 2, ..",
                      {.file = file.string(), .line = csv.lines[i], .field = "index"},
                      "simulate again");
    }
    slips.push_back(csv.columns[2][i]);
  }
  return memory;
}

}  // namespace drape::simulate
