// Publishes releases, and estimates what an update costs before it is published.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bake/report.hpp"
#include "bake/ship/keys/keys.hpp"
#include "bake/ship/recipe_maker.hpp"
#include "modar/release.hpp"

namespace modar {

struct PublishRequest {
  std::vector<std::string> bundles;  ///< files; their names without extension name the bundles
  std::vector<std::string> drop;     ///< names of bundles that leave the release
  bool dry_run = false;              ///< writes nothing
  bool force = false;                ///< into a folder of other files, too
  std::string folder;
  std::uint64_t version = 0;  ///< 0: one more than the newest
  std::int64_t expires = 0;   ///< seconds since 1970, UTC; kNever
  std::optional<std::uint64_t>
      fresh_days;  ///< 0: no freshness; nothing: as the newest release has it
  std::map<std::string, std::vector<std::string>> devices;  ///< by bundle name; none: for all
  RecipeOptions recipe;
};

/// What a release does to a bundle of the one before it.
struct BundleChange {
  enum class Kind { kAdded, kChanged, kKept, kDropped };
  Kind kind = Kind::kKept;
  std::string name;
};
const char* to_string(BundleChange::Kind kind);

struct PublishReport {
  Release release;
  std::vector<BundleChange> changes;  ///< by name
  std::uint64_t added_bytes = 0;      ///< of objects that were not in the folder
  std::map<PieceForm, FormTotals> forms;
};

/// A release is the whole set: bundles that the request does not name are kept from the newest.
/// Validates each bundle, writes its pieces, then the signed document, then `latest`: the release
/// before stays valid at every moment.
/// Errors: kInvalidInput "ship.bad-bundle"; kUsage "ship.name", "ship.version", "ship.key",
/// "ship.drop"; kIo, "ship.damaged" (an object of a kept bundle); kExitLocked.
Result<PublishReport> publish(const PublishRequest& request, const SecretKey& key, Report& report);

/// A network as planning sees it.
struct Link {
  const char* name;
  double bits_per_second;
  double round_trip_s;
  const char* source;
};
std::span<const Link> links();
const Link* find_link(std::string_view name);

/// Instructions of modar-fetch per installed byte of geometry, counted by callgrind on x86-64. ARM
/// is assumed to need as many.
inline constexpr double kGeometryInstructions = 353;
inline constexpr double kOtherInstructions = 47;

struct UpdatePlan {
  std::uint64_t full_bytes = 0;    ///< for a device that has nothing
  std::uint64_t update_bytes = 0;  ///< for one that has the old bundle: document, recipe, pieces
  std::uint32_t update_pieces = 0;
  double transfer_s = 0;
  std::uint64_t geometry_bytes = 0;  ///< of the new bundle: meshes and coarser levels
  std::uint64_t other_bytes = 0;     ///< of the new bundle: textures, patterns, tables
  double install_s = 0;              ///< decoding, writing, checking, on the device
  std::uint64_t storage_bytes = 0;   ///< free space that installing needs
};

/// Errors: as make_recipe().
Result<UpdatePlan> plan_update(const std::string& old_bundle, const std::string& new_bundle,
                               const Link& link, const RecipeOptions& options);

}  // namespace modar
