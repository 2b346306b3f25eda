// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "compare/records/provenance.hpp"
#include "compare/store/inputs.hpp"
#include "compare/store/store.hpp"

namespace drape::compare {

/// <store>.seal.json ("drapebench/seal/1"): hashes of the store as a whole and of every file that
/// stands behind its numbers, run records included. Written after the store; its own hash is its
/// last line, so that no byte of it can change unseen.
struct Seal {
  std::string store;  ///< its file name
  std::string store_sha256;
  long long entries = 0;                     ///< entries of the ledger
  std::string head;                          ///< chain_sha256 of the last
  std::map<std::string, std::string> files;  ///< path relative to the store's folder, SHA-256
};

/// Folder of the store.
[[nodiscard]] std::filesystem::path folder_of(const std::filesystem::path& store);

[[nodiscard]] std::filesystem::path seal_path(const std::filesystem::path& store);

/// Throws Error(bad_input) when there is none, any byte of it was changed, or the store is called
/// otherwise than when it was sealed.
[[nodiscard]] Seal read_seal(const std::filesystem::path& store);

/// Throws Error(bad_input) where a seal stands without its store, in whose place another would
/// never be sealed.
void require_store_of_seal(const std::filesystem::path& store);

/// Where each of these contents lies by the seal: a file that still has it, the store's own copy
/// where no other has, and a file that had it where none has. Of another simulator's mesh, whose
/// content is that of two files, the one that people wrote.
[[nodiscard]] std::map<std::string, std::filesystem::path> sealed_places(
    const std::filesystem::path& store, RecordBook& book, const std::set<std::string>& contents);

/// Seals a store, keeping what was sealed before; `held` has been held since before the first
/// commit. Of each file its name and hash are kept and no more, so that a long import adds its
/// files in parts. A damaged seal is not overwritten but an Error.
class Sealing {
 public:
  Sealing(const StoreLock& held, std::filesystem::path store);
  /// The files behind `starts` (sheets, calibration, reports).
  void add(const std::vector<std::filesystem::path>& starts);
  /// Takes over what another store's seal knows, hashes and all: a file that was changed since is
  /// not sealed as it is now. Files that are gone are kept only with `absent_too`. The other's
  /// copies are those that take_copies() brought. Returns the files that are gone or changed.
  std::vector<std::filesystem::path> take_over(const std::filesystem::path& other, bool absent_too);
  /// The run record of the sealing step is written after the seal and stands in none.
  void write(const std::filesystem::path& own_record = {}) const;

 private:
  std::filesystem::path store_;
  Seal before_;
  std::map<std::string, std::string> files_;
};

/// All at once.
void seal_store(const StoreLock& held, const std::filesystem::path& store,
                const std::vector<std::filesystem::path>& starts,
                const std::filesystem::path& own_record = {});

/// Counts and findings of a check.
struct Verification {
  std::vector<std::string> findings;  ///< empty: all is as it was written
  long long rows = 0;                 ///< entries of the ledger recomputed
  int files = 0;                      ///< hashed
  int comparisons = 0;                ///< recomputed from their sheets, bit for bit
};

/// The seal's own bytes, the store's bytes, every row against the ledger, every sealed file's
/// bytes, every comparison recomputed from its sheets; one whose sheets are not sealed is a
/// finding. With `recompute` off the last is left out.
[[nodiscard]] Verification verify_store(const std::filesystem::path& store, bool recompute = true);

/// Copies every sheet of the session, and every list of branches, into `<store>.files/`, named by
/// its content, so that its comparisons can be recomputed when a later run has replaced the sheet
/// or a folder is gone. What is there already stays. Returns the copies.
std::vector<std::filesystem::path> keep_copies(const std::filesystem::path& store,
                                               const Session& session);

/// Takes over the copies that another store keeps. Returns them.
std::vector<std::filesystem::path> take_copies(const std::filesystem::path& store,
                                               const std::filesystem::path& other);

/// Where take_copies() puts what a seal of the other store calls so; empty where it is no copy.
[[nodiscard]] std::filesystem::path copy_of_same_name(const std::filesystem::path& store,
                                                      const std::filesystem::path& other,
                                                      const std::string& path);

/// True for a path that keep_copies() made.
[[nodiscard]] bool is_copy(const std::string& path);

/// Signs the seal of the store with an Ed25519 private key (PEM) into `<store>.seal.sig`, so that
/// whoever rewrites store, ledger and seal together is found by those who have the public key.
/// Throws Error(bad_input) when the store has no seal or the key is none.
void sign_seal(const std::filesystem::path& store, const std::filesystem::path& private_key);

/// True when the seal is what was signed with the private key of this public key (PEM). Throws
/// Error(bad_input) when there is no signature or the key is none.
[[nodiscard]] bool is_signed(const std::filesystem::path& store,
                             const std::filesystem::path& public_key);

}  // namespace drape::compare
