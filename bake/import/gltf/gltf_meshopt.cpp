// Decodes view by view, and writes the JSON with the views' new places.
#include "bake/import/gltf/gltf_meshopt.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <vector>

#include "bake/import/conversion.hpp"
#include "bake/import/name_form.hpp"
#include "bake/io/input.hpp"
#include "bake/json.hpp"

namespace modar {
namespace {

/// One extension under two names; Khronos' may use version 1 of the vertex codec, too.
constexpr std::array kExtensions = {"EXT_meshopt_compression", "KHR_meshopt_compression"};

std::optional<Json> extension_of(const Json& view) {
  for (const char* const name : kExtensions) {
    if (auto extension = view.find(std::string("extensions/") + name)) return extension;
  }
  return std::nullopt;
}

constexpr std::uint32_t kJsonChunk = 0x4E4F534A;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004E4942;  // "BIN"
/// Decoded bytes of an encoded one: 16 values of a byte each take two bits at least, and a triangle
/// of three 32-bit indices takes one byte.
constexpr std::uint64_t kMostExpanded = 64;

std::uint32_t number_at(const std::string& file, std::size_t offset) {
  std::uint32_t number = 0;
  std::memcpy(&number, file.data() + offset, sizeof number);
  return number;
}

/// The JSON of a file, and the binary chunk that a GLB has. A file that is no GLB by its chunks is
/// left to the reader, which says so.
struct Parts {
  std::string json;
  std::string binary;
};
std::optional<Parts> split(const std::string& file) {
  if (!file.starts_with("glTF")) return Parts{file, {}};
  if (file.size() < 20 || number_at(file, 16) != kJsonChunk) return std::nullopt;
  const std::uint64_t json_end = std::uint64_t{20} + number_at(file, 12);
  if (json_end > file.size()) return std::nullopt;
  Parts parts{file.substr(20, json_end - 20), {}};
  if (json_end + 8 > file.size()) return parts;
  const std::uint64_t end = json_end + 8 + number_at(file, json_end);
  if (number_at(file, json_end + 4) != kBinaryChunk || end > file.size()) return std::nullopt;
  parts.binary = file.substr(json_end + 8, end - json_end - 8);
  return parts;
}

/// Fills up to a multiple of 8 bytes.
void align(std::string& bytes, char with) {
  bytes.resize((bytes.size() + 7) / 8 * 8, with);
}

std::string joined(std::string json, std::string binary) {
  align(json, ' ');
  align(binary, '\0');
  std::string file = "glTF";
  const auto add = [&](std::uint64_t number) {
    const auto narrow = static_cast<std::uint32_t>(number);
    file.append(reinterpret_cast<const char*>(&narrow), sizeof narrow);
  };
  add(2);
  add(28 + json.size() + binary.size());
  add(json.size());
  add(kJsonChunk);
  file += json;
  add(binary.size());
  add(kBinaryChunk);
  return file + binary;
}

/// What a view's extension says.
struct EncodedView {
  std::uint64_t buffer = 0;
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::uint64_t stride = 0;
  std::uint64_t count = 0;
  std::string mode;
  std::string filter;
};
EncodedView encoded_view(const Json& extension) {
  const auto count = [&](const char* key) {
    const auto member = extension.find(key);
    return member ? member->count().value_or(0) : 0;
  };
  const auto text = [&](const char* key) {
    const auto member = extension.find(key);
    return member ? member->text().value_or("") : std::string();
  };
  return {count("buffer"), count("byteOffset"), count("byteLength"), count("byteStride"),
          count("count"),  text("mode"),        text("filter")};
}

/// Undoes the filter; false if none exists for such elements.
bool undo_filter(const EncodedView& view, std::string& bytes) {
  if (view.filter.empty() || view.filter == "NONE") return true;
  if (view.mode != "ATTRIBUTES") return false;
  if (view.filter == "OCTAHEDRAL" && (view.stride == 4 || view.stride == 8)) {
    meshopt_decodeFilterOct(bytes.data(), view.count, view.stride);
  } else if (view.filter == "QUATERNION" && view.stride == 8) {
    meshopt_decodeFilterQuat(bytes.data(), view.count, view.stride);
  } else if (view.filter == "EXPONENTIAL" && view.stride % 4 == 0) {
    meshopt_decodeFilterExp(bytes.data(), view.count, view.stride);
  } else {
    return false;
  }
  return true;
}

/// Whether a newer encoder wrote the view than the library reads, which knows version 0 of the
/// vertex codec. Only that version has colours with a filter.
bool is_too_new(const EncodedView& view, const std::string& buffer) {
  constexpr unsigned kVertexCodec = 0xA0;
  if (view.mode != "ATTRIBUTES" || view.offset >= buffer.size()) return false;
  const auto head = static_cast<unsigned char>(buffer[view.offset]);
  return (head & 0xF0) == kVertexCodec && head != kVertexCodec;
}

/// Reading and writing JSON goes as deep as it does; glTF needs about ten.
constexpr int kDeepest = 200;
bool is_deep(const std::string& json) {
  int depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (c == '"') in_text = !in_text;
    if (c == '\\' && in_text) ++i;
    if (in_text) continue;
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (depth > kDeepest) return true;
  }
  return false;
}

/// Nothing where the bytes are not what the view says.
std::optional<std::string> decoded(const EncodedView& view, const std::string& buffer) {
  const bool attributes = view.mode == "ATTRIBUTES";
  const bool fits = view.offset <= buffer.size() && view.length <= buffer.size() - view.offset;
  const bool good_stride = attributes
                               ? view.stride > 0 && view.stride <= 256 && view.stride % 4 == 0
                               : view.stride == 2 || view.stride == 4;
  if (!fits || !good_stride || view.count > kMostExpanded * view.length) return std::nullopt;
  if (view.count * view.stride > kMostExpanded * view.length) return std::nullopt;
  const auto* source = reinterpret_cast<const unsigned char*>(buffer.data()) + view.offset;
  std::string bytes(view.count * view.stride, '\0');
  int failed = 1;
  if (attributes) {
    failed = meshopt_decodeVertexBuffer(bytes.data(), view.count, view.stride, source, view.length);
  } else if (view.mode == "TRIANGLES" && view.count % 3 == 0) {
    failed = meshopt_decodeIndexBuffer(bytes.data(), view.count, view.stride, source, view.length);
  } else if (view.mode == "INDICES") {
    failed =
        meshopt_decodeIndexSequence(bytes.data(), view.count, view.stride, source, view.length);
  }
  if (failed != 0 || !undo_filter(view, bytes)) return std::nullopt;
  return bytes;
}

class Rewriter {
 public:
  Rewriter(Json json, std::string binary, bool is_glb, const ModelFolder& folder, std::string label)
      : json_(std::move(json)),
        binary_(std::move(binary)),
        folder_(folder),
        label_(std::move(label)),
        all_(binary_),
        buffers_(json_.find("buffers").value_or(Json::array())),
        loaded_(buffers_.size()),
        is_glb_(is_glb) {}

