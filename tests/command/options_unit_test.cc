// A command line is read as it is written: numbers are decimal and whole where they must be, and
// whatever is wrong is said in one sentence.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/command/command_line.h"
#include "tests/support/message_of.h"

namespace turbidock::command {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;

struct Arguments {
  std::string file, name = "anybody", seed;
  int count = 3;
  std::optional<int> most;
  std::optional<int64_t> trial;
  uint64_t root = 0;
  double length = 0.5;
  std::vector<double> distances;
  std::vector<std::string> keys, sets;
  bool quiet = false;
};

const Arguments* seen = nullptr;

Arguments Parse(std::vector<std::string> words) {
  CommandLine line("program", "A program.");
  auto [command, arguments] = line.Add<Arguments>("command", "A command.", [](const Arguments& a) {
    seen = &a;
    return 0;
  });
  command.Add("file", arguments.file, "A file").Required();
  command.Add("--name", arguments.name, "A name").OneOf({"anybody", "me"});
  command.Add("--count", arguments.count, "How many").Positive();
  command.Add("--most", arguments.most, "At most").NotNegative();
  command.Add("--trial", arguments.trial, "Which");
  command.Add("--root", arguments.root, "A root");
  command.Add("--length", arguments.length, "How long").Between(0, 2);
  command.Add("--distances MM,...", arguments.distances, "How far").Between(200, 3000);
  command.Add("--by KEY,...", arguments.keys, "By what");
  command.AddSet(arguments.sets, "Set a key");
  command.AddSeed(arguments.seed);
  command.AddQuiet(arguments.quiet);
  words.insert(words.begin(), {"program", "command"});
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  EXPECT_FALSE(line.Parse(static_cast<int>(argv.size()), argv.data()));
  EXPECT_EQ(line.Run(), 0);
  return *seen;
}

std::string Refusal(std::vector<std::string> words) {
  words.insert(words.begin(), "x.db");
  return MessageOf([&] { Parse(words); });
}

TEST(Options, AreWhatIsWritten) {
  const Arguments a = Parse({"[x]",
                             "--name",
                             "me",
                             "--count",
                             "010",
                             "--most",
                             "0",
                             "--trial",
                             "9223372036854775807",
                             "--root",
                             "18446744073709551615",
                             "--length",
                             "+1.5e-1",
                             "--distances",
                             "400,600",
                             "--by",
                             "a,b",
                             "--by",
                             "[c]",
                             "--set",
                             "k=[1,2]",
                             "--set",
                             "m=[]",
                             "--seed",
                             "7",
                             "--quiet"});
  EXPECT_EQ(a.file, "[x]");
  EXPECT_EQ(a.name, "me");
  EXPECT_EQ(a.count, 10);
  EXPECT_EQ(a.most, 0);
  EXPECT_EQ(a.trial, INT64_MAX);
  EXPECT_EQ(a.root, UINT64_MAX);
  EXPECT_EQ(a.length, 0.15);
  EXPECT_THAT(a.distances, ElementsAre(400, 600));
  EXPECT_THAT(a.keys, ElementsAre("a", "b", "[c]"));
  EXPECT_THAT(a.sets, ElementsAre("k=[1,2]", "m=[]"));
  EXPECT_EQ(a.seed, "7");
  EXPECT_TRUE(a.quiet);
}

TEST(Options, HaveTheirDefaultsOtherwise) {
  const Arguments a = Parse({"x.db"});
  EXPECT_EQ(a.name, "anybody");
  EXPECT_EQ(a.count, 3);
  EXPECT_FALSE(a.most);
  EXPECT_TRUE(a.distances.empty());
}

TEST(Options, OfOneValueTakeNoOtherArgument) {
  const Arguments a = Parse({"--distances", "400", "x.db"});
  EXPECT_EQ(a.file, "x.db");
  EXPECT_THAT(a.distances, ElementsAre(400));
}

TEST(Options, AWholeNumberIsOneInDigits) {
  for (const std::string text : {"0x3", "1e3", "1.5", "3 ", " 3", "1_000", "1'000", "+-3", "--3",
                                 "0b1", "three", "7 # x", ""}) {
    EXPECT_EQ(Refusal({"--most", text}),
              "--most: '" + text + "' must be a whole number; see --help");
    EXPECT_THAT(Refusal({"--seed", text}), HasSubstr("--seed: "));
  }
  EXPECT_THAT(Refusal({"--root", "-1"}), HasSubstr("--root: '-1' must be a whole number without"));
}

TEST(Options, WhatIsTooLargeIsNotTheLargest) {
  EXPECT_THAT(Refusal({"--most", "99999999999"}),
              HasSubstr("--most: 99999999999 must be from -2147483648 to 2147483647"));
  EXPECT_THAT(Refusal({"--trial", "-99999999999999999999"}),
              HasSubstr("must be from -9223372036854775808 to 9223372036854775807"));
  EXPECT_THAT(Refusal({"--root", "18446744073709551616"}),
              HasSubstr("must be from 0 to 18446744073709551615"));
  EXPECT_THAT(Refusal({"--length", "1e999"}), HasSubstr("1e999 is too large or too small"));
  EXPECT_THAT(Refusal({"--length", "nan"}), HasSubstr("nan is not a finite number"));
}

TEST(Options, ARangeIsSaidInShort) {
  EXPECT_THAT(Refusal({"--count", "0"}), HasSubstr("--count: 0 must be above 0;"));
  EXPECT_THAT(Refusal({"--most", "-1"}), HasSubstr("--most: -1 must be at least 0;"));
  EXPECT_THAT(Refusal({"--length", "2.5"}), HasSubstr("2.5 must be a number from 0 to 2;"));
  EXPECT_THAT(Refusal({"--name", "you"}), HasSubstr("'you' must be one of anybody, me;"));
}

TEST(Options, NoValueIsEmpty) {
  for (const char* list : {"", ",", "600,,600", "600,", ",600"})
    EXPECT_THAT(Refusal({"--distances", list}), HasSubstr("--distances: '' must be a number;"));
  EXPECT_THAT(Refusal({"--by", "a,,b"}), HasSubstr("--by: has an empty value"));
  EXPECT_THAT(Refusal({"--set", ""}), HasSubstr("--set: has an empty value"));
  EXPECT_THAT(Refusal({"--distances", "600,9000"}), HasSubstr("9000 must be a number from 200"));
}

TEST(Options, AListHasAValueOnce) {
  const std::string twice = " is given twice; see --help";
  EXPECT_EQ(Refusal({"--distances", "600,800,600"}), "--distances: '600'" + twice);
  EXPECT_EQ(Refusal({"--distances", "600,6e2"}), "--distances: '6e2'" + twice);
  EXPECT_EQ(Refusal({"--distances", "600", "--distances", "600.0"}),
            "--distances: '600.0'" + twice);
  EXPECT_EQ(Refusal({"--by", "a,b,a"}), "--by: 'a'" + twice);
  EXPECT_EQ(Parse({"x.db", "--set", "k=1", "--set", "k=1"}).sets.size(), 2u);
}

TEST(Options, WhatIsNotKnownIsNamedInItsOrder) {
  EXPECT_EQ(Refusal({"b", "--nope", "c"}), "not expected here: b --nope c; see --help");
  EXPECT_THAT(Refusal({"--quiet=3"}), HasSubstr("quiet was given"));
  EXPECT_EQ(MessageOf([] { Parse({}); }), "file is required; see --help");
}

}  // namespace
}  // namespace turbidock::command
