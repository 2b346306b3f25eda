// SPDX-License-Identifier: Apache-2.0
#include "compare/store/sqlite_error.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>

namespace drape::compare {

Error store_error(const std::filesystem::path& file, const SQLite::Exception& exception) {
  const Where where{.file = file.string()};
  const std::string reason = exception.what();
  switch (exception.getErrorCode() & 0xFF) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return bad_input(fmt::format("the results store was in use by another program for {} s",
                                   kBusyTimeout_ms / 1000),
                       where,
                       "wait for the other program and run this one again; nothing stored is lost");
    case SQLITE_FULL:
      return bad_input("the results store cannot grow: " + reason, where,
                       "free disk space and run again; nothing already stored is lost");
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_IOERR:
      return bad_input("the results store cannot be opened or written: " + reason, where,
                       "check the path, the permissions and the disk, then run again; nothing "
                       "already stored is lost");
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return bad_input("this is not a readable results store: " + reason, where,
                       "name another file with --store, or restore this one from a backup");
    case SQLITE_CONSTRAINT:
      if (exception.getExtendedErrorCode() == SQLITE_CONSTRAINT_TRIGGER)
        return bad_input("the results store does not take these rows: " + reason, where,
                         "a trigger of another hand may be in it: run drape results verify");
      [[fallthrough]];
    default:
      return internal_error("the results store answered: " + reason, where);
  }
}

}  // namespace drape::compare
