// What commands do before they work: see that what they will write can be written, and destroys
// nothing that they read; and folders of files that are written whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/base/leftover.hpp"

namespace modar {

class BundleView;

/// Makes the folder and those above it where they are missing. Errors: kIo "io.folder".
Result<void> make_output_folder(const std::string& folder);

/// Refuses a folder that holds files and no mark of an earlier run: somebody may have named a web
/// server's root. Errors: kUsage "out.foreign-folder".
Result<void> keep_foreign_folder(const std::string& folder, const std::string& cure);

/// A folder of files that are written together: all of them, or none where one fails.
class OutputFolder {
 public:
  /// Makes the folder where it is missing. Errors: those of keep_foreign_folder() unless `force` is
  /// set; kIo "io.folder".
  static Result<OutputFolder> claim(const std::string& folder, bool force);
  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&&) = delete;
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;
  /// Without commit(), written files are removed, and the folder if claim() made it.
  ~OutputFolder();

  /// name: a path within the folder. Errors: kIo "io.folder", "io.write".
  Result<void> write(const std::string& name, std::span<const std::byte> bytes);
  /// Puts the files in their places, in the order of their writing. Errors: kIo "io.commit".
  Result<void> commit();
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }

 private:
  OutputFolder(std::string folder, bool made);
  std::string folder_;
  std::string staging_;  ///< a folder within it; empty: nothing is to be done any more
  bool made_ = false;
  bool marked_ = false;  ///< claim() has written the mark into the folder
  std::vector<std::string> names_;
  std::vector<Leftover> leftovers_;
};

/// Refuses an output that is one of the inputs: by its path, a symbolic link or a hard link.
/// Errors: kUsage "out.input".
Result<void> keep_inputs(const std::string& output, const std::vector<std::string>& inputs);

/// Refuses to write over a file of another kind than the output will be. is_ours: judges the first
/// 4 KiB of an existing file; a missing, empty or special file is written to. kind: "a
/// page of modar report". Errors: kUsage "out.foreign".
Result<void> keep_other_kinds(const std::string& output, const std::string& kind,
                              const std::function<bool(std::string_view)>& is_ours);

/// Tries the folder of a file that will be written: it can be written, and `bytes` are free there.
/// Leaves nothing behind. Errors: kIo "io.folder", "io.space".
Result<void> try_output(const std::string& path, std::uint64_t bytes);

/// Bytes of those of the files that are there.
std::uint64_t file_bytes(const std::vector<std::string>& paths);

/// A bundle as pages, apps and releases get it: without keypoints of the ModAR paper's method (see
/// trim()), unless its bake named `parameters`. Empty: nothing is left out. Errors: those of
/// encode_bundle().
Result<std::vector<std::byte>> trim_to_publish(const BundleView& bundle);

}  // namespace modar
