// libFuzzer target: any bytes as a ZIP are unpacked into their folder, or refused with a coded
// error.
#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "bake/extensions/studio/archive.hpp"
#include "bake/process/process.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static modar::test::InputFile file("archive.zip");
  const modar::TemporaryFolder folder;
  const auto names = modar::unpack_zip(file.write(data, size), folder.path());
  if (!names) {
    modar::test::need_told(names.error());
    return 0;
  }
  for (const std::string& name : *names) {
    modar::test::need(std::filesystem::is_regular_file(folder.path() + "/" + name));
  }
  return 0;
}