  Result<std::string> run() {
    const Json views = json_.find("bufferViews").value_or(Json::array());
    Json placed = Json::array();
    for (std::size_t i = 0; i < views.size(); ++i) {
      Json view = *views.at(i);
      if (const auto extension = extension_of(view))
        MODAR_TRY(place(i, encoded_view(*extension), view));
      placed.push_back(std::move(view));
    }
    json_.set("bufferViews", std::move(placed));
    json_.set("buffers", buffers());
    return joined(json_.dump(), std::move(all_));
  }

 private:
  Result<void> place(std::size_t index, const EncodedView& encoded, Json& view) {
    MODAR_ASSIGN(const std::string* buffer, load(index, encoded.buffer));
    if (is_too_new(encoded, *buffer)) {
      return fail(ExitCode::kUnsupported, "gltf.meshopt", label_,
                  "its buffer view " + std::to_string(index) + " (at byte " +
                      std::to_string(encoded.offset) +
                      " of its buffer) has a newer version of meshoptimizer's vertex codec than 0",
                  gltf_conversion(label_, {true, requires_basis()}));
    }
    const std::optional<std::string> bytes = decoded(encoded, *buffer);
    if (!bytes) return fail_at(index, "its bytes contradict its extension");
    align(all_, '\0');
    view.set("buffer", buffers_.size());
    view.set("byteOffset", all_.size());
    view.set("byteLength", bytes->size());
    view.set("extensions", Json::object());
    all_ += *bytes;
    if (all_.size() <= std::numeric_limits<std::uint32_t>::max() / 2) return {};
    return fail(ExitCode::kUnsupported, "gltf.meshopt", label_, "it decodes to more than 2 GiB",
                "cut it into several files");
  }

