// Device profiles of a user's own: files like those of assets/devices/, read when a check runs.
#pragma once

#include <string>
#include <string_view>

#include "formats/base/error.hpp"
#include "modar/device_profile.hpp"

namespace modar {

/// A profile with the texts that it points into: it stays where it was made.
struct DeviceFile {
  DeviceFile() = default;
  DeviceFile(const DeviceFile&) = delete;
  DeviceFile& operator=(const DeviceFile&) = delete;

  std::string name;
  std::string title;
  std::string extensions;
  DeviceProfile profile{};
};

/// Reads the JSON of a profile: every key of assets/devices/*.json, each number from 1 to 2^20.
/// where: its file, for messages.
/// Errors: kInvalidInput "device.file".
Result<void> parse_device_profile(std::string_view json, const std::string& where,
                                  DeviceFile& file);

/// The profile that `--device` names: one that is compiled in, or a file where the word ends in
/// ".json", which is read into `file`. nullptr where the word is empty.
/// Errors: kUsage "device.unknown"; those of parse_device_profile() and of opening the file.
Result<const DeviceProfile*> choose_device(const std::string& word, DeviceFile& file);

}  // namespace modar
