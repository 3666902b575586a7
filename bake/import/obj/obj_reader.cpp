// Reads OBJ files: blocks are parsed on several threads and joined in file order.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/common.hpp>

#include "bake/import/obj/mtl_reader.hpp"
#include "bake/import/obj/number_parser.hpp"
#include "bake/import/obj/obj_block.hpp"
#include "bake/import/obj/obj_text.hpp"
#include "bake/import/read_model.hpp"
#include "bake/import/source_model.hpp"
#include "bake/import/up_comment.hpp"
#include "formats/base/parallel.hpp"
#include "formats/base/path.hpp"

namespace modar {
namespace {

// Joins blocks into one SourceModel.

constexpr std::uint64_t kMaxElements = 0x3FFFFFFFu;  ///< of each kind, and corners

/// Bytes of a file whose arrays begin as large blocks, which are not copied as they grow.
constexpr std::uint64_t kLargeFile = 4 * kLargeBlock;

class ObjAssembler {
 public:
  /// model: filled; outlives this.
  /// bytes: of the file.
  ObjAssembler(SourceModel& model, std::uint64_t bytes)
      : model_(model), large_(bytes >= kLargeFile) {}

  /// Appends a block; changes it on the way.
  void add(ObjBlock& block);
  /// Totals of the blocks added so far.
  [[nodiscard]] const ObjCounts& counts() const { return counts_; }
  /// Does some corner refer to nothing? Then the file must be parsed again with ObjLimits.
  [[nodiscard]] bool needs_checked_pass() const;
  [[nodiscard]] bool too_large() const;
  /// Reads the materials and turns tallies into diagnostics.
  void finish(const ModelFolder& folder, const std::string& label, const ReadOptions& options);

 private:
  template <class T>
  void append(Array<T>& to, const Scratch<T>& from) {
    if (large_ && from.size() != 0) to.reserve((kLargeBlock + sizeof(T) - 1) / sizeof(T));
    to.append(from.data(), from.size());
  }
  void resolve_relative(ObjBlock& block);
  void add_colours(const ObjBlock& block);
  void add_plane(const ObjBlock& block, const Scratch<std::uint32_t>& indices, IndexPlane& plane);
  void add_faces(ObjBlock& block);
  void apply(const ObjStatement& statement, std::uint64_t face);
  void finish_colours(const std::string& label);