  Result<const std::string*> load(std::size_t view, std::uint64_t index) {
    const auto buffer = buffers_.at(index);
    if (!buffer) return fail_at(view, "its buffer does not exist");
    const auto uri = buffer->find("uri");
    if (!uri) return &binary_;
    std::optional<std::string>& bytes = loaded_[index];
    if (bytes) return &*bytes;
    const std::string name = uri->text().value_or("");
    for (const std::string& file : {name, percent_decoded(name)}) {
      if (bytes || !folder_.has(folder_.path + file)) continue;
      std::ifstream stream(folder_.path + file, std::ios::binary);
      if (!stream) continue;
      bytes.emplace(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
    }
    if (!bytes) return fail_at(view, "its buffer '" + name.substr(0, 80) + "' cannot be read");
    return &*bytes;
  }

  /// The file's, and one more: the whole binary chunk. Others without a file begin where it does;
  /// but for a GLB's own they represented the decoded data.
  [[nodiscard]] Json buffers() const {
    Json result = Json::array();
    for (std::size_t i = 0; i < buffers_.size(); ++i) {
      const Json buffer = *buffers_.at(i);
      const bool kept = buffer.find("uri") || (is_glb_ && i == 0);
      result.push_back(kept ? buffer : Json({{"byteLength", 1}}));
    }
    result.push_back({{"byteLength", all_.size()}});
    return result;
  }

  [[nodiscard]] bool requires_basis() const {
    const Json names = json_.find("extensionsRequired").value_or(Json::array());
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (names.at(i)->text() == kBasisTextures) return true;
    }
    return false;
  }

  [[nodiscard]] tl::unexpected<Error> fail_at(std::size_t view, const std::string& why) const {
    return fail(ExitCode::kInvalidInput, "gltf.meshopt", label_,
                "its buffer view " + std::to_string(view) + " cannot be decoded: " + why,
                "put its buffers next to it, or export it again");
  }

  Json json_;
  std::string binary_;  ///< the chunk of a GLB
  const ModelFolder& folder_;
  std::string label_;
  std::string all_;  ///< the same, and the decoded data
  Json buffers_;
  std::vector<std::optional<std::string>> loaded_;
  bool is_glb_;
};

}  // namespace

Result<std::string> decode_meshopt_views(std::string file, const ModelFolder& folder,
                                         const std::string& label) {
  const auto named = [&](const char* name) { return file.find(name) != std::string::npos; };
  if (std::none_of(kExtensions.begin(), kExtensions.end(), named)) return file;
  std::optional<Parts> parts = split(file);
  if (!parts || is_deep(parts->json)) return file;
  Json json = Json::parse(parts->json);
  const Json views = json.find("bufferViews").value_or(Json::array());
  const Json buffers = json.find("buffers").value_or(Json::array());
  if (!views.is_array() || !buffers.is_array()) return file;
  bool any = false;
  for (std::size_t i = 0; i < views.size() && !any; ++i) {
    any = extension_of(*views.at(i)).has_value();
  }
  if (!any) return file;
  return Rewriter(std::move(json), std::move(parts->binary), file.starts_with("glTF"), folder,
                  label)
      .run();
}

}  // namespace modar
