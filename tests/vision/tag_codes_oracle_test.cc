// ArUco's tags as OpenCV has them: the same cells, and its detector reads what is painted with
// them.

#include <gtest/gtest.h>

#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "tests/support/paint_tags.h"
#include "vision/fiducial_estimator.h"

namespace turbidock::vision {
namespace {

// OpenCV 4.6 gives a pointer to a dictionary, later ones the dictionary.
[[maybe_unused]] cv::Ptr<cv::aruco::Dictionary> Held(cv::Ptr<cv::aruco::Dictionary> given) {
  return given;
}
[[maybe_unused]] cv::Ptr<cv::aruco::Dictionary> Held(const cv::aruco::Dictionary& given) {
  return cv::makePtr<cv::aruco::Dictionary>(given);
}

struct Dictionary {
  TagFamily family;
  std::vector<int> opencv;  // all that begin with the family's tags, or are among them
};
const Dictionary kDictionaries[] = {
    {TagFamily::kAruco4x4,
     {cv::aruco::DICT_4X4_50, cv::aruco::DICT_4X4_100, cv::aruco::DICT_4X4_250,
      cv::aruco::DICT_4X4_1000}},
    {TagFamily::kAruco5x5,
     {cv::aruco::DICT_5X5_50, cv::aruco::DICT_5X5_100, cv::aruco::DICT_5X5_250,
      cv::aruco::DICT_5X5_1000}},
    {TagFamily::kAruco6x6,
     {cv::aruco::DICT_6X6_50, cv::aruco::DICT_6X6_100, cv::aruco::DICT_6X6_250,
      cv::aruco::DICT_6X6_1000}},
    {TagFamily::kArucoOriginal, {cv::aruco::DICT_ARUCO_ORIGINAL}},
};

cv::Ptr<cv::aruco::Dictionary> OfOpenCv(int name) {
  return Held(cv::aruco::getPredefinedDictionary(name));
}

TEST(ArucoTags, HaveTheCellsOfOpenCvs) {
  int compared = 0;
  for (const auto& [family, names] : kDictionaries)
    for (const int name : names) {
      const cv::Ptr<cv::aruco::Dictionary> theirs = OfOpenCv(name);
      for (int id = 0; id < std::min(TagCount(family), theirs->bytesList.rows); ++id, ++compared) {
        const TagCells cells = CellsOf(family, id);
        ASSERT_EQ(cells.across, theirs->markerSize + 4);
        const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(
            theirs->bytesList.rowRange(id, id + 1), theirs->markerSize);
        for (int row = 0; row < cells.across; ++row)
          for (int column = 0; column < cells.across; ++column) {
            const int ring =
                std::min({row, column, cells.across - 1 - row, cells.across - 1 - column});
            ASSERT_EQ(cells(row, column),
                      ring == 0 || (ring > 1 && bits.at<uchar>(row - 2, column - 2) == 1))
                << NameOf(family) << " " << id << ", row " << row << ", column " << column;
          }
      }
    }
  EXPECT_EQ(compared, 3 * (50 + 100 + 250 + 250) + 1024);
}

TEST(ArucoTags, AreReadByOpenCvWhereOurDetectorReadsThem) {
  const StereoRig rig = RigParams{}.MakeRig();
  const Pose X_HM = {FromYawPitchRoll(0.1, -0.05, 0.03), {0.5, 0.03, -0.02}};
  for (const auto& [family, names] : kDictionaries) {
    SCOPED_TRACE(NameOf(family));
    FiducialParams params{.family = family};
    params.tags = {{.id = 7, .p_MT_m = {0.1, 0.15, -0.06}, .size_m = 0.1},
                   {.id = 41, .p_MT_m = {0.1, -0.15, 0.08}, .size_m = 0.1}};
    // The wall as bright as the white border, whose outline OpenCV might take for the tag's.
    const StereoImage seen = testing::Paint(params, rig, X_HM, 200);
    FiducialEstimator estimator(params, rig);
    ASSERT_TRUE(estimator.Update(seen).detected);
    int compared = 0;
    for (const Side side : kSides) {
      const Image3u8& image = seen[side];
      cv::Mat grey(image.height(), image.width(), CV_8UC1);
      for (int v = 0; v < image.height(); ++v)
        for (int u = 0; u < image.width(); ++u) grey.at<uchar>(v, u) = *image.at(u, v);
      std::vector<std::vector<cv::Point2f>> corners;
      std::vector<int> ids;
      const auto parameters = cv::makePtr<cv::aruco::DetectorParameters>();
      parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
      cv::aruco::detectMarkers(grey, OfOpenCv(names.front()), corners, ids, parameters);
      for (const FiducialEstimator::Reading& reading : estimator.readings()) {
        if (reading.side != side) continue;
        const auto found = std::ranges::find(ids, params.tags[reading.tag].id);
        ASSERT_NE(found, ids.end());
        // theirs go round from the top left, ours from the bottom left
        for (size_t i = 0; i < 4; ++i, ++compared) {
          const cv::Point2f& p = corners[static_cast<size_t>(found - ids.begin())][3 - i];
          EXPECT_LT((reading.corners_px[i] - Eigen::Vector2d(p.x, p.y)).norm(), 1.5);
        }
      }
    }
    EXPECT_EQ(compared, 16);
  }
}

}  // namespace
}  // namespace turbidock::vision
