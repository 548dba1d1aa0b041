#include "experiments/report/table.h"

#include <gtest/gtest.h>

namespace turbidock::report {
namespace {

TEST(Table, WordsBeginAndNumbersEndInLine) {
  Table table({"<name", "trials", "<verdict"});
  table.Row({"calm", "12", "pass"});
  table.Row({"moderate", "5", ""});
  EXPECT_EQ(table.Text(),
            "name      trials  verdict\n"
            "calm          12  pass\n"
            "moderate       5\n");
}

TEST(Table, MarkdownEscapesBarsAndLineBreaks) {
  Table table({"<name", "trials", "<verdict"});
  table.Row({"calm | one", "12", "pass"});
  table.Row({"two\nlines", "5", ""});
  EXPECT_EQ(table.Markdown(),
            "| name | trials | verdict |\n"
            "|---|---:|---|\n"
            "| calm \\| one | 12 | pass |\n"
            "| two lines | 5 | |\n");
}

TEST(NumberIn, IsAllOfTheTextOrNothing) {
  EXPECT_EQ(NumberIn("-1e-3"), -0.001);
  for (const char* text : {"", "1 ", "1x", "x"}) EXPECT_FALSE(NumberIn(text)) << text;
}

TEST(Fixed, IsADashForWhatIsNotThere) {
  EXPECT_EQ(Fixed(1.25, 1), "1.2");  // to even
  EXPECT_EQ(Fixed(-0.001, 2), "0.00");
  EXPECT_EQ(Fixed(-0.006, 2), "-0.01");
  EXPECT_EQ(Fixed(std::nullopt, 3), "-");
}

TEST(Digits, HasAllDigitsBeforeThePoint) {
  EXPECT_EQ(Digits(18000), "18000");
  EXPECT_EQ(Digits(123456.7), "123457");
  EXPECT_EQ(Digits(0.123456), "0.1235");
  EXPECT_EQ(Digits(-12345), "-12345");
  EXPECT_EQ(Digits(2e6), "2e+06");
  EXPECT_EQ(Digits(999.6, 3), "1000");
  EXPECT_EQ(Digits(-0.0), "0");
}

}  // namespace
}  // namespace turbidock::report
