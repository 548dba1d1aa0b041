// Files are written whole or not at all and never over what they are made of; what is no file is
// neither read nor written.

#include "experiments/system/output_path.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include "experiments/system/plain_text.h"
#include "sim/base/check.h"
#include "tests/support/message_of.h"
#include "tests/support/own_folder.h"

namespace turbidock::system {
namespace {

namespace fs = std::filesystem;
using testing::MessageOf;

class OutputPath : public testing::OwnFolder {
 protected:
  int Files() const { return static_cast<int>(std::distance(fs::directory_iterator(folder_), {})); }
};

TEST_F(OutputPath, AnOutputIsNoInputUnderAnyName) {
  File("in.png", "precious");
  fs::create_symlink("in.png", File("soft"));
  fs::create_hard_link(File("in.png"), File("hard"));
  const std::string read = ": is read by this command; give another file to write";
  for (const std::string& name : {File("in.png"), File("soft"), File("hard"), File("./in.png"),
                                  (folder_ / "." / ".." / folder_.filename() / "in.png").string()})
    EXPECT_EQ(MessageOf([&] { OutputPlan().Reads(File("in.png")).Writes(name).Require(); }),
              name + read);
  EXPECT_EQ(MessageOf([&] { OutputPlan().Reads(File("in.png")).Writes(File("o")).Require(); }),
            "no error");
  EXPECT_EQ(ReadWhole(File("in.png")), "precious");
  EXPECT_EQ(Files(), 3);  // nothing was left
}

TEST_F(OutputPath, TwoOutputsAreTwoFiles) {
  const std::string twice = ": is written by it twice; give another file to write";
  EXPECT_EQ(MessageOf([&] { OutputPlan().Writes(File("a")).Writes(File("./a")).Require(); }),
            File("./a") + twice);
  fs::create_directory(File("d"));
  EXPECT_EQ(MessageOf([&] {
              OutputPlan().WritesInto(File("d"), {"a", "b"}).Require();
            }),
            "no error");
  EXPECT_EQ(
      MessageOf([&] { OutputPlan().Writes(File("d/a")).WritesInto(File("d"), {"a"}).Require(); }),
      File("d/a") + twice);
}

TEST_F(OutputPath, NothingIsMadeBeforeSomethingIsWritten) {
  File("in", "");
  EXPECT_NE(
      MessageOf([&] {
        OutputPlan().Reads(File("in")).WritesInto(File("new"), {"a"}).Writes(File("in")).Require();
      }),
      "no error");
  EXPECT_FALSE(fs::exists(File("new")));
  OutputPlan().WritesInto(File("new/deep"), {"a"}).WritesInto(File("new"), {"b"}).Require();
  OutputPlan().Writes(File("new/results"), kResultFile).Require();
  EXPECT_FALSE(fs::exists(File("new")));
  fs::create_directory(File("there"));
  OutputPlan().WritesInto(File("there"), {"a"}).Require();
  EXPECT_TRUE(fs::is_directory(File("there")));
}

TEST_F(OutputPath, AFileBringsItsFolder) {
  WriteWhole(File("new/deep/a"), "text");
  EXPECT_EQ(ReadWhole(File("new/deep/a")), "text");
  EXPECT_EQ(MessageOf([&] { WriteWhole(File("new/deep/a/b"), "text"); }),
            File("new/deep/a") + ": cannot be made: Not a directory");
}

TEST_F(OutputPath, WhatAnEarlierRunSaidGoesAndItsResultsStay) {
  for (const char* name : {"in", "report.html", "notes.txt"}) File(name, "old");
  File("trials.db", std::string(kResultFile.mark));
  OutputPlan()
      .Reads(File("in"))
      .Writes(File("report.html"))
      .WritesInto(File("not_there"), {"a"})
      .Writes(File("trials.db"), kResultFile)
      .RemoveOld();
  EXPECT_FALSE(fs::exists(File("report.html")));
  for (const char* name : {"in", "notes.txt", "trials.db"}) EXPECT_TRUE(fs::exists(File(name)));
}

TEST_F(OutputPath, OnlyFilesAreWritten) {
  fs::create_directory(File("folder"));
  mkfifo(File("pipe").c_str(), 0666);
  fs::create_symlink("loop", File("loop"));
  const std::string cannot = ": cannot be written: ";
  EXPECT_EQ(MessageOf([&] { RequireWritable(File("folder")); }),
            File("folder") + cannot + "it is a directory");
  EXPECT_EQ(MessageOf([&] { RequireWritable(File("pipe")); }),
            File("pipe") + cannot + "it is no regular file");
  EXPECT_EQ(MessageOf([&] { RequireWritable("/dev/null"); }),
            "/dev/null" + cannot + "it is no regular file");
  EXPECT_EQ(MessageOf([&] { RequireWritable(File("loop")); }),
            File("loop") + cannot + "Too many levels of symbolic links");
  EXPECT_EQ(MessageOf([&] { RequireWritable(File("none/a")); }),
            File("none/a") + cannot + "No such file or directory");
  const std::string longest(255, 'n');  // there is no room for the name it has while it is written
  EXPECT_EQ(MessageOf([&] { RequireWritable(File(longest)); }),
            File(longest) + cannot + "File name too long");
  EXPECT_EQ(MessageOf([&] { MakeFolder(File("pipe")); }).substr(0, File("pipe").size() + 16),
            File("pipe") + ": cannot be made");
}

TEST_F(OutputPath, OnlyItsOwnKindIsReplaced) {
  constexpr FileKind kList = {"list of ours", "# A list"};
  const std::string remedy = "; name another file, or move this one away";
  File("mine", "1\n2\n");
  File("list", "\n# A list, edited\n");
  File("empty", "");
  File("results", "SQLite format 3 and so on");
  mkfifo(File("pipe").c_str(), 0666);
  const auto said = [&](const char* name, const FileKind& kind) {
    return MessageOf([&] { OutputPlan().Writes(File(name), kind).Require(); });
  };
  for (const char* name : {"list", "empty", "none"}) EXPECT_EQ(said(name, kList), "no error");
  for (const char* name : {"mine", "list", "empty", "none"})
    EXPECT_EQ(said(name, kAnyFile), "no error");
  EXPECT_EQ(said("mine", kList),
            File("mine") + ": is no list of ours and is not replaced by one" + remedy);
  EXPECT_EQ(said("results", kAnyFile),
            File("results") + ": is a result file and is not replaced by another kind" + remedy);
  EXPECT_EQ(said("results", kResultFile), "no error");
  EXPECT_EQ(MessageOf([&] { WriteWhole(File("results"), "x"); }),
            said("results", kAnyFile));  // whoever writes
  EXPECT_NE(MessageOf([&] {
              OutputPlan().WritesInto(File("new"), {"a"}).Writes(File("mine"), kList).Require();
            }),
            "no error");
  EXPECT_FALSE(fs::exists(File("new")));
}

TEST_F(OutputPath, OnlyFilesAreRead) {
  mkfifo(File("pipe").c_str(), 0666);
  const std::string cannot = ": cannot be read: ";
  EXPECT_EQ(MessageOf([&] { ReadWhole(File("pipe")); }),
            File("pipe") + cannot + "it is no regular file");
  EXPECT_EQ(MessageOf([&] { ReadWhole("/dev/zero"); }),
            "/dev/zero" + cannot + "it is no regular file");
  File("large", std::string(3 << 20, 'x'));
  EXPECT_EQ(MessageOf([&] { ReadWhole(File("large"), 2 << 20); }),
            File("large") + cannot + "it is larger than 2 MiB");
  EXPECT_EQ(ReadWhole(File("large")).size(), size_t{3} << 20);
  EXPECT_EQ(WhyUnreadable(File("large")), "");
  EXPECT_EQ(WhyUnreadable(File("none")), "no such file");
  EXPECT_EQ(WhyUnreadable(folder_), "is a directory");
}

TEST_F(OutputPath, AFileIsWholeOrNotThere) {
  File("a", "old");
  {
    WholeFile file(File("a"));
    std::ofstream(file.partial()) << "half";
  }
  EXPECT_EQ(ReadWhole(File("a")), "old");
  EXPECT_EQ(Files(), 1);
  {
    WholeFile file(File("a"));
    std::ofstream(file.partial()) << "new";
    file.Commit();
  }
  EXPECT_EQ(ReadWhole(File("a")), "new");
  EXPECT_EQ(Files(), 1);
}

TEST_F(OutputPath, AFullDiskLeavesNothingBehind) {
  // What is written grows beyond what a file of this process may have.
  File("a", "old");
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{1000, before.rlim_max};
  std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  const std::string error = MessageOf([&] { WriteWhole(File("a"), std::string(100000, 'x')); });
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(error, File("a") + ": cannot be written: File too large");
  EXPECT_EQ(ReadWhole(File("a")), "old");
  EXPECT_EQ(Files(), 1);
}

TEST_F(OutputPath, ALinkStaysOne) {
  fs::create_directory(File("there"));
  File("there/a", "old");
  fs::create_symlink("there/a", File("link"));
  WriteWhole(File("link"), "new");
  EXPECT_TRUE(fs::is_symlink(File("link")));
  EXPECT_EQ(ReadWhole(File("there/a")), "new");
}

TEST(PlainText, WhatIsPrintedIsSafeOnATerminal) {
  EXPECT_EQ(Printable("caf\xc3\xa9 \x1b[31m\x07 \xe9 \xc2\x9b\x7f"),
            "caf\xc3\xa9 \\x1b[31m\\x07 \\xe9 \\xc2\\x9b\\x7f");
  EXPECT_EQ(Printable("a\tb\nc"), "a\tb\nc");
  EXPECT_EQ(OneLineOf("first\r\nsecond\n\n"), "first second");
  EXPECT_EQ(OneLineOf(" \r\n"), "");
  EXPECT_EQ(Shortened(std::string(60, 'x')), std::string(60, 'x'));
  EXPECT_EQ(Shortened(std::string(59, 'x') + "\xc3\xa9"), std::string(59, 'x') + "...");
  // of a message's text, nothing after a zero would be seen
  EXPECT_EQ(Shortened(std::string("a\0b", 3)), "a\\x00b");
}

TEST(PlainText, AMessageIsNoLongerThanALine) {
  const std::string word(200, 'x'), cut = word.substr(100) + "..." + word.substr(100);
  EXPECT_EQ(OneLineOf("key " + word + " is unknown"), "key " + word + " is unknown");
  EXPECT_EQ(OneLineOf("key " + std::string(1'000'000, 'x') + " is unknown"),
            "key " + cut + " is unknown");
  // no letter is cut
  std::string letters = "x";
  for (int i = 0; i < 200; ++i) letters += "\xc3\xa9";
  const std::string shown = OneLineOf(letters);
  EXPECT_EQ(shown.size(), 202u);
  EXPECT_FALSE(FirstNoText(shown));
  std::string line = "FILE:3:";
  for (int i = 0; i < 100'000; ++i) line += " word";
  const std::string short_line = OneLineOf(line + ": unknown");
  EXPECT_LT(short_line.size(), 2100u);
  EXPECT_TRUE(short_line.starts_with("FILE:3: word") && short_line.ends_with("word: unknown"));
}

TEST(ShellWord, IsReadBackAsItIs) {
  EXPECT_EQ(ShellWord("out/a-1.db"), "out/a-1.db");
  EXPECT_EQ(ShellWord("my results/it's.db"), R"('my results/it'\''s.db')");
  EXPECT_EQ(ShellWord(""), "''");
}

}  // namespace
}  // namespace turbidock::system
