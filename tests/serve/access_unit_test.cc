#include "experiments/serve/access.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace turbidock::serve {
namespace {

TEST(Access, SecretsAreLongAndNeverTheSame) {
  std::set<std::string> secrets;
  for (int i = 0; i < 100; ++i) {
    const std::string secret = NewSecret();
    EXPECT_EQ(secret.size(), 32u);
    EXPECT_EQ(secret.find_first_not_of("0123456789abcdef"), std::string::npos);
    secrets.insert(secret);
  }
  EXPECT_EQ(secrets.size(), 100u);
}

TEST(Access, TextsAreTheSameOrNot) {
  EXPECT_TRUE(AreSame("abc", "abc"));
  EXPECT_TRUE(AreSame("", ""));
  for (const char* other : {"", "ab", "abd", "bbc", "abcd", "ABC"})
    EXPECT_FALSE(AreSame("abc", other)) << other;
}

TEST(Access, OnLoopbackOnlyItsOwnNamesAreServed) {
  for (const char* host : {"127.0.0.1", "127.0.0.1:8137", "localhost:9000", "localhost", "[::1]:80",
                           "[::1]", "127.9.9.9:1"})
    EXPECT_TRUE(IsOwnHost(host, "127.0.0.1")) << host;
  for (const char* host :
       {"", ":80", "evil.example", "evil.example:8137", "localhost.evil.example", "10.0.0.3:8137",
        "127.0.0.1.evil.example", "127.0.0.1:8137:9", "127.0.0.1:", "127.0.0.1:80x", "127.0.0.1@x",
        "[::1", "[::1]x", "[]", "::1", "0.0.0.0:80", "localhost:999999", "2130706433"})
    EXPECT_FALSE(IsOwnHost(host, "127.0.0.1")) << host;
}

TEST(Access, ElsewhereAddressesAreServedButNoForeignNames) {
  for (const char* address : {"0.0.0.0", "10.0.0.3", "::"}) {
    EXPECT_TRUE(IsOwnHost("10.0.0.3:8137", address));
    EXPECT_TRUE(IsOwnHost("[fe80::1]:8137", address));
    EXPECT_TRUE(IsOwnHost("localhost:8137", address));
    EXPECT_FALSE(IsOwnHost("evil.example:8137", address));
  }
}

TEST(Access, ThePageOfAnOriginIsItsOwnWhenHostAndPortAgree) {
  EXPECT_TRUE(IsOwnOrigin("http://localhost:8137", "localhost:8137"));
  for (const char* origin :
       {"", "null", "http://localhost", "http://localhost:8138", "https://localhost:8137",
        "http://evil.example", "localhost:8137", "http://localhost:8137/"})
    EXPECT_FALSE(IsOwnOrigin(origin, "localhost:8137")) << origin;
}

}  // namespace
}  // namespace turbidock::serve
