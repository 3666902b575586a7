// Reads OBJ files block by block and joins the blocks into one SourceModel.
#include "bake/model/obj_reader.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <glm/common.hpp>

#include "bake/model/number_parser.hpp"
#include "bake/model/obj_block.hpp"
#include "bake/model/obj_materials.hpp"

namespace modar {
namespace {

constexpr std::uint64_t kMaxElements = 0x3FFFFFFFu;  ///< of each kind, and faces
constexpr std::uint64_t kMaxStatement = 1ull << 30;  ///< bytes

struct NoteText {
  const char* id;
  FindingSeverity severity;
  const char* message;  ///< follows the count
  const char* cure;
};

/// In the order of ObjNote.
constexpr NoteText kNoteTexts[] = {
    {"obj.not-finite", FindingSeverity::kWarning, "numbers are not finite (nan, inf)",
     "export again; faces that use such a vertex are left out"},
    {"obj.bad-number", FindingSeverity::kWarning, "words are not the number they should be",
     "export again; what could be read of them is used, faces with such corners are left out"},
    {"obj.short-vertex", FindingSeverity::kWarning, "vertices have fewer than three coordinates",
     "the missing ones are taken as 0"},
    {"obj.weight", FindingSeverity::kInfo, "vertices have a weight other than 1",
     "weights are ignored: only curves use them"},
    {"obj.lines", FindingSeverity::kInfo, "line elements are skipped", "only faces are baked"},
    {"obj.points", FindingSeverity::kInfo, "point elements are skipped", "only faces are baked"},
    {"obj.free-form", FindingSeverity::kWarning, "statements of curves and surfaces are skipped",
     "convert the model to polygons before export"},
    {"obj.unknown", FindingSeverity::kWarning, "statements have an unknown keyword",
     "remove them if they are not meant as comments"},
    {"obj.short-face", FindingSeverity::kWarning, "faces have fewer than three corners",
     "they are left out"},
    {"obj.zero-index", FindingSeverity::kWarning, "corners have index 0; OBJ counts from 1",
     "their faces are left out; export again"},
    {"obj.index-range", FindingSeverity::kWarning, "corners refer to vertices that do not exist",
     "their faces are left out; is the file cut short?"},
    {"obj.no-position", FindingSeverity::kWarning, "corners have no vertex index",
     "their faces are left out"},
    {"obj.attribute-range", FindingSeverity::kWarning,
     "corners refer to a uv or normal that does not exist", "the attribute is left out"},
};
static_assert(std::size(kNoteTexts) == static_cast<std::size_t>(ObjNote::kCount));

/// Bytes by offset, from a file or from memory. A file that shrinks while it is read gives fewer
/// bytes, where a mapped one would end the program.
class ByteSource {
 public:
  explicit ByteSource(std::string_view text) : text_(text), size_(text.size()) {}
  ByteSource(int descriptor, std::uint64_t size) : descriptor_(descriptor), size_(size) {}

  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// Appends up to `count` bytes from `offset` to `out`; answers false where reading failed.
  bool read(std::uint64_t offset, std::size_t count, std::string& out) const {
    count =
        static_cast<std::size_t>(std::min<std::uint64_t>(count, size_ - std::min(size_, offset)));
    if (descriptor_ < 0) {
      out.append(text_.substr(static_cast<std::size_t>(offset), count));
      return true;
    }
    const std::size_t start = out.size();
    out.resize(start + count);
    std::size_t done = 0;
    while (done < count) {
      const ssize_t n = ::pread(descriptor_, out.data() + start + done, count - done,
                                static_cast<off_t>(offset + done));
      if (n < 0) return false;
      if (n == 0) break;
      done += static_cast<std::size_t>(n);
    }
    out.resize(start + done);
    return true;
  }

 private:
  std::string_view text_;
  int descriptor_ = -1;
  std::uint64_t size_;
};

/// Joins parsed blocks, in file order, into the model.
class Assembler {
 public:
  explicit Assembler(SourceModel& model) : model_(model) {}

  [[nodiscard]] const ObjCounts& counts() const { return counts_; }
  [[nodiscard]] bool needs_careful_pass() const {
    return bad_relative_ || highest_.positions > counts_.positions || highest_.uvs > counts_.uvs ||
           highest_.normals > counts_.normals;
  }
  [[nodiscard]] bool too_large() const {
    return counts_.positions > kMaxElements || counts_.uvs > kMaxElements ||
           counts_.normals > kMaxElements || model_.corners.size() > kMaxElements;
  }

