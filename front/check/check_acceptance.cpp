// SPDX-License-Identifier: Apache-2.0
#include "core/files/json_file.hpp"
#include "front/check/check.hpp"

namespace drape {
namespace {

void require_sha256(const JsonNode& node, const std::string& key) {
  const std::string text = node.text(key);
  if (text.size() != 64 || text.find_first_not_of("0123456789abcdef") != std::string::npos)
    node.reject(key, "this is no SHA-256");
}

}  // namespace

/// The fields of docs/schemas/acceptance.schema.json that `drape compare` reads when all else is
/// done.
void require_acceptance(const std::filesystem::path& file) {
  const JsonNode root = JsonNode::open(file, "acceptance", 1);
  static_cast<void>(root.text("rig"));
  require_sha256(root, "calibration_sha256");
  for (const char* key : {"date", "valid_until", "cause"})
    static_cast<void>(root.optional_text(key));
  static_cast<void>(root.integer("positions"));
  static_cast<void>(root.boolean("go"));
  for (const JsonNode& row : root.items("figures")) {
    for (const char* key : {"name", "unit", "where"}) static_cast<void>(row.text(key));
    for (const char* key : {"value", "expanded_uncertainty", "limit"})
      static_cast<void>(row.optional_number(key));
    static_cast<void>(row.boolean("go"));
  }
}

}  // namespace drape