  SourceModel& model_;
  ObjMaterials materials_;
  std::vector<glm::vec3> painted_;
  ObjCounts counts_;
  ObjCounts highest_;
  NoteTallies notes_{};
  std::uint64_t faces_ = 0;
  std::uint64_t lines_ = 0;
  bool large_;
  bool bad_relative_ = false;
};

struct NoteText {
  const char* id;
  DiagnosticSeverity severity;
  const char* message;  ///< follows the count
  const char* cure;
};

/// In the order of ObjNote.
constexpr NoteText kNoteTexts[] = {
    {"obj.not-finite", DiagnosticSeverity::kWarning, "numbers are not finite (nan, inf)",
     "export again; faces that use such a vertex are left out"},
    {"obj.bad-number", DiagnosticSeverity::kWarning, "values are not numbers",
     "export again; readable parts are used, faces with such corners are left out"},
    {"obj.short-vertex", DiagnosticSeverity::kWarning, "vertices have fewer than three coordinates",
     "the missing ones are taken as 0"},
    {"obj.weight", DiagnosticSeverity::kInfo, "vertices have a weight other than 1",
     "weights are ignored: only curves use them"},
    {"obj.lines", DiagnosticSeverity::kInfo, "line elements are skipped", "only faces are baked"},
    {"obj.points", DiagnosticSeverity::kInfo, "point elements are skipped", "only faces are baked"},
    {"obj.free-form", DiagnosticSeverity::kWarning, "statements of curves and surfaces are skipped",
     "convert the model to polygons before export"},
    {"obj.unknown", DiagnosticSeverity::kWarning, "statements have an unknown keyword",
     "remove them if they are not meant as comments"},
    {"obj.short-face", DiagnosticSeverity::kWarning, "faces have fewer than three corners",
     "they are left out"},
    {"obj.zero-index", DiagnosticSeverity::kWarning, "corners have index 0; OBJ counts from 1",
     "their faces are left out; export again"},
    {"obj.index-range", DiagnosticSeverity::kWarning, "corners refer to vertices that do not exist",
     "their faces are left out; is the file cut short?"},
    {"obj.no-position", DiagnosticSeverity::kWarning, "corners have no vertex index",
     "their faces are left out"},
    {"", DiagnosticSeverity::kInfo, "", ""},  // lost faces, which weld() reports
    {"obj.attribute-range", DiagnosticSeverity::kWarning,
     "corners refer to a uv or normal that does not exist", "the attribute is left out"},
};
static_assert(std::size(kNoteTexts) == static_cast<std::size_t>(ObjNote::kCount));

/// How a block's indices of one attribute relate to its position indices, of which there is one at
/// least.
IndexPlane::Kind kind_of(const Scratch<std::uint32_t>& positions,
                         const Scratch<std::uint32_t>& indices) {
  if (indices.size() == 0) return IndexPlane::Kind::kAbsent;
  const std::uint32_t* const all = indices.data();
  const std::size_t count = indices.size();
  const bool absent = all[0] == kNoIndex && std::equal(all + 1, all + count, all);
  if (!absent && !std::equal(all, all + count, positions.data())) return IndexPlane::Kind::kOwn;
  return absent ? IndexPlane::Kind::kAbsent : IndexPlane::Kind::kSame;
}

bool ObjAssembler::needs_checked_pass() const {
  return bad_relative_ || highest_.positions > counts_.positions || highest_.uvs > counts_.uvs ||
         highest_.normals > counts_.normals;
}

bool ObjAssembler::too_large() const {
  return counts_.positions > kMaxElements || counts_.uvs > kMaxElements ||
         counts_.normals > kMaxElements || model_.corner_count() > kMaxElements;
}

void ObjAssembler::add(ObjBlock& block) {
  resolve_relative(block);
  add_colours(block);
  painted_.insert(painted_.end(), block.painted.begin(), block.painted.end());
  add_plane(block, block.corner_uvs, model_.corner_uvs);
  add_plane(block, block.corner_normals, model_.corner_normals);
  add_faces(block);
  append(model_.corner_positions, block.corner_positions);
  append(model_.positions, block.positions);
  append(model_.uvs, block.uvs);
  append(model_.normals, block.normals);
  counts_.positions += block.positions.size();
  counts_.uvs += block.uvs.size();
  counts_.normals += block.normals.size();
  highest_.positions = std::max(highest_.positions, block.highest.positions);
  highest_.uvs = std::max(highest_.uvs, block.highest.uvs);
  highest_.normals = std::max(highest_.normals, block.highest.normals);
  for (std::size_t i = 0; i < notes_.size(); ++i) {
    if (notes_[i].count == 0 && block.notes[i].count != 0) {
      notes_[i].first_line = lines_ + block.notes[i].first_line;
    }
    notes_[i].count += block.notes[i].count;
  }
  lines_ += block.lines;
}

void ObjAssembler::resolve_relative(ObjBlock& block) {
  const std::uint64_t base[3] = {counts_.positions, counts_.uvs, counts_.normals};
  for (const std::uint32_t entry : block.relative) {
    const std::uint32_t component = entry % 3;
    Scratch<std::uint32_t>& plane = component == 0   ? block.corner_positions
                                    : component == 1 ? block.corner_uvs
                                                     : block.corner_normals;
    const std::int64_t value =
        static_cast<std::int64_t>(base[component]) + static_cast<std::int32_t>(plane[entry / 3]);
    if (value < 0) bad_relative_ = true;
    plane[entry / 3] = static_cast<std::uint32_t>(value);
  }
}

void ObjAssembler::add_colours(const ObjBlock& block) {
  if (block.colours.size() == 0 && model_.colours.empty()) return;
  const glm::vec3 none(std::numeric_limits<float>::quiet_NaN());
  model_.colours.append(model_.positions.size() - model_.colours.size(), none);
  append(model_.colours, block.colours);
  model_.colours.append(block.positions.size() - block.colours.size(), none);
}

void ObjAssembler::add_plane(const ObjBlock& block, const Scratch<std::uint32_t>& indices,
                             IndexPlane& plane) {
  if (block.corner_positions.size() == 0) return;
  if (plane.kind != IndexPlane::Kind::kOwn) {
    const IndexPlane::Kind kind = kind_of(block.corner_positions, indices);
    if (model_.corner_count() == 0 && kind != IndexPlane::Kind::kOwn) plane.kind = kind;
    if (plane.kind == kind) return;
    // The rule no longer holds: write out the indices that it replaced.
    if (plane.kind == IndexPlane::Kind::kSame) {
      plane.own = model_.corner_positions;
    } else {
      plane.own.assign(model_.corner_count(), kNoIndex);
    }
    plane.kind = IndexPlane::Kind::kOwn;
  }
  append(plane.own, indices);
  plane.own.append(block.corner_positions.size() - indices.size(), kNoIndex);
}

void ObjAssembler::add_faces(ObjBlock& block) {
  if (faces_ == 0 && model_.material_runs.empty()) {
    model_.material_runs.push_back({0, 0});
    model_.smoothing_runs.push_back({0, kUnstatedSmoothing});
  }
  const std::size_t count = block.face_corners.size();
  const bool triangles = block.corner_positions.size() == 3 * count;  // no face has fewer
  if (!triangles && model_.first_corner.empty()) {
    model_.first_corner.resize(faces_ + 1);
    for (std::size_t f = 0; f <= faces_; ++f) {
      model_.first_corner[f] = static_cast<std::uint32_t>(3 * f);
    }
  }
  if (!model_.first_corner.empty()) {
    std::uint32_t end = model_.first_corner.back();
    for (std::size_t f = 0; f < count; ++f) block.face_corners[f] = end += block.face_corners[f];
    append(model_.first_corner, block.face_corners);
  }
  for (const ObjStatement& s : block.statements) apply(s, faces_ + s.face);
  faces_ += count;
}

void ObjAssembler::apply(const ObjStatement& statement, std::uint64_t face) {
  const auto start_run = [&](std::vector<FaceRun>& runs, std::uint32_t value) {
    if (runs.back().first_face == face) runs.pop_back();
    if (runs.empty() || runs.back().value != value) runs.push_back({face, value});
  };
  switch (statement.kind) {
    case ObjStatement::Kind::kMaterial:
      start_run(model_.material_runs, materials_.use(statement.text, lines_ + statement.line));
      break;
    case ObjStatement::Kind::kSmoothing:
      start_run(model_.smoothing_runs, statement.group);
      break;
    case ObjStatement::Kind::kLibrary:
      materials_.add_library(statement.text, lines_ + statement.line);
      break;
  }
}

/// Vertices without a colour among coloured ones are white; colours of 0 to 255 become 0 to 1.
void ObjAssembler::finish_colours(const std::string& label) {
  if (model_.colours.empty() && painted_.size() == model_.positions.size()) {
    model_.colours.append(painted_.data(), painted_.size());
  } else if (!painted_.empty()) {
    model_.diagnostics.push_back({"obj.painted", DiagnosticSeverity::kWarning, label, 0,
                                  std::to_string(painted_.size()) +
                                      " colours in #MRGB comments do not belong to " +
                                      std::to_string(model_.positions.size()) + " vertices",
                                  "they are left out; export again"});
  }
  std::uint64_t missing = 0;
  glm::vec3 least(0.0f);
  glm::vec3 most(0.0f);
  for (const glm::vec3& c : model_.colours) {
    missing += std::isnan(c.x) ? 1u : 0u;
    least = glm::min(least, c);  // a missing one is not a number, and changes neither
    most = glm::max(most, c);
  }
  const float greatest = std::max({most.x, most.y, most.z});
  const bool bytes = greatest > 2.0f && greatest <= 255.0f;
  if (missing != 0 || greatest > 1.0f || std::min({least.x, least.y, least.z}) < 0.0f) {
    for (glm::vec3& c : model_.colours) {
      c = std::isnan(c.x) ? glm::vec3(1.0f) : (bytes ? c / 255.0f : c);
      c = glm::clamp(c, 0.0f, 1.0f);
    }
  }
  if (missing != 0) {
    model_.diagnostics.push_back(
        {"obj.partial-colours", DiagnosticSeverity::kInfo, label, 0,
         std::to_string(missing) + " vertices have no colour while others do", "they are white"});
  }
  if (bytes) {
    model_.diagnostics.push_back({"obj.byte-colours", DiagnosticSeverity::kInfo, label, 0,
                                  "vertex colours exceed 1", "they are taken as 0 to 255"});
  }
}

void ObjAssembler::finish(const ModelFolder& folder, const std::string& label,
                          const ReadOptions& options) {
  finish_colours(label);
  for (std::size_t i = 0; i < notes_.size(); ++i) {
    if (i == static_cast<std::size_t>(ObjNote::kLostFace)) model_.lost_faces = notes_[i].count;
    if (notes_[i].count == 0 || *kNoteTexts[i].id == '\0') continue;
    const NoteText& text = kNoteTexts[i];
    model_.diagnostics.push_back({text.id, text.severity, label, notes_[i].first_line,
                                  std::to_string(notes_[i].count) + " " + text.message, text.cure});
  }
  materials_.resolve(folder, label, options.own_picture, model_);
}

// The threads. Blocks are cut at fixed places, so the result does not depend on the number of
// threads.

/// Hands out blocks in order and joins them in the same order.
class BlockQueue {
 public:
  explicit BlockQueue(std::uint64_t count) : count_(count) {}

