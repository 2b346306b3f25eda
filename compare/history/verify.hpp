// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/store/store.hpp"

namespace drape::compare {

/// Counts and findings of a verification.
struct Verification {
  std::vector<std::string> findings;  ///< empty if everything is as written
  std::int64_t manifests = 0;
  std::string last_manifest;  ///< SHA-256 of the last manifest
  long long rows = 0;         ///< number of listed keys and blobs hashed
  int comparisons = 0;        ///< number recomputed from their sheets, bit for bit
};

/// Compares the schema with this program's, every manifest, row and blob with its hash, the file
/// with the size stated in its last manifest, and every number with its recomputation from the
/// blobs; a number whose sheets are not in the store is a finding. Without `recompute` the numbers
/// are not checked. Files outside of the store are not read.
[[nodiscard]] Verification verify_store(const std::filesystem::path& store, bool recompute = true);

/// Findings about manifests, rows and blobs only.
[[nodiscard]] std::vector<std::string> altered_rows(const StoreReader& reader);

/// Signs the last manifest of the store with an Ed25519 private key (PEM) into `<store>.sig`.
/// Anyone who can write the file can alter rows and recompute every hash; only a signature reveals
/// that, to holders of the public key. Throws Error(bad_input) if the store is not as written or
/// the key is invalid.
void sign_store(const std::filesystem::path& store, const std::filesystem::path& private_key);

/// File of the signature.
[[nodiscard]] std::filesystem::path signature_path(const std::filesystem::path& store);

/// True if this manifest was signed with the private key that belongs to this public key (PEM).
/// Throws Error(bad_input) if there is no signature or the key is invalid.
[[nodiscard]] bool is_signed(const std::filesystem::path& store, const std::string& manifest_sha256,
                             const std::filesystem::path& public_key);

/// Counts of keys (with the rows of one table that have the key) and blobs.
struct MergeCounts {
  long long added = 0;
  long long present = 0;  ///< equal in every value that both stores have
  /// Rows of the target for which a source has values that the target lacks: rows are never
  /// changed.
  std::set<std::string> known_better;
};

/// Imports everything missing in `target` from other stores, in one transaction with one manifest.
/// Every row of each source is hashed first. Merging again adds nothing, and the order of the
/// sources does not matter: they are processed in the order of the hashes of their last manifests.
/// Numbers of runs and comparisons are the target's own. Throws Error(bad_input) if a row of a
/// source was altered, or if two stores contradict each other, and leaves the target unchanged. A
/// value that only one store has is not a contradiction: new rows of the target get it.
[[nodiscard]] MergeCounts merge_stores(const std::filesystem::path& target,
                                       const std::vector<std::filesystem::path>& sources);

/// Content copied from a damaged store into another one.
struct Rescue {
  long long kept = 0;             ///< keys (with their rows) and blobs
  std::vector<std::string> lost;  ///< those that the damaged store no longer has as written
};

/// Imports all rows and blobs of a damaged store that still have the hash listed in its
/// manifests into the store `fresh`, which is created if absent; nothing else is trusted. The
/// damaged store is only read. Repeating it adds nothing. Throws Error(bad_input) if nothing can
/// be read.
[[nodiscard]] Rescue rescue_store(const std::filesystem::path& damaged,
                                  const std::filesystem::path& fresh);

}  // namespace drape::compare