  void add(ObjBlock& block) {
    resolve_relative(block);
    add_colours(block);
    append(model_.positions, block.positions);
    append(model_.uvs, block.uvs);
    append(model_.normals, block.normals);
    append(model_.corners, block.corners);
    add_faces(block);
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

  void finish(const std::string& folder, const std::string& label) {
    if (model_.first_corner.empty()) model_.first_corner.push_back(0);
    finish_colours(label);
    for (std::size_t i = 0; i < notes_.size(); ++i) {
      if (notes_[i].count == 0) continue;
      const NoteText& text = kNoteTexts[i];
      model_.findings.push_back({text.id, text.severity, label, notes_[i].first_line,
                                 std::to_string(notes_[i].count) + " " + text.message, text.cure});
    }
    model_.materials = materials_.resolve(folder, model_.name, label, model_.findings);
  }

 private:
  template <class T>
  static void append(std::vector<T>& to, const Scratch<T>& from) {
    to.insert(to.end(), from.data(), from.data() + from.size());
  }

  void resolve_relative(ObjBlock& block) {
    const std::uint64_t base[3] = {counts_.positions, counts_.uvs, counts_.normals};
    for (const std::uint32_t entry : block.relative) {
      Corner& corner = block.corners[entry / 3];
      const std::uint32_t component = entry % 3;
      std::uint32_t& index =
          component == 0 ? corner.position : (component == 1 ? corner.uv : corner.normal);
      const std::int64_t value =
          static_cast<std::int64_t>(base[component]) + static_cast<std::int32_t>(index);
      if (value < 0) bad_relative_ = true;
      index = static_cast<std::uint32_t>(value);
    }
  }

  void add_colours(const ObjBlock& block) {
    if (block.colours.size() == 0 && model_.colours.empty()) return;
    const glm::vec3 none(std::numeric_limits<float>::quiet_NaN());
    model_.colours.resize(model_.positions.size(), none);
    append(model_.colours, block.colours);
    model_.colours.resize(model_.positions.size() + block.positions.size(), none);
  }

  /// Vertices without a colour among coloured ones are white; colours of 0 to 255 become 0 to 1.
  void finish_colours(const std::string& label) {
    std::uint64_t missing = 0;
    float greatest = 0.0f;
    for (glm::vec3& c : model_.colours) {
      if (std::isnan(c.x)) {
        ++missing;
        continue;
      }
      greatest = std::max({greatest, c.x, c.y, c.z});
    }
    const bool bytes = greatest > 2.0f && greatest <= 255.0f;
    for (glm::vec3& c : model_.colours) {
      c = std::isnan(c.x) ? glm::vec3(1.0f) : (bytes ? c / 255.0f : c);
      c = glm::clamp(c, 0.0f, 1.0f);
    }
    if (missing != 0) {
      model_.findings.push_back(
          {"obj.partial-colours", FindingSeverity::kInfo, label, 0,
           std::to_string(missing) + " vertices have no colour while others do", "they are white"});
    }
    if (bytes) {
      model_.findings.push_back({"obj.byte-colours", FindingSeverity::kInfo, label, 0,
                                 "vertex colours go beyond 1", "they are taken as 0 to 255"});
    }
  }

  void add_faces(const ObjBlock& block) {
    if (model_.first_corner.empty()) model_.first_corner.push_back(0);
    std::size_t next = 0;
    for (std::size_t face = 0; face <= block.face_corners.size(); ++face) {
      while (next < block.statements.size() && block.statements[next].face == face) {
        apply(block.statements[next++]);
      }
      if (face == block.face_corners.size()) break;
      model_.first_corner.push_back(model_.first_corner.back() + block.face_corners[face]);
      model_.face_material.push_back(material_);
      model_.face_smoothing.push_back(smoothing_);
    }
  }

  void apply(const ObjStatement& statement) {
    switch (statement.kind) {
      case ObjStatement::Kind::kMaterial:
        material_ = materials_.use(statement.text, lines_ + statement.line);
        break;
      case ObjStatement::Kind::kSmoothing:
        smoothing_ = statement.group;
        break;
      case ObjStatement::Kind::kLibrary:
        materials_.add_library(statement.text, lines_ + statement.line);
        break;
    }
  }

  SourceModel& model_;
  ObjMaterials materials_;
  ObjCounts counts_;
  ObjCounts highest_;
  NoteTallies notes_{};
  std::uint64_t lines_ = 0;
  std::uint32_t material_ = 0;
  std::uint32_t smoothing_ = kUnstatedSmoothing;
  bool bad_relative_ = false;
};

tl::unexpected<Error> too_large(const std::string& label) {
  return fail(ExitCode::kInvalidInput, "obj.too-large", label,
              "the file holds more than 1,073,741,823 vertices, corners or bytes in one statement",
              "split the model into several files");
}

constexpr std::size_t kBlockBytes = std::size_t{1} << 20;

/// Reads the whole statements from `offset` on, about kBlockBytes of them, into block.text.
/// Returns how many bytes they are; 0 where reading failed.
std::uint64_t load_block(const ByteSource& source, std::uint64_t offset, std::string& text) {
  text.clear();
  std::size_t end = 0;
  while (end == 0) {
    const std::size_t from = text.size();
    if (!source.read(offset + from, kBlockBytes, text)) return 0;
    if (text.size() == from || offset + text.size() >= source.size()) {
      end = text.size();
      break;
    }
    if (text.size() > kMaxStatement) break;
    // The last end in what was read keeps blocks near their size.
    for (std::size_t at = first_statement_end(text, from == 0 ? text.size() / 2 : from); at != 0;
         at = first_statement_end(text, at)) {
      end = at;
    }
  }
  text.resize(end);
  text += '\n';
  text.append(kTextPadding, '\0');
  return end;
}

Result<void> read_blocks(const ByteSource& source, const std::string& label,
                         const ObjCounts* totals, Assembler& assembler) {
  ObjBlock block;
  std::uint64_t offset = 0;
  std::string head;
  if (source.read(0, 3, head) && head == "\xEF\xBB\xBF") offset = 3;
  while (offset < source.size()) {
    const std::uint64_t size = load_block(source, offset, block.text);
    if (size == 0) {
      if (block.text.size() > kMaxStatement) return too_large(label);
      return fail(ExitCode::kIo, "io.read", label, "the file cannot be read",
                  "check the disk and the file's permissions");
    }
    const ObjLimits limits{assembler.counts(), totals != nullptr ? *totals : ObjCounts{}};
    parse_obj_block(block.text.data(), static_cast<std::size_t>(size) + 1,
                    totals != nullptr ? &limits : nullptr, block);
    if (block.text[static_cast<std::size_t>(size) - 1] == '\n') --block.lines;
    assembler.add(block);
    if (assembler.too_large()) return too_large(label);
    offset += size;
  }
  return {};
}

bool is_utf16(std::string_view head) {
  if (head.size() < 4) return false;
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(head[i]); };
  if ((byte(0) == 0xFE && byte(1) == 0xFF) || (byte(0) == 0xFF && byte(1) == 0xFE)) return true;
  return (byte(0) == 0 && byte(1) != 0 && byte(2) == 0 && byte(3) != 0) ||
         (byte(0) != 0 && byte(1) == 0 && byte(2) != 0 && byte(3) == 0);
}

Result<SourceModel> parse_source(const ByteSource& source, const std::string& folder,
                                 const std::string& stem, const std::string& label) {
  std::string head;
  source.read(0, 4, head);
  if (is_utf16(head)) {
    return fail(ExitCode::kInvalidInput, "obj.utf16", label, "the file is UTF-16 text",
                "save it as UTF-8 (or plain ASCII) and bake again");
  }
  SourceModel model;
  model.name = stem;
  auto assembler = std::make_unique<Assembler>(model);
  if (auto done = read_blocks(source, label, nullptr, *assembler); !done) {
    return tl::unexpected(done.error());
  }
  if (assembler->needs_careful_pass()) {
    const ObjCounts totals = assembler->counts();
    model = SourceModel();
    model.name = stem;
    assembler = std::make_unique<Assembler>(model);
    if (auto done = read_blocks(source, label, &totals, *assembler); !done) {
      return tl::unexpected(done.error());
    }
  }
  assembler->finish(folder, label);
  if (model.face_count() == 0) {
    return fail(ExitCode::kInvalidInput, "obj.no-faces", label,
                "the file has " + std::to_string(model.positions.size()) +
                    " vertices and no face that can be kept",
                "export the model as polygons (point clouds must be meshed first)");
  }
  return model;
}

std::string stem_of(const std::string& path) {
  std::string name = path.substr(path.rfind('/') + 1);
  const std::size_t dot = name.rfind('.');
  if (dot != std::string::npos && dot > 0) name.resize(dot);
  return name;
}

}  // namespace

Result<SourceModel> read_obj(const std::string& path) {
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
                             folder, stem_of(path), path);
  ::close(descriptor);
  return result;
}

Result<SourceModel> parse_obj(std::string_view text, const std::string& folder,
                              const std::string& label) {
  return parse_source(ByteSource(text), folder, stem_of(label), label);
}

}  // namespace modar
