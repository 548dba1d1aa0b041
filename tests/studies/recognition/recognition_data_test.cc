// The shipped optics against the published tables, by the program's own search, a second a cell.
// Not asserted is what is missed (assets/measured/recognition.md): both ends at 800 mm, which the
// optics were not calibrated to, and the passive marker's at 1000 mm to a tenth.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "experiments/config/data_files.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"
#include "experiments/system/output_path.h"

namespace turbidock::recognition {
namespace {

TableComparison CompareWithPublished(MarkerKind marker) {
  const std::string file =
      config::AssetPath(fmt::format("plans/recognition_{}.yaml", NameOf(marker)));
  std::string text = system::ReadWhole(file);
  const size_t at = text.find("  600 mm: ");  // which no table has
  text.erase(at, text.find('\n', at) + 1 - at);
  const batch::Plan plan(text, file);
  EXPECT_EQ(plan.trials(), std::ssize(PublishedTable(marker)));
  return Compare(Recognize(plan, {.seconds = 1, .jobs = {.workers = 2}}), PublishedTable(marker))
      .value();
}

void ExpectAreasAndLoss(const TableComparison& c, double least_areas, double accepted_loss) {
  EXPECT_GE(c.area_agreement, least_areas);
  ASSERT_EQ(c.loss_by_distance_m.size(), 3u);
  for (const auto& [distance_m, loss] : c.loss_by_distance_m) {
    ASSERT_TRUE(loss.ratio()) << distance_m;
    if (distance_m == 0.8) continue;
    EXPECT_NEAR(*loss.ratio(), 1, accepted_loss) << distance_m;
  }
}

TEST(ShippedOptics, RecogniseTheActiveMarkerAsPublished) {
  const TableComparison c = CompareWithPublished(MarkerKind::kActive);
  ExpectAreasAndLoss(c, 0.9, 0.12);
  EXPECT_LE(c.rmse, 0.07);
}

TEST(ShippedOptics, RecogniseThePassiveMarkerAsPublished) {
  const TableComparison c = CompareWithPublished(MarkerKind::kPassive);
  ExpectAreasAndLoss(c, 0.85, 0.2);
  EXPECT_LE(c.rmse, 0.12);
}

}  // namespace
}  // namespace turbidock::recognition
