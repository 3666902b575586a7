// `modar-lab bench wild` on clips that are rendered here, in each form that it reads, with the
// truth of the renderer.
#include "bake/extensions/lab/wild_bench.hpp"

#include <filesystem>
#include <fstream>
#include <map>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "bake/process/process.hpp"
#include "tests/track/synthetic.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 12;

using Points = std::vector<cv::Point2d>;

/// A sheet before a camera that moves a little, whose focal length nobody tells the bench.
struct Film {
  Film() {
    Camera camera = default_camera(320, 240);
    camera.fx = camera.fy = 270;
    for (int i = 0; i < kFrames; ++i) {
      const test::View view = test::look_at(3.2, 20 + 0.5 * i, 40, 0.6 * i, 0.01 * i, -0.01 * i);
      frames.push_back(test::render(
          sheet, view, camera, cv::Mat(camera.height, camera.width, CV_8UC1, cv::Scalar(120))));
      truth.push_back(test::true_corners(sheet, view, camera));
    }
  }
  cv::Mat sheet = test::textured_picture(220, 180, 31);
  std::vector<cv::Mat> frames;
  std::vector<Points> truth;
};

const Film& film() {
  static const Film kFilm;
  return kFilm;
}

class WildBench : public testing::Test {
 protected:
  std::ofstream file(const std::string& name) const {
    const fs::path path = fs::path(folder_.path()) / name;
    fs::create_directories(path.parent_path());
    return std::ofstream(path);
  }
  void video(const std::string& name, const std::vector<cv::Mat>& frames) const {
    cv::VideoWriter writer(folder_.path() + "/" + name, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'),
                           25, frames[0].size(), false);
    ASSERT_TRUE(writer.isOpened());
    for (const cv::Mat& frame : frames) writer.write(frame);
  }
  void pictures(const std::string& name) const {
    fs::create_directories(folder_.path() + "/" + name);
    for (int i = 0; i < kFrames; ++i) {
      const std::string number = std::to_string(100 + i);
      ASSERT_TRUE(cv::imwrite(folder_.path() + "/" + name + "/" + number + ".png",
                              film().frames[static_cast<std::size_t>(i)]));
    }
  }
  /// A line a frame: from corner `first` on, against the clock, as annotators may begin; eight
  /// zeros where `labelled` is 0. aside: of all but the first, pixels to the right.
  void points(const std::string& name, int first, double aside, const std::string& labelled) const {
    auto out = file(name);
    for (std::size_t i = 0; i < kFrames; ++i) {
      for (int k = 0; k < 4; ++k) {
        const cv::Point2d at = film().truth[i][static_cast<std::size_t>((first - k + 8) % 4)];
        if (labelled[i] == '0') {
          out << "0 0 ";
        } else {
          out << at.x + (i > 0 ? aside : 0) << '\t' << at.y << ' ';
        }
      }
      out << '\n';
    }
  }
  void flags(const std::string& name, const std::string& each) const {
    auto out = file(name);
    for (const char flag : each) out << flag << " \n";
  }
  [[nodiscard]] std::map<std::string, BenchRow> rows(std::uint32_t paper_set) const {
    WildBenchOptions options;
    options.folder = folder_.path();
    options.paper_set = paper_set;
    options.bake.features = 500;
    options.bake.trial_views = 8;
    const auto measured = bench_wild(options, {});
    EXPECT_TRUE(measured) << to_line(measured.error());
    std::map<std::string, BenchRow> found;
    if (!measured) return found;
    for (const BenchRow& row : *measured) found[row.measure] = row;
    return found;
  }
  [[nodiscard]] Error refused() const {
    WildBenchOptions options;
    options.folder = folder_.path();
    const auto measured = bench_wild(options, {});
    EXPECT_FALSE(measured);
    return measured ? Error{} : measured.error();
  }

  TemporaryFolder folder_;
};

