// Images on their way: what arrives of a sequence in which every image is known by its grey.

#include "sim/camera/image_fault.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace turbidock::camera {
namespace {

using enum ImageFaultKind;

// Greys of what arrives of ten pairs, one a second: the left ones are 10, 11, ..., the right ones
// 110, 111, ...
std::pair<std::vector<int>, std::vector<int>> Arriving(const std::vector<ImageFault>& faults) {
  FaultyImages line(faults);
  std::pair<std::vector<int>, std::vector<int>> greys;
  for (int i = 0; i < 10; ++i) {
    StereoImage images;
    images.frame = i;
    images.left = Image3u8(4, 3, static_cast<uint8_t>(10 + i));
    images.right = Image3u8(4, 3, static_cast<uint8_t>(110 + i));
    line.Apply(i, &images);
    EXPECT_EQ(images.frame, i);
    for (const Side side : kSides) {
      const Image3u8& image = images[side];
      EXPECT_EQ(image, Image3u8(4, 3, *image.data()));  // all of it, not a part
      (side == Side::kLeft ? greys.first : greys.second).push_back(*image.data());
    }
  }
  return greys;
}

using Greys = std::vector<int>;
const Greys kLeft = {10, 11, 12, 13, 14, 15, 16, 17, 18, 19};
const Greys kRight = {110, 111, 112, 113, 114, 115, 116, 117, 118, 119};

TEST(ImageFault, NoneChangesNothing) {
  EXPECT_FALSE(FaultyImages({}).on());
  EXPECT_EQ(Arriving({}), std::pair(kLeft, kRight));
}

TEST(ImageFault, AFrozenImageIsTheOneBefore) {
  const auto [left, right] = Arriving({ImageFault{{4, 7}, kFrozen, FaultyCamera::kLeft}});
  EXPECT_EQ(left, (Greys{10, 11, 12, 13, 13, 13, 13, 17, 18, 19}));
  EXPECT_EQ(right, kRight);
}

TEST(ImageFault, FrozenFromTheBeginningItIsTheFirst) {
  const auto [left, right] = Arriving({ImageFault{{0, 3}, kFrozen, FaultyCamera::kBoth}});
  EXPECT_EQ(left, (Greys{10, 10, 10, 13, 14, 15, 16, 17, 18, 19}));
  EXPECT_EQ(right, (Greys{110, 110, 110, 113, 114, 115, 116, 117, 118, 119}));
}

TEST(ImageFault, ABlackImageIsZero) {
  const auto [left, right] = Arriving({ImageFault{{8, 90}, kBlack, FaultyCamera::kRight}});
  EXPECT_EQ(left, kLeft);
  EXPECT_EQ(right, (Greys{110, 111, 112, 113, 114, 115, 116, 117, 0, 0}));
}

TEST(ImageFault, SwappedImagesAreEachOthers) {
  const auto [left, right] = Arriving({ImageFault{{1, 3}, kSwapped, FaultyCamera::kLeft}});
  EXPECT_EQ(left, (Greys{10, 111, 112, 13, 14, 15, 16, 17, 18, 19}));
  EXPECT_EQ(right, (Greys{110, 11, 12, 113, 114, 115, 116, 117, 118, 119}));
}

TEST(ImageFault, ALateImageIsThatManyOlder) {
  const auto [left, right] =
      Arriving({ImageFault{{1, 8}, kLate, FaultyCamera::kRight, /*late_images=*/3}});
  EXPECT_EQ(left, kLeft);
  EXPECT_EQ(right, (Greys{110, 110, 110, 110, 111, 112, 113, 114, 118, 119}));
}

TEST(ImageFault, SeveralApplyInTheirOrder) {
  const auto [left, right] = Arriving({ImageFault{{2, 4}, kBlack, FaultyCamera::kLeft},
                                       ImageFault{{3, 5}, kSwapped, FaultyCamera::kBoth},
                                       ImageFault{{5, 6}, kFrozen, FaultyCamera::kLeft}});
  EXPECT_EQ(left, (Greys{10, 11, 0, 113, 114, 114, 16, 17, 18, 19}));
  EXPECT_EQ(right, (Greys{110, 111, 112, 0, 14, 115, 116, 117, 118, 119}));
}

}  // namespace
}  // namespace turbidock::camera
