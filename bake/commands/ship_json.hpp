// The --json documents of `modar ship`. The keys are a contract (json.md).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bake/ship/publish.hpp"
#include "bake/ship/verify_release.hpp"

namespace modar {

std::string publish_json(const PublishReport& report);
struct ListedRelease {
  Release release;
  std::int64_t published = 0;  ///< seconds since 1970, UTC
  bool current = false;        ///< the one that `latest` names
};
std::string list_json(const std::vector<ListedRelease>& releases);
std::string prune_json(std::uint64_t freed_bytes, const std::vector<std::uint64_t>& releases);
std::string verify_json(const VerifyReport& report);
std::string plan_json(const UpdatePlan& plan, const Link& link, const std::string& device,
                      double minutes);

}  // namespace modar