TEST_F(WildBench, ReadsOurFormBesideOtherMethods) {
  video("sheet.avi", film().frames);
  ASSERT_TRUE(cv::imwrite(folder_.path() + "/sheet_photo.png", film().sheet));
  auto truth = file("sheet_corners.csv");
  truth << "frame,x0,y0,x1,y1,x2,y2,x3,y3\n";
  for (std::size_t i = 0; i < kFrames; i += 3) {
    truth << i;
    for (const cv::Point2d& corner : film().truth[i]) truth << ',' << corner.x << ',' << corner.y;
    truth << '\n';
  }
  truth.close();
  std::vector<cv::Mat> street;
  for (int i = 0; i < 3; ++i) street.push_back(cv::Mat(240, 320, CV_8UC1, cv::Scalar(90 + i)));
  video("street.avi", street);
  const auto found = rows(1);
  for (const char* method : {"sift", "orb", "paper"}) {
    const std::string beside = std::string(" sheet_photo with ") + method;
    ASSERT_TRUE(found.contains("shown_pct" + beside)) << beside;
    EXPECT_EQ(found.at("shown_pct" + beside).ours, 100) << beside;
    EXPECT_LT(found.at("error_px" + beside).ours, 1.5) << beside;
  }
  // Its free homography needs no camera.
  EXPECT_EQ(found.at("shown_pct sheet_photo with sift").reference, 100);
  EXPECT_LT(found.at("error_px sheet_photo with sift").reference, 1.5);
  EXPECT_LT(found.at("pose_px sheet_photo").ours, 1.5);
  EXPECT_EQ(found.at("shown_frames sheet_photo").ours, kFrames);
  EXPECT_EQ(found.at("shown_frames sheet_photo").reference, kFrames);
  EXPECT_EQ(found.at("false_frames street").ours, 0);
  EXPECT_EQ(found.at("false_frames street").reference, 3);
  EXPECT_FALSE(found.contains("P@5 sheet_photo"));
}

// Every other frame is labelled, flags leave frames out, the initial one is not judged. In two
// clips the points are next to the truth, by 8 pixels or in frames that a flag leaves out.
TEST_F(WildBench, ReadsTheFormsOfPublishedBenchmarks) {
  pictures("V01_1");
  points("annotation/V01_1_gt_points.txt", 2, 0, "101010101010");
  flags("annotation/V01_1_flag.txt", "000020000000");
  pictures("V01_2");
  points("annotation/V01_2_gt_points.txt", 0, 8, "111111111111");
  pictures("sequences/Seq_00001/img");
  points("annos/Seq_00001.txt", 1, 100, "111111111111");
  flags("annos/Seq_00001_flag.txt", "011111111110");
  const auto found = rows(0);
  const auto value = [&](const std::string& measure) {
    EXPECT_TRUE(found.contains(measure)) << measure;
    return found.contains(measure) ? found.at(measure).ours : -1;
  };
  EXPECT_EQ(value("P@5 V01_1"), 100);
  EXPECT_EQ(value("P@15 V01_1"), 100);
  EXPECT_EQ(value("P@5 V01_2"), 0);
  EXPECT_EQ(value("P@15 V01_2"), 100);
  EXPECT_NEAR(value("error_px V01_2"), 16, 1.5);  // of 640
  EXPECT_EQ(value("P@15 Seq_00001"), 0);
  EXPECT_EQ(value("shown_pct Seq_00001"), 100);
  EXPECT_NEAR(value("P@5 all published clips"), 100.0 / 3, 1e-9);
  EXPECT_NEAR(value("P@15 all published clips"), 200.0 / 3, 1e-9);
  EXPECT_EQ(value("shown_frames V01_1"), kFrames);
}

TEST_F(WildBench, SaysWhatDoesNotFit) {
  EXPECT_EQ(refused().code, "bench.wild");
  points("V01_1_gt_points.txt", 0, 0, "111111111111");
  EXPECT_NE(refused().cause.find("no folder V01_1"), std::string::npos);
  pictures("V01_1");
  flags("V01_1_flag.txt", "000");
  EXPECT_NE(refused().where.find("V01_1_flag.txt:3"), std::string::npos) << refused().where;
  flags("V01_1_flag.txt", "222222222222");
  EXPECT_NE(refused().cause.find("no frame has corners"), std::string::npos);
  file("V01_1_gt_points.txt") << "1 2 3 4 5 6 7 8\n1 2 3\n";
  flags("V01_1_flag.txt", "00");
  EXPECT_NE(refused().where.find("V01_1_gt_points.txt:2"), std::string::npos);
}

}  // namespace
}  // namespace modar
