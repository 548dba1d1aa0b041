#include "vision/gene.h"

#include <gtest/gtest.h>

#include "sim/base/random.h"

namespace turbidock::vision {
namespace {

Gene RandomGene(Rng* rng) {
  Gene gene;
  for (uint16_t& field : gene.fields) field = static_cast<uint16_t>(rng->Below(kFieldMax + 1));
  return gene;
}

TEST(Gene, HasSixFieldsOfTwelveBitsMostSignificantFirst) {
  EXPECT_EQ(kGeneBits, 72);
  for (int i = 0; i < kGeneBits; ++i) {
    Gene gene;
    gene.FlipBit(i);
    for (int f = 0; f < kGeneFields; ++f)
      EXPECT_EQ(gene.fields[f], f == i / 12 ? 1 << (11 - i % 12) : 0) << "bit " << i;
    for (int j = 0; j < kGeneBits; ++j) EXPECT_EQ(gene.bit(j), j == i);
    gene.FlipBit(i);
    EXPECT_EQ(gene, Gene{});
  }
}

TEST(Gene, TwoPointCrossoverSwapsExactlyTheBitsBetweenTheCuts) {
  Rng rng = SeedTree(5).Stream("genes");
  const Gene a = RandomGene(&rng);
  Gene b;  // the complement of a, so that every bit tells whose it is
  for (int f = 0; f < kGeneFields; ++f)
    b.fields[f] = static_cast<uint16_t>(kFieldMax - a.fields[f]);
  int checked = 0;
  for (int first = 0; first <= kGeneBits; ++first)
    for (int last = first; last <= kGeneBits; ++last, ++checked) {
      const Gene child = Cross(a, b, first, last);
      for (int i = 0; i < kGeneBits; ++i)
        ASSERT_EQ(child.bit(i), (i >= first && i < last ? b : a).bit(i))
            << first << ' ' << last << ' ' << i;
    }
  EXPECT_EQ(checked, 73 * 74 / 2);
}

TEST(GeneMap, EndsOfTheRangeAreTheEndsOfTheCode) {
  const SearchRange range;
  const GeneMap map(range);
  Gene high;
  high.fields.fill(kFieldMax);
  EXPECT_EQ(map.Decode(Gene{}), (GeneMap::Values{0.3, -0.4, -0.3, -0.15, -0.15, -0.15}));
  const GeneMap::Values top = map.Decode(high);
  const GeneMap::Values expected = {1.6, 0.4, 0.3, 0.15, 0.15, 0.15};
  for (int f = 0; f < kGeneFields; ++f) EXPECT_DOUBLE_EQ(top[f], expected[f]);
  // Outside the range: its end.
  EXPECT_EQ(map.Encode({9, 9, 9, 9, 9, 9}), high);
  EXPECT_EQ(map.Encode({-9, -9, -9, -9, -9, -9}), Gene{});
}

TEST(GeneMap, OneStepOfTheCodeIsOne4095thOfTheRange) {
  const GeneMap map{SearchRange{}};
  Gene gene;
  gene.fields[0] = 1;
  EXPECT_NEAR(map.Decode(gene)[0] - 0.3, 1.3 / 4095, 1e-15);
}

TEST(GeneMap, EveryCodeSurvivesTheRoundTrip) {
  const GeneMap map{SearchRange{}};
  for (int code = 0; code <= kFieldMax; ++code) {
    Gene gene;
    gene.fields.fill(static_cast<uint16_t>(code));
    ASSERT_EQ(map.Encode(map.Decode(gene)), gene) << code;
  }
}

TEST(GeneMap, PoseTakesTheVectorPartOfTheQuaternion) {
  const Pose X_HM = GeneMap::PoseOf({0.6, 0.1, -0.067, 0.01, -0.02, 0.14});
  EXPECT_EQ(X_HM.p, Eigen::Vector3d(0.6, 0.1, -0.067));
  EXPECT_EQ(X_HM.q.vec(), Eigen::Vector3d(0.01, -0.02, 0.14));
  EXPECT_GT(X_HM.q.w(), 0);
  EXPECT_NEAR(X_HM.q.norm(), 1, 1e-15);
}

TEST(SearchRange, RefusesAnEmptyRange) {
  SearchRange range;
  EXPECT_NO_THROW(CheckFields(range, "range"));
  range.x_min_m = range.x_max_m;
  EXPECT_THROW(CheckFields(range, "range"), ConfigError);
}

}  // namespace
}  // namespace turbidock::vision
