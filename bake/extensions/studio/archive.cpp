// ZIP by minizip, which reads and writes; what may come out of one is decided here.
#include "bake/extensions/studio/archive.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include <minizip/unzip.h>
#include <minizip/zip.h>

#include "bake/extensions/studio/path_guard.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/base/path.hpp"
#include "formats/base/utf8.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostGrowth = 1000;       // times; deflate reaches 1032 on zeros
constexpr std::uint64_t kFreeGrowth = 16u << 20;  // bytes that may grow as they like
constexpr unsigned kUtf8Flag = 1u << 11;          // of an entry: its name is UTF-8
constexpr unsigned kLockedFlag = 1u;
constexpr unsigned long kUnixLink = 0120000;  // in the upper half of an entry's attributes
constexpr unsigned long kUnixType = 0170000;

using Archive = std::unique_ptr<void, int (*)(unzFile)>;

tl::unexpected<Error> bad_zip(const char* code, const std::string& name, const std::string& cause,
                              const char* cure) {
  return fail(ExitCode::kInvalidInput, code, printable(name), cause, cure);
}

tl::unexpected<Error> damaged(const std::string& archive) {
  return bad_zip("zip.damaged", archive, "the archive is damaged", "pack it again");
}

/// Windows writes names in the code page of DOS, whose letters above 127 are these.
std::string from_code_page_437(std::string_view name) {
  constexpr std::u16string_view kLetters =
      u"ÇüéâäàåçêëèïîìÄÅÉæÆôöòûùÿÖÜ¢£¥₧ƒáíóúñÑªº¿⌐¬½¼¡«»░▒▓│┤╡╢╖╕╣║╗╝╜╛┐└┴┬├─┼╞╟╚╔╩╦╠═╬╧╨╤╥╙╘╒╓╫╪┘"
      u"┌█▄▌▐▀αßΓπΣσµτΦΘΩδ∞φε∩≡±≥≤⌠⌡÷≈°∙·√ⁿ²■ ";
  std::string out;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    append_utf8(out, byte < 128 ? byte : kLetters[byte - 128U]);
  }
  return out;
}

bool is_left_out(const std::string& name) {
  if (name.find("../") != std::string::npos) return false;  // refused, not passed over
  return name.starts_with("__MACOSX/") || file_name(name).starts_with('.') ||
         name.find("/.") != std::string::npos;
}

struct Entry {
  std::string name;
  bool folder = false;
  std::uint64_t packed = 0;
};

Result<Entry> read_entry(unzFile file, const std::string& archive) {
  std::array<char, 2048> name{};
  unz_file_info64 info{};
  if (unzGetCurrentFileInfo64(file, &info, name.data(), name.size(), nullptr, 0, nullptr, 0) !=
          UNZ_OK ||
      info.size_filename >= name.size()) {
    return damaged(archive);
  }
  Entry entry;
  entry.packed = info.compressed_size;
  const std::string_view raw(name.data(), info.size_filename);
  entry.name =
      (info.flag & kUtf8Flag) != 0 || is_utf8(raw) ? std::string(raw) : from_code_page_437(raw);
  std::replace(entry.name.begin(), entry.name.end(), '\\', '/');
  entry.folder = entry.name.ends_with('/');
  if ((info.flag & kLockedFlag) != 0) {
    return bad_zip("zip.locked", entry.name, "the archive asks for a password",
                   "pack it without one");
  }
  if ((info.external_fa >> 16 & kUnixType) == kUnixLink) {
    return bad_zip("zip.link", entry.name, "the archive has a link", "pack files only");
  }
  return entry;
}

/// Copies the entry that is open to a file that is not there yet. left: bytes that may come, less
/// those that came.
Result<void> copy_entry(unzFile file, const std::string& path, const Entry& entry,
                        std::uint64_t& left) {
  const int descriptor =
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644);
  if (descriptor < 0 && errno == EEXIST) {
    return bad_zip("zip.name", entry.name, "the archive has this name twice", "pack it again");
  }
  if (descriptor < 0) {
    return fail(ExitCode::kIo, "io.write", entry.name, std::strerror(errno),
                cure_of_writing(errno));
  }
  const auto close = [descriptor](Result<void> done) {
    return ::close(descriptor) == 0 || !done
               ? done
               : fail(ExitCode::kIo, "io.write", "", std::strerror(errno), cure_of_writing(errno));
  };
  std::array<char, 1 << 16> buffer{};
  std::uint64_t came = 0;
  for (;;) {
    const int got = unzReadCurrentFile(file, buffer.data(), static_cast<unsigned>(buffer.size()));
    if (got == 0) return close({});
    if (got < 0) return close(damaged(entry.name));
    const auto size = static_cast<std::size_t>(got);
    came += size;
    if (size > left || (came > kFreeGrowth && came / kMostGrowth > entry.packed)) {
      return close(bad_zip("zip.too-large", entry.name, "unpacked, the archive is too large",
                           "pack less into it, or copy the files yourself"));
    }
    left -= size;
    const ssize_t written = ::write(descriptor, buffer.data(), size);
    if (written != got) {
      if (written >= 0) errno = ENOSPC;
      return close(fail(ExitCode::kIo, "io.write", entry.name,
                        std::string("cannot write: ") + std::strerror(errno),
                        cure_of_writing(errno)));
    }
  }
}