  /// The next block to parse; nothing when all are taken or one has failed.
  std::optional<std::uint64_t> next() {
    const std::lock_guard lock(mutex_);
    if (failed_ || next_ >= count_) return std::nullopt;
    return next_++;
  }
  /// Waits for the turn of block `index`, runs `join` and passes the turn on. Returns false if a
  /// block has failed meanwhile.
  template <class Join>
  bool in_turn(std::uint64_t index, const Join& join) {
    std::unique_lock lock(mutex_);
    turn_.wait(lock, [&] { return failed_ || joined_ == index; });
    if (failed_) return false;
    const bool good = join();
    ++joined_;
    failed_ = !good;
    turn_.notify_all();
    return good;
  }

 private:
  std::mutex mutex_;
  std::condition_variable turn_;
  std::uint64_t count_;
  std::uint64_t next_ = 0;
  std::uint64_t joined_ = 0;
  bool failed_ = false;
};

/// Offset of the first statement, after a UTF-8 byte order mark.
std::uint64_t text_start(const ByteSource& source) {
  char head[3];
  return source.read(0, 3, head) == 3 && std::memcmp(head, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
}

Result<void> to_result(LoadResult worst, const std::string& label) {
  if (worst == LoadResult::kFailed) {
    return fail(ExitCode::kIo, "io.read", label, "the file cannot be read",
                "check the disk and the file's permissions");
  }
  if (worst == LoadResult::kTooLarge) {
    return fail(ExitCode::kInvalidInput, "obj.too-large", label,
                "the file has more than 1,073,741,823 vertices or corners, or a line of more than "
                "64 MiB",
                "split the model into several files");
  }
  return {};
}

Result<void> read_obj_blocks(const ByteSource& source, const std::string& label, unsigned jobs,
                             const ObjCounts* totals, ObjAssembler& assembler) {
  const BlockLoader loader(source, text_start(source));
  BlockQueue queue(loader.count());
  LoadResult worst = LoadResult::kLoaded;  // guarded by the queue's turn
  const auto work = [&] {
    ObjBlock block;
    BlockText loading;
    while (const auto index = queue.next()) {
      const LoadResult loaded = loader.load(*index, loading);
      ObjLimits limits;
      if (totals != nullptr) limits = {assembler.counts(), *totals};
      if (loaded == LoadResult::kLoaded) {
        parse_obj_block(loading.text.data(), loading.text.size(),
                        totals != nullptr ? &limits : nullptr, block);
        if (loading.unfinished) --block.lines;
      }
      const bool good = queue.in_turn(*index, [&] {
        if (loaded == LoadResult::kEmpty) return true;
        worst = loaded;
        if (loaded != LoadResult::kLoaded) return false;
        assembler.add(block);
        if (assembler.too_large()) worst = LoadResult::kTooLarge;
        return worst == LoadResult::kLoaded;
      });
      if (!good) return;
    }
  };
  const std::uint64_t useful = std::min<std::uint64_t>(loader.count(), 64);
  const unsigned threads = totals != nullptr ? 1u : std::min(jobs, static_cast<unsigned>(useful));
  run_on_threads(threads, work);
  return to_result(worst, label);
}

bool is_utf16(std::string_view head) {
  if (head.size() < 4) return false;
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(head[i]); };
  if ((byte(0) == 0xFE && byte(1) == 0xFF) || (byte(0) == 0xFF && byte(1) == 0xFE)) return true;
  return (byte(0) == 0 && byte(1) != 0 && byte(2) == 0 && byte(3) != 0) ||
         (byte(0) != 0 && byte(1) == 0 && byte(2) != 0 && byte(3) == 0);
}

/// Refuses zeros where a text should be, which a copy that broke off leaves: at the start, and at
/// places of a large file, before gigabytes of them are read. Errors: "obj.not-text".
Result<void> require_text(const ByteSource& source, const std::string& label) {
  constexpr std::uint64_t kLooks = 16;
  constexpr std::uint64_t kLarge = 1u << 20;  // bytes
  constexpr std::array<char, 64> kZeros{};
  std::array<char, 64> bytes;
  for (std::uint64_t i = 0; i <= (source.size() < kLarge ? 0 : kLooks); ++i) {
    const std::uint64_t at =
        (source.size() - std::min<std::uint64_t>(source.size(), bytes.size())) / kLooks * i;
    const std::int64_t got = source.read(at, bytes.size(), bytes.data());
    const std::size_t looked = i == 0 ? 1 : bytes.size();
    const bool zeros = got >= static_cast<std::int64_t>(looked) &&
                       std::memcmp(bytes.data(), kZeros.data(), looked) == 0;
    if (zeros) {
      return fail(ExitCode::kInvalidInput, "obj.not-text", label,
                  "it has zeros at byte " + std::to_string(at + 1) +
                      ": not a text file, or an incomplete copy",
                  "copy or export it again");
    }
  }
  return {};
}

/// Releases the unused capacity of arrays that grew in steps.
void shrink_arrays(SourceModel& model) {
  model.positions.shrink();
  model.colours.shrink();
  model.uvs.shrink();
  model.normals.shrink();
  model.corner_positions.shrink();
  model.corner_uvs.own.shrink();
  model.corner_normals.own.shrink();
  model.first_corner.shrink();
}

/// One pass over the text. totals: as in read_obj_blocks(). Returns the counts where some corner
/// refers to nothing, so that a checked pass has to follow; otherwise nothing.
Result<std::optional<ObjCounts>> parse_once(const ByteSource& source, const ModelFolder& folder,
                                            const std::string& label, const ReadOptions& options,
                                            const ObjCounts* totals, SourceModel& model) {
  ObjAssembler assembler(model, source.size());
  MODAR_TRY(read_obj_blocks(source, label, options.jobs, totals, assembler));
  if (totals == nullptr && assembler.needs_checked_pass()) return assembler.counts();
  assembler.finish(folder, label, options);
  return std::nullopt;
}

/// ": " and what faces are lost by; empty where no note says it.
std::string loss_of(const SourceModel& model) {
  for (const Diagnostic& note : model.diagnostics) {
    for (const char* id : {"obj.index-range", "obj.zero-index", "obj.no-position", "obj.short-face",
                           "obj.bad-number", "obj.not-finite"}) {
      if (note.id == id) return ": " + note.message;
    }
  }
  return {};
}

Result<SourceModel> parse_source(const ByteSource& source, const ModelFolder& folder,
                                 const std::string& stem, const std::string& label,
                                 const ReadOptions& options) {
  char bytes[4096];
  const std::int64_t got = source.read(0, sizeof bytes, bytes);
  const std::string_view head(bytes, got > 0 ? static_cast<std::size_t>(got) : 0);
  if (is_utf16(head.substr(0, 4))) {
    return fail(ExitCode::kInvalidInput, "obj.utf16", label, "the file is UTF-16 text",
                "save it as UTF-8 (or plain ASCII) and bake again");
  }
  MODAR_TRY(require_text(source, label));
  SourceModel model;
  model.name = stem;
  MODAR_ASSIGN(const std::optional<ObjCounts> bad,
               parse_once(source, folder, label, options, nullptr, model));
  if (bad) {
    model = SourceModel();
    model.name = stem;
    MODAR_TRY(parse_once(source, folder, label, {1, options.own_picture}, &*bad, model));
  }
  if (model.face_count() == 0 && model.lost_faces > 0) {
    return fail(
        ExitCode::kInvalidInput, "obj.no-faces", label,
        "none of its " + std::to_string(model.lost_faces) + " faces can be used" + loss_of(model),
        "export the model again");
  }
  if (model.face_count() == 0) {
    return fail(
        ExitCode::kInvalidInput, "obj.no-faces", label,
        "the file has " + std::to_string(model.positions.size()) + " vertices but no usable face",
        "export the model as polygons (point clouds must be meshed first)");
  }
  if (const auto up = up_in_comments(head)) model.up = {*up, UpReason::kHeader};
  shrink_arrays(model);
  return model;
}

}  // namespace

bool is_broken_off(const std::string& path) {
  if (!path.ends_with(".obj") && !path.ends_with(".OBJ")) return false;
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  struct stat status {};
  const bool regular =
      descriptor >= 0 && ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
  const ByteSource source(descriptor, static_cast<std::uint64_t>(status.st_size));
  const bool broken = regular && !require_text(source, path);
  if (descriptor >= 0) ::close(descriptor);
  return broken;
}

Result<SourceModel> read_obj(const std::string& path, const ReadOptions& options) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  struct stat status {};
  if (descriptor < 0 || ::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
    const std::string cause = descriptor < 0 ? std::strerror(errno) : "this is not a regular file";
    if (descriptor >= 0) ::close(descriptor);
    return fail(ExitCode::kIo, "io.open", path, cause, "check the path and its permissions");
  }
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  auto result = parse_source(ByteSource(descriptor, static_cast<std::uint64_t>(status.st_size)),
                             {folder, options.within}, file_stem(path), path, options);
  struct stat now {};
  const bool same = ::fstat(descriptor, &now) == 0 && now.st_size == status.st_size &&
                    now.st_mtim.tv_sec == status.st_mtim.tv_sec &&
                    now.st_mtim.tv_nsec == status.st_mtim.tv_nsec;
  ::close(descriptor);
  if (same) return result;
  return fail(ExitCode::kIo, "io.changed", path, "the file was changed while it was read",
              "try again when nothing writes to it");
}

Result<SourceModel> parse_obj(std::string_view text, const ModelFolder& folder,
                              const std::string& label, const ReadOptions& options) {
  return parse_source(ByteSource(text), folder, file_stem(label), label, options);
}

}  // namespace modar
