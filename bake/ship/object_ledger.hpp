// Which objects of a release folder hold what their names say, without reading each again.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "formats/base/error.hpp"
#include "formats/transport/recipe.hpp"

namespace modar {

/// It is in the folder as `.objects`: an object a line with its size, time and inode when it was
/// last read. Rot that leaves all three is found by verify_release() alone.
class ObjectLedger {
 public:
  /// What an earlier run has noted; nothing where the file is missing or of another form.
  explicit ObjectLedger(const std::string& folder);

  /// Whether the object's file is there and hashes to its name. Reads the file, unless its size,
  /// time and inode are those that were noted.
  bool holds(const ObjectId& id);

  /// Notes the objects queried by holds(), and no others. Errors: kIo.
  [[nodiscard]] Result<void> save() const;

 private:
  struct Look {
    std::uint64_t size = 0;
    std::int64_t time = 0;  ///< of the last change of bytes or inode, nanoseconds
    std::uint64_t inode = 0;
    bool operator==(const Look&) const = default;
  };

  std::string folder_;
  std::map<std::string, Look> known_;  ///< by the name of the object
  std::map<std::string, Look> seen_;   ///< in this run, and old enough to be noted
};

}  // namespace modar
