// modar-play: maps a bundle and plays it over a video, pictures or a camera.
#include <cstdio>

#include "formats/bundle_view.hpp"
#include "modar/mapped_file.hpp"
#include "options.hpp"
#include "play.hpp"

namespace modar {

Result<void> print_line(const std::string& line) {
  const bool written = std::fwrite(line.data(), 1, line.size(), stdout) == line.size() &&
                       std::fputc('\n', stdout) != EOF && std::fflush(stdout) == 0;
  if (written) return {};
  return fail(ExitCode::kIo, "out.write", "standard output", "it takes no more text",
              "free space or mend the pipe");
}

namespace {

Result<int> run(const PlayOptions& options) {
  Result<MappedFile> file = MappedFile::open(options.bundle);
  if (!file) return tl::unexpected(file.error());
  Result<BundleView> bundle = BundleView::open(file->bytes());
  if (!bundle) {
    Error error = bundle.error();
    error.where = options.bundle + (error.where.empty() ? "" : ":" + error.where);
    return tl::unexpected(error);
  }
  if (options.turntable == 0) return play_video(options, *bundle);
  const Result<void> turned = play_turntable(options, *bundle);
  if (!turned) return tl::unexpected(turned.error());
  return 0;
}

int report(const Error& error) {
  std::fprintf(stderr, "modar-play: %s\n", to_line(error).c_str());
  return static_cast<int>(error.exit);
}

int start(int argc, char** argv) {
  const Result<PlayOptions> options =
      parse_options({argv + 1, argc > 0 ? static_cast<std::size_t>(argc - 1) : 0});
  if (!options) return report(options.error());
  if (options->help || options->version) {
    const std::string text =
        options->help ? std::string(help_text()) : "modar-play " MODAR_VERSION "\n";
    const Result<void> printed = print_line(text.substr(0, text.size() - 1));
    return printed ? 0 : report(printed.error());
  }
  const Result<int> done = run(*options);
  return done ? *done : report(done.error());
}

}  // namespace
}  // namespace modar

int main(int argc, char** argv) {
  return modar::start(argc, argv);
}
