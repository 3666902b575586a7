// A page on this machine from which a project is made, baked and shipped: the door of
// bake/extensions/studio.
#pragma once

#include <functional>
#include <string>

#include "formats/base/error.hpp"

namespace modar {

struct StudioOptions {
  std::string folder;        ///< of the project, made if absent
  int port = 0;              ///< on 127.0.0.1; 0: any that is free
  std::string tool_version;  ///< as the commands state it in bundles
};

/// Where a studio answers.
struct StudioAddress {
  std::string page;     ///< with its secret: whoever has it may do what the page does
  std::string opening;  ///< leads to the page once; other users may see it in a browser's arguments
  bool elsewhere = false;  ///< another process serves this folder already: this one has ended
};

/// Serves the page until SIGINT, SIGTERM or the page ends it; what runs is ended with it. Binds
/// 127.0.0.1 alone, answers to its own address and pages only, and reads and writes nothing outside
/// the folder. ready: called with the address once it answers. One studio serves a folder.
/// Errors: kUsage "studio.folder"; kIo "io.folder", "studio.port", "studio.locked"; kUnsupported
/// "studio.page".
Result<void> run_studio(const StudioOptions& options,
                        const std::function<void(const StudioAddress&)>& ready);

}  // namespace modar
