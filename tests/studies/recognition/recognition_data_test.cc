// The shipped optics against the published tables, by the program's own search, a second a cell.
// Not asserted is what is missed (assets/measured/recognition.md): the passive marker's end at
// 1000 mm to a tenth.

#include <gtest/gtest.h>

#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"

namespace turbidock::recognition {
namespace {

TableComparison CompareWithPublished(MarkerKind marker) {
  const std::vector<TableRow> rows = PublishedTable(marker);
  std::vector<RecognitionCell> cells;
  for (const TableRow& row : rows) cells.push_back(row.cell);
  return Compare(RunCells({{marker, RecognitionScenario(marker, {})}}, cells,
                          {.seconds = 1, .jobs = {.workers = 2}}),
                 rows);
}

void ExpectAreasAndLoss(const TableComparison& c, double accepted_loss) {
  EXPECT_GE(c.area_agreement, 0.9);
  ASSERT_EQ(c.loss_by_distance_m.size(), 2u);
  for (const auto& [distance_m, loss] : c.loss_by_distance_m) {
    ASSERT_TRUE(loss.ratio()) << distance_m;
    EXPECT_NEAR(*loss.ratio(), 1, accepted_loss) << distance_m;
  }
}

TEST(ShippedOptics, RecogniseTheActiveMarkerAsPublished) {
  const TableComparison c = CompareWithPublished(MarkerKind::kActive);
  ExpectAreasAndLoss(c, 0.12);
  EXPECT_LE(c.rmse, 0.07);
}

TEST(ShippedOptics, RecogniseThePassiveMarkerAsPublished) {
  const TableComparison c = CompareWithPublished(MarkerKind::kPassive);
  ExpectAreasAndLoss(c, 0.2);
  EXPECT_LE(c.rmse, 0.095);
}

}  // namespace
}  // namespace turbidock::recognition
