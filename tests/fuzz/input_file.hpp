// Fuzzed bytes as a file, for readers that take a path.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace modar::test {

/// One file in a folder of its own, written anew for each input, removed at the end.
class InputFile {
 public:
  explicit InputFile(const char* name) {
    const char* base = std::getenv("TMPDIR");
    folder_ = std::string(base != nullptr ? base : "/tmp") + "/modar-fuzz-XXXXXX";
    if (mkdtemp(folder_.data()) == nullptr) std::abort();
    path_ = folder_ + "/" + name;
  }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile() {
    std::error_code left;
    std::filesystem::remove_all(folder_, left);  // and what readers made next to the file
  }

  /// The folder of its own.
  [[nodiscard]] const std::string& folder() const { return folder_; }

  const std::string& write(const std::uint8_t* data, std::size_t size) {
    std::FILE* file = std::fopen(path_.c_str(), "wb");
    // Nothing at all comes as a null pointer.
    const bool written = file != nullptr && (size == 0 || std::fwrite(data, 1, size, file) == size);
    if (!written || std::fclose(file) != 0) {
      std::abort();
    }
    return path_;
  }

 private:
  std::string folder_;
  std::string path_;
};

}  // namespace modar::test
