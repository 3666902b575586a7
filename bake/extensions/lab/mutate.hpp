// The checker's proof of itself: bundles damaged on purpose, and how many of them it finds bad.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

struct MutateOptions {
  std::uint64_t count = 0;
  std::uint64_t seed = 1;
  /// The second reader (scripts/read_bundle.py). Empty: no survivor can be shown to be harmless.
  std::string second_reader;
  std::function<void(double done)> progress;  ///< 0 to 1; may be empty
};

/// How mutations of one kind fared.
struct MutationTally {
  std::uint64_t tried = 0;
  std::uint64_t killed = 0;    ///< the checker found the bundle bad
  std::uint64_t harmless = 0;  ///< survived, and both readers decode the identical scene
  std::uint64_t summary = 0;   ///< of the killed, those that only STATEMENT_DIFFERS found
  /// Killed among those that are not harmless; 1 if there is no one.
  [[nodiscard]] double rate() const;
  /// The same without the kills of the content summary: what the other rules do.
  [[nodiscard]] double rate_without_summary() const;
};

struct MutationSurvivor {
  std::uint64_t number = 0;  ///< of the mutation, from 0
  std::string kind;
  std::string field;
  std::uint64_t offset = 0;  ///< byte in the file
  std::string before;        ///< hexadecimal
  std::string after;
  bool rehashed = false;
};

struct MutationReport {
  std::uint64_t n = 0;
  MutationTally unhashed;
  MutationTally rehashed;
  std::map<std::string, MutationTally> by_kind;
  std::map<std::string, MutationTally> by_field;  ///< of the rehashed ones
  std::vector<MutationSurvivor> survivors;        ///< those that count, the first kMaxSurvivors
};

inline constexpr std::size_t kMaxSurvivors = 200;

/// One mutation in four leaves the hashes unchanged (bits, truncations, longer files, swapped
/// sections), three have them made true again. Fields of the specification are drawn evenly, then
/// one of their places. The same bytes, count and seed give the same report.
/// bytes: a good bundle, which is left unchanged. Errors: those of BundleView::open();
/// kInvalidInput "mutate.bad" where the bundle is not good to begin with; kIo
/// "mutate.second-reader".
Result<MutationReport> mutate_bundle(std::span<const std::byte> bytes,
                                     const MutateOptions& options);

}  // namespace modar
