// --live: the bundle's file, opened again whenever another one replaced it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "formats/bundle_view.hpp"
#include "modar/mapped_file.hpp"
#include "spot_pattern.hpp"

namespace modar {

/// view points into file: neither copied nor moved.
struct LiveBundle {
  MappedFile file;
  BundleView view;
};
using LiveSlot = Slot<LiveBundle>;

/// Looks at a file now and then.
class BundleWatch {
 public:
  explicit BundleWatch(std::string path);

  /// The file, where another version of it is there and was not answered yet; null where not, or it
  /// is looked at too soon. Errors: those of MappedFile and BundleView, once for each version.
  Result<std::shared_ptr<const LiveBundle>> look();

 private:
  std::string path_;
  std::string state_;  ///< inode, size and time of the last file
  std::int64_t next_ns_ = 0;
};

}  // namespace modar
