// Writes the golden bundle of the current version. A released version's file never changes again.
#include <cstdio>

#include "formats/base/atomic_file.hpp"
#include "formats/content_summary.hpp"
#include "tests/formats/support.hpp"

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: make_golden OUT.modar\n");
    return 1;
  }
  modar::BundleContent content = modar::test::golden_content();
  modar::test::add_looks(content);
  modar::test::add_nodes(content);
  modar::test::add_clips(content);
  content.summary = modar::content_summary_of(content);
  const modar::test::Bytes bytes = modar::test::encode(content);
  return modar::write_file(arguments[1], bytes) ? 0 : 2;
}
