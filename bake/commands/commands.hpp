// The commands of `modar`: plain options in, an exit code out. cli.cpp fills the options.
#pragma once

#include <string>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/pattern/confusion.hpp"
#include "bake/pattern/pattern_image.hpp"
#include "bake/pattern/simulate.hpp"

namespace modar {

struct BakeCommand {
  BakeRequest request;
  std::string output;
  bool prove_reproducible = false;
  std::vector<std::string> words;  ///< the command line, from "bake" on
  bool quiet = false;
  bool json = false;
};

struct RectifyCommand {
  std::string photo;
  RectifyOptions options;
  std::string output;
  bool json = false;
};

struct ScoreCommand {
  std::vector<std::string> patterns;  ///< image files
  std::string overlay_folder;         ///< empty: none
  unsigned jobs = 1;                  ///< threads; the scores do not depend on it
  bool json = false;
};

struct ConfusionCommand {
  std::vector<std::string> inputs;  ///< bundles and image files
  std::string photos;               ///< folder; empty: none
  ConfusionOptions options;
  bool quiet = false;
  bool json = false;
};

struct SimulateCommand {
  std::vector<std::string> patterns;  ///< image files
  std::string camera_file;            ///< empty: the default camera
  std::string backgrounds;            ///< folder; empty: made ones
  std::string picture_folder;         ///< of contact sheets; empty: none
  SimulateOptions options;
  bool quiet = false;
  bool json = false;
};

struct InspectCommand {
  std::string bundle;
  std::string extract;  ///< folder for GLB, PKM, YML; empty: none
  bool json = false;
};

/// `modar bench pose`.
struct PoseBenchCommand {
  std::string patterns;                 ///< a folder of pictures, or one
  std::string backgrounds;              ///< the same
  std::string video;                    ///< empty: none
  std::string truth;                    ///< CSV of the video's corners; empty: it shows no pattern
  std::string video_pattern;            ///< picture of what the video shows; empty: see VideoBench
  std::string parameters = "orb-2000";  ///< set of the article's method; "none": ours alone
  std::string only;                     ///< bands whose name holds this text
  int frames = 100;                     ///< a band and pattern
  int clutter = 0;                      ///< frames without a pattern, in all; 0: as the others
  bool tables = false;                  ///< print the article's tables instead
  bool scores = false;                  ///< hold scores against working ranges instead
  int many = 0;                         ///< measure bundles of 1 to so many patterns instead
  unsigned seed = 1;
  bool quiet = false;
};

/// `modar bench model`.
struct ModelBenchCommand {
  std::string obj;    ///< measured as it is; empty: one is made from the input scan
  bool big = false;   ///< made at the size of the article's CHURCH
  unsigned jobs = 1;  ///< of our own runs
};

struct BenchCommand {
  std::string name;
  std::vector<std::string> inputs;
  unsigned crop = 0;   ///< etc1: side of the centre crop in pixels, 0: whole images
  std::string device;  ///< render: profile that masks the context; empty: none
  PoseBenchCommand pose;
  ModelBenchCommand model;
  bool json = false;
};

/// Each prints data to stdout and words to stderr, and answers the exit code.
int run_bake(const BakeCommand& command);
int run_rectify(const RectifyCommand& command);
int run_confusion(ConfusionCommand& command);
int run_score(const ScoreCommand& command);
int run_simulate(SimulateCommand& command);
/// `modar pattern ARGUMENT...`, with a command line of its own.
int run_pattern(std::vector<std::string> arguments);
/// `modar calibrate ARGUMENT...`, the same.
int run_calibrate(std::vector<std::string> arguments);
int run_inspect(const InspectCommand& command);
int run_bench(const BenchCommand& command);

}  // namespace modar
