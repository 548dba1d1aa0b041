#pragma once
// Tables under tests/data/variants that a test draws from its variants.

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace turbidock::testing {

using Swaps = std::vector<std::pair<std::string, std::string>>;

// `text` with each first replaced by its second everywhere; each must be there.
inline std::string With(std::string text, const Swaps& swaps) {
  for (const auto& [from, to] : swaps) {
    EXPECT_NE(text.find(from), std::string::npos) << from << " in\n" << text;
    for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
  }
  return text;
}

// The file `name` of tests/data/variants must be `table`. Draws it anew into the test's folder.
inline void ExpectDrawn(const std::string& name, const std::string& table) {
  std::ifstream committed(TURBIDOCK_TEST_DATA "/variants/" + name);
  const std::string text(std::istreambuf_iterator<char>(committed), {});
  const std::string drawn = ::testing::TempDir() + "/" + name;
  std::ofstream(drawn) << table;
  EXPECT_EQ(text, table) << "drawn anew: " << drawn;
}

}  // namespace turbidock::testing
