// SPDX-License-Identifier: Apache-2.0
#include "compare/history/apart.hpp"

#include <algorithm>

#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/store/writer.hpp"
#include "core/error.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {

namespace fs = std::filesystem;

ApartCounts import_simulations(const fs::path& store, std::vector<fs::path> sheets) {
  constexpr std::ptrdiff_t kAtATime = 500;  // limits the memory
  ApartCounts sum;
  sum.unfinished = std::erase_if(
      sheets, [](const fs::path& sheet) { return !fs::is_regular_file(run_record_path(sheet)); });
  Store results(store);
  for (auto first = sheets.begin(); first != sheets.end();) {
    const auto last = first + std::min(kAtATime, sheets.end() - first);
    const Session session = read_session({first, last}, {});
    if (!session.drapes.empty())
      throw usage_error("a measured sheet cannot be imported apart",
                        "leave out --apart to compare it with its simulations");
    results.write([&](Writer& writer) {
      add_content(writer, session, store);
      for (const auto& simulations : session.virtual_only) {
        for (const Simulation& one : simulations)
          if (one.sheet.sheet.no_go)
            throw bad_input("it was placed by a sheet that is NO-GO: " + *one.sheet.sheet.no_go,
                            {.file = one.sheet.file.string()},
                            "simulate it again from a sheet that is GO, or leave it out: a "
                            "simulation that is stored apart has no verdict");
        const ImportCounts counts = results.add(simulations);
        sum.added += counts.added;
        sum.present += counts.present;
      }
    });
    first = last;
  }
  results.close();
  return sum;
}

}  // namespace drape::compare
