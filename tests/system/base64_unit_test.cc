#include "experiments/system/base64.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::system {
namespace {

TEST(Base64, IsThatOfRfc4648AndReadsBack) {
  for (const auto& [bytes, text] : {std::pair<std::string, std::string>{"", ""},
                                    {"f", "Zg=="},
                                    {"fo", "Zm8="},
                                    {"foo", "Zm9v"},
                                    {"foobar", "Zm9vYmFy"},
                                    {"\xff\xfe", "//4="}}) {
    EXPECT_EQ(Base64(bytes), text);
    EXPECT_EQ(BytesOf(text), bytes);
  }
}

TEST(Base64, EveryByteComesBack) {
  std::string bytes;
  for (int i = 0; i < 256; ++i) bytes += static_cast<char>(255 - i);
  for (size_t size = 0; size <= bytes.size(); ++size)
    EXPECT_EQ(BytesOf(Base64(bytes.substr(0, size))), bytes.substr(0, size));
}

TEST(Base64, WhatIsNoneIsAnError) {
  for (const char* text : {"Zg", "Zg=", "Z g=", "Zm9%", "Zm\n=", "Z=g="})
    EXPECT_THROW(BytesOf(text), ConfigError) << text;
}

}  // namespace
}  // namespace turbidock::system
