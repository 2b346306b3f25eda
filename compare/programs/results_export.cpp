// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/results_export.hpp"

#include <fmt/format.h>

#include "compare/crate/crate.hpp"
#include "compare/history/verify.hpp"
#include "compare/programs/results_output.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/shell_word.hpp"

namespace drape::compare {
namespace {

int export_crate(const StoreReader& reader, const ResultsArguments& arguments,
                 const CommonOptions& common) {
  if (arguments.file.empty() || arguments.lab.empty())
    throw usage_error("a crate needs --out FOLDER and --about lab.toml",
                      "lab.toml names title, description, license and authors");
  const Crate crate =
      write_crate(reader, arguments.filter.run, read_record<Lab>(arguments.lab), arguments.file);
  Ending ending;
  ending.go = crate.findings.empty();
  ending.verdict = ending.go ? "the crate holds everything behind its numbers" : crate.findings[0];
  ending.numbers = {{"files", std::to_string(crate.files)},
                    {"runs of programs", std::to_string(crate.actions)}};
  ending.rejected = crate.findings;
  ending.next_command = fmt::format("zip -r crate.zip {}", shell_word(arguments.file));
  return finish(ending, common);
}

/// Throws for an option that the format would silently ignore.
void require_of_format(const Command& command, ExportFormat format) {
  const bool table = format == ExportFormat::csv || format == ExportFormat::json,
             crate = format == ExportFormat::ro_crate;
  for (const auto& [option, fits] :
       {std::pair{"--table", table}, {"--run", crate}, {"--about", crate}})
    if (command.count(option) > 0 && !fits)
      throw usage_error(fmt::format("{} says nothing of export {}", option, name_of(format)),
                        "leave it out; `drape results sql` asks for rows of a table");
}

}  // namespace

int export_store(const Command& command, const StoreReader& reader,
                 const ResultsArguments& arguments, const CommonOptions& common) {
  require_of_format(command, *arguments.format);
  if (const auto altered = altered_rows(reader); !altered.empty())
    throw not_as_written(arguments.store, altered.front());
  if (arguments.format == ExportFormat::ro_crate) return export_crate(reader, arguments, common);
  if (arguments.format != ExportFormat::sql) {
    write(arguments, common, export_table(reader, arguments.table));
    return 0;
  }
  const std::string dump = dump_sql(reader);
  arguments.file.empty() ? print_text(dump) : write_durable(arguments.file, dump);
  return 0;
}

}  // namespace drape::compare
