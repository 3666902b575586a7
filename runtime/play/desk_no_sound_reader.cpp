// Where FFmpeg's libraries are missing at build time.
#include "desk_sound_reader.hpp"

namespace modar {

Result<std::unique_ptr<SoundReader>> open_sound(std::span<const std::byte> /*file*/,
                                                const std::string& name) {
  return fail(ExitCode::kUnsupported, "sound.unsupported", name,
              "this build of the player has no decoder for sounds",
              "build it with FFmpeg's libraries (Debian: libavformat-dev, libavcodec-dev)");
}

}  // namespace modar
