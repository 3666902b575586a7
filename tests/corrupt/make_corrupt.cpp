// Writes every damaged bundle and the report that it has to give: ID.modar and ID.txt in a folder.
// Reports of its folder workstation/ take the whole program: tests/cli/corrupt_test.py --write.
// Whoever runs it reads the difference of the reports before committing them.
#include <cstdio>
#include <string>

#include "formats/base/atomic_file.hpp"
#include "tests/corrupt/cases.hpp"

namespace {

bool write_case(const std::string& folder, const modar::test::CorruptCase& made) {
  const modar::test::Bytes bytes = made.make();
  std::string text;
  for (const std::string& line : modar::test::report(bytes)) text += line + "\n";
  const std::string path = folder + "/" + made.id;
  return modar::write_file(path + ".modar", bytes).has_value() &&
         modar::write_file(path + ".txt", text).has_value();
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: make_corrupt FOLDER\n");
    return 1;
  }
  for (const auto cases : {modar::test::structure_cases(), modar::test::payload_cases()}) {
    for (const modar::test::CorruptCase& made : cases) {
      if (!write_case(arguments[1], made)) return 2;
    }
  }
  for (const modar::test::CorruptCase& made : modar::test::workstation_cases()) {
    const std::string path = std::string(arguments[1]) + "/workstation/" + made.id + ".modar";
    if (!modar::write_file(path, made.make())) return 2;
  }
  return 0;
}