Result<void> unpack_entry(unzFile file, const std::string& folder, const Entry& entry,
                          std::uint64_t& left) {
  if (const auto good = check_name(entry.name); !good) {
    return bad_zip("zip.name", entry.name, "the archive has a name that leads elsewhere",
                   "pack the files again, with a program that you trust");
  }
  MODAR_ASSIGN(const std::string path, place_inside(folder, entry.name));
  if (unzOpenCurrentFile(file) != UNZ_OK) return damaged(entry.name);
  auto copied = copy_entry(file, path, entry, left);
  if (unzCloseCurrentFile(file) != UNZ_OK && copied) return damaged(entry.name);
  return copied;
}

}  // namespace

Result<std::vector<std::string>> unpack_zip(const std::string& archive, const std::string& folder) {
  const Archive file(unzOpen64(archive.c_str()), unzClose);
  unz_global_info64 info{};
  if (file == nullptr || unzGetGlobalInfo64(file.get(), &info) != UNZ_OK) return damaged("");
  if (info.number_entry > kMostUnpackedFiles) {
    return bad_zip("zip.too-large", "", "the archive has more than 2000 files",
                   "pack less into it, or copy the files yourself");
  }
  std::vector<std::string> names;
  std::uint64_t left = kMostUnpackedBytes;
  int more = info.number_entry == 0 ? UNZ_END_OF_LIST_OF_FILE : unzGoToFirstFile(file.get());
  for (std::size_t seen = 0; more == UNZ_OK; more = unzGoToNextFile(file.get())) {
    if (++seen > kMostUnpackedFiles) return damaged("");
    MODAR_ASSIGN(const Entry entry, read_entry(file.get(), archive));
    if (entry.folder || is_left_out(entry.name)) continue;
    MODAR_TRY(unpack_entry(file.get(), folder, entry, left));
    names.push_back(entry.name);
  }
  if (more != UNZ_END_OF_LIST_OF_FILE) return damaged("");
  return names;
}

Result<void> pack_zip(const std::string& folder, const std::string& archive) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (it->is_regular_file(error)) names.push_back(it->path().lexically_relative(folder).string());
  }
  std::sort(names.begin(), names.end());
  const auto no_write = [&] {
    return fail(ExitCode::kIo, "io.write", archive, "the archive cannot be written",
                cure_of_writing(errno));
  };
  const std::string own = archive + ".tmp";
  zipFile zip = zipOpen64(own.c_str(), APPEND_STATUS_CREATE);
  if (zip == nullptr) return no_write();
  Result<void> done;
  for (const std::string& name : names) {
    auto content = MappedFile::open((fs::path(folder) / name).string());
    const std::span<const std::byte> bytes =
        content ? content->bytes() : std::span<const std::byte>();
    zip_fileinfo info{};
    info.dosDate = 0x00210000;  // the first day of DOS: no time at all
    const bool added =
        zipOpenNewFileInZip4_64(zip, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr,
                                Z_DEFLATED, Z_DEFAULT_COMPRESSION, 0, -MAX_WBITS, DEF_MEM_LEVEL,
                                Z_DEFAULT_STRATEGY, nullptr, 0, 0, kUtf8Flag, 1) == ZIP_OK &&
        zipWriteInFileInZip(zip, bytes.data(), static_cast<unsigned>(bytes.size())) == ZIP_OK &&
        zipCloseFileInZip(zip) == ZIP_OK;
    if (!added) done = no_write();
    if (done && content) done = content->intact();
    if (!done) break;
  }
  if (zipClose(zip, nullptr) != ZIP_OK && done) done = no_write();
  if (done && std::rename(own.c_str(), archive.c_str()) != 0) done = no_write();
  if (!done) ::unlink(own.c_str());
  return done;
}

}  // namespace modar
