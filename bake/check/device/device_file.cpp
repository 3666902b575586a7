// Reads and judges the JSON of a device profile.
#include "bake/check/device/device_file.hpp"

#include "bake/json.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

/// Above every limit and size of a real device, and far from overflow in bytes.
constexpr std::uint64_t kGreatest = std::uint64_t{1} << 20;

/// Takes keys over and remembers the first that is missing or wrong.
class ProfileReader {
 public:
  explicit ProfileReader(const Json& document) : document_(document) {}
  [[nodiscard]] const std::string& wrong_key() const { return wrong_; }

  void text(const char* key, std::string& value) {
    const std::optional<std::string> found = document_[key].text();
    if (!found || found->empty()) return blame(key);
    value = *found;
  }

  template <class T>
  void number(const char* key, T& value) {
    take(key, document_[key], value);
  }

  /// Two numbers.
  void sides(const char* key, int& width, int& height) {
    const Json found = document_[key];
    if (!found.is_array() || found.size() != 2) return blame(key);
    take(key, found[0], width);
    take(key, found[1], height);
  }

  /// Names, as the profile has them: one string with a blank before and after each.
  void names(const char* key, std::string& value) {
    const Json found = document_[key];
    if (!found.is_array()) return blame(key);
    value = " ";
    for (const Json& one : found.elements()) {
      const std::optional<std::string> name = one.text();
      if (!name || name->find(' ') != std::string::npos) return blame(key);
      value += *name + " ";
    }
  }

 private:
  template <class T>
  void take(const char* key, const Json& from, T& value) {
    const std::optional<std::uint64_t> count = from.count();
    if (!count || *count < 1 || *count > kGreatest) return blame(key);
    value = static_cast<T>(*count);
  }

  void blame(const char* key) {
    if (wrong_.empty()) wrong_ = key;
  }

  const Json& document_;
  std::string wrong_;
};

tl::unexpected<Error> refuse(const std::string& where, const std::string& cause) {
  return fail(ExitCode::kInvalidInput, "device.file", where, cause,
              "write it like the files of assets/devices/");
}

}  // namespace

Result<void> parse_device_profile(std::string_view json, const std::string& where,
                                  DeviceFile& file) {
  const Json document = Json::parse(json);
  if (document.keys().empty()) return refuse(where, "it is not a JSON object");
  ProfileReader reader(document);
  DeviceProfile& profile = file.profile;
  reader.text("name", file.name);
  reader.text("title", file.title);
  std::string source;  // for those who read the file
  reader.text("source", source);
  reader.names("extensions", file.extensions);
  reader.number("es_version", profile.es_version);
  reader.number("max_texture_size", profile.max_texture_size);
  reader.number("max_vertex_uniform_vectors", profile.max_vertex_uniform_vectors);
  reader.number("max_fragment_uniform_vectors", profile.max_fragment_uniform_vectors);
  reader.number("max_vertex_attributes", profile.max_vertex_attributes);
  reader.number("max_varying_vectors", profile.max_varying_vectors);
  reader.number("gpu_memory_mib", profile.gpu_memory_mib);
  reader.number("ram_mib", profile.ram_mib);
  reader.number("storage_mib", profile.storage_mib);
  reader.number("cores", profile.cores);
  reader.sides("screen", profile.screen_width, profile.screen_height);
  reader.sides("frame", profile.frame_width, profile.frame_height);
  if (!reader.wrong_key().empty()) {
    return refuse(where, "the key '" + reader.wrong_key() + "' is missing or has a wrong value");
  }
  profile.name = file.name;
  profile.title = file.title;
  profile.extensions = file.extensions;
  return {};
}

Result<const DeviceProfile*> choose_device(const std::string& word, DeviceFile& file) {
  if (word.empty()) return nullptr;
  if (word.ends_with(".json")) {
    MODAR_ASSIGN(const MappedFile text, MappedFile::open(word));
    const auto bytes = text.bytes();
    MODAR_TRY(parse_device_profile({reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                                   word, file));
    return &file.profile;
  }
  const DeviceProfile* device = find_device_profile(word);
  if (device != nullptr) return device;
  return fail(ExitCode::kUsage, "device.unknown", word, "unknown device profile",
              "choose one of " + device_profile_names() + ", or a file NAME.json");
}

}  // namespace modar
