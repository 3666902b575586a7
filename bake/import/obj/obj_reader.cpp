// Reads OBJ files: opens, refuses what is no OBJ text, parses fast and, where that fails,
// carefully.
#include "bake/import/obj/obj_reader.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>

#include "bake/import/obj/obj_assembler.hpp"
#include "bake/import/obj/obj_blocks.hpp"

namespace modar {
namespace {

bool is_utf16(std::string_view head) {
  if (head.size() < 4) return false;
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(head[i]); };
  if ((byte(0) == 0xFE && byte(1) == 0xFF) || (byte(0) == 0xFF && byte(1) == 0xFE)) return true;
  return (byte(0) == 0 && byte(1) != 0 && byte(2) == 0 && byte(3) != 0) ||
         (byte(0) != 0 && byte(1) == 0 && byte(2) != 0 && byte(3) == 0);
}

/// Shrinks what grew in steps.
void give_spare_back(SourceModel& model) {
  model.positions.shrink();
  model.colours.shrink();
  model.uvs.shrink();
  model.normals.shrink();
  model.corner_positions.shrink();
  model.corner_uvs.own.shrink();
  model.corner_normals.own.shrink();
  model.first_corner.shrink();
}

/// One pass over the text. totals: as in read_obj_blocks(). Answers the counts where some corner
/// refers to nothing, so that a careful pass has to follow; nothing where all is well.
Result<std::optional<ObjCounts>> parse_once(const ByteSource& source, const std::string& folder,
                                            const std::string& label, unsigned jobs,
                                            const ObjCounts* totals, SourceModel& model) {
  ObjAssembler assembler(model);
  if (auto done = read_obj_blocks(source, label, jobs, totals, assembler); !done) {
    return tl::unexpected(done.error());
  }
  if (totals == nullptr && assembler.needs_careful_pass()) return assembler.counts();
  assembler.finish(folder, label);
  return std::nullopt;
}

Result<SourceModel> parse_source(const ByteSource& source, const std::string& folder,
                                 const std::string& stem, const std::string& label,
                                 const ReadOptions& options) {
  char head[4];
  const std::int64_t got = source.read(0, sizeof head, head);
  if (got > 0 && is_utf16({head, static_cast<std::size_t>(got)})) {
    return fail(ExitCode::kInvalidInput, "obj.utf16", label, "the file is UTF-16 text",
                "save it as UTF-8 (or plain ASCII) and bake again");
  }
  SourceModel model;
  model.name = stem;
  const auto bad = parse_once(source, folder, label, options.jobs, nullptr, model);
  if (!bad) return tl::unexpected(bad.error());
  if (bad->has_value()) {
    model = SourceModel();
    model.name = stem;
    const ObjCounts totals = **bad;
    if (const auto again = parse_once(source, folder, label, 1, &totals, model); !again) {
      return tl::unexpected(again.error());
    }
  }
  if (model.face_count() == 0) {
    return fail(ExitCode::kInvalidInput, "obj.no-faces", label,
                "the file has " + std::to_string(model.positions.size()) +
                    " vertices and no face that can be kept",
                "export the model as polygons (point clouds must be meshed first)");
  }
  give_spare_back(model);
  return model;
}

std::string stem_of(const std::string& path) {
  std::string name = path.substr(path.rfind('/') + 1);
  const std::size_t dot = name.rfind('.');
  if (dot != std::string::npos && dot > 0) name.resize(dot);
  return name;
}

}  // namespace

Result<SourceModel> read_obj(const std::string& path, const ReadOptions& options) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (descriptor < 0 || ::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    const std::string cause = descriptor < 0 ? std::strerror(errno) : "this is no regular file";
    if (descriptor >= 0) ::close(descriptor);
    return fail(ExitCode::kIo, "io.open", path, cause, "check the path and its permissions");
  }
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  auto result = parse_source(ByteSource(descriptor, static_cast<std::uint64_t>(status.st_size)),
                             folder, stem_of(path), path, options);
  ::close(descriptor);
  return result;
}

Result<SourceModel> parse_obj(std::string_view text, const std::string& folder,
                              const std::string& label, const ReadOptions& options) {
  return parse_source(ByteSource(text), folder, stem_of(label), label, options);
}

}  // namespace modar
