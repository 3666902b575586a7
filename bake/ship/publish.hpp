// Publishes releases, and estimates what an update costs before it is published.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bake/report.hpp"
#include "bake/ship/keys.hpp"
#include "bake/ship/recipe_maker.hpp"
#include "modar/device_profile.hpp"
#include "modar/release.hpp"

namespace modar {

struct PublishRequest {
  std::vector<std::string> bundles;  ///< files; their names without extension name the bundles
  std::string folder;
  std::uint64_t version = 0;                                ///< 0: one more than the newest
  std::int64_t expires = 0;                                 ///< seconds since 1970, UTC
  std::map<std::string, std::vector<std::string>> devices;  ///< by bundle name; none: for all
  RecipeOptions recipe;
};

struct PublishReport {
  Release release;
  std::uint64_t added_bytes = 0;  ///< of objects that were not in the folder
  std::map<PieceForm, FormTotals> forms;
};

/// Validates each bundle, writes its pieces, then the signed document, then `latest`: the release
/// before stays valid at every moment.
/// Errors: kInvalidInput "ship.bad-bundle", "ship.name"; kUsage "ship.version"; kIo; kExitLocked.
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

struct UpdatePlan {
  std::uint64_t full_bytes = 0;    ///< for a device that has nothing
  std::uint64_t update_bytes = 0;  ///< for one that has the old bundle: document, recipe, pieces
  std::uint32_t update_pieces = 0;
  double transfer_s = 0;
  double install_s = 0;             ///< decoding, writing, checking, on the device
  std::uint64_t storage_bytes = 0;  ///< free space that installing needs
};

/// Errors: as make_recipe().
Result<UpdatePlan> plan_update(const std::string& old_bundle, const std::string& new_bundle,
                               const Link& link, const DeviceProfile* device,
                               const RecipeOptions& options);

}  // namespace modar
