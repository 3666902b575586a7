// Runs the second reader as a process.
#include "bake/check/second_reader.hpp"

#include <fstream>

#include "bake/process.hpp"
#include "formats/atomic_file.hpp"

namespace modar {
namespace {

tl::unexpected<Error> trouble(const std::string& reader, const std::string& cause) {
  return fail(ExitCode::kIo, "mutate.second-reader", reader, cause,
              "name scripts/read_bundle.py with --second-reader, and install python3");
}

}  // namespace

Result<std::vector<std::string>> read_scenes(const std::string& reader,
                                             const std::vector<std::span<const std::byte>>& files) {
  const TemporaryFolder folder;
  if (folder.path().empty()) return trouble(reader, "there is no room for temporary files");
  ProcessRequest request;
  request.words = {"python3", reader, "--scenes"};
  for (std::size_t i = 0; i < files.size(); ++i) {
    request.words.push_back(folder.path() + "/" + std::to_string(i) + ".modar");
    if (auto written = write_file(request.words.back(), files[i]); !written) {
      return tl::unexpected(written.error());
    }
  }
  request.output = folder.path() + "/scenes";
  // 3: it refuses a file, which its line tells.
  if (const int code = run_process(request); code != 0 && code != 3) {
    return trouble(reader, "it could not be run, or failed");
  }
  std::vector<std::string> lines;
  std::ifstream text(request.output);
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  if (lines.size() != files.size()) {
    return trouble(reader, "it told of " + std::to_string(lines.size()) + " files, not of " +
                               std::to_string(files.size()));
  }
  return lines;
}

}  // namespace modar
