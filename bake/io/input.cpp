// A whole file, as far as its reader allows.
#include "bake/io/input.hpp"

#include <cstdio>
#include <memory>

namespace modar {

Result<std::string> read_file(const std::string& path, std::size_t most) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(
      is_regular_file(path) ? std::fopen(path.c_str(), "rb") : nullptr, &std::fclose);
  const auto unreadable = [&path] {
    return fail(ExitCode::kIo, "io.open", path, "the file cannot be opened or read",
                "check its name and permissions");
  };
  if (std::error_code error; !file && std::filesystem::is_directory(path, error)) {
    return fail(ExitCode::kIo, "io.open", path, "it is a folder", "name a file in it");
  }
  if (!file) return unreadable();
  std::string bytes;
  char part[65536];
  while (const std::size_t count = std::fread(part, 1, sizeof part, file.get())) {
    if (count > most - bytes.size()) {
      return fail(ExitCode::kInvalidInput, "io.too-large", path,
                  "the file is larger than " + std::to_string(most) + " bytes", "make it smaller");
    }
    bytes.append(part, count);
  }
  if (std::ferror(file.get()) != 0) return unreadable();
  return bytes;
}

}  // namespace modar
